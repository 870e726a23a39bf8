"""Sizes and constants of the networks, for inference and training alike.

Fields of the options are the names in files of weights and configurations.
"""

from __future__ import annotations

from dataclasses import dataclass

from anisomesh.errors import OptionError

LEAKY_SLOPE = 0.1
"""Slope of the leaky rectifiers below zero."""

NORM_EPSILON = 1e-5
"""Added to the variance of a channel, the default of torch."""

INPUT_SCALE = 0.3
"""Brings the input features to about 1; normalising would hide how large curvatures are. Heuristic."""

OFFSET_SCALE = 0.1
"""Offsets are small before training. Heuristic."""

HEAD_WIDTH = 32
"""Channels of an edge inside a head."""

HEAD_LINES, HEAD_ROUNDS = 4, 2
"""Lines per node inside a head, and rounds of mixing them with the neighbours' lines."""

EDGES_PER_CHUNK = 8_192
"""Edges of a head at a time, which bounds its memory."""

PAPER_INPUTS, PAPER_OUTPUTS = 6, 5
"""Numbers of coordinates into the paper's network (points and normals) and out of it (beyond the first three)."""

SKIPS, NORMS = ("before", "after"), ("batch", "mesh")
"""Values of the options ``skip`` and ``norm`` of the paper's network; the first of each is the paper's."""

DISTANCE_SOFTENING = 1e-12
"""Squared units of features: keeps the root of a squared distance differentiable where features are equal."""


@dataclass(frozen=True, kw_only=True)
class NetworkOptions:
    """Sizes of the default network.

    Attributes
    ----------
    channels
        Channels of a node.
    scales
        Levels of the graph hierarchy.
    blocks
        Residual blocks on each level, on the way down and on the way up.
    heads
        Levels, from the finest, whose edges contribute to the line field.
    """

    channels: int = 64
    scales: int = 5
    blocks: int = 2
    heads: int = 3

    def __post_init__(self) -> None:
        for name in ("channels", "scales", "blocks", "heads"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise OptionError(f"[network] {name} = {getattr(self, name)}; expected at least 1")
        if self.heads > self.scales:
            raise OptionError(f"[network] heads = {self.heads}; expected no more than scales, {self.scales}")


@dataclass(frozen=True, kw_only=True)
class PaperOptions:
    """Sizes of the paper's network.

    Attributes
    ----------
    channels
        Channels of a node; 256 in the paper.
    levels
        Number of poolings.
    ratio
        Share of the nodes that a pooling keeps.
    skip
        Whether a residual block adds its input ``"before"`` the second activation, as in the paper, or ``"after"`` it.
    norm
        What channels are normalised over: ``"batch"``, all nodes of a batch in training and running means in inference,
        as in the paper, or ``"mesh"``, the nodes of one mesh in both.
    """

    channels: int = 64
    levels: int = 5
    ratio: float = 0.5
    skip: str = SKIPS[0]
    norm: str = NORMS[0]

    def __post_init__(self) -> None:
        whole = isinstance(self.channels, int) and isinstance(self.levels, int)
        if not whole or self.channels < 1 or self.levels < 0 or not 0.0 < self.ratio <= 1.0:
            raise OptionError(
                f"[paper] channels = {self.channels}, levels = {self.levels}, ratio = {self.ratio}; "
                "expected at least 1 channel, no negative number of levels, and a ratio above 0 and at most 1"
            )
        for name, known in (("skip", SKIPS), ("norm", NORMS)):
            if getattr(self, name) not in known:
                raise OptionError(f"[paper] {name} = {getattr(self, name)!r}; expected one of {', '.join(known)}")


@dataclass(frozen=True, kw_only=True)
class FilterOptions:
    """Sizes of the learnt filter of normals.

    Attributes
    ----------
    channels
        Channels of a face.
    blocks
        Residual blocks.
    rounds
        Number of times that the normals are filtered.
    """

    channels: int = 48
    blocks: int = 4
    rounds: int = 8

    def __post_init__(self) -> None:
        for name in ("channels", "blocks", "rounds"):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise OptionError(f"[filter] {name} = {getattr(self, name)}; expected at least 1")

"""How to remesh, and how a run reports its progress."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

from anisomesh.errors import OptionError
from anisomesh.metric.names import METRIC_NAMES, MetricName

if TYPE_CHECKING:  # the command line imports this module, and has to start at once
    import numpy.typing as npt

EmbeddingName = Literal["auto", "direct", "neural", "hybrid"]
DeviceName = Literal["cpu", "cuda"]
EMBEDDINGS: tuple[EmbeddingName, ...] = get_args(EmbeddingName)
DEVICES: tuple[DeviceName, ...] = get_args(DeviceName)


@dataclass(frozen=True, kw_only=True)
class RemeshOptions:
    """How to remesh.

    Attributes
    ----------
    sharpness
        The factor s of the normal metric, at least 1: 1 is the plain CVT with the most regular elements, 7 the
        paper's value, larger values keep the surface and its creases more exactly.
    final_sharpness
        If given, the optimisation ends with this factor (30 brings vertices onto corners and creases).
    metric
        ``"curvature"``, ``"approximation"``, ``"uniform"``, or tensors (V, 3, 3) at the points of the input, in
        model units.
    embedding
        Where the metric comes from. ``"direct"``: measured principal curvatures; ``"neural"``: a trained network, which
        takes noise away first; ``"hybrid"``: a mean of both, on the surface without noise; ``"auto"``: hybrid where
        torch is installed and the metric is ``"curvature"``, the only one that networks know, else direct.
    weights
        For ``"neural"`` and ``"hybrid"``: a file that training has written, or the name of a network that comes with
        the package; by default the one called ``default``.
    device
        Where the network runs, ``"cpu"`` or ``"cuda"``.
    denoise
        Whether the result follows the surface that the network sees beneath the noise, where it finds any, and not
        the noise. Where a tenth of the edges are between faces in one plane nothing is taken away.
    seed
        Of the start positions; the same seed and input give the same result.
    threads
        Worker threads; they do not change the result.
    lloyd_iterations, max_iterations
        Iterations of Lloyd's algorithm at the start and bound on those of L-BFGS after it.
    embedding_iterations
        Bound on the local/global steps of the direct embedding.
    weld_tolerance
        Points of the input up to this distance (model units) become one.
    feature_angle
        Edges of the input whose faces differ by more than this many degrees are creases, which edges of the result
        follow where there are vertices enough; 180 for none. The plain CVT (``sharpness`` 1) has none.
    features
        Edges of the input that are creases in any case, as pairs of its points (n, 2).
    time_limit
        Wall-clock seconds after which the optimisation and the mending of faults end with what they have. The first
        60 % are for the optimisation. What a valid mesh needs is done all the same, so it may take somewhat longer.
    """

    sharpness: float = 7.0
    final_sharpness: float | None = None
    metric: MetricName | npt.NDArray[Any] = "curvature"
    embedding: str = "auto"
    weights: str | os.PathLike[str] | None = None
    device: str = "cpu"
    denoise: bool = True
    seed: int = 0
    threads: int = 2
    lloyd_iterations: int = 9
    max_iterations: int = 150
    embedding_iterations: int = 10
    weld_tolerance: float = 0.0
    feature_angle: float = 40.0
    features: npt.ArrayLike | None = None
    time_limit: float | None = None

    def __post_init__(self) -> None:
        for name in ("sharpness", "final_sharpness"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 1.0):
                raise OptionError(f"{name} = {value}; expected a finite number of at least 1 (1 is the plain CVT)")
        if isinstance(self.metric, str) and self.metric not in METRIC_NAMES:
            raise OptionError(f"metric = {self.metric!r}; expected one of {', '.join(METRIC_NAMES)}, or tensors")
        for name, known in (("embedding", EMBEDDINGS), ("device", DEVICES)):
            if getattr(self, name) not in known:
                raise OptionError(f"{name} = {getattr(self, name)!r}; expected one of {', '.join(known)}")
        if self.embedding == "direct" and self.weights is not None:
            raise OptionError("weights are of a network, and embedding 'direct' has none; ask for 'neural' or 'hybrid'")
        network = self.embedding in ("neural", "hybrid") or self.weights is not None
        if network and not (isinstance(self.metric, str) and self.metric == "curvature"):
            raise OptionError("a network (embedding, weights) predicts the curvature metric and no other")
        if not 0.0 <= self.feature_angle <= 180.0:
            raise OptionError(f"feature_angle = {self.feature_angle}; expected 0 to 180 degrees")
        if self.time_limit is not None and not self.time_limit > 0.0:
            raise OptionError(f"time_limit = {self.time_limit}; expected a positive number of seconds")
        for name, low in (
            ("seed", 0),
            ("threads", 1),
            ("lloyd_iterations", 0),
            ("max_iterations", 0),
            ("embedding_iterations", 1),
        ):
            if getattr(self, name) < low:
                raise OptionError(f"{name} = {getattr(self, name)}; expected at least {low}")


@dataclass(frozen=True, kw_only=True)
class StepInfo:
    """One step of a run: the stage, iteration ``iteration`` of at most ``total``, the energy if there is one."""

    stage: str
    iteration: int = 0
    total: int = 0
    energy: float | None = None
    message: str = ""


OnStep = Callable[[StepInfo], None]

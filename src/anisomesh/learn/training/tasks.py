"""What networks are trained for: stretch and offsets (the default), or the paper's embedding; examples and losses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from anisomesh.learn.data.examples import Example, example_of
from anisomesh.learn.data.items import Item
from anisomesh.learn.models.paper import PaperNetwork, PaperOptions, Seen, seen_of
from anisomesh.learn.models.stretch import NetworkOptions, Prediction, StretchNetwork
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.losses import cosine_loss, dot_loss, l2_loss, laplacian_loss, line_loss, offset_loss
from anisomesh.mesh.noise import NOISES, with_noise
from anisomesh.mesh.surface import Surface

_OFFSETS = 2.0  # weight of the loss of offsets, beside that of lines
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


Losses = dict[str, Tensor]


class Task(Protocol):
    """A kind of network, and how it is trained."""

    def network(self) -> nn.Module:
        """Return a network with random weights."""
        ...

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> Any:
        """Return what the network sees of an item with noise, in mean edge lengths, and what is wanted of it."""
        ...

    def losses(self, network: nn.Module, example: Any) -> Losses:
        """Return the losses of a network on an example, of which training lowers the sum."""
        ...

    def losses_of_nothing(self, example: Any) -> Losses:
        """Return those of predicting no stretch, and no noise."""
        ...


def task_of(options: TrainingOptions) -> Task:
    """Return the task of a training run."""
    return StretchTask(options) if isinstance(options.network, NetworkOptions) else EmbeddingTask(options)


class StretchTask:
    """Lines of stretch and offsets by the default network; it turns with the mesh, so it needs no turned copies."""

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, NetworkOptions)
        self._network = options.network

    def network(self) -> StretchNetwork:
        """See :class:`Task`."""
        return StretchNetwork(self._network)

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> Example:
        """See :class:`Task`. In training the noise is of any kind."""
        kind = NOISES[int(rng.integers(len(NOISES)))] if training else NOISES[0]
        return example_of(item, self._network.scales, noise, rng, kind)

    def losses(self, network: nn.Module, example: Example) -> Losses:
        """See :class:`Task`."""
        return self._losses(Prediction(*(values.cpu() for values in network(example.pyramid))), example)

    def losses_of_nothing(self, example: Example) -> Losses:
        """See :class:`Task`."""
        nothing = Prediction(torch.zeros_like(example.lines), torch.zeros_like(example.offsets))
        return self._losses(nothing, example)

    def _losses(self, found: Prediction, example: Example) -> Losses:
        offset = offset_loss(
            found.offsets / example.unit, example.offsets, example.quadrics, example.edges, example.weight
        )
        return {
            "lines": line_loss(found.lines, example.lines, example.weight),
            "offsets": _OFFSETS * offset,
        }


@dataclass(frozen=True, eq=False)
class EmbeddingExample:
    """What the network sees, the extra coordinates wanted (N, 5), points (N, 3), faces (F, 3) and edges (E, 2)."""

    seen: Seen
    extra: Tensor
    points: Tensor
    faces: Tensor
    edges: Tensor


class EmbeddingTask:
    """The extra coordinates by the paper's network, with its losses and its turned and mirrored copies."""

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, PaperOptions)
        self._options, self._network = options, options.network

    def network(self) -> PaperNetwork:
        """See :class:`Task`."""
        return PaperNetwork(self._network)

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> EmbeddingExample:
        """See :class:`Task`. The first three extra coordinates turn with the mesh, as the normals they come from."""
        clean, extra = item.surface, item.extra
        if training and self._options.augment:
            turn = random_symmetry(rng)
            clean = clean.with_points(clean.points @ turn.T)
            if np.linalg.det(turn) < 0.0:
                clean = Surface(clean.points, clean.faces[:, ::-1])
            extra = np.concatenate([extra[:, :3] @ turn.T, extra[:, 3:]], axis=1)
        noisy = with_noise(clean, noise, rng)
        return EmbeddingExample(
            seen=seen_of(noisy),
            extra=torch.from_numpy(extra.astype(np.float32)),
            points=torch.from_numpy(clean.points.astype(np.float32)),
            faces=torch.from_numpy(clean.faces.astype(np.int64)),
            edges=torch.from_numpy(clean.edges.astype(np.int64)),
        )

    def losses(self, network: nn.Module, example: EmbeddingExample) -> Losses:
        """See :class:`Task`."""
        return {"embedding": self._loss(network(example.seen).cpu(), example)}

    def losses_of_nothing(self, example: EmbeddingExample) -> Losses:
        """See :class:`Task`."""
        return {"embedding": self._loss(torch.zeros_like(example.extra), example)}

    def _loss(self, extra: Tensor, example: EmbeddingExample) -> Tensor:
        options = self._options
        if options.loss == "dot":
            whole, wanted = (torch.cat([example.points, values], dim=1) for values in (extra, example.extra))
            loss = dot_loss(whole, wanted, example.faces)
        else:
            loss = (l2_loss if options.loss == "l2" else cosine_loss)(extra, example.extra)
        if options.laplacian > 0.0:
            aligned = options.gauge == "aligned"
            loss = loss + options.laplacian * laplacian_loss(extra, example.extra, example.edges, aligned=aligned)
        return loss


def random_symmetry(rng: np.random.Generator) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return one of the ten symmetries of the paper's augmentation (3, 3): none, mirrors, quarter turns either way."""
    number = int(rng.integers(10))
    axis = number % 3
    if number < 3:
        return np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
    if number < 9:
        order = np.roll(np.arange(3), axis)
        turn = _QUARTER[np.ix_(order, order)]
        return turn if number < 6 else turn.T
    return np.eye(3)

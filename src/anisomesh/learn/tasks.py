"""What networks are trained for: lines of stretch (the default), or the paper's embedding; examples and losses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from anisomesh.learn.config import TrainingOptions
from anisomesh.learn.examples import Example, example_of, with_noise
from anisomesh.learn.items import Item
from anisomesh.learn.lines import line_loss
from anisomesh.learn.losses import cosine_loss, dot_loss, l2_loss, laplacian_loss
from anisomesh.learn.network import NetworkOptions, StretchNetwork
from anisomesh.learn.paper import PaperNetwork, PaperOptions, Seen, seen_of
from anisomesh.surface.mesh import Surface

_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


class Task(Protocol):
    """A kind of network, and how it is trained."""

    def network(self) -> nn.Module:
        """Return a network with random weights."""
        ...

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> Any:
        """Return what the network sees of an item with noise, in mean edge lengths, and what is wanted of it."""
        ...

    def loss(self, network: nn.Module, example: Any) -> Tensor:
        """Return the loss of a network on an example."""
        ...

    def loss_of_nothing(self, example: Any) -> float:
        """Return the loss of predicting no stretch at all."""
        ...


def task_of(options: TrainingOptions) -> Task:
    """Return the task of a training run."""
    return LinesTask(options) if isinstance(options.network, NetworkOptions) else EmbeddingTask(options)


class LinesTask:
    """Lines of stretch by the default network; turns with the mesh, so it needs no turned copies."""

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, NetworkOptions)
        self._network = options.network

    def network(self) -> StretchNetwork:
        """See :class:`Task`."""
        return StretchNetwork(self._network)

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> Example:
        """See :class:`Task`."""
        return example_of(item, self._network.scales, noise, rng)

    def loss(self, network: nn.Module, example: Example) -> Tensor:
        """See :class:`Task`."""
        return line_loss(network(example.pyramid), example.lines, example.weight)

    def loss_of_nothing(self, example: Example) -> float:
        """See :class:`Task`."""
        return float(line_loss(torch.zeros_like(example.lines), example.lines, example.weight))


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

    def loss(self, network: nn.Module, example: EmbeddingExample) -> Tensor:
        """See :class:`Task`."""
        return self._loss(network(example.seen), example)

    def loss_of_nothing(self, example: EmbeddingExample) -> float:
        """See :class:`Task`."""
        return float(self._loss(torch.zeros_like(example.extra), example))

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

"""Training tasks: examples and losses of the default network (stretch and offsets) and of the paper's (embedding)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from anisomesh.learn.architecture import NetworkOptions, PaperOptions
from anisomesh.learn.data.examples import StretchExample, stretch_example
from anisomesh.learn.data.items import Item
from anisomesh.learn.models.paper import PaperInput, PaperNetwork, paper_input
from anisomesh.learn.models.stretch import Prediction, StretchNetwork
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.losses import cosine_loss, dot_loss, l2_loss, laplacian_loss, line_loss, offset_loss
from anisomesh.mesh.noise import NOISES, with_noise
from anisomesh.mesh.surface import Surface

_OFFSET_WEIGHT = 2.0  # heuristic: weight of the loss of offsets; the loss of line fields has weight 1
_QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # about the z axis

Losses = dict[str, Tensor]
"""Scalar losses by name; the names are columns of the rows of a run."""


class Task(Protocol):
    """The examples and losses that a kind of network is trained with."""

    def network(self) -> nn.Module:
        """Return a network with random weights."""
        ...

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> Any:
        """Return input and targets for an item with noise on the input, in mean edge lengths."""
        ...

    def losses(self, network: nn.Module, example: Any) -> Losses:
        """Return the losses of a network on an example; training minimises their sum."""
        ...

    def baseline_losses(self, example: Any) -> Losses:
        """Return the losses of the constant prediction of no stretch and no noise."""
        ...


def task_of(options: TrainingOptions) -> Task:
    """Return the task of a training run."""
    return StretchTask(options) if isinstance(options.network, NetworkOptions) else EmbeddingTask(options)


class StretchTask:
    """Line field and offsets of the default network, which needs no augmentation by rotations as it is equivariant."""

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, NetworkOptions)
        self._network = options.network

    def network(self) -> StretchNetwork:
        """See :class:`Task`."""
        return StretchNetwork(self._network)

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> StretchExample:
        """See :class:`Task`. Training has noise of all kinds, validation independent noise."""
        kind = NOISES[int(rng.integers(len(NOISES)))] if training else NOISES[0]
        return stretch_example(item, self._network.scales, noise, rng, kind)

    def losses(self, network: nn.Module, example: StretchExample) -> Losses:
        """See :class:`Task`."""
        return self._losses(Prediction(*(values.cpu() for values in network(example.hierarchy))), example)

    def baseline_losses(self, example: StretchExample) -> Losses:
        """See :class:`Task`."""
        nothing = Prediction(torch.zeros_like(example.line_field), torch.zeros_like(example.offsets))
        return self._losses(nothing, example)

    def _losses(self, found: Prediction, example: StretchExample) -> Losses:
        offset = offset_loss(
            found.offsets / example.unit, example.offsets, example.quadrics, example.edges, example.weight
        )
        return {
            "lines": line_loss(found.line_field, example.line_field, example.weight),
            "offsets": _OFFSET_WEIGHT * offset,
        }


@dataclass(frozen=True, eq=False)
class EmbeddingExample:
    """Input of the paper's network, target extra coordinates (N, 5), points (N, 3), faces (F, 3) and edges (E, 2)."""

    inputs: PaperInput
    extra: Tensor
    points: Tensor
    faces: Tensor
    edges: Tensor


class EmbeddingTask:
    """Extra coordinates of the paper's network, with its losses and its augmentation by rotations and mirrors."""

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, PaperOptions)
        self._options, self._network = options, options.network

    def network(self) -> PaperNetwork:
        """See :class:`Task`."""
        return PaperNetwork(self._network)

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool) -> EmbeddingExample:
        """See :class:`Task`. The first three extra coordinates start from the normals, so they rotate with the mesh."""
        clean, extra = item.surface, item.extra
        if training and self._options.augment:
            symmetry = random_symmetry(rng)
            clean = clean.with_points(clean.points @ symmetry.T)
            if np.linalg.det(symmetry) < 0.0:
                clean = Surface(clean.points, clean.faces[:, ::-1])
            extra = np.concatenate([extra[:, :3] @ symmetry.T, extra[:, 3:]], axis=1)
        noisy = with_noise(clean, noise, rng)
        return EmbeddingExample(
            inputs=paper_input(noisy),
            extra=torch.from_numpy(extra.astype(np.float32)),
            points=torch.from_numpy(clean.points.astype(np.float32)),
            faces=torch.from_numpy(clean.faces.astype(np.int64)),
            edges=torch.from_numpy(clean.edges.astype(np.int64)),
        )

    def losses(self, network: nn.Module, example: EmbeddingExample) -> Losses:
        """See :class:`Task`."""
        return {"embedding": self._loss(network(example.inputs).cpu(), example)}

    def baseline_losses(self, example: EmbeddingExample) -> Losses:
        """See :class:`Task`."""
        return {"embedding": self._loss(torch.zeros_like(example.extra), example)}

    def _loss(self, extra: Tensor, example: EmbeddingExample) -> Tensor:
        options = self._options
        if options.loss == "dot":
            whole, target = (torch.cat([example.points, values], dim=1) for values in (extra, example.extra))
            loss = dot_loss(whole, target, example.faces)
        else:
            loss = (l2_loss if options.loss == "l2" else cosine_loss)(extra, example.extra)
        if options.laplacian > 0.0:
            aligned = options.gauge == "aligned"
            loss = loss + options.laplacian * laplacian_loss(extra, example.extra, example.edges, aligned=aligned)
        return loss


def random_symmetry(rng: np.random.Generator) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return one of the ten symmetries of the paper's augmentation (3, 3): identity, mirrors and quarter turns."""
    number = int(rng.integers(10))
    axis = number % 3
    if number < 3:
        return np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
    if number < 9:
        order = np.roll(np.arange(3), axis)
        symmetry = _QUARTER_TURN[np.ix_(order, order)]
        return symmetry if number < 6 else symmetry.T
    return np.eye(3)

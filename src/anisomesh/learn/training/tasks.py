"""Training tasks: examples and losses of the default network, of the filter of normals, and of the paper's network."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from anisomesh.denoise.noise import NOISES, with_noise
from anisomesh.learn.architecture import FilterOptions, NetworkOptions, PaperOptions
from anisomesh.learn.data.examples import FilterExample, StretchExample, filter_example, stretch_example
from anisomesh.learn.data.items import Item
from anisomesh.learn.graphs.faces import FILTER_ROUNDS
from anisomesh.learn.inference.predict import NOISE_FLOOR, moved_by_network
from anisomesh.learn.models.normals import NormalFilter
from anisomesh.learn.models.paper import PaperInput, PaperNetwork, joined, paper_input
from anisomesh.learn.models.stretch import Prediction, StretchNetwork
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.losses import (
    cosine_loss,
    dot_loss,
    l2_loss,
    laplacian_loss,
    laplacian_unit,
    line_loss,
    normal_loss,
    offset_loss,
)
from anisomesh.mesh.surface import Surface

N_SYMMETRIES = 10
"""Number of symmetries of the paper's augmentation."""

VALIDATION_NOISE = (0.0, 0.3)
"""Standard deviations of noise in the validation of the networks for metrics, in mean edge lengths."""

_OFFSET_WEIGHT = 2.0  # heuristic: weight of the loss of offsets; the loss of line fields has weight 1
_MOVE_WEIGHT, _FILTERED_WEIGHT, _ROUND_WEIGHT = 1.0, 0.5, 0.25  # heuristic: offsets; normals, last and all
_QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # about the z axis

Losses = dict[str, Tensor]
"""Scalar losses by name; the names are columns of the rows of a run."""


class Task(Protocol):
    """The examples and losses that a kind of network is trained with.

    Attributes
    ----------
    copies
        Number of examples of each item in an epoch.
    validation_noise
        Standard deviations of noise in the validation, in mean edge lengths.
    """

    copies: int
    validation_noise: tuple[float, ...]

    def network(self) -> nn.Module:
        """Return a network with random weights."""
        ...

    def example(self, item: Item, noise: float, rng: np.random.Generator, *, training: bool, copy: int = 0) -> Any:
        """Return input and targets for a copy of an item with noise on the input, in mean edge lengths."""
        ...

    def losses(self, network: nn.Module, example: Any) -> Losses:
        """Return the losses of a network on an example; training minimises their sum."""
        ...

    def training_losses(self, network: nn.Module, examples: Iterable[Any]) -> Iterator[Losses]:
        """Yield losses of a network on the examples of a batch; their sums are over the examples of the batch."""
        ...

    def baseline_losses(self, example: Any) -> Losses:
        """Return the losses of a baseline: of predicting no stretch and no noise, or of the bilateral filter."""
        ...


def task_of(options: TrainingOptions) -> Task:
    """Return the task of a training run."""
    if isinstance(options.network, FilterOptions):
        return FilterTask(options)
    return StretchTask(options) if isinstance(options.network, NetworkOptions) else EmbeddingTask(options)


class StretchTask:
    """Line field and offsets of the default network, which needs no augmentation by rotations as it is equivariant."""

    copies = 1
    validation_noise: tuple[float, ...] = VALIDATION_NOISE

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, NetworkOptions)
        self._network = options.network

    def network(self) -> StretchNetwork:
        """See :class:`Task`."""
        return StretchNetwork(self._network)

    def example(
        self, item: Item, noise: float, rng: np.random.Generator, *, training: bool, copy: int = 0
    ) -> StretchExample:
        """See :class:`Task`. Training has noise of all kinds, validation independent noise."""
        kind = NOISES[int(rng.integers(len(NOISES)))] if training else NOISES[0]
        return stretch_example(item, self._network.scales, noise, rng, kind)

    def losses(self, network: nn.Module, example: StretchExample) -> Losses:
        """See :class:`Task`."""
        return self._losses(Prediction(*(values.cpu() for values in network(example.hierarchy))), example)

    def training_losses(self, network: nn.Module, examples: Iterable[StretchExample]) -> Iterator[Losses]:
        """See :class:`Task`."""
        return (self.losses(network, example) for example in examples)

    def baseline_losses(self, example: StretchExample) -> Losses:
        """See :class:`Task`."""
        nothing = Prediction(torch.zeros_like(example.line_field), torch.zeros_like(example.offsets.offsets))
        return self._losses(nothing, example)

    def _losses(self, found: Prediction, example: StretchExample) -> Losses:
        offset = offset_loss(found.offsets / example.offsets.unit, example.offsets)
        return {
            "lines": line_loss(found.line_field, example.line_field, example.offsets.weight),
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


class FilterTask:
    """The filter of normals, behind the pretrained default network; it is compared with the bilateral filter."""

    copies = 1
    validation_noise: tuple[float, ...] = (0.1, 0.3, 0.5)

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, FilterOptions)
        self._network = options.network
        self._bilateral = NormalFilter(replace(options.network, rounds=FILTER_ROUNDS))

    def network(self) -> NormalFilter:
        """See :class:`Task`."""
        return NormalFilter(self._network)

    def example(
        self, item: Item, noise: float, rng: np.random.Generator, *, training: bool, copy: int = 0
    ) -> FilterExample:
        """See :class:`Task`. Training has noise of all kinds, validation independent noise."""
        kind = NOISES[int(rng.integers(len(NOISES)))] if training else NOISES[0]
        return filter_example(item, moved_by_network, max(noise, NOISE_FLOOR), rng, kind)

    def losses(self, network: nn.Module, example: FilterExample) -> Losses:
        """See :class:`Task`."""
        found = network(example.faces)
        points = found.points.cpu()
        normals = [*(each.cpu() for each in found.rounds), _normals_of(points, example.corners)]
        losses = [normal_loss(each, example.normals, example.area) for each in normals]
        offsets = (points - example.points) / example.offsets.unit
        return {
            "rounds": _ROUND_WEIGHT * torch.stack(losses[:-1]).mean(),
            "filtered": _FILTERED_WEIGHT * losses[-2],
            "normals": losses[-1],
            "offsets": _MOVE_WEIGHT * offset_loss(offsets, example.offsets),
        }

    def training_losses(self, network: nn.Module, examples: Iterable[FilterExample]) -> Iterator[Losses]:
        """See :class:`Task`."""
        return (self.losses(network, example) for example in examples)

    def baseline_losses(self, example: FilterExample) -> Losses:
        """See :class:`Task`. Before its training a filter is bilateral."""
        with torch.no_grad():
            return self.losses(self._bilateral, example)


def _normals_of(points: Tensor, faces: Tensor) -> Tensor:
    """Return the unit normals (F, 3) of faces (F, 3) of points (V, 3)."""
    corners = points[faces]
    normals = torch.linalg.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return nn.functional.normalize(normals, dim=1, eps=1e-30)


class EmbeddingTask:
    """Extra coordinates of the paper's network, with its losses and its augmentation by rotations and mirrors."""

    validation_noise: tuple[float, ...] = VALIDATION_NOISE

    def __init__(self, options: TrainingOptions) -> None:
        assert isinstance(options.network, PaperOptions)
        self._options, self._network = options, options.network
        self.copies = N_SYMMETRIES if options.augment and options.symmetries == "all" else 1

    def network(self) -> PaperNetwork:
        """See :class:`Task`."""
        return PaperNetwork(self._network)

    def example(
        self, item: Item, noise: float, rng: np.random.Generator, *, training: bool, copy: int = 0
    ) -> EmbeddingExample:
        """See :class:`Task`. The first three extra coordinates start from the normals, so they rotate with the mesh."""
        clean, extra = item.surface, item.extra
        if training and self._options.augment:
            turn = symmetry(copy if self.copies > 1 else int(rng.integers(N_SYMMETRIES)))
            clean = clean.with_points(clean.points @ turn.T)
            if np.linalg.det(turn) < 0.0:
                clean = Surface(clean.points, clean.faces[:, ::-1])
            extra = np.concatenate([extra[:, :3] @ turn.T, extra[:, 3:]], axis=1)
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
        return self._losses(network(example.inputs).cpu(), example)

    def training_losses(self, network: nn.Module, examples: Iterable[EmbeddingExample]) -> Iterator[Losses]:
        """See :class:`Task`. Batch norms need all examples of the batch at once."""
        if self._network.norm == "mesh":
            yield from (self.losses(network, example) for example in examples)
            return
        batch = list(examples)
        if not batch:  # more processes than examples
            return
        found = network(joined([example.inputs for example in batch])).cpu().split([len(one.extra) for one in batch])
        losses = [self._losses(extra, example) for extra, example in zip(found, batch, strict=True)]
        yield {name: torch.stack([one[name] for one in losses]).sum() for name in losses[0]}

    def baseline_losses(self, example: EmbeddingExample) -> Losses:
        """See :class:`Task`."""
        return self._losses(torch.zeros_like(example.extra), example)

    def _losses(self, extra: Tensor, example: EmbeddingExample) -> Losses:
        options, faces, edges = self._options, example.faces, example.edges
        whole, target = (torch.cat([example.points, values], dim=1) for values in (extra, example.extra))
        if options.loss == "dot":
            losses = {"dot": dot_loss(whole, target, faces)}
        else:
            losses = {options.loss: (l2_loss if options.loss == "l2" else cosine_loss)(extra, example.extra)}
        if options.laplacian > 0.0:
            loss = laplacian_loss(extra, example.extra, edges, aligned=options.gauge == "aligned")
            unit = laplacian_unit(options.loss, options.laplacian_scale, example.extra, target, faces, edges)
            losses["laplacian"] = options.laplacian * loss / unit
        return losses


def symmetry(number: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return one of the symmetries of the paper's augmentation (3, 3): three mirrors, six quarter turns, identity."""
    axis = number % 3
    if number < 3:
        return np.diag(np.where(np.arange(3) == axis, -1.0, 1.0))
    if number < 9:
        order = np.roll(np.arange(3), axis)
        symmetry = _QUARTER_TURN[np.ix_(order, order)]
        return symmetry if number < 6 else symmetry.T
    return np.eye(3)

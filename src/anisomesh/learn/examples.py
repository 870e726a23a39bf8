"""Training examples: items with noise, as pyramids, with the lines that a network is to find on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from anisomesh.learn.items import Item
from anisomesh.learn.lines import directions_of, lines_in
from anisomesh.learn.pyramid import Pyramid, pyramid
from anisomesh.surface.mesh import Surface

_UNTRUSTED = 0.1  # weight of points whose curvature is not known well


@dataclass(frozen=True, eq=False)
class Example:
    """A mesh as the network sees it, the lines wanted (N, 2), and the weights of its points (N,), sum 1."""

    pyramid: Pyramid
    lines: Tensor
    weight: Tensor


def example_of(item: Item, n_scales: int, noise: float = 0.0, rng: np.random.Generator | None = None) -> Example:
    """Return an example.

    Parameters
    ----------
    item
        The mesh and the metric of its clean shape.
    n_scales
        Graphs of the pyramid.
    noise
        Standard deviation of the noise that is added to every coordinate, in mean edge lengths. The lines wanted are
        still those of the clean shape.
    rng
        Of the noise.
    """
    clean = item.surface
    directions, logarithms = directions_of(item.tensors)
    scales = pyramid(clean if rng is None else with_noise(clean, noise, rng), n_scales)
    area = np.bincount(clean.faces.ravel(), np.repeat(clean.face_areas, 3), minlength=clean.n_points)
    weight = area * np.where(item.trusted, 1.0, _UNTRUSTED)
    return Example(
        pyramid=scales,
        lines=torch.from_numpy(lines_in(scales.frames, directions, logarithms)),
        weight=torch.from_numpy((weight / weight.sum()).astype(np.float32)),
    )


def with_noise(surface: Surface, noise: float, rng: np.random.Generator) -> Surface:
    """Return a surface with noise of this deviation, in mean edge lengths, added to every coordinate."""
    if noise == 0.0:
        return surface
    size = noise * float(surface.edge_lengths.mean())
    return surface.with_points(surface.points + rng.normal(0.0, size, surface.points.shape))

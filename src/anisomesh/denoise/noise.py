"""Noise on the points of a surface: synthetic noise for training, tests and benchmarks, and how high noise is."""

from __future__ import annotations

from typing import Literal

import numpy as np

from anisomesh._arrays import PointVectors
from anisomesh.mesh.surface import Surface

Noise = Literal["independent", "normal", "smooth"]
NOISES: tuple[Noise, ...] = ("independent", "normal", "smooth")


def with_noise(surface: Surface, noise: float, rng: np.random.Generator, kind: Noise = "independent") -> Surface:
    """Return a copy of a surface with Gaussian noise added to its points.

    Parameters
    ----------
    surface
        Any surface.
    noise
        Standard deviation of each coordinate, or of the offset along the normal, over the mean edge length.
    rng
        Generator of the noise.
    kind
        ``"independent"``: independent coordinates; ``"normal"``: offsets along the point normals, as from a scanner;
        ``"smooth"``: half the deviation, correlated between neighbours.
    """
    if noise == 0.0:
        return surface
    deviation = noise * float(surface.edge_lengths.mean())
    offsets = rng.normal(0.0, deviation, surface.points.shape)
    if kind == "normal":
        offsets = offsets[:, :1] * surface.point_normals
    elif kind == "smooth":
        ends = np.concatenate([surface.edges, surface.edges[:, ::-1]])
        sums = np.stack([np.bincount(ends[:, 0], offsets[ends[:, 1], k], len(offsets)) for k in range(3)], axis=1)
        count = np.bincount(ends[:, 0], minlength=len(offsets))[:, None]
        offsets = (offsets + sums) / (2.0 * np.sqrt(count + 1.0))
    return surface.with_points(surface.points + offsets)


def noise_height(surface: Surface, offsets: PointVectors) -> float:
    """Return the root mean square of offsets (V, 3) along the normals of a surface, in mean edge lengths."""
    heights = np.einsum("nx,nx->n", surface.point_normals, offsets)
    return float(np.sqrt((heights**2).mean()) / surface.edge_lengths.mean())

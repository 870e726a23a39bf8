"""Noise on the points of a surface."""

from __future__ import annotations

from typing import Literal

import numpy as np

from anisomesh.mesh.surface import Surface

Noise = Literal["independent", "normal", "smooth"]
NOISES: tuple[Noise, ...] = ("independent", "normal", "smooth")


def with_noise(surface: Surface, noise: float, rng: np.random.Generator, kind: Noise = "independent") -> Surface:
    """Return a surface with noise of this deviation, in mean edge lengths.

    Parameters
    ----------
    surface
        The surface.
    noise
        Deviation of every coordinate, or of the height along the normal.
    rng
        Of the noise.
    kind
        ``"independent"``, every coordinate by itself; ``"normal"``, along the normals alone, as of a scanner that looks
        from there; ``"smooth"``, half as much, alike at neighbours.
    """
    if noise == 0.0:
        return surface
    size = noise * float(surface.edge_lengths.mean())
    away = rng.normal(0.0, size, surface.points.shape)
    if kind == "normal":
        away = away[:, :1] * surface.point_normals
    elif kind == "smooth":
        ends = np.concatenate([surface.edges, surface.edges[:, ::-1]])
        total = np.stack([np.bincount(ends[:, 0], away[ends[:, 1], axis], len(away)) for axis in range(3)], axis=1)
        count = np.bincount(ends[:, 0], minlength=len(away))[:, None]
        away = (away + total) / (2.0 * np.sqrt(count + 1.0))
    return surface.with_points(surface.points + away)

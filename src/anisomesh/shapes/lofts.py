"""Machine parts made by code at random: lofts with creases, steps, bevels, rounds and bulges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches
from anisomesh.shapes.parts import hollow_loft, is_star, loft

Outline = npt.NDArray[np.float64]

_ROUND = 6  # points of a rounded corner
_AROUND = 48  # of a circle
_HOLLOW = 0.4  # share of parts with a hole along their axis
_STRETCH = 1.0  # largest logarithm of the stretch of an axis


def random_part(rng: np.random.Generator) -> Surface:
    """Return a random loft, stretched along its axes and turned: a closed surface of large flat and curved triangles.

    Its sections are polygons, gears or circles; its profile goes up in cylinders, cones and bulges, with steps between
    them. Corners of both are sharp, bevelled or rounded. Some parts have a hole along their axis.
    """
    outline = _outline(rng)
    while not is_star(outline):
        outline = _outline(rng)
    profile = _profile(rng)
    if rng.random() < _HOLLOW:
        part = hollow_loft(outline, _hollowed(profile[1:-1], rng))
    else:
        part = loft(outline, _cut(profile, rng, closed=False))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    stretch = np.exp(rng.uniform(-_STRETCH, _STRETCH, 3))
    return part.with_points(part.points * stretch @ turn.T)


def _outline(rng: np.random.Generator) -> Outline:
    kind = rng.choice(["polygon", "gear", "circle"], p=[0.6, 0.15, 0.25])
    if kind == "circle":
        return patches.circle(1.0, _AROUND)
    if kind == "gear":
        teeth, depth = int(rng.integers(5, 16)), rng.uniform(0.1, 0.4)
        angle = 2.0 * np.pi * (np.arange(teeth)[:, None] + np.array([0.0, 0.3, 0.5, 0.8])) / teeth
        radius = np.broadcast_to([1.0, 1.0, 1.0 - depth, 1.0 - depth], angle.shape)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=2).reshape(-1, 2)
    n = int(rng.integers(3, 9))
    angle = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    return _cut(rng.uniform(0.5, 1.0, n)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1), rng, closed=True)


def _profile(rng: np.random.Generator) -> Outline:
    size, height = rng.uniform(0.4, 1.0), 0.0
    rows = [[0.0, rng.choice([0.0, -rng.uniform(0.1, 0.6)])], [size, 0.0]]
    for left in reversed(range(int(rng.integers(1, 5)))):
        rise, kind = rng.uniform(0.15, 1.0), rng.choice(["cylinder", "cone", "bulge"], p=[0.5, 0.25, 0.25])
        if kind == "bulge":
            t = np.arange(1, _ROUND + 1) / (_ROUND + 1)
            belly = size * (1.0 + rng.uniform(-0.4, 0.5) * np.sin(np.pi * t))
            rows += np.stack([belly, height + rise * t], axis=1).tolist()
        elif kind == "cone":
            size *= rng.uniform(0.5, 1.5)
        height += rise
        rows.append([size, height])
        if left and rng.random() < 0.6:
            size *= rng.uniform(0.4, 1.6)
            rows.append([size, height])
    rows.append([0.0, height + rng.choice([0.0, rng.uniform(0.1, 0.6)])])
    return np.array(rows)


def _hollowed(outside: Outline, rng: np.random.Generator) -> Outline:
    """Return the closed section of a part with this outside and a hole that is narrower everywhere."""
    low, high = outside[0, 1], outside[-1, 1]
    inside = outside[:, 0].min() * rng.uniform(0.3, 0.9, 2)
    return _cut(np.concatenate([outside, [[inside[0], high], [inside[1], low]]]), rng, closed=True)


def _cut(corners: Outline, rng: np.random.Generator, *, closed: bool) -> Outline:
    """Return a polygon or chain (n, 2) with some of its corners bevelled or rounded."""
    parts = []
    for k, corner in enumerate(corners):
        kind = rng.choice(["sharp", "bevelled", "rounded"], p=[0.5, 0.2, 0.3])
        if kind == "sharp" or (not closed and k in (0, len(corners) - 1)):
            parts.append(corner[None])
            continue
        share = rng.uniform(0.1, 0.45, 2)
        before, after = corners[k - 1], corners[(k + 1) % len(corners)]
        start, end = corner + share[0] * (before - corner), corner + share[1] * (after - corner)
        t = np.linspace(0.0, 1.0, _ROUND if kind == "rounded" else 2)[:, None]
        curve = (1.0 - t) ** 2 * start + 2.0 * t * (1.0 - t) * corner + t**2 * end
        parts.append(curve)
    return np.concatenate(parts)

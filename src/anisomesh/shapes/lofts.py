"""Random CAD parts: lofts with creases, steps, bevels, fillets and bulges."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches
from anisomesh.shapes.parts import hollow_loft, is_star_shaped, loft

Outline = npt.NDArray[np.float64]

_CURVE_POINTS = 6  # of a fillet or a bulge; heuristic, for large triangles
_CIRCLE_POINTS = 48  # of a circular outline; heuristic
_HOLLOW_FRACTION = 0.4  # of the parts have a hole along the axis; heuristic, as all probabilities below
_MAX_LOG_SCALE = 1.0  # logarithm of the scale of an axis; heuristic


def random_part(rng: np.random.Generator) -> Surface:
    """Return a random loft, scaled along its axes and rotated: a closed surface of few large triangles.

    The sections are polygons, gears or circles; the profile has cylinders, cones, bulges and steps. Corners of both are
    sharp, bevelled or rounded. Some parts have a hole along the axis. Creases and planes are exact; curved parts are
    polygons with vertices on the curves.
    """
    outline = _outline(rng)
    while not is_star_shaped(outline):
        outline = _outline(rng)
    profile = _profile(rng)
    if rng.random() < _HOLLOW_FRACTION:
        part = hollow_loft(outline, _hollowed(profile[1:-1], rng))
    else:
        part = loft(outline, _blend_corners(profile, rng, closed=False))
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    scale = np.exp(rng.uniform(-_MAX_LOG_SCALE, _MAX_LOG_SCALE, 3))
    return part.with_points(part.points * scale @ rotation.T)


def _outline(rng: np.random.Generator) -> Outline:
    """Return a random circle, gear or polygon (m, 2) around the origin."""
    kind = rng.choice(["polygon", "gear", "circle"], p=[0.6, 0.15, 0.25])
    if kind == "circle":
        return patches.circle(1.0, _CIRCLE_POINTS)
    if kind == "gear":
        teeth, depth = int(rng.integers(5, 16)), rng.uniform(0.1, 0.4)
        angle = 2.0 * np.pi * (np.arange(teeth)[:, None] + np.array([0.0, 0.3, 0.5, 0.8])) / teeth
        radius = np.broadcast_to([1.0, 1.0, 1.0 - depth, 1.0 - depth], angle.shape)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=2).reshape(-1, 2)
    n = int(rng.integers(3, 9))
    angle = 2.0 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    return _blend_corners(
        rng.uniform(0.5, 1.0, n)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1), rng, closed=True
    )


def _profile(rng: np.random.Generator) -> Outline:
    """Return a random profile of sizes and heights (n, 2), from axis to axis."""
    size, height = rng.uniform(0.4, 1.0), 0.0
    rows = [[0.0, rng.choice([0.0, -rng.uniform(0.1, 0.6)])], [size, 0.0]]
    for left in reversed(range(int(rng.integers(1, 5)))):
        rise, kind = rng.uniform(0.15, 1.0), rng.choice(["cylinder", "cone", "bulge"], p=[0.5, 0.25, 0.25])
        if kind == "bulge":
            t = np.arange(1, _CURVE_POINTS + 1) / (_CURVE_POINTS + 1)
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


def _hollowed(outer: Outline, rng: np.random.Generator) -> Outline:
    """Return the closed section of a part with an outer profile and a narrower random hole."""
    low, high = outer[0, 1], outer[-1, 1]
    inner = outer[:, 0].min() * rng.uniform(0.3, 0.9, 2)
    return _blend_corners(np.concatenate([outer, [[inner[0], high], [inner[1], low]]]), rng, closed=True)


def _blend_corners(corners: Outline, rng: np.random.Generator, *, closed: bool) -> Outline:
    """Return a polygon, or an open polyline, (n, 2) with random corners bevelled or rounded (by quadratic curves)."""
    parts = []
    for k, corner in enumerate(corners):
        kind = rng.choice(["sharp", "bevelled", "rounded"], p=[0.5, 0.2, 0.3])
        if kind == "sharp" or (not closed and k in (0, len(corners) - 1)):
            parts.append(corner[None])
            continue
        fraction = rng.uniform(0.1, 0.45, 2)
        before, after = corners[k - 1], corners[(k + 1) % len(corners)]
        start, end = corner + fraction[0] * (before - corner), corner + fraction[1] * (after - corner)
        t = np.linspace(0.0, 1.0, _CURVE_POINTS if kind == "rounded" else 2)[:, None]
        curve = (1.0 - t) ** 2 * start + 2.0 * t * (1.0 - t) * corner + t**2 * end
        parts.append(curve)
    return np.concatenate(parts)

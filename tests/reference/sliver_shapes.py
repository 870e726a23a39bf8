"""Shapes triangulated as CAD programs export them: long triangles from rim to rim."""

import numpy as np

from anisomesh.mesh.surface import Surface


def comb(teeth, seed=0, bulge=0.0):
    """Return a flat plate, 1 by 0.6 with bulging long sides, whose triangles reach from one of these to the other."""
    rng = np.random.default_rng(seed)
    x = np.sort(np.concatenate([[0.0, 1.0], rng.random(teeth)]))
    arch = bulge * np.sin(np.pi * x)
    lower, upper = (np.stack([x, y, np.zeros_like(x)], axis=1) for y in (-arch, 0.6 + arch))
    k, n = np.arange(teeth + 1), teeth + 2
    faces = np.concatenate([np.stack([k, k + 1, n + k], axis=1), np.stack([k + 1, n + k + 1, n + k], axis=1)])
    return Surface(np.concatenate([lower, upper]), faces.astype(np.int32))


def thick_comb(teeth, height=0.1, bulge=0.0):
    """Return a closed plate of this height whose bottom and top are combs, at z = 0 and at the height."""
    bottom = comb(teeth, bulge=bulge)
    n = bottom.n_points
    points = np.concatenate([bottom.points, bottom.points + np.array([0.0, 0.0, height])])
    corners = np.concatenate([bottom.faces[:, [0, 1]], bottom.faces[:, [1, 2]], bottom.faces[:, [2, 0]]])
    twice = {tuple(pair) for pair in corners.tolist()}
    rim = np.array([pair for pair in corners.tolist() if (pair[1], pair[0]) not in twice])
    a, b = rim.T
    walls = np.concatenate([np.stack([a, b, b + n], axis=1), np.stack([a, b + n, a + n], axis=1)])
    return Surface(points, np.concatenate([bottom.faces[:, ::-1], bottom.faces + n, walls]).astype(np.int32))


def needle_tube(sections, height=3.0):
    """Return the side of a cylinder of radius 1 made of one long quadrilateral per section."""
    angle = 2.0 * np.pi * np.arange(sections) / sections
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.insert(circle, 2, z, axis=1) for z in (0.0, height)])
    k = np.arange(sections)
    after = (k + 1) % sections
    lower = np.stack([k, after, sections + k], axis=1)
    faces = np.concatenate([lower, np.stack([after, sections + after, sections + k], axis=1)])
    return Surface(points, faces.astype(np.int32))

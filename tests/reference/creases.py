"""A crease with a known opening angle."""

import numpy as np

from anisomesh.mesh.surface import Surface


def wedge(angle):
    """A roof of two long rectangles meeting at a crest with this opening angle, crest along y at the origin."""
    run, drop = np.sin(angle / 2), -np.cos(angle / 2)
    y = np.linspace(-1, 1, 9)
    rows = [np.stack([np.full(9, x), y, np.full(9, z)], axis=1) for x, z in ((-run, drop), (0.0, 0.0), (run, drop))]
    faces = []
    for row in range(2):
        for k in range(8):
            a, b = 9 * row + k, 9 * (row + 1) + k
            faces += [[a, b, b + 1], [a, b + 1, a + 1]]
    return Surface(np.concatenate(rows), np.array(faces))

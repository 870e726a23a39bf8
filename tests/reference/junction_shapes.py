"""Surfaces with non-manifold junctions, as points and faces, and what their edges are."""

import numpy as np


def lattice(places):
    """Return points and faces of a lattice of places (n, m, 3)."""
    n, m = places.shape[:2]
    number = np.arange(n * m).reshape(n, m)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return places.reshape(-1, 3), np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def square(n, m, place):
    """Return a lattice of n x m places, each at ``place(u, v)`` for u and v from 0 to 1."""
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    return lattice(np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).astype(float))


def glued(*parts):
    """Return the parts with points at one place made one, and faces that have lost a corner left out."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    points = np.concatenate([points for points, _ in parts]).round(9) + 0.0
    unique, number = np.unique(points, axis=0, return_inverse=True)
    faces = np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=True)])
    faces = number.reshape(-1)[faces]
    return unique, faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


def wavy_fin():
    """A fin on a curved sheet, from one boundary to the other."""

    def height(v):
        return 0.1 * np.sin(3 * v)

    return glued(
        square(25, 15, lambda u, v: (2 * u - 1, v, height(v))),
        square(9, 15, lambda u, v: (0 * u, v, height(v) + 0.6 * u)),
    )


def tee():
    """A plate on another one, where its foot ends inside."""
    return glued(
        square(17, 17, lambda u, v: (2 * u - 1, 2 * v - 1, 0 * u)),
        square(7, 9, lambda u, v: (0 * u, v - 0.5, u)),
    )


def book(n=5):
    """Pages that meet at a spine."""
    angles = np.linspace(0, 2 * np.pi, n, endpoint=False) + 0.3
    return glued(*(square(7, 13, lambda u, v, t=t: (u * np.cos(t), u * np.sin(t), 2 * v)) for t in angles))


def sphere_with_fin():
    """A fin on a part of a meridian of a sphere."""

    def sphere(t, u):
        return np.cos(t) * np.sin(u), np.sin(t) * np.sin(u), np.cos(u)

    def fin(t, u):
        x, y, z = sphere(0 * t, np.pi / 4 + np.pi / 2 * u)
        return x * (1 + 0.4 * t), y, z * (1 + 0.4 * t)

    return glued(square(33, 17, lambda u, v: sphere(2 * np.pi * u, np.pi * v)), square(4, 9, fin))


def boxes(nx, ny, nz, n=4):
    """All walls of a grid of unit boxes, each once, in n x n cells."""
    walls = []
    for axis, sizes in enumerate([(nx, ny, nz), (ny, nz, nx), (nz, nx, ny)]):
        for i, j, k in np.ndindex(sizes[0] + 1, *sizes[1:]):
            points, faces = square(n + 1, n + 1, lambda u, v, i=i, j=j, k=k: (i + 0 * u, u + j, v + k))
            walls.append((np.roll(points, axis, axis=1), faces))
    return glued(*walls)


def cubes_at_an_edge():
    """Two cubes of twelve triangles each with an edge in common."""
    points, faces = boxes(1, 1, 1, n=1)
    return glued((points, faces), (points + np.array([1, 1, 0]), faces))


def disc_in_tube():
    """A disc across a tube: the junction is closed."""
    return glued(
        square(33, 17, lambda u, v: (np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 2 * v - 1)),
        square(33, 7, lambda u, v: (v * np.cos(2 * np.pi * u), v * np.sin(2 * np.pi * u), 0 * u)),
    )


def soap_films():
    """A double bubble: two caps and a disc that meet at 120 degrees in a circle."""
    root = np.sqrt(0.75)

    def cap(u, v, sign):
        height = np.pi * 2 / 3 * v
        radius, z = np.sin(height), 0.5 + np.cos(height)
        return radius * np.cos(2 * np.pi * u), radius * np.sin(2 * np.pi * u), sign * z

    return glued(
        square(41, 11, lambda u, v: cap(u, v, 1)),
        square(41, 11, lambda u, v: cap(u, v, -1)),
        square(41, 6, lambda u, v: (root * v * np.cos(2 * np.pi * u), root * v * np.sin(2 * np.pi * u), 0 * u)),
    )


SHAPES = {
    "wavy_fin": wavy_fin,
    "tee": tee,
    "book": book,
    "sphere_with_fin": sphere_with_fin,
    "two_boxes": lambda: boxes(2, 1, 1),
    "grid_of_boxes": lambda: boxes(2, 2, 1),
    "cubes_at_an_edge": cubes_at_an_edge,
    "disc_in_tube": disc_in_tube,
    "soap_films": soap_films,
}


def lengths_by_count(points, faces):
    """Return the total length of the edges with one face, and with three or more, as {number of faces: length}."""
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, count = np.unique(ends, axis=0, return_counts=True)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    return {int(k): float(length[count == k].sum()) for k in np.unique(count) if k != 2}

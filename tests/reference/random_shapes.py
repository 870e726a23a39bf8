"""Random shapes that are hard to remesh: thin and nearly touching sheets, spikes, tiny handles, high genus, needles."""

import numpy as np

from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, cylinder, open_patch, sphere


def sheet(rng):
    """Return a plate of a thickness from a tenth to a thousandth."""
    return box((1.0, 1.0, 10 ** rng.uniform(-3, -1)), n=int(rng.integers(2, 12)))


def nearly_touching(rng):
    """Return two waves, the upper side of one next to the lower side of the other."""
    wave = open_patch(lambda x, y: 0.1 * np.sin(3 * x), n=int(rng.integers(4, 16)))
    other = wave.points + np.array([0.0, 0.0, 10 ** rng.uniform(-4, -1)])
    return Surface(
        np.concatenate([wave.points, other]), np.concatenate([wave.faces, wave.faces[:, ::-1] + wave.n_points])
    )


def spikes(rng):
    """Return a ball with some points pulled far out."""
    ball = sphere(int(rng.integers(2, 4)))
    points = ball.points.copy()
    pulled = rng.choice(len(points), size=int(rng.integers(1, 12)), replace=False)
    points[pulled] *= rng.uniform(1.2, 5.0, size=(len(pulled), 1))
    return Surface(points, ball.faces)


def tiny_handle(rng):
    """Return a ball with a tube of three sides between two of its triangles."""
    ball = sphere(3)
    centre = ball.points[ball.faces].mean(axis=1)
    first = int(rng.integers(ball.n_faces))
    order = np.argsort(np.linalg.norm(centre - centre[first], axis=1))
    second = next(int(k) for k in order[1:] if not set(ball.faces[first]) & set(ball.faces[k]))
    start, end = ball.faces[first].astype(int), ball.faces[second][::-1].astype(int)
    turns = [np.roll(end, k) for k in range(3)]
    end = min(turns, key=lambda turn: np.linalg.norm(ball.points[start] - ball.points[turn], axis=1).sum())
    middle = 0.5 * (ball.points[start] + ball.points[end]) * (1.0 + 10 ** rng.uniform(-3, -0.7))
    middle = middle.mean(axis=0) + 0.5 * (middle - middle.mean(axis=0))
    waist = ball.n_points + np.arange(3)
    tube = []
    for lower, upper in ((start, waist), (waist, end)):
        for k in range(3):
            a, b, c, d = lower[k], lower[(k + 1) % 3], upper[k], upper[(k + 1) % 3]
            tube += [[a, b, d], [a, d, c]]
    faces = np.concatenate([np.delete(ball.faces, [first, second], axis=0), np.array(tube)])
    return Surface(np.concatenate([ball.points, middle]), faces)


def of_cubes(filled):
    """Return the boundary of the filled cells of a grid (l, m, n), of unit squares cut in two."""
    filled = np.pad(filled, 1)
    squares = []
    for axis in range(3):
        step_u, step_v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
        for ahead in (0, 1):
            outside = ~np.roll(filled, -1 if ahead else 1, axis=axis)
            for cell in np.argwhere(filled & outside):
                start = cell + ahead * np.eye(3, dtype=int)[axis]
                square = [start, start + step_u, start + step_u + step_v, start + step_v]
                squares.append(square if ahead else square[::-1])
    points, number = np.unique(np.array(squares).reshape(-1, 3), axis=0, return_inverse=True)
    corners = number.reshape(-1, 4)
    return Surface(points.astype(float), np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]))


def high_genus(rng):
    """Return a plate with up to 9 square holes; with 16, a remesh to fewer vertices than they need takes 25 s."""
    m = 2 * int(rng.integers(1, 4)) + 1
    plate = np.ones((m, m, 1), dtype=bool)
    plate[1::2, 1::2] = False
    return of_cubes(plate)


def blocks(rng):
    """Return random cubes of a grid, which also meet at edges and points only."""
    filled = rng.random((3, 3, 3)) < 0.5
    filled[1, 1, 1] = True
    return of_cubes(filled)


def needle(rng):
    """Return a long thin cylinder."""
    radius = 10 ** rng.uniform(-3, -1)
    return cylinder(radius, 1.0, n_around=int(rng.integers(3, 12)), n_along=int(rng.integers(1, 30)))


def rough(rng):
    """Return a ball with noise, a little to so much that it intersects itself."""
    ball = sphere(int(rng.integers(2, 4)))
    return Surface(ball.points * (1.0 + rng.normal(0.0, 10 ** rng.uniform(-3, -0.7), (ball.n_points, 1))), ball.faces)


def torn(rng):
    """Return a ball without some of its triangles."""
    ball = sphere(3)
    return Surface(ball.points, ball.faces[rng.random(ball.n_faces) > rng.uniform(0.01, 0.3)])


SHAPES = (sheet, nearly_touching, spikes, tiny_handle, high_genus, blocks, needle, rough, torn)

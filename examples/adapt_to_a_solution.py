"""Adapt a mesh to a solution: solve, adapt, solve again, and compare the error at the same number of vertices.

The problem is -e^2 div grad u + u = f on a tilted plate, with linear finite elements. Its solution is known: u = -1 in
a disc and 1 around it, with a layer of width e between.

Usage: python examples/adapt_to_a_solution.py [OUT]    (extra: picture)
"""

import sys

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

import anisomesh
from anisomesh.metric.solution import SolutionMetric
from anisomesh.shapes.analytic import open_patch
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring

WIDTH, RADIUS = 0.05, 0.6  # of the layer, and of the disc; the plate is 2 wide


def exact(points: np.ndarray) -> np.ndarray:
    """Return the solution at points: tanh of the distance from the circle over the width of the layer."""
    return np.tanh((np.linalg.norm(points, axis=-1) - RADIUS) / WIDTH)


def load(points: np.ndarray) -> np.ndarray:
    """Return f = u - e^2 (u'' + u' / r)."""
    u, r = exact(points), np.maximum(np.linalg.norm(points, axis=-1), 1e-9)
    return u + (1 - u**2) * (2 * u - WIDTH / r)


def solve(mesh: anisomesh.Surface) -> np.ndarray:
    """Return the solution with linear finite elements, at the vertices."""
    corners, area = mesh.points[mesh.faces], mesh.face_areas[:, None]
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]  # opposite the corners
    stiffness = np.einsum("fix,fjx->fij", sides, sides) / (4 * area[:, :, None])
    mass = (np.ones((3, 3)) + np.eye(3)) * area[:, :, None] / 12
    rows, columns = np.repeat(mesh.faces, 3, axis=1).ravel(), np.tile(mesh.faces, (1, 3)).ravel()
    matrix = sparse.csc_matrix(((WIDTH**2 * stiffness + mass).ravel(), (rows, columns)), shape=(mesh.n_points,) * 2)
    at_middles = load((corners[:, [1, 2, 0]] + corners[:, [2, 0, 1]]) / 2)
    shares = area / 6 * (at_middles[:, [1, 2, 0]] + at_middles[:, [2, 0, 1]])
    return spsolve(matrix, np.bincount(mesh.faces.ravel(), shares.ravel(), minlength=mesh.n_points))


def error(mesh: anisomesh.Surface, u: np.ndarray, n: int = 8) -> float:
    """Return the L2 norm of u minus the exact solution, by the midpoint rule on n^2 parts of each triangle."""
    places = [(i + s, j + s) for s in (1 / 3, 2 / 3) for i in range(n) for j in range(n - i) if i + j + 2 * s < n]
    weights = np.array([(a / n, b / n, 1 - (a + b) / n) for a, b in places])
    points = np.einsum("qc,fcx->qfx", weights, mesh.points[mesh.faces])
    squared = (np.einsum("qc,fc->qf", weights, u[mesh.faces]) - exact(points)) ** 2
    return float(np.sqrt((squared.mean(axis=0) * mesh.face_areas).sum()))


def main(out: str = "adapted.png", n_vertices: int = 500, rounds: int = 2) -> list[float]:
    plate = open_patch(lambda x, y: 0.25 * x)
    mesh = anisomesh.remesh(plate, n_vertices=n_vertices, metric="uniform").surface
    meshes, errors = [mesh], []
    for step in range(rounds + 1):
        u = solve(mesh)
        errors.append(error(mesh, u))
        name = f"adapted {step} x" if step else "even"
        print(f"{name:10} {mesh.n_points} vertices, L2 error {errors[-1]:.4f}, {errors[0] / errors[-1]:.1f} times less")
        if step < rounds:
            mesh = anisomesh.remesh(plate, n_vertices=n_vertices, metric=SolutionMetric(u, surface=mesh)).surface
            meshes.append(mesh)
    panels = [
        Panel(surface=each, name=name, note=f"L2 error {value:.3f}", colouring=stretch_colouring(each))
        for each, name, value in ((meshes[0], "even", errors[0]), (meshes[-1], "adapted", errors[-1]))
    ]
    gallery(panels, out, columns=2, same_view=True, options=PictureOptions(scale=2))
    return errors


if __name__ == "__main__":
    main(*sys.argv[1:])

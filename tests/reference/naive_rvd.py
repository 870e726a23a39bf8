"""Slow and plain versions of the restricted Voronoi diagram and its energy, to test the fast ones against.

Nothing here is taken from the package: cells are clipped against all sites, one after the other; signs are
decided in exact rational arithmetic; derivatives are taken by complex steps.
"""

from fractions import Fraction
from itertools import pairwise

import numpy as np

TINY = Fraction(1, 2**700)


def embed(points, dimension, rng, strength=0.6):
    """Return points (V, d) whose first three coordinates are those given; the others are smooth functions of them."""
    waves = points @ rng.normal(size=(3, dimension - 3)) + rng.uniform(0, 6, dimension - 3)
    return np.column_stack([points, strength * np.sin(waves)])


def random_sites(points, faces, n, rng, lift=0.0):
    """Return n points (n, d) on random faces, moved off the surface by normal deviates times ``lift``."""
    face = rng.integers(len(faces), size=n)
    share = rng.dirichlet(np.ones(3), size=n)
    on_surface = np.einsum("nc,ncd->nd", share, points[faces[face]])
    return on_surface + lift * rng.normal(size=on_surface.shape)


def areas(points, faces):
    """Return the areas (F,) of triangles in any dimension, by Gram-Schmidt."""
    u, v = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    length = np.linalg.norm(u, axis=1)
    along = (u * v).sum(axis=1) / length
    return 0.5 * length * np.linalg.norm(v - u * (along / length)[:, None], axis=1)


def normals(points, faces):
    """Return unit normals (F, 3) of the faces in space."""
    a, b, c = points[faces].transpose(1, 0, 2)[:, :, :3]
    cross = np.cross(b - a, c - a)
    return cross / np.linalg.norm(cross, axis=1)[:, None]


# ---------------------------------------------------------------------------------------- exact predicates


def perturbed(rows, indices):
    """Return tables as exact numbers, each row raised by an infinitesimal that shrinks with its index."""
    rank = {index: k for k, index in enumerate(sorted(indices))}
    return [
        [Fraction(float(w)) + TINY ** (rank[index] + 1) for w in row] for row, index in zip(rows, indices, strict=True)
    ]


def exact_owner(conditions, row_i, row_j):
    """Return 1 if i owns against j the point that these three linear equations define, -1 if j does, None if none.

    ``conditions`` are rows (l_a, l_b, l_c, value) of exact numbers.
    """
    point = _solve([list(row) for row in conditions])
    if point is None:
        return None
    form = sum(share * (wj - wi) for share, wi, wj in zip(point, row_i, row_j, strict=True))
    return 1 if form > 0 else -1


def _solve(rows):
    """Return the solution of three equations by Gauss-Jordan elimination, None if they are dependent."""
    for k in range(3):
        pivot = next((m for m in range(k, 3) if rows[m][k] != 0), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [value / rows[k][k] for value in rows[k]]
        for m in range(3):
            if m != k:
                rows[m] = [value - rows[m][k] * other for value, other in zip(rows[m], rows[k], strict=True)]
    return [row[3] for row in rows]


# ------------------------------------------------------------------------------------------------ diagram


def table(points, face, sites):
    """Return the squared distances (S, 3) from the sites to the corners of a face."""
    return ((points[face][None] - sites[:, None]) ** 2).sum(axis=2)


def clipped(polygon, form):
    """Return the part of a polygon (n, 3) where a linear form (3,) of the barycentric coordinates is not negative."""
    value = polygon @ form
    if (value >= 0).all():
        return polygon
    result = []
    for k in range(len(polygon)):
        here, there = value[k - 1], value[k]
        if (here >= 0) != (there >= 0):
            result.append(polygon[k - 1] + here / (here - there) * (polygon[k] - polygon[k - 1]))
        if there >= 0:
            result.append(polygon[k])
    return np.array(result).reshape(-1, 3)


def polygons(points, faces, sites):
    """Return {(facet, site): polygon (n, 3)}: every cell clipped against every other site, on every facet."""
    result = {}
    for facet, face in enumerate(faces):
        rows = table(points, face, sites)
        for site in range(len(sites)):
            polygon = np.eye(3)
            for other in range(len(sites)):
                if other != site and len(polygon):
                    polygon = clipped(polygon, rows[other] - rows[site])
            if len(polygon):
                result[facet, site] = polygon
    return result


def fraction(polygon):
    """Return the area of a polygon (n, 3) as a share of its facet."""
    following = np.roll(polygon, -1, axis=0)
    return float((polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]).sum())


def triangles(polygon):
    """Return the triangles (n - 2, 3, 3) of a convex polygon (n, 3) as a fan."""
    n = len(polygon)
    return np.stack([np.repeat(polygon[:1], n - 2, axis=0), polygon[1:-1], polygon[2:]], axis=1)


def energy(points, faces, sites, sharpness):
    """Return the normal-metric CVT energy from its definition, and the mass (S,) and first moment (S, d) of cells.

    The integrand is |M (y - x)|^2 with M = I + (s - 1) N N^t on the first three coordinates; over a triangle of
    area A with U the vertices of M (y - x) its integral is A (|U1|^2 + |U2|^2 + |U3|^2 + |U1 + U2 + U3|^2) / 12.
    """
    area, normal = areas(points, faces), normals(points, faces)
    total, mass, moment = 0.0, np.zeros(len(sites)), np.zeros_like(sites)
    for (facet, site), polygon in polygons(points, faces, sites).items():
        corners = points[faces[facet]]
        for triangle in triangles(polygon):
            y = triangle @ corners
            share = abs(float(np.linalg.det(triangle))) * area[facet]
            u = y - sites[site]
            u[:, :3] += (sharpness - 1) * np.outer(u[:, :3] @ normal[facet], normal[facet])
            total += share * ((u**2).sum() + (u.sum(axis=0) ** 2).sum()) / 12
            mass[site] += share
            moment[site] += share * y.mean(axis=0)
    return total, mass, moment


# --------------------------------------------------------------------------------------------- derivative


def symbolic_energy(diagram, sites, sharpness):
    """Return the energy of a diagram whose combinatorics are fixed, as an analytic function of complex sites (S, d).

    Vertices without a bisector are corners; with one they solve l . (W_k - W_i) = 0 on their side of the facet;
    with two they solve two such equations.
    """
    points, faces = diagram.points, diagram.faces
    facet, own = diagram.facet[diagram.polygon_of], diagram.site[diagram.polygon_of]
    corners = points[faces[facet]]

    def rows(site):
        return ((corners - sites[site][:, None]) ** 2).sum(axis=2)

    before, after = diagram.label[diagram.previous], diagram.label
    matrix = np.zeros((len(own), 3, 3), dtype=complex)
    matrix[:, 2] = 1.0
    for row, label in ((0, before), (1, after)):
        bisector = rows(np.maximum(label, 0)) - rows(own)
        side = np.eye(3)[np.clip(-1 - label, 0, 2)]
        matrix[:, row] = np.where((label >= 0)[:, None], bisector, side)
    vertex = np.linalg.solve(matrix, np.tile([[[0.0], [0.0], [1.0]]], (len(own), 1, 1)))[:, :, 0]
    area, normal = areas(points, faces)[facet], normals(points, faces)[facet]
    first = vertex[diagram.offset[diagram.polygon_of]]
    fan = np.stack([first, vertex, vertex[diagram.following]], axis=1)
    u = np.einsum("qkc,qcd->qkd", fan, corners) - sites[own][:, None]
    height = np.einsum("qkx,qx->qk", u[:, :, :3], normal)
    u[:, :, :3] += (sharpness - 1) * height[:, :, None] * normal[:, None]
    share = area * np.linalg.det(fan)
    return (share * ((u**2).sum(axis=(1, 2)) + (u.sum(axis=1) ** 2).sum(axis=1)) / 12).sum()


def complex_step_gradient(diagram, sites, sharpness, step=1e-30):
    """Return the gradient (S, d) of :func:`symbolic_energy`, exact to rounding."""
    gradient = np.zeros_like(sites)
    for place in np.ndindex(*sites.shape):
        moved = sites.astype(complex)
        moved[place] += 1j * step
        gradient[place] = symbolic_energy(diagram, moved, sharpness).imag / step
    return gradient


# -------------------------------------------------------------------------------------------------- cells


def component_count_and_euler(diagram, tolerance=1e-9):
    """Return {site: sorted Euler characteristics of the components of its cell}, by gluing points by position.

    Vertices of the polygons of one site are the same if they are at the same place in the embedding; edges are
    pairs of vertices. Only for diagrams in general position.
    """
    result = {}
    for site in np.unique(diagram.site):
        chosen = np.flatnonzero(diagram.site == site)
        loops = [diagram.positions[diagram.offset[p] : diagram.offset[p + 1]] for p in chosen]
        places = np.concatenate(loops)
        number = np.argmax(np.linalg.norm(places[:, None] - places[None], axis=2) < tolerance, axis=1)
        start = np.cumsum([0] + [len(loop) for loop in loops])
        numbered = [number[a:b].tolist() for a, b in pairwise(start)]
        groups = []
        for loop in numbered:
            edges = {frozenset(pair) for pair in zip(loop, loop[1:] + loop[:1], strict=True)}
            touching = [group for group in groups if group[1] & edges]
            groups = [group for group in groups if not group[1] & edges]
            groups.append(
                (
                    set(loop).union(*(group[0] for group in touching)),
                    edges.union(*(group[1] for group in touching)),
                    1 + sum(group[2] for group in touching),
                )
            )
        result[int(site)] = sorted(len(vertices) - len(edges) + faces for vertices, edges, faces in groups)
    return result

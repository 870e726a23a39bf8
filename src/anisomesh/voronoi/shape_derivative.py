"""How the vertices of a restricted Voronoi diagram move with its sites."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Sites
from anisomesh.voronoi.diagram import Diagram

_MIN_DETERMINANT = (
    1e-12  # sine of the angle between two edges at a vertex, below which its motion is left out: rounding
)

Floats = npt.NDArray[np.float64]
Rows = npt.NDArray[np.integer[Any]]


def pull_back(diagram: Diagram, vertex_gradient: Floats) -> Sites:
    """Return the derivative by the sites (S, d) of a function of the vertices of a diagram.

    Parameters
    ----------
    diagram
        The diagram.
    vertex_gradient
        Derivative of the function by the position of each vertex (Q, d), vertex by vertex of each polygon.

    Notes
    -----
    A vertex y of the polygon of site i is where two lines in the plane of its facet meet. A bisector with site j is
    g(y) = |y - x_j|^2 - |y - x_i|^2 = 0; a side of the facet does not move. Differentiating both equations gives
    A dy = -B dx with the 2 x 2 matrix A of the gradients of the g in the plane, hence the adjoint A^-t of the gradient
    times -B. This is what reverse-mode differentiation through the vertices C2 and C3 of the paper computes.

    References
    ----------
    NASM, gradient of the energy through the vertices C2 and C3; Levy, Liu, "Lp centroidal Voronoi tessellation and its
    applications", TOG 2010.
    """
    before, after = diagram.label[diagram.previous], diagram.label
    moving = np.flatnonzero((before >= 0) | (after >= 0))
    frames = _face_frames(diagram)[diagram.facet[diagram.polygon_of[moving]]]
    own = diagram.site[diagram.polygon_of[moving]].astype(np.int64)
    place = diagram.at(diagram.facet[diagram.polygon_of[moving]], diagram.barycentric[moving])
    lines = [_line_normals(diagram, moving, label[moving], own, frames) for label in (before, after)]
    (a, b), (c, d) = (line.T for line in lines)
    determinant = a * d - b * c
    size = np.linalg.norm(lines[0], axis=1) * np.linalg.norm(lines[1], axis=1)
    solid = np.abs(determinant) > _MIN_DETERMINANT * size
    p, q = np.einsum("nkd,nd->kn", frames, vertex_gradient[moving])
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=solid)
    adjoint = (inverse * (d * p - c * q), inverse * (a * q - b * p))
    result = np.zeros_like(diagram.sites)
    for label, factor in zip((before, after), adjoint, strict=True):
        bisector = np.flatnonzero(label[moving] >= 0)
        other, weight = label[moving][bisector].astype(np.int64), 2.0 * factor[bisector, None]
        np.add.at(result, own[bisector], -weight * (place[bisector] - diagram.sites[own[bisector]]))
        np.add.at(result, other, weight * (place[bisector] - diagram.sites[other]))
    return result


def _line_normals(diagram: Diagram, vertices: Rows, label: Rows, own: Rows, frames: Floats) -> Floats:
    """Return the gradients in the planes of the facets (n, 2) of the equations of the lines with these labels (n,)."""
    facet = diagram.facet[diagram.polygon_of[vertices]]
    corner = -1 - np.minimum(label, -1)
    corners = diagram.points[diagram.faces[facet]]
    rows = np.arange(len(facet))
    along = corners[rows, (corner + 2) % 3] - corners[rows, (corner + 1) % 3]
    x, y = np.einsum("nkd,nd->kn", frames, along)
    between = 2.0 * (diagram.sites[own] - diagram.sites[np.maximum(label, 0)])
    return np.where((label >= 0)[:, None], np.einsum("nkd,nd->nk", frames, between), np.stack([-y, x], axis=1))


def _face_frames(diagram: Diagram) -> Floats:
    """Return two orthonormal vectors (F, 2, d) in the plane of each embedded face; zero where it has no area."""
    corners = diagram.points[diagram.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    first = _unit(u)
    second = _unit(v - np.einsum("fd,fd->f", v, first)[:, None] * first)
    return np.stack([first, second], axis=1)


def _unit(vectors: Floats) -> Floats:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0))

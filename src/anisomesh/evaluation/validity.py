"""Whether a remesh is a valid surface of the same kind as its input."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, FaceVectors
from anisomesh.evaluation.quality import closest_points
from anisomesh.surface.geometry import unit
from anisomesh.surface.mesh import Surface
from anisomesh.surface.topology import (
    boundary_loops,
    connected_components,
    count_nonmanifold_edges,
    count_nonmanifold_points,
    euler_characteristic,
    is_oriented,
)

_ON_SIDE = 1e-6


@dataclass(frozen=True, kw_only=True)
class Validity:
    """What a remesh is, topologically, and how many of its triangles face the wrong way.

    Attributes
    ----------
    closed
        Whether every edge has two faces.
    boundary_loops, components
        Their numbers.
    euler, euler_input
        Euler characteristic of the remesh and of the input.
    nonmanifold_edges, nonmanifold_vertices
        Edges with more than two faces; vertices whose faces do not form one fan.
    oriented
        Whether faces that share an edge agree on their side.
    flipped
        Number of triangles that face away from the input, see :func:`flipped_faces`.
    """

    closed: bool
    boundary_loops: int
    components: int
    euler: int
    euler_input: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    oriented: bool
    flipped: int

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def check_validity(result: Surface, reference: Surface) -> Validity:
    """Return the topology of a remesh, beside that of its input, and count its flipped triangles.

    Parameters
    ----------
    result
        The remesh.
    reference
        The input it stands for, consistently oriented, in the same units.
    """
    return Validity(
        closed=bool((result.edge_face_count == 2).all()),
        boundary_loops=len(boundary_loops(result.faces)),
        components=connected_components(result.faces, result.n_points)[0],
        euler=euler_characteristic(result.faces),
        euler_input=euler_characteristic(reference.faces),
        nonmanifold_edges=count_nonmanifold_edges(result.faces),
        nonmanifold_vertices=count_nonmanifold_points(result.faces),
        oriented=is_oriented(result.faces),
        flipped=int(flipped_faces(result, reference).sum()),
    )


def flipped_faces(result: Surface, reference: Surface) -> FaceMask:
    """Return which triangles (F,) face away from the input where they are closest to it.

    A triangle is flipped if its normal has a negative dot product with the normal of the input at the point closest
    to its barycentre. Inside a facet that is the facet's normal, on an edge the sum of the unit normals of the faces
    there, at a point their sum weighted by the angles at the point. So on a crease or a corner, however sharp, the
    choice among the facets that are equally close does not matter. A triangle without area is not flipped.

    Notes
    -----
    Where a sheet is thinner than twice the distance between its one side and the triangles that stand for it, a
    barycentre can be closer to the other side, and counts as flipped: the remesh really passes through it there.
    A point counts as on a side of the facet when its barycentric coordinate is below 1e-6.

    References
    ----------
    Baerentzen, Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
    """
    barycentres = result.points[result.faces].mean(axis=1)
    facet, weights = closest_points(reference, barycentres)
    normals = pseudo_normals(reference, facet, weights)
    return np.asarray(np.einsum("fx,fx->f", result.face_normals, normals) < 0.0)


def pseudo_normals(surface: Surface, facet: npt.NDArray[np.int64], weights: npt.NDArray[np.float64]) -> FaceVectors:
    """Return the normals (n, 3), of any length, at points given by facet (n,) and barycentric coordinates (n, 3)."""
    at_zero = weights < _ON_SIDE
    normals = surface.face_normals[facet].copy()
    on_edge = np.flatnonzero(at_zero.sum(axis=1) == 1)
    if len(on_edge):
        edge = surface.face_edges[facet[on_edge], np.argmax(at_zero[on_edge], axis=1)]
        normals[on_edge] = _summed(surface.face_edges, np.ones((surface.n_faces, 3)), surface, len(surface.edges))[edge]
    at_point = np.flatnonzero(at_zero.sum(axis=1) == 2)
    if len(at_point):
        point = surface.faces[facet[at_point], np.argmin(at_zero[at_point], axis=1)]
        normals[at_point] = _summed(surface.faces, _corner_angles(surface), surface, surface.n_points)[point]
    return normals


def _summed(
    target: npt.NDArray[np.int32], weight: npt.NDArray[np.float64], surface: Surface, size: int
) -> npt.NDArray[np.float64]:
    """Return the face normals summed over the edges or points (F, 3) of the faces, with weights (F, 3)."""
    terms = weight[:, :, None] * surface.face_normals[:, None, :]
    columns = [np.bincount(target.ravel(), terms[:, :, axis].ravel(), minlength=size) for axis in range(3)]
    return np.stack(columns, axis=1)


def _corner_angles(surface: Surface) -> npt.NDArray[np.float64]:
    corners = surface.points[surface.faces]
    ahead = unit(corners[:, [1, 2, 0]] - corners)
    back = unit(corners[:, [2, 0, 1]] - corners)
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.asarray(np.arctan2(sine, np.einsum("fcx,fcx->fc", ahead, back)))

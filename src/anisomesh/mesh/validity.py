"""Whether a remesh is a valid surface of the same kind as its input."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from anisomesh._arrays import FaceMask
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import is_flat
from anisomesh.mesh.intersections import Pairs, self_intersections
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import (
    boundary_loops,
    connected_components,
    count_nonmanifold_edges,
    count_nonmanifold_points,
    euler_characteristic,
    is_oriented,
)


@dataclass(frozen=True, kw_only=True)
class Validity:
    """What a remesh is, topologically, and how many of its triangles are flat or face the wrong way.

    Attributes
    ----------
    closed
        Whether every edge has two faces.
    boundary_loops, components, euler
        Their numbers, and the Euler characteristic.
    boundary_loops_input, components_input, euler_input
        The same of the input.
    duplicate_faces
        Faces with the same three vertices as another.
    nonmanifold_edges, nonmanifold_vertices
        Edges with more than two faces; vertices whose faces do not form one fan.
    oriented
        Whether faces that share an edge agree on their side.
    flat
        Number of triangles without area, see :func:`~anisomesh.mesh.geometry.is_flat`.
    inverted
        Number of triangles that face away from the input, see :func:`inverted_faces`.
    self_intersections, self_intersections_input
        Pairs of triangles that intersect, see :func:`~anisomesh.mesh.intersections.self_intersections`.
    new_intersections
        Those of the remesh that are not at an intersection of the input, see :func:`new_intersections`.
    """

    closed: bool
    boundary_loops: int
    boundary_loops_input: int
    components: int
    components_input: int
    euler: int
    euler_input: int
    duplicate_faces: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    oriented: bool
    flat: int
    inverted: int
    self_intersections: int
    self_intersections_input: int
    new_intersections: int

    def as_dict(self) -> dict[str, Any]:
        """Return the values under their names, for JSON."""
        return asdict(self)


def check_validity(result: Surface, reference: Surface) -> Validity:
    """Return the topology of a remesh, beside that of its input, and count its flat and inverted triangles.

    Parameters
    ----------
    result
        The remesh.
    reference
        The input it stands for, consistently oriented, in the same units.
    """
    pairs_input = self_intersections(reference)
    return Validity(
        closed=bool((result.edge_face_count == 2).all()),
        boundary_loops=len(boundary_loops(result.faces)),
        boundary_loops_input=len(boundary_loops(reference.faces)),
        components=connected_components(result.faces, result.n_points)[0],
        components_input=connected_components(reference.faces, reference.n_points)[0],
        euler=euler_characteristic(result.faces),
        euler_input=euler_characteristic(reference.faces),
        duplicate_faces=result.n_faces - len(np.unique(np.sort(result.faces, axis=1), axis=0)),
        nonmanifold_edges=count_nonmanifold_edges(result.faces),
        nonmanifold_vertices=count_nonmanifold_points(result.faces),
        oriented=is_oriented(result.faces),
        flat=int(is_flat(result.points[result.faces]).sum()),
        inverted=int(inverted_faces(result, reference).sum()),
        self_intersections=len(self_intersections(result)),
        self_intersections_input=len(pairs_input),
        new_intersections=len(new_intersections(result, _facets_of(reference, pairs_input))),
    )


def crossing_facets(reference: Surface) -> ClosestPoints | None:
    """Return the facets of a surface that intersect others, for :func:`new_intersections`, None if there are none."""
    return _facets_of(reference, self_intersections(reference))


def _facets_of(surface: Surface, pairs: Pairs) -> ClosestPoints | None:
    facets = np.unique(pairs)
    return ClosestPoints(Surface(surface.points, surface.faces[facets])) if len(facets) else None


def new_intersections(result: Surface, crossing: ClosestPoints | None) -> Pairs:
    """Return the pairs of faces (n, 2) of a remesh that intersect where its input does not.

    A pair stands for an intersection of the input if both triangles are no farther than their longest edge from
    the facets of the input that intersect others, ``crossing``.
    """
    pairs = self_intersections(result)
    if len(pairs) == 0 or crossing is None:
        return pairs
    faces, place = np.unique(pairs, return_inverse=True)
    corners = result.points[result.faces[faces]]
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    near = np.sqrt(crossing.squared_distances(corners.mean(axis=1))) <= longest
    return np.asarray(pairs[~near[place.reshape(-1, 2)].all(axis=1)])


def inverted_faces(result: Surface, reference: Surface) -> FaceMask:
    """Return which triangles (F,) face away from the input where they are closest to it.

    A triangle is inverted if its normal has a negative dot product with the normal of the input at the point closest
    to its barycentre. Inside a facet that is the facet's normal, on an edge the sum of the unit normals of the faces
    there, at a point their sum weighted by the angles at the point. So on a crease or a corner, however sharp, the
    choice among the facets that are equally close does not matter. A triangle without area is not inverted.

    Notes
    -----
    Where a sheet is thinner than twice the distance between its one side and the triangles that stand for it, a
    barycentre can be closer to the other side, and counts as inverted: the remesh really passes through it there.
    A point counts as on a side of the facet when its barycentric coordinate is below 1e-6.

    References
    ----------
    Baerentzen, Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
    """
    return ClosestPoints(reference).inverted(result.points[result.faces])

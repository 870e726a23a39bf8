"""Validity of a remesh: its topology beside the input's, and its degenerate, inverted and intersecting triangles.

Remeshing itself relies on these measures for its warnings and for removing self-intersections.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from anisomesh._arrays import FaceLabels, FaceMask
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
    """Topology of a remesh and of its input, and counts of defects of the remesh.

    Attributes
    ----------
    closed
        Whether every edge has two faces.
    boundary_loops, components, euler
        Number of boundary loops and of connected components, and Euler characteristic V - E + F; ``..._input`` are
        numbers of the input, its sheets joined at non-manifold edges.
    duplicate_faces
        Number of faces with the same three vertices as an earlier face.
    nonmanifold_edges, nonmanifold_vertices
        Number of edges with more than two faces, and of vertices whose faces do not form a single fan.
    oriented
        Whether faces that share an edge are consistently oriented.
    flat
        Number of triangles without area, see :func:`~anisomesh.mesh.geometry.is_flat`.
    inverted
        Number of triangles that face away from the input, see :func:`inverted_faces`.
    self_intersections, self_intersections_input
        Number of intersecting pairs, see :func:`~anisomesh.mesh.intersections.self_intersections`.
    new_intersections
        Number of intersecting pairs of the remesh away from intersections of the input, see :func:`new_intersections`.
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
    nonmanifold_edges_input: int
    nonmanifold_vertices: int
    oriented: bool
    flat: int
    inverted: int
    self_intersections: int
    self_intersections_input: int
    new_intersections: int

    @property
    def faults(self) -> int:
        """Number of inverted and flat triangles and of new intersections, which a remesh is to avoid."""
        return self.inverted + self.new_intersections + self.flat

    def as_dict(self) -> dict[str, Any]:
        """Return a dictionary of all fields, for JSON."""
        return asdict(self)


def check_validity(result: Surface, reference: Surface | ClosestPoints, whole: Surface | None = None) -> Validity:
    """Compare the topology of a remesh with its input's and count its defects.

    Parameters
    ----------
    result
        The remesh.
    reference, whole
        Its prepared input, consistently oriented, in the same units, or closest points of that, and the same surface
        with its sheets joined if it is cut.
    """
    closest = reference if isinstance(reference, ClosestPoints) else ClosestPoints(reference)
    whole = closest.surface if whole is None else whole
    return Validity(
        closed=bool((result.edge_face_count == 2).all()),
        boundary_loops=len(boundary_loops(result.faces)),
        boundary_loops_input=len(boundary_loops(whole.faces)),
        components=connected_components(result.faces, result.n_points)[0],
        components_input=connected_components(whole.faces, whole.n_points)[0],
        euler=euler_characteristic(result.faces),
        euler_input=euler_characteristic(whole.faces),
        duplicate_faces=result.n_faces - len(np.unique(np.sort(result.faces, axis=1), axis=0)),
        nonmanifold_edges=count_nonmanifold_edges(result.faces),
        nonmanifold_edges_input=count_nonmanifold_edges(whole.faces),
        nonmanifold_vertices=count_nonmanifold_points(result.faces),
        oriented=is_oriented(result.faces),
        flat=int(is_flat(result.points[result.faces]).sum()),
        inverted=int(inverted_faces(result, closest).sum()),
        self_intersections=len(self_intersections(result)),
        self_intersections_input=len(closest.intersecting_pairs),
        new_intersections=len(new_intersections(result, closest)),
    )


def new_intersections(result: Surface, reference: ClosestPoints) -> Pairs:
    """Return the pairs of faces (n, 2) of a remesh that intersect where its input does not.

    A pair is attributed to the input if the barycentres of both triangles are no farther than their longest edges from
    the intersecting facets of the input. The input is searched for these only if the remesh has intersections.
    """
    pairs = self_intersections(result)
    if len(pairs) == 0 or reference.crossing_facets is None:
        return pairs
    faces, position = np.unique(pairs, return_inverse=True)
    corners = result.points[result.faces[faces]]
    longest = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=2).max(axis=1)
    near = np.sqrt(reference.crossing_facets.squared_distances(corners.mean(axis=1))) <= longest
    return np.asarray(pairs[~near[position.reshape(-1, 2)].all(axis=1)])


def inverted_faces(result: Surface, reference: ClosestPoints) -> FaceMask:
    """Return which triangles (F,) of a remesh face away from its input.

    A triangle is inverted if its normal has a negative dot product with the pseudonormal of the input at the point
    closest to its barycentre, see :meth:`ClosestPoints.normals`. The pseudonormal makes the result independent of
    which of several equally close facets is found, at creases and corners too. Triangles without area are not inverted.

    Notes
    -----
    Where a part is thinner than twice the approximation error, the closest point can be on its opposite side, and the
    triangle counts as inverted: the remesh passes through that side there.

    References
    ----------
    Baerentzen, Aanaes, "Signed distance computation using the angle weighted pseudonormal", 2005.
    """
    return reference.inverted(result.points[result.faces])


def faulty_faces(mesh: Surface, reference: ClosestPoints) -> FaceLabels:
    """Return the faces (n,) that have no area, are inverted against the reference, or intersect where it does not."""
    bad = np.flatnonzero(is_flat(mesh.points[mesh.faces]) | inverted_faces(mesh, reference))
    return np.union1d(bad, new_intersections(mesh, reference)).astype(np.int32)

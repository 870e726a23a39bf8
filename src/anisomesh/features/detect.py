"""Detection of sharp edges by their dihedral angle, of corners, where these end, meet or turn, and of apexes."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EdgeMask, PointMask, Points
from anisomesh.mesh import geometry
from anisomesh.mesh.surface import Surface

WEAK_ANGLE = 20.0  # degrees; edges this sharp stay when slivers are triangulated anew; heuristic

_MAX_FLAT_ANGLE = 1e-3  # sine of the angle between face normals at a flat edge; above the rounding of files, heuristic
_MIN_CORNER_TURN = 45.0  # degrees between the two sharp edges at a corner; heuristic
_MIN_APEX_DEFECT = 20.0  # degrees by which the angles around an apex fall short of 360; heuristic
_MIN_APEX_FACTOR = 2.0  # times what is missing around all its neighbours together; heuristic


def sharp_edges(surface: Surface, angle: float) -> EdgeMask:
    """Return which edges (E,) have two faces whose normals enclose more than an angle in degrees.

    Boundary and non-manifold edges are not sharp.
    """
    first, second = surface.edge_faces.T
    cosine = np.einsum("ex,ex->e", surface.face_normals[first], surface.face_normals[second])
    return np.asarray((second >= 0) & (cosine < np.cos(np.radians(angle))))


def share_of_flat_edges(surface: Surface) -> float:
    """Return the fraction of the interior edges with coplanar faces, to a thousandth of a radian; 1 without such edges.

    Designed parts have many flat edges, measured surfaces hardly any.
    """
    first, second = surface.edge_faces[surface.edge_faces[:, 1] >= 0].T
    sine = np.linalg.norm(np.cross(surface.face_normals[first], surface.face_normals[second]), axis=1)
    return float((sine < _MAX_FLAT_ANGLE).mean()) if len(sine) else 1.0


def corners(surface: Surface, sharp: EdgeMask) -> PointMask:
    """Return which points (V,) are corners of the sharp edges (E,).

    A corner is the end of one sharp edge, of more than two, or of two that turn by 45 degrees or more, and any point
    where a sharp edge comes to the boundary from inside.
    """
    ends = surface.edges[sharp]
    along = geometry.unit(surface.points[ends[:, 1]] - surface.points[ends[:, 0]])
    count = np.bincount(ends.ravel(), minlength=surface.n_points)
    outward = np.zeros((surface.n_points, 3))
    np.add.at(outward, ends[:, 0], along)
    np.add.at(outward, ends[:, 1], -along)
    straight = (count == 2) & (np.linalg.norm(outward, axis=1) < 2.0 * np.sin(np.radians(_MIN_CORNER_TURN) / 2.0))
    reached = np.zeros(surface.n_points, dtype=bool)
    reached[surface.edges[sharp & (surface.edge_face_count > 1)]] = True
    return np.asarray((count > 0) & ~(straight & ~(reached & surface.on_boundary)))


def apexes(surface: Surface, sharp: EdgeMask) -> PointMask:
    """Return which points (V,) off the sharp edges (E,) and the boundary are apexes, as of a cone.

    The angles around an apex fall short of 360 degrees by 20 or more, and by more than twice as much as the angles
    around all its neighbours off the sharp edges together. So tips of smooth and of rough surfaces do not count.
    """
    angles = geometry.corner_angles(surface.points[surface.faces])
    total = np.bincount(surface.faces.ravel(), angles.ravel(), minlength=surface.n_points)
    smooth = np.bincount(surface.faces.ravel(), minlength=surface.n_points) > 0
    smooth[surface.edges[sharp]] = False
    smooth &= ~surface.on_boundary
    defect = np.where(smooth, 2.0 * np.pi - total, 0.0)
    around = np.zeros(surface.n_points)
    for ends in (surface.edges, surface.edges[:, ::-1]):
        np.add.at(around, ends[:, 0], np.abs(defect[ends[:, 1]]))
    return np.asarray((defect > np.radians(_MIN_APEX_DEFECT)) & (defect > _MIN_APEX_FACTOR * around))


def points_along(surface: Surface, edges: EdgeMask, spacing: float) -> Points:
    """Return points (n, 3) on the marked edges (E,), evenly from end to end, at most a spacing (model units) apart."""
    ends = surface.points[surface.edges[edges]]
    count = np.ceil(surface.edge_lengths[edges] / spacing).astype(np.int64) + 1
    edge = np.repeat(np.arange(len(count)), count)
    position = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    parameter = (position / np.maximum(count[edge] - 1, 1))[:, None]
    return np.asarray((1.0 - parameter) * ends[edge, 0] + parameter * ends[edge, 1])

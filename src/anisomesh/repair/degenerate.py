"""Removal of degenerate faces, such that a closed surface stays closed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, Faces, Floats, Points
from anisomesh._kernels import degenerate as kernels
from anisomesh.mesh import geometry, topology
from anisomesh.mesh.surface import Surface

_DEGENERATE_RATIO = 1e-14  # 2 area over longest side^2 of degenerate faces: above the rounding error of the area
_THIN_FACTOR = 2.0  # times that ratio for faces that are looked at closely, beyond all rounding
_MAX_REMOVAL_ROUNDS = 100  # bounds the time on meshes with long chains of caps; heuristic


def why_none_is_left(surface: Surface, tolerance: float) -> str:
    """Return a message for a surface without a face that has an area, once points up to a distance are welded."""
    if is_degenerate(surface.points, surface.faces).all():
        return f"none of the {surface.n_faces:,} faces has an area; nothing is left after the repair"
    return (
        f"none of the {surface.n_faces:,} faces has an area once points up to {tolerance:g} apart are welded, on a "
        f"mesh whose diagonal is {surface.diagonal:g}; give a smaller weld_tolerance"
    )


def remove_degenerate(
    points: Points, faces: Faces, labels: npt.NDArray[np.int32]
) -> tuple[Faces, npt.NDArray[np.int32]]:
    """Remove faces with repeated points or without area.

    Parameters
    ----------
    points
        Coordinates (V, 3).
    faces
        Point indices (F, 3).
    labels
        Points with equal labels (V,) are identified; a label is the index of one of them.

    Returns
    -------
    tuple
        The remaining faces (F', 3), and the labels (V,) after the necessary merges.

    Notes
    -----
    Deleting faces of three distinct collinear points would leave gaps. Instead the shortest side of a needle (a side of
    length zero) is collapsed, and the longest side of a cap (a point on the opposite side) is flipped, longest first
    among caps of a common neighbour. Caps whose longest side is on the boundary are deleted.

    References
    ----------
    Botsch, Kobbelt, "A robust procedure to eliminate degenerate faces from triangle meshes", VMV 2001.
    """
    faces, labels = faces.copy(), labels.copy()
    points = _scaled(points)
    for _ in range(_MAX_REMOVAL_ROUNDS):
        faces = faces[~_has_repeated_point(labels[faces])]
        if len(faces) == 0:
            break
        sides = _side_lengths(points, labels[faces])
        flat = _has_no_area(points, labels[faces], sides)
        if not flat.any():
            return faces, labels
        needle = flat & (sides.min(axis=1) <= 2 * _DEGENERATE_RATIO * sides.max(axis=1))
        if needle.any():
            labels = _collapse_needles(faces[needle], sides[needle], labels)
        else:
            faces = _flip_caps(faces, labels, sides, np.flatnonzero(flat))
    else:
        faces = faces[~_has_no_area(points, labels[faces], _side_lengths(points, labels[faces]))]
    return faces, labels


def is_degenerate(points: Points, faces: Faces) -> FaceMask:
    """Return which faces (F,) have a repeated point or no area."""
    points, faces = _scaled(points), np.array(faces, dtype=np.int32)
    found = np.empty(len(faces), dtype=bool)
    kernels.thin_faces(points, faces, _THIN_FACTOR * _DEGENERATE_RATIO, found)
    thin = faces[found]
    found[found] = _has_repeated_point(thin) | _has_no_area(points, thin, _side_lengths(points, thin))
    return found


def _scaled(points: Points) -> Points:
    """Return the points at about unit size, scaled without rounding by a power of two."""
    return np.asarray(np.ldexp(points, -int(np.frexp(np.abs(points).max())[1])))


def _has_repeated_point(faces: Faces) -> FaceMask:
    a, b, c = faces.T
    return np.asarray((a == b) | (b == c) | (c == a))


def _side_lengths(points: Points, faces: Faces) -> npt.NDArray[np.float64]:
    """Return the length of the side opposite each corner (F, 3)."""
    return np.stack(
        [np.linalg.norm(points[faces[:, c - 2]] - points[faces[:, c - 1]], axis=1) for c in range(3)], axis=1
    )


def _has_no_area(points: Points, faces: Faces, sides: npt.NDArray[np.float64]) -> FaceMask:
    doubled_areas: Floats = np.linalg.norm(geometry.face_cross(points, faces), axis=1)
    return np.asarray(doubled_areas <= _DEGENERATE_RATIO * sides.max(axis=1) ** 2)


def _collapse_needles(
    faces: Faces, sides: npt.NDArray[np.float64], labels: npt.NDArray[np.int32]
) -> npt.NDArray[np.int32]:
    """Give the ends of the shortest side of each face one label."""
    ends = sides.argmin(axis=1)[:, None] - [2, 1]
    group = topology.graph_components(labels[np.take_along_axis(faces, ends, axis=1)], len(labels))[1]
    lowest = np.full(len(labels), len(labels), dtype=np.int32)
    np.minimum.at(lowest, group, labels)
    merged: npt.NDArray[np.int32] = lowest[group[labels]]
    return merged


def _flip_caps(
    faces: Faces, labels: npt.NDArray[np.int32], sides: npt.NDArray[np.float64], caps: npt.NDArray[np.int64]
) -> Faces:
    """Flip the longest side of caps that share no faces; delete caps whose longest side is on the boundary."""
    longest = sides[caps].argmax(axis=1)
    neighbour = _face_across(labels[faces], caps, longest)
    on_boundary = neighbour < 0
    order = np.lexsort((caps, sides[caps, longest]))
    rank = np.empty(len(caps), dtype=np.int64)
    rank[order] = np.arange(len(caps))
    best = np.full(len(faces), -1, dtype=np.int64)
    np.maximum.at(best, caps[~on_boundary], rank[~on_boundary])
    np.maximum.at(best, neighbour[~on_boundary], rank[~on_boundary])
    independent = np.flatnonzero(~on_boundary & (best[caps] == rank) & (best[neighbour] == rank))
    delete = np.zeros(len(faces), dtype=np.bool_)
    delete[caps[on_boundary]] = True
    result = faces.copy()
    for k in independent.tolist():
        face, other, corner = caps[k], neighbour[k], longest[k]
        tip, ends = faces[face, corner], labels[faces[face, [corner - 2, corner - 1]]]
        other_labels = labels[faces[other]]
        if labels[tip] in other_labels:
            # Both faces have the same points: opposite ones are both deleted, of equal ones the second is kept.
            delete[face] = True
            first = int(np.flatnonzero(other_labels == ends[0])[0])
            delete[other] = other_labels[(first + 1) % 3] != ends[1]
            continue
        result[face, :] = np.where(other_labels == ends[0], tip, faces[other])
        result[other, :] = np.where(other_labels == ends[1], tip, faces[other])
    return result[~delete]


def _face_across(faces: Faces, chosen: npt.NDArray[np.int64], corner: npt.NDArray[np.intp]) -> npt.NDArray[np.int64]:
    """Return a face, or -1, across the side opposite ``corner`` (n,) of each chosen face (n,)."""
    pairs = topology.side_pairs(faces)
    other = np.full(3 * len(faces), -1, dtype=np.int64)
    other[pairs[:, 0]] = pairs[:, 1] // 3
    unset = pairs[other[pairs[:, 1]] < 0]
    other[unset[:, 1]] = unset[:, 0] // 3
    found: npt.NDArray[np.int64] = other[3 * chosen + corner]
    return found

"""Faces of sheets that lie between two chains of one junction curve, which are one line when the sheets are joined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, FaceMask, Points
from anisomesh.conforming.chains import Bundle
from anisomesh.junctions.chains import Bundled
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.change import Change, apply_changes
from anisomesh.meshops.split import edge_split, face_split

_MAX_OPENING_ROUNDS = 8  # of splits, of which each takes no two at one face

Ints = npt.NDArray[np.int64]


def without_narrow_faces(found: Bundled, reference: ClosestPoints) -> Bundled:
    """Return a mesh without faces that have all corners on one curve, on two chains of it.

    Where a sheet is narrower than its triangles they reach from one of its boundaries to another. If both are joined
    at the same curve these triangles have no area, and edges across them would have twice the same end. So the edges
    across are split, at places on the sheet beside the curve.
    """
    for _ in range(_MAX_OPENING_ROUNDS):
        sheets = Surface(found.points, found.faces)
        changes: list[Change] = []
        taken = np.zeros(sheets.n_faces, dtype=bool)
        across, faces = _across(sheets, found.bundles)
        for edge in np.flatnonzero(across).tolist():
            change = edge_split(sheets, edge, place_beside(sheets, edge, reference))
            _add(changes, taken, change)
        for face in faces.tolist():
            _add(changes, taken, face_split(sheets, face, sheets.points[sheets.faces[face]].mean(axis=0)))
        if not changes:
            break
        points, new_faces = apply_changes(sheets, changes)
        found = replace(found, points=points, faces=new_faces)
    return found


def place_beside(sheets: Surface, edge: int, reference: ClosestPoints) -> Points:
    """Return a place (3,) on a reference between the middle of an edge and the corners opposite to it."""
    faces = sheets.faces[sheets.edge_faces[edge][: sheets.edge_face_count[edge]]]
    place = sheets.points[faces].mean(axis=(0, 1))
    facet, weights = reference.locate(place[None])
    return np.asarray(weights[0] @ reference.surface.points[reference.surface.faces[facet[0]]])


def _add(changes: list[Change], taken: FaceMask, change: Change) -> None:
    if not taken[change.gone].any():
        taken[change.gone] = True
        changes.append(change)


def _across(sheets: Surface, bundles: list[Bundle]) -> tuple[EdgeMask, Ints]:
    """Return the inner edges (E,) of faces between two chains of one curve, and such faces (n,) without inner edges."""
    across, alone = np.zeros(len(sheets.edges), dtype=bool), []
    boundary = np.asarray(sheets.edge_face_count[sheets.face_edges] == 1, dtype=bool)
    beside_boundary = np.flatnonzero(np.any(boundary, axis=1) | np.all(sheets.on_boundary[sheets.faces], axis=1))
    corners = sheets.faces[beside_boundary]
    for bundle in bundles:
        rows = np.zeros((len(bundle.chains), sheets.n_points), dtype=bool)
        for row, chain in zip(rows, bundle.chains, strict=True):
            row[chain.points] = True
        on_curve = np.all(np.any(rows, axis=0)[corners], axis=1)
        on_one = np.any(np.all(rows[:, corners], axis=2), axis=0)
        narrow = on_curve & (~on_one | np.all(boundary[beside_boundary], axis=1))
        for face in beside_boundary[narrow].tolist():
            inner = sheets.face_edges[face][~boundary[face]]
            across[inner] = True
            if len(inner) == 0:
                alone.append(face)
    return across, np.array(alone, dtype=np.int64)

"""A mesh with its sides split at T-junctions, and everything that it carries on the parts of its faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh.attributes.blend import Blend
from anisomesh.attributes.charts import Joints, with_seams_at_corners
from anisomesh.attributes.model import Array, Ints, Mesh, Regions
from anisomesh.attributes.places import closest_weights
from anisomesh.mesh.surface import Surface
from anisomesh.repair.degenerate import is_degenerate
from anisomesh.repair.t_junctions import split_at_t_junctions

_MAX_SPLIT_ROUNDS = 20  # of splitting one side of each face; three are enough but for chains of narrow faces


def without_t_junctions(mesh: Mesh, tolerance: float) -> Mesh:
    """Return a mesh on which every side of a face is a whole side of its neighbour, as after the repair.

    Parameters
    ----------
    mesh
        The mesh. Its points and features stay.
    tolerance
        Distance in model units up to which points are welded, and lie on sides.

    Returns
    -------
    Mesh
        Parts of a face have its data and its regions, and corner data are interpolated at the points that its sides
        are split at. Point data that differ at welded points are corner data. Faces without an area are left out.
    """
    surface = mesh.surface
    joints = Joints(surface, tolerance)
    mesh = with_seams_at_corners(mesh, joints)
    source = np.flatnonzero(~is_degenerate(surface.points, joints.place[surface.faces])).astype(np.int64)
    faces, labels = surface.faces[source], joints.place.astype(np.int32)
    for _ in range(_MAX_SPLIT_ROUNDS):
        split = split_at_t_junctions(surface.points, faces, labels, tolerance)
        if split.n_split == 0:
            break
        faces, source = split.faces, source[split.source]
    parts = Surface(surface.points, faces)
    is_whole = (np.bincount(source, minlength=surface.n_faces) == 1)[source]
    return replace(
        mesh,
        surface=parts,
        fixed_faces=np.flatnonzero(is_whole & np.isin(source, mesh.fixed_faces)),
        face_data={name: values[source] for name, values in mesh.face_data.items()},
        corner_data={name: _at_corners(name, values, mesh, parts, source) for name, values in mesh.corner_data.items()},
        regions={name: Regions(regions.labels[source], regions.names) for name, regions in mesh.regions.items()},
    )


def _at_corners(name: str, values: Array, mesh: Mesh, parts: Surface, source: Ints) -> Array:
    """Return corner data (F, 3, ...) at the corners of parts of the faces, given the face (F',) of each part."""
    surface, result = mesh.surface, values[source]
    is_part = (np.bincount(source, minlength=surface.n_faces) > 1)[source]
    face = np.repeat(source[is_part], 3)
    places = parts.points[parts.faces[is_part].ravel()]
    weights = closest_weights(surface.points[surface.faces[face]], places)
    blended = Blend(name, values).at(values[face], weights, np.argmax(weights, axis=1))
    result[is_part] = blended.reshape(-1, 3, *values.shape[2:])
    return result

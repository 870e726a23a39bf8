"""Corner data as point data, at points that are repeated where these differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import NORMAL, Array, Integers
from anisomesh.io.holding.losses import Losses
from anisomesh.mesh.surface import Surface


def continuous_corner_data(mesh: Mesh, losses: Losses) -> dict[str, Array]:
    """Return the corner data that are the same in all faces at each point as point data; the others are lost."""
    kept = {}
    points = mesh.surface.faces.ravel()
    for name, values in mesh.corner_data.items():
        rows = values.reshape(len(points), *values.shape[2:])
        at_points = _blank(name, mesh.surface.n_points, values)
        at_points[points] = rows
        same = at_points[points] == rows
        if values.dtype.kind in "fc":
            same |= np.isnan(at_points[points]) & np.isnan(rows)
        if same.all():
            kept[name] = at_points
        else:
            losses.add("corner data", name)
    return kept


def _blank(name: str, count: int, values: Array) -> Array:
    """Return rows (count, ...) for corner data (F, 3, ...) at points that no face uses: 0, of normals NaN."""
    rows = np.zeros((count, *values.shape[2:]), dtype=values.dtype)
    if name == NORMAL and values.dtype.kind == "f":
        rows[:] = np.nan
    return rows


def distinct_corners(mesh: Mesh, chosen: Integers) -> tuple[Integers, Integers]:
    """Return the first corner ``3 f + c`` (n,) of each combination of a point and corner data in some faces.

    The second array is the number of the combination at each corner of these faces (m, 3). Combinations are in the
    order of their points.
    """
    corners = (3 * chosen[:, None] + np.arange(3)).ravel()
    columns = [mesh.surface.faces.astype(np.int64).ravel()[corners]]
    for values in mesh.corner_data.values():
        rows = values.reshape(mesh.surface.faces.size, -1)[corners]
        columns.append(np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1))
    _, first, number = np.unique(np.stack(columns, axis=1), axis=0, return_index=True, return_inverse=True)
    return corners[first], number.reshape(-1, 3).astype(np.int64)


def with_points_repeated(mesh: Mesh) -> tuple[Mesh, Integers]:
    """Return a mesh whose corner data are point data, since points are repeated where these differ.

    The second array is the point of the given mesh that each point is (V',). The points that there were come first, in
    their order, and features refer to them.
    """
    joined = continuous_corner_data(mesh, Losses())
    apart = {name: values for name, values in mesh.corner_data.items() if name not in joined}
    mesh = replace(mesh, point_data={**mesh.point_data, **joined}, corner_data=apart)
    own, faces = mesh.surface, mesh.surface.faces.astype(np.int64)
    if not apart:
        return mesh, np.arange(own.n_points)
    corners, numbers = distinct_corners(mesh, np.arange(own.n_faces))
    points = faces.ravel()[corners]
    is_first = np.diff(points, prepend=-1) > 0
    place = np.where(is_first, points, own.n_points - 1 + np.cumsum(~is_first))
    source = np.concatenate([np.arange(own.n_points), points[~is_first]])
    point_data = {name: values[source] for name, values in mesh.point_data.items()}
    for name, values in apart.items():
        rows = values.reshape(faces.size, *values.shape[2:])
        point_data[name] = _blank(name, len(source), values)
        point_data[name][place] = rows[corners]
    surface = Surface(own.points[source], place[numbers])
    return replace(mesh, surface=surface, point_data=point_data, corner_data={}), source

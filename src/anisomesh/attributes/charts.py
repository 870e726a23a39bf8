"""Where values at corners are continuous: charts, their seams, and the borders between regions."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeEnds, Faces
from anisomesh.attributes.model import Array, Ints, Mesh
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edges_of, graph_components, half_edges, side_ends
from anisomesh.mesh.weld import coincident

BEYOND_BOUNDARY, BEYOND_SEAM = -1, -2  # in place of a face across a side

_SAME_VALUE = 1e-4  # of the range of values, up to which real numbers agree: above what welded points differ by
_ROUNDING = 4.0 * float(np.finfo(np.float32).eps)  # of the values: of files in float32

Mask = npt.NDArray[np.bool_]


class Joints:
    """How the faces of a surface are joined at sides whose end points coincide, up to a distance in model units."""

    def __init__(self, surface: Surface, distance: float = 0.0) -> None:
        self.surface = surface
        used = np.unique(surface.faces)
        self.place = np.arange(surface.n_points)
        self.place[used] = used[coincident(surface.points[used], distance)]

    @cached_property
    def _faces(self) -> Faces:
        return np.asarray(self.place[self.surface.faces])

    @cached_property
    def _edge_of_side(self) -> Ints:
        return edges_of(self._faces)[1].ravel().astype(np.int64)

    @cached_property
    def pairs(self) -> Ints:
        """Sides ``3 f + c`` (n, 2) of two faces at an edge without others."""
        order = np.argsort(self._edge_of_side, kind="stable")
        count = np.bincount(self._edge_of_side)
        start = (np.cumsum(count) - count)[count == 2]
        return np.stack([order[start], order[start + 1]], axis=1).astype(np.int64)

    @cached_property
    def _corners(self) -> Ints:
        """Corners ``3 f + c`` (n, 2, 2) at the two ends of each pair of sides: one end after the other."""
        start, end = side_ends(self.pairs)
        places = self._faces.ravel()
        same = places[start[:, 0]] == places[start[:, 1]]
        first = np.stack([start[:, 0], np.where(same, start[:, 1], end[:, 1])], axis=1)
        second = np.stack([end[:, 0], np.where(same, end[:, 1], start[:, 1])], axis=1)
        return np.stack([first, second], axis=1)

    def continuous(self, values: Array) -> Mask:
        """Return at which pairs of sides (n,) values at corners (F, 3, ...) agree at both ends."""
        rows = values.reshape(3 * len(values), -1)
        apart = _differ(rows[self._corners[:, :, 0]], rows[self._corners[:, :, 1]], rows)
        return np.asarray(~apart.any(axis=(1, 2)))

    def charts(self, continuous: Mask) -> Ints:
        """Return the chart of each face (F,): faces joined by continuous pairs of sides (n,) are in one."""
        links = self.pairs[continuous] // 3
        return graph_components(links, self.surface.n_faces)[1].astype(np.int64)

    def neighbours(self, continuous: Mask) -> Ints:
        """Return the face across each side (F, 3), or what is there in place of one in the same chart."""
        table = np.full(3 * self.surface.n_faces, BEYOND_BOUNDARY, dtype=np.int64)
        for own, other in ((0, 1), (1, 0)):
            table[self.pairs[:, own]] = np.where(continuous, self.pairs[:, other] // 3, BEYOND_SEAM)
        return table.reshape(-1, 3)

    def region_borders(self, parts: Ints) -> EdgeEnds:
        """Return the edges (n, 2) between faces of different parts (F,), in points of the surface."""
        part = np.repeat(parts, 3)
        low = np.full(self._edge_of_side.max() + 1, part.max(), dtype=np.int64)
        high = np.zeros_like(low)
        np.minimum.at(low, self._edge_of_side, part)
        np.maximum.at(high, self._edge_of_side, part)
        side = np.unique(self._edge_of_side, return_index=True)[1][low != high]
        return np.asarray(half_edges(self.surface.faces)[side], dtype=np.int64)

    def seams(self, continuous: Mask) -> EdgeEnds:
        """Return the edges (n, 2) at which pairs of sides (n,) are not continuous, in points of the surface."""
        return np.asarray(half_edges(self.surface.faces)[self.pairs[~continuous, 0]], dtype=np.int64)


def _differ(values: Array, others: Array, field: Array) -> Mask:
    """Return where values (n, ...) of a field differ, real numbers by more than a share of its range and rounding."""
    if field.dtype.kind not in "fc":
        return np.asarray(values != others)
    finite = field[np.isfinite(field)]
    slack = 0.0
    if finite.size:
        slack = _SAME_VALUE * float(np.abs(finite - finite[0]).max()) + _ROUNDING * float(np.abs(finite).max())
    with np.errstate(invalid="ignore"):  # of infinite values
        near = (values == others) | (np.abs(values - others) <= slack)
    return np.asarray(~(near | (np.isnan(values) & np.isnan(others))))


def with_seams_at_corners(mesh: Mesh, joints: Joints) -> Mesh:
    """Return a mesh whose point data with different values at coincident points are corner data.

    Real numbers that differ by rounding, or as little as values at points that a tolerance welds, are equal.

    Files without corner data, such as GLB, repeat points along seams.
    """
    used = np.unique(mesh.surface.faces)
    place = joints.place[used]
    if (place == used).all():
        return mesh
    point_data, corner_data = dict(mesh.point_data), dict(mesh.corner_data)
    for name, values in mesh.point_data.items():
        if _differ(values[used], values[place], values).any():
            corner_data[name] = point_data.pop(name)[mesh.surface.faces]
    if len(point_data) == len(mesh.point_data):
        return mesh
    return replace(mesh, point_data=point_data, corner_data=corner_data)

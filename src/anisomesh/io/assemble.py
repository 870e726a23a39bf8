"""From polygons and what a file carries with them to a mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Array, Carried, Integers
from anisomesh.io.polygons import PolygonSoup, as_triangles
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

_CARRIED_KINDS = "biufcSU"  # of dtypes that a mesh can carry


def as_mesh(soup: PolygonSoup) -> tuple[Mesh, tuple[str, ...], tuple[str, ...]]:
    """Return polygons as triangles, with everything that the file carries.

    Returns
    -------
    mesh
        Faces have the data of the face or cell of the file that they belong to.
    remarks
        What was left out or changed of the geometry, a line each.
    losses
        The same of everything else.

    Raises
    ------
    ValueError
        If the polygons are not a surface, see :func:`~anisomesh.io.polygons.as_triangles`.
    """
    triangles = as_triangles(soup)
    surface, carried = triangles.surface, soup.carried
    rows = {
        "point_data": _rows(carried, carried.point_data, "point data", np.arange(surface.n_points)),
        "face_data": _rows(carried, carried.cell_data, "face data", triangles.source),
        "corner_data": _rows(carried, carried.corner_data, "corner data", triangles.corners),
    }
    for name in rows["point_data"].keys() & rows["corner_data"].keys():
        del rows["point_data"][name]
        carried.remarks.append(f"left out point data {name!r}, which is given at corners too")
    regions = {}
    for name, division in carried.divisions.items():
        labels = _rows(carried, {name: division.labels}, "regions", triangles.source)
        if labels:
            present = set(np.unique(labels[name]).tolist())
            names = {label: text for label, text in division.names.items() if label in present}
            regions[name] = Regions(labels[name].astype(np.int64), names)
    mesh = Mesh(
        surface=surface,
        **rows,
        regions=regions,
        features=_features(carried, surface),
        fixed_points=_fixed_points(carried, surface),
        materials=carried.materials,
    )
    return mesh, triangles.remarks, tuple(dict.fromkeys(carried.remarks))


def _rows(carried: Carried, data: dict[str, Array], what: str, rows: Integers) -> dict[str, Array]:
    """Return the rows of arrays; arrays that have fewer, or of other types, are left out with a remark."""
    chosen = {}
    n_needed = int(rows.max()) + 1
    for name, values in data.items():
        if not isinstance(name, str) or not name:
            carried.remarks.append(f"left out {what} without a name")
        elif values.dtype.kind not in _CARRIED_KINDS or values.size == 0:
            carried.remarks.append(f"left out {what} {name!r} of type {values.dtype} and shape {values.shape}")
        elif len(values) < n_needed:
            carried.remarks.append(f"left out {what} {name!r}: it has {len(values)} rows; expected {n_needed}")
        else:
            chosen[name] = values[rows].astype(values.dtype.newbyteorder("="))
    return chosen


def _features(carried: Carried, surface: Surface) -> Integers:
    """Return the lines that are edges of the surface (n, 2), without repetition, in order."""
    straight, halves = _in_range(carried.lines, surface.n_points)
    both = np.concatenate([straight, halves])
    if len(both) == 0:
        return both
    n_lines = len(straight)
    keys = edge_keys(np.sort(both, axis=1))
    are_edges = np.isin(keys, edge_keys(surface.edges))
    missing = n_lines - np.count_nonzero(are_edges[:n_lines])
    if missing and len(halves) == 0:
        carried.remarks.append(f"left out {missing} line(s) that are not edges of its surface")
    chosen = np.flatnonzero(are_edges)
    chosen = chosen[np.sort(np.unique(keys[chosen], return_index=True)[1])]
    features: Integers = both[chosen]
    return features


def _in_range(lines: Sequence[Integers], n_points: int) -> tuple[Integers, Integers]:
    """Return lines from end to end (n, 2), and the halves (m, 2) of the ones of second order, within the points."""
    straight, halves = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 2), dtype=np.int64)]
    for block in lines:
        inside = block[((block >= 0) & (block < n_points)).all(axis=1) & (block[:, 0] != block[:, 1])]
        straight.append(inside[:, :2])
        if block.shape[1] == 3:
            halves += [inside[:, [0, 2]], inside[:, [2, 1]]]
    return np.concatenate(straight), np.concatenate(halves)


def _fixed_points(carried: Carried, surface: Surface) -> Integers:
    """Return the points (n,) that faces use, sorted; all points of a surface are fixed by mistake and not kept."""
    given = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *carried.fixed_points]))
    fixed: Integers = given[np.isin(given, surface.faces)]
    if len(fixed) < len(given):
        carried.remarks.append(f"left out {len(given) - len(fixed)} point(s) that no face uses as fixed points")
    if len(fixed) and len(fixed) == len(np.unique(surface.faces)):
        carried.remarks.append("did not fix points since it lists every point of its surface")
        return fixed[:0]
    return fixed

"""From polygons and what a file carries with them to a mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Array, Carried, Integers, Marked, listed
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
    regions = _regions(carried, triangles.source)
    features, feature_regions = _features(carried, surface)
    fixed_points, fixed_point_regions = _fixed_points(carried, surface)
    mesh = Mesh(
        surface=surface,
        **rows,
        regions=regions,
        features=features,
        fixed_points=fixed_points,
        fixed_faces=_fixed_faces(carried, triangles.source),
        feature_regions=feature_regions,
        fixed_point_regions=fixed_point_regions,
        materials=carried.materials,
    )
    if carried.lost_at_marks:
        lost = listed(list(map(repr, carried.lost_at_marks)))
        carried.remarks.append(f"left out cell data {lost} of lines and vertices")
    _say_empty_regions(carried, mesh)
    return mesh, triangles.remarks, tuple(dict.fromkeys(carried.remarks))


def _regions(carried: Carried, source: Integers) -> dict[str, Regions]:
    """Return the divisions of the faces, each of which is from a face or cell of the file (F,)."""
    regions = {}
    for name, division in carried.divisions.items():
        labels = _rows(carried, {name: division.labels}, "regions", source)
        if labels:
            present = set(np.unique(labels[name]).tolist())
            names = {label: text for label, text in division.names.items() if label in present}
            regions[name] = Regions(labels[name].astype(np.int64), names)
    return regions


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


def _say_empty_regions(carried: Carried, mesh: Mesh) -> None:
    """Say which names of regions are left out since no face, feature or fixed point is in the region."""
    given = {name: list(texts) for name, texts in carried.named.items()}
    for divisions in (carried.divisions, carried.lines.divisions, carried.fixed_points.divisions):
        for name, division in divisions.items():
            given.setdefault(name, []).extend(division.names.values())
    told = []
    for name, texts in given.items():
        kept = {
            text
            for divisions in (mesh.regions, mesh.feature_regions, mesh.fixed_point_regions)
            if name in divisions
            for text in divisions[name].names.values()
        }
        empty = [text for text in dict.fromkeys(texts) if text and text not in kept]
        if empty:
            told.append(f"{name} {listed(list(map(repr, empty)))}".lstrip())
    if told:
        carried.remarks.append(f"left out the names of regions with nothing in them: {'; '.join(told)}")


def _features(carried: Carried, surface: Surface) -> tuple[Integers, dict[str, Regions]]:
    """Return the lines that are edges of the surface (n, 2), without repetition, in order, and divisions of them."""
    (straight, halves), (row, row_of_half) = _in_range(carried.lines.blocks, surface.n_points)
    both = np.concatenate([straight, halves])
    n_lines = len(straight)
    keys = edge_keys(np.sort(both, axis=1))
    are_edges = np.isin(keys, edge_keys(surface.edges) if len(keys) else keys)
    missing = sum(map(len, carried.lines.blocks)) - n_lines  # not within the points
    if len(halves) == 0:
        missing += n_lines - int(np.count_nonzero(are_edges))
    if missing:
        carried.remarks.append(f"left out {missing} line(s) that are not edges of its surface")
    if len(both) == 0:
        return both, {}
    rows = np.concatenate([row, row_of_half])
    chosen, divisions = _each_once(carried, carried.lines, keys, rows, np.flatnonzero(are_edges))
    features: Integers = both[chosen]
    return features, divisions


def _in_range(lines: Sequence[Integers], n_points: int) -> tuple[tuple[Integers, Integers], tuple[Integers, Integers]]:
    """Return lines from end to end (n, 2), and the halves (m, 2) of the ones of second order, within the points.

    The second pair is the number (n,) and (m,) of the line that each is among all lines.
    """
    straight, halves = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 2), dtype=np.int64)]
    row, row_of_half, first = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)], 0
    for block in lines:
        chosen = np.flatnonzero(((block >= 0) & (block < n_points)).all(axis=1) & (block[:, 0] != block[:, 1]))
        straight.append(block[chosen, :2])
        row.append(first + chosen)
        if block.shape[1] == 3:
            halves += [block[chosen][:, [0, 2]], block[chosen][:, [2, 1]]]
            row_of_half += [first + chosen] * 2
        first += len(block)
    return (np.concatenate(straight), np.concatenate(halves)), (np.concatenate(row), np.concatenate(row_of_half))


def _fixed_points(carried: Carried, surface: Surface) -> tuple[Integers, dict[str, Regions]]:
    """Return the points (n,) that faces use, sorted, and divisions of them.

    All points of a surface are fixed by mistake and not kept.
    """
    marked = np.concatenate([np.zeros(0, dtype=np.int64), *carried.fixed_points.blocks])
    used = np.isin(marked, surface.faces)
    unused = len(np.unique(marked[~used]))
    if unused:
        carried.remarks.append(f"left out {unused} point(s) that no face uses as fixed points")
    rows = np.flatnonzero(used)
    if len(rows) and len(np.unique(marked[rows])) == len(np.unique(surface.faces)):
        carried.remarks.append("did not fix points since it lists every point of its surface")
        return marked[:0], {}
    rows = rows[np.argsort(marked[rows], kind="stable")]
    chosen, divisions = _each_once(carried, carried.fixed_points, marked[rows], rows, np.arange(len(rows)))
    fixed: Integers = marked[rows][chosen]
    return fixed, divisions


def _fixed_faces(carried: Carried, source: Integers) -> Integers:
    """Return the triangles (n,) of cells that are to stay, given the cell of each triangle (F,).

    All triangles of a surface are fixed by mistake and not kept.
    """
    faces = np.flatnonzero(np.isin(source, carried.fixed_cells)).astype(np.int64)
    if len(faces) == len(source):
        carried.remarks.append("did not fix faces since it lists every face of its surface")
        return faces[:0]
    return faces


def _each_once(
    carried: Carried, marked: Marked, keys: Integers, rows: Integers, chosen: Integers
) -> tuple[Integers, dict[str, Regions]]:
    """Choose among lines or points one for each key, one with a label if there is any.

    Parameters
    ----------
    carried
        Remarks are added here.
    marked
        All lines or points.
    keys, rows
        Key of each of these (n,), and its row (n,) in all blocks.
    chosen
        Which (m,) to choose from.

    Returns
    -------
    chosen
        The ones that are chosen (k,), in order.
    divisions
        Divisions of these by name.
    """
    labels: dict[str, Integers] = {}
    for name in marked.divisions:
        with carried.optional(f"regions {name!r} of lines or points"):
            labels[name] = marked.labels(name)[rows]
    bare = ~np.any([np.zeros(len(keys), dtype=bool), *(values != 0 for values in labels.values())], axis=0)
    chosen = chosen[np.argsort(bare[chosen], kind="stable")]
    once = np.sort(chosen[np.unique(keys[chosen], return_index=True)[1]])
    divisions = {}
    for name, values in labels.items():
        given = chosen[values[chosen] != 0]
        several = len(np.unique(np.stack([keys[given], values[given]]), axis=1).T) - len(np.unique(keys[given]))
        if several:
            carried.remarks.append(
                f"{several} line(s) or point(s) are in several regions {name!r} and kept in one only"
            )
        present = set(values[once].tolist())
        if present - {0}:
            names = {label: text for label, text in marked.divisions[name].names.items() if label in present - {0}}
            divisions[name] = Regions(values[once], names)
    return once, divisions

"""Writing of binary Gmsh files of version 2.2, in float64."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from anisomesh._arrays import Points
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Array, Integers, separate_columns
from anisomesh.io.formats.gmsh.data import COMMENT, UNLABELLED
from anisomesh.io.formats.gmsh.elements import GEOMETRICAL, LINE, POINT, TRIANGLE, entities_of
from anisomesh.io.formats.gmsh.groups import PHYSICAL
from anisomesh.io.formats.region_names import empty_regions, in_a_line, region_texts
from anisomesh.io.holding.corners import continuous_corner_data
from anisomesh.io.holding.divisions import fits_int32, held_division, main_division
from anisomesh.io.holding.losses import EMPTY_REGIONS, OF_FEATURES, OF_FIXED_POINTS, TOO_LARGE, Losses
from anisomesh.io.holding.values import flat_rows, is_exact_in_float64, numeric

_TOO_LARGE_TAGS = "whose integers are too large for tags, which have 32 bits"
_WIDTHS = (1, 3, 9)  # numbers of components that Gmsh knows


def msh_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a Gmsh file.

    Notes
    -----
    One division is the physical groups, and the one called ``geometrical`` the entities; others are element data.
    Features are lines and fixed points are points, with physical groups of their own. Points in no region are in a
    group that a comment names, since points without a group are no fixed points. Data are float64.
    """
    faces = mesh.surface.faces
    physical, geometrical, others = _divisions(mesh, losses)
    names = {} if physical is None else region_texts(physical, Losses(), _quotable)
    labels = np.zeros(len(faces), dtype=np.int64) if physical is None else physical.labels
    losses.add(EMPTY_REGIONS, *([] if physical is None else empty_regions(physical)))
    curves = _marked(mesh.features, mesh.feature_regions, OF_FEATURES, losses)
    vertices = _marked(mesh.fixed_points[:, None], mesh.fixed_point_regions, OF_FIXED_POINTS, losses)
    unlabelled = _unused_number(vertices.physical) if (vertices.physical == 0).any() else 0
    groups = np.where(vertices.physical == 0, unlabelled, vertices.physical)
    parts = [
        _elements(TRIANGLE, faces, labels, geometrical, 1),
        _elements(LINE, curves.nodes, curves.physical, entities_of(curves.physical), 1 + len(faces)),
        _elements(POINT, vertices.nodes, groups, entities_of(groups), 1 + len(faces) + len(curves.nodes)),
    ]
    n_others = len(curves.nodes) + len(vertices.nodes)
    at_points = continuous_corner_data(mesh, Losses())
    at_corners = {name: values for name, values in mesh.corner_data.items() if name not in at_points}
    point_data = {**mesh.point_data, **at_points}
    for name in (*point_data, *mesh.face_data, *at_corners):
        if _quotable(name) != name:
            losses.changed(name)
    losses.add("materials", *mesh.materials)
    losses.fixed_faces(mesh)
    return b"".join(
        [
            b"$MeshFormat\n2.2 1 8\n" + (1).to_bytes(4, "little") + b"\n$EndMeshFormat\n",
            _comments(mesh, physical, names, unlabelled),
            _physical_names(vertices.names, curves.names, _given_names(physical, names)),
            _nodes(mesh.surface.points),
            b"$Elements\n%d\n" % (len(faces) + n_others) + b"".join(parts) + b"\n$EndElements\n",
            *_data("NodeData", _exact(point_data, "point data", losses), 0),
            *_data("ElementData", {**_exact(mesh.face_data, "face data", losses), **others}, n_others),
            *_corner_data(_exact(at_corners, "corner data", losses)),
        ]
    )


def _exact(data: Mapping[str, Array], what: str, losses: Losses) -> dict[str, Array]:
    """Return the arrays of numbers that float64 holds exactly."""
    numbers = numeric(data, what, losses)
    exact = {name: values for name, values in numbers.items() if is_exact_in_float64(values)}
    for name in (name for name in numbers if name not in exact):
        losses.because(what, name, TOO_LARGE)
    return exact


def _nodes(points: Points) -> bytes:
    rows = np.zeros(len(points), dtype=[("tag", "<i4"), ("xyz", "<f8", 3)])
    rows["tag"], rows["xyz"] = np.arange(1, len(points) + 1), points
    return b"$Nodes\n%d\n" % len(points) + rows.tobytes() + b"\n$EndNodes\n"


class _Marked(NamedTuple):
    """Elements of lines or points: their nodes (n, k), their physical groups (n,), 0 for none, and names of these."""

    nodes: Integers
    physical: Integers
    names: dict[int, str]


def _marked(nodes: Integers, regions: Mapping[str, Regions], what: str, losses: Losses) -> _Marked:
    """Return features or fixed points with one division of them as physical groups."""
    usable = {name: division for name, division in regions.items() if fits_int32(division.labels)}
    for name in (name for name in regions if name not in usable):
        losses.because(what, name, _TOO_LARGE_TAGS)
    division = held_division(usable, what, losses, PHYSICAL, with_names=True)
    if division is None:
        return _Marked(nodes, np.zeros(len(nodes), dtype=np.int64), {})
    names = _given_names(division, region_texts(division, losses, _quotable))
    return _Marked(nodes, division.labels, {label: text for label, text in names.items() if label != 0})


def _unused_number(labels: Integers) -> int:
    """Return the smallest positive number that is no label (n,)."""
    return int(np.setdiff1d(np.arange(1, len(labels) + 2), labels)[0])


def _divisions(mesh: Mesh, losses: Losses) -> tuple[Regions | None, Integers, dict[str, Array]]:
    """Return the physical groups, the entities (F,), and other divisions as element data."""
    usable, large = {}, dict[str, Regions]()
    for name, regions in mesh.regions.items():
        if fits_int32(regions.labels):
            usable[name] = regions
        elif name in (PHYSICAL, GEOMETRICAL):
            losses.because("regions", name, _TOO_LARGE_TAGS)
        elif is_exact_in_float64(regions.labels):
            large[name] = regions
        else:
            losses.because("regions", name, TOO_LARGE)
    entities = usable.pop(GEOMETRICAL, None)
    found = main_division(usable, PHYSICAL)
    physical = None if found is None else usable.pop(found[0])
    if entities is not None:
        geometrical = entities.labels
    elif physical is not None:
        geometrical = entities_of(physical.labels)
    else:
        geometrical = np.ones(mesh.surface.n_faces, dtype=np.int64)
    others = {name: regions.labels for name, regions in (usable | large).items()}
    losses.add("regions", *(name for name in others if not name))
    return physical, geometrical, {name: labels for name, labels in others.items() if name}


def _elements(kind: int, nodes: Array, physical: Integers | int, entity: Integers | int, first: int) -> bytes:
    """Return a block of elements with two tags each, numbered from the first one on."""
    if len(nodes) == 0:
        return b""
    rows = np.zeros((len(nodes), 3 + nodes.shape[1]), dtype="<i4")
    rows[:, 0], rows[:, 1], rows[:, 2] = np.arange(first, first + len(nodes)), physical, entity
    rows[:, 3:] = nodes + 1
    return np.array([kind, len(nodes), 2], dtype="<i4").tobytes() + rows.tobytes()


def _comments(mesh: Mesh, physical: Regions | None, names: Mapping[int, str], unlabelled: int) -> bytes:
    """Return the names of divisions and regions that no section of Gmsh has, in a section that it skips."""
    kept = {name: dict(regions.names) for name, regions in mesh.regions.items() if regions is not physical}
    if physical is not None:
        changed = {label: text for label, text in physical.names.items() if text and names.get(label, text) != text}
        if changed or not physical.labels.any():
            kept[PHYSICAL] = changed
    lines = []
    if kept:
        text = json.dumps(kept).replace("$", "\\u0024")  # with which sections begin
        lines.append(f"{COMMENT} {text}\n")
    if unlabelled:
        lines.append(f"{UNLABELLED} {unlabelled}\n")
    return f"$Comments\n{''.join(lines)}$EndComments\n".encode() if lines else b""


def _given_names(regions: Regions | None, texts: Mapping[int, str]) -> dict[int, str]:
    """Return the texts of the regions that have a name."""
    return {} if regions is None else {label: text for label, text in texts.items() if regions.names.get(label)}


def _physical_names(*names: Mapping[int, str]) -> bytes:
    """Return the section of the names of physical groups of each dimension, from points on."""
    lines = [f'{dimension} {label} "{text}"' for dimension, of in enumerate(names) for label, text in of.items()]
    if not lines:
        return b""
    return "\n".join(["$PhysicalNames", str(len(lines)), *lines, "$EndPhysicalNames\n"]).encode()


def _quotable(text: str) -> str:
    return in_a_line(text).replace('"', "'")


def _data(section: str, data: dict[str, Array], n_others: int) -> list[bytes]:
    """Return the sections of arrays, with NaN for other elements."""
    found = []
    for name, values in _of_known_widths(data).items():
        width, count = _width(values), len(values) + n_others
        rows = np.zeros(count, dtype=[("tag", "<i4"), ("values", "<f8", (width,))])
        rows["tag"], rows["values"] = np.arange(1, count + 1), np.nan
        rows["values"][: len(values)] = values.reshape(-1, width)
        found.append(_section(section, name, width, rows))
    return found


def _corner_data(data: dict[str, Array]) -> list[bytes]:
    """Return the sections of arrays at the corners of the faces (F, 3, ...)."""
    at_corners = {name: values.reshape(-1, *values.shape[2:]) for name, values in data.items()}
    found = []
    for name, values in _of_known_widths(at_corners).items():
        count, width = len(values) // 3, _width(values)
        rows = np.zeros(count, dtype=[("tag", "<i4"), ("nodes", "<i4"), ("values", "<f8", (3 * width,))])
        rows["tag"], rows["nodes"] = np.arange(1, count + 1), 3
        rows["values"] = values.reshape(count, 3 * width)
        found.append(_section("ElementNodeData", name, width, rows))
    return found


def _of_known_widths(data: dict[str, Array]) -> dict[str, Array]:
    """Return arrays (n,) or (n, k) of a width that Gmsh knows; others as one for each column."""
    known = {name: rows for name, values in data.items() if _width(rows := flat_rows(values)) in _WIDTHS}
    columns = separate_columns({name: values for name, values in data.items() if name not in known})
    return {**known, **columns}


def _section(section: str, name: str, width: int, rows: Array) -> bytes:
    """Return a section of rows of ``width`` components."""
    head = f'${section}\n1\n"{_quotable(name)}"\n1\n0\n3\n0\n{width}\n{len(rows)}\n'
    return head.encode() + rows.tobytes() + f"\n$End{section}\n".encode()


def _width(values: Array) -> int:
    return 1 if values.ndim == 1 else values.shape[1]

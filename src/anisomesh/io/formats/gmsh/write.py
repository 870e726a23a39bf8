"""Writing of binary Gmsh files of version 2.2, in float64."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Array, Integers, separate_columns
from anisomesh.io.formats.gmsh.data import COMMENT
from anisomesh.io.formats.gmsh.elements import LINE, PHYSICAL, POINT, TRIANGLE, entities_of
from anisomesh.io.formats.region_names import in_a_line, region_texts
from anisomesh.io.holding import (
    Losses,
    continuous_corner_data,
    flat_rows,
    is_exact_in_float64,
    main_division,
    numeric,
)

_WIDTHS = (1, 3, 9)  # numbers of components that Gmsh knows


def msh_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a Gmsh file.

    Notes
    -----
    One division is the physical groups, and the one called ``geometrical`` the entities; others are element data.
    Features are lines, fixed points are points of the physical group 1. Data are float64.
    """
    points, faces = mesh.surface.points, mesh.surface.faces
    physical, geometrical, others = _divisions(mesh, losses)
    names = {} if physical is None else region_texts(physical, Losses(), _quotable)
    nodes = np.zeros(len(points), dtype=[("tag", "<i4"), ("xyz", "<f8", 3)])
    nodes["tag"], nodes["xyz"] = np.arange(1, len(points) + 1), points
    labels = np.zeros(len(faces), dtype=np.int64) if physical is None else physical.labels
    parts = [
        _elements(TRIANGLE, faces, labels, geometrical, 1),
        _elements(LINE, mesh.features, 0, 1, 1 + len(faces)),
        _elements(POINT, mesh.fixed_points[:, None], 1, 1, 1 + len(faces) + len(mesh.features)),
    ]
    n_others = len(mesh.features) + len(mesh.fixed_points)
    point_data = {**mesh.point_data, **continuous_corner_data(mesh, losses)}
    for name in (*point_data, *mesh.face_data):
        if _quotable(name) != name:
            losses.changed(name)
    losses.add("materials", *mesh.materials)
    return b"".join(
        [
            b"$MeshFormat\n2.2 1 8\n" + (1).to_bytes(4, "little") + b"\n$EndMeshFormat\n",
            _comments(mesh, physical, names),
            _physical_names(physical, names),
            b"$Nodes\n%d\n" % len(points) + nodes.tobytes() + b"\n$EndNodes\n",
            b"$Elements\n%d\n" % (len(faces) + n_others) + b"".join(parts) + b"\n$EndElements\n",
            *_data("NodeData", _exact(point_data, "point data", losses), 0),
            *_data("ElementData", {**_exact(mesh.face_data, "face data", losses), **others}, n_others),
        ]
    )


def _exact(data: Mapping[str, Array], what: str, losses: Losses) -> dict[str, Array]:
    """Return the arrays of numbers that float64 holds exactly."""
    numbers = numeric(data, what, losses)
    losses.add(what, *(name for name, values in numbers.items() if not is_exact_in_float64(values)))
    return {name: values for name, values in numbers.items() if is_exact_in_float64(values)}


def _divisions(mesh: Mesh, losses: Losses) -> tuple[Regions | None, Integers, dict[str, Array]]:
    """Return the physical groups, the entities (F,), and other divisions as element data."""
    usable = {}
    limits = np.iinfo(np.int32)
    for name, regions in mesh.regions.items():
        if regions.labels.min() < limits.min or regions.labels.max() > limits.max:
            losses.add("regions", name)
        else:
            usable[name] = regions
    entities = usable.pop("geometrical", None)
    found = main_division(usable, "physical")
    physical = None if found is None else usable.pop(found[0])
    if entities is not None:
        geometrical = entities.labels
    elif physical is not None:
        geometrical = entities_of(physical.labels)
    else:
        geometrical = np.ones(mesh.surface.n_faces, dtype=np.int64)
    return physical, geometrical, {name: regions.labels for name, regions in usable.items()}


def _elements(kind: int, nodes: Array, physical: Integers | int, entity: Integers | int, first: int) -> bytes:
    """Return a block of elements with two tags each, numbered from the first one on."""
    if len(nodes) == 0:
        return b""
    rows = np.zeros((len(nodes), 3 + nodes.shape[1]), dtype="<i4")
    rows[:, 0], rows[:, 1], rows[:, 2] = np.arange(first, first + len(nodes)), physical, entity
    rows[:, 3:] = nodes + 1
    return np.array([kind, len(nodes), 2], dtype="<i4").tobytes() + rows.tobytes()


def _comments(mesh: Mesh, physical: Regions | None, names: Mapping[int, str]) -> bytes:
    """Return the names of divisions and regions that no section of Gmsh has, in a section that it skips."""
    kept = {name: dict(regions.names) for name, regions in mesh.regions.items() if regions is not physical}
    if physical is not None:
        changed = {label: text for label, text in physical.names.items() if text and names.get(label, text) != text}
        if changed or not physical.labels.any():
            kept[PHYSICAL] = changed
    if not kept:
        return b""
    text = json.dumps(kept).replace("$", "\\u0024")  # with which sections begin
    return f"$Comments\n{COMMENT} {text}\n$EndComments\n".encode()


def _physical_names(physical: Regions | None, names: Mapping[int, str]) -> bytes:
    given = {} if physical is None else {label: text for label, text in names.items() if physical.names.get(label)}
    if not given:
        return b""
    lines = [f'2 {label} "{text}"' for label, text in given.items()]
    return "\n".join(["$PhysicalNames", str(len(lines)), *lines, "$EndPhysicalNames\n"]).encode()


def _quotable(text: str) -> str:
    return in_a_line(text).replace('"', "'")


def _data(section: str, data: dict[str, Array], n_others: int) -> list[bytes]:
    """Return the sections of arrays, with NaN for other elements; of a width that Gmsh does not know by column."""
    known = {name: rows for name, values in data.items() if _width(rows := flat_rows(values)) in _WIDTHS}
    columns = separate_columns({name: values for name, values in data.items() if name not in known})
    found = []
    for name, values in {**known, **columns}.items():
        width, count = _width(values), len(values) + n_others
        rows = np.zeros(count, dtype=[("tag", "<i4"), ("values", "<f8", (width,))])
        rows["tag"], rows["values"] = np.arange(1, count + 1), np.nan
        rows["values"][: len(values)] = values.reshape(-1, width)
        head = f'${section}\n1\n"{_quotable(name)}"\n1\n0\n3\n0\n{width}\n{count}\n'
        found.append(head.encode() + rows.tobytes() + f"\n$End{section}\n".encode())
    return found


def _width(values: Array) -> int:
    return 1 if values.ndim == 1 else values.shape[1]

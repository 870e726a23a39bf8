"""Writing of binary little-endian PLY files with float64 coordinates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import COLOUR, NORMAL, UV, Array, separate_columns
from anisomesh.io.formats.ply.header import EDGE_REGIONS, NAME, PLY_TYPES, REGIONS, TEXTURE_FILE
from anisomesh.io.formats.region_names import quoted
from anisomesh.io.holding.divisions import narrowed, regions_as_integers
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, TOO_LARGE, Losses
from anisomesh.io.holding.values import flat_rows, is_exact_in_float64, numeric, without_unnamed

_COLUMNS = {  # names of the columns of arrays, by name and width
    (COLOUR, 3): ("red", "green", "blue"),
    (COLOUR, 4): ("red", "green", "blue", "alpha"),
    (NORMAL, 3): ("nx", "ny", "nz"),
    (UV, 2): ("s", "t"),
}
_UV_LIST = "texcoord"
_NAMES_OF_TYPES = {kind: name for name, kind in reversed(PLY_TYPES.items())}  # the first name of each
_LONG = ("i8", "u8")
_MAX_LIST = 255  # values, since sizes are written as one byte


def ply_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a PLY file.

    Notes
    -----
    Arrays (n, k) are k properties; colours, normals and texture coordinates have their usual names. Corner data are
    lists of faces, features are the element ``edge``. Regions are integers of faces and edges, with their names in
    comments.
    """
    mesh = without_unnamed(mesh, losses, divisions=True)
    surface = mesh.surface
    vertex = {name: surface.points[:, k] for k, name in enumerate("xyz")}
    _add_columns(vertex, numeric(mesh.point_data, "point data", losses), "point data", losses)
    face: dict[str, Array] = {"vertex_indices": surface.faces.astype(np.int32)}
    _add_columns(face, regions_as_integers(mesh, list(mesh.regions)), "regions", losses)
    _add_columns(face, numeric(mesh.face_data, "face data", losses), "face data", losses)
    lists = _corner_lists(face, numeric(mesh.corner_data, "corner data", losses), losses)
    textures = mesh.materials.get("texture_files", ())
    textures = textures if isinstance(textures, tuple | list) else ()
    comments = [f"{TEXTURE_FILE} {_line(name)}" for name in textures]
    losses.add("materials", *(name for name in mesh.materials if name != "texture_files"))
    if len(mesh.fixed_points):
        losses.say(f"{len(mesh.fixed_points)} fixed point(s)")
    losses.fixed_faces(mesh)
    losses.add(OF_FIXED_POINTS, *mesh.fixed_point_regions)
    edge = {"vertex1": mesh.features[:, 0].astype(np.int32), "vertex2": mesh.features[:, 1].astype(np.int32)}
    labels = {name: narrowed(division.labels) for name, division in mesh.feature_regions.items()}
    _add_columns(edge, labels if len(mesh.features) else {}, OF_FEATURES, losses)
    elements = [
        ("vertex", vertex, {}),
        ("face", {name: values for name, values in face.items() if name != "vertex_indices"}, lists),
    ]
    if len(mesh.features):
        elements.append(("edge", edge, {}))
    names = [
        *_names_of_regions(REGIONS, mesh.regions, face),
        *_names_of_regions(EDGE_REGIONS, mesh.feature_regions, edge),
    ]
    header, body = ["ply", "format binary_little_endian 1.0"], []
    header += [f"comment {line}" for line in (*comments, *_names_of_data(mesh), *names)]
    for name, scalars, of_lists in elements:
        lines, rows = _element(scalars, of_lists)
        header += [f"element {name} {len(rows)}", *lines]
        body.append(rows.tobytes())
    return "\n".join([*header, "end_header", ""]).encode() + b"".join(body)


def _add_columns(columns: dict[str, Array], data: Mapping[str, Array], what: str, losses: Losses) -> None:
    """Add arrays as columns, unless their names are taken or their values have no exact type."""
    for name, values in data.items():
        rows = flat_rows(values)
        usual = _COLUMNS.get((name, rows.shape[1])) if rows.ndim == 2 else None
        found = dict(zip(usual, rows.T, strict=True)) if usual else separate_columns({_word(name): rows})
        exact = {key: _exact(column) for key, column in found.items()}
        if any(column is None for column in exact.values()):
            losses.because(what, name, TOO_LARGE)
        elif exact.keys() & columns.keys():
            losses.because(what, name, "whose names in PLY are taken")
        else:
            columns |= {key: column for key, column in exact.items() if column is not None}


def _exact(values: Array) -> Array | None:
    """Return values in a type of PLY, None if there is none that holds integers of 64 bits."""
    if values.dtype.str[1:] not in _LONG:
        return values
    limits = np.iinfo(np.int32)
    if limits.min <= values.min() and values.max() <= limits.max:
        return values.astype(np.int32)
    return values.astype(np.float64) if is_exact_in_float64(values) else None


def _corner_lists(face: Mapping[str, Array], data: Mapping[str, Array], losses: Losses) -> dict[str, Array]:
    """Return the lists of faces, (F, n) each: the corners, then data of corners."""
    lists = {"vertex_indices": face["vertex_indices"]}
    for name, values in data.items():
        rows = _exact(flat_rows(values))
        key = _UV_LIST if name == UV and values.shape[2:] == (2,) else _word(name)
        if rows is None:
            losses.because("corner data", name, TOO_LARGE)
        elif key in lists or key in face:
            losses.because("corner data", name, "whose name in PLY is taken")
        elif rows.shape[1] > _MAX_LIST:
            losses.because("corner data", name, f"which have {rows.shape[1]} numbers at a face")
        else:
            lists[key] = rows
    return lists


def _element(scalars: Mapping[str, Array], lists: Mapping[str, Array]) -> tuple[list[str], Array]:
    """Return the lines of the header and the rows of an element: lists first."""
    lines, fields = [], []
    for name, values in lists.items():
        lines.append(f"property list uchar {_NAMES_OF_TYPES[values.dtype.str[1:]]} {name}")
        fields += [(f"count {name}", "u1", ()), (f"value {name}", "<" + values.dtype.str[1:], (values.shape[1],))]
    for name, values in scalars.items():
        lines.append(f"property {_NAMES_OF_TYPES[values.dtype.str[1:]]} {name}")
        fields.append((f"value {name}", "<" + values.dtype.str[1:], ()))
    columns = {**lists, **scalars}
    rows = np.zeros(len(next(iter(columns.values()))), dtype=fields)
    for name, values in columns.items():
        rows[f"value {name}"] = values
        if name in lists:
            rows[f"count {name}"] = values.shape[1]
    return lines, rows


def _names_of_regions(word: str, regions: Mapping[str, Regions], columns: Mapping[str, Array]) -> list[str]:
    """Return the comments that tell which properties of an element are divisions, and the names of their labels."""
    lines = []
    for name, division in regions.items():
        if _word(name) in columns:
            lines.append(f"{word} {_word(name)}")
            names = {label: text for label, text in division.names.items() if text}
            lines += [f"{word} {_word(name)} {label} {quoted(text)}" for label, text in names.items()]
    return lines


def _names_of_data(mesh: Mesh) -> list[str]:
    """Return the comments that give data and divisions the names that are not one word."""
    of_elements: tuple[tuple[str, Mapping[str, object]], ...] = (
        ("vertex", mesh.point_data),
        ("face", {**mesh.face_data, **mesh.corner_data, **mesh.regions}),
        ("edge", mesh.feature_regions),
    )
    return [
        f"{NAME} {element} {_word(name)} {quoted(name)}"
        for element, data in of_elements
        for name in data
        if _word(name) != name
    ]


def _word(name: str) -> str:
    return "_".join(name.split()) or "_"


def _line(text: object) -> str:
    return " ".join(str(text).split())

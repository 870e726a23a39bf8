"""Writing of MEDIT's text files, version 2 (float64)."""

from __future__ import annotations

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import NORMAL, Array, Integers
from anisomesh.io.formats.medit.read import REFERENCE
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding import Losses, continuous_corner_data, main_division


def medit_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a MEDIT file.

    Notes
    -----
    One division is the references of triangles, point data ``reference`` the references of vertices. Features are
    required edges, fixed points required vertices and corners.
    """
    points, faces = mesh.surface.points, mesh.surface.faces
    vertices = np.zeros(len(points), dtype=np.int64)
    found = main_division(mesh.regions, REFERENCE)
    losses.add("regions", *(name for name in mesh.regions if found is None or name != found[0]))
    if found is not None and found[1].labels.any():
        losses.names_of_regions(mesh, found[0])
    elif found is not None:
        losses.add("regions", found[0])  # 0 is the reference of faces without one
    references = np.zeros(len(faces), dtype=np.int64) if found is None else found[1].labels
    point_data = {**mesh.point_data, **continuous_corner_data(mesh, losses)}
    given, normals = point_data.pop(REFERENCE, None), point_data.pop(NORMAL, None)
    if given is not None and given.ndim == 1 and given.dtype.kind in "iub":
        vertices = given.astype(np.int64)
    elif given is not None:
        losses.add("point data", REFERENCE)
    losses.add("point data", *point_data)
    losses.add("face data", *mesh.face_data)
    losses.add("materials", *mesh.materials)
    return "".join(
        [
            f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n",
            _lines("%r %r %r %d\n", points, vertices),
            f"Triangles\n{len(faces)}\n",
            _lines("%d %d %d %d\n", faces + 1, references),
            _edges(mesh.features),
            _points(mesh.fixed_points),
            _normals(normals, losses),
            "End\n",
        ]
    ).encode()


def _lines(pattern: str, rows: Array, references: Integers) -> str:
    """Return rows, each with a reference."""
    columns = [*rows.T.tolist(), references.tolist()]
    return "".join(map(pattern.__mod__, zip(*columns, strict=True)))


def _edges(features: Integers) -> str:
    if len(features) == 0:
        return ""
    edges = format_rows("%d %d 0\n", features + 1)
    required = format_rows("%d\n", np.arange(1, len(features) + 1))
    return f"Edges\n{len(features)}\n{edges}RequiredEdges\n{len(features)}\n{required}"


def _points(fixed_points: Integers) -> str:
    if len(fixed_points) == 0:
        return ""
    numbers = f"{len(fixed_points)}\n" + format_rows("%d\n", fixed_points + 1)
    return f"Corners\n{numbers}RequiredVertices\n{numbers}"


def _normals(normals: Array | None, losses: Losses) -> str:
    if normals is None:
        return ""
    if normals.dtype.kind != "f" or normals.shape[1:] != (3,):
        losses.add("point data", NORMAL)
        return ""
    numbers = np.arange(1, len(normals) + 1)
    places = format_rows("%d %d\n", np.stack([numbers, numbers], axis=1))
    rows = format_rows("%r %r %r\n", normals.astype(np.float64))
    return f"Normals\n{len(normals)}\n{rows}NormalAtVertices\n{len(normals)}\n{places}"

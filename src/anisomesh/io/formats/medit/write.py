"""Writing of MEDIT's text files, version 2 (float64)."""

from __future__ import annotations

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import NORMAL, Array, Integers
from anisomesh.io.formats.medit.read import REFERENCE
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding import (
    OF_FEATURES,
    OF_FIXED_POINTS,
    Losses,
    continuous_corner_data,
    held_division,
    main_division,
)


def medit_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a MEDIT file.

    Notes
    -----
    One division each is the references of triangles, of edges, which features are, and of required vertices, which
    fixed points are. Point data ``reference`` are the references of vertices in place of the last.
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
        losses.add(OF_FIXED_POINTS, *mesh.fixed_point_regions)  # whose place the point data take
    else:
        losses.add("point data", *([] if given is None else [REFERENCE]))
        of_points = held_division(mesh.fixed_point_regions, OF_FIXED_POINTS, losses, REFERENCE)
        vertices[mesh.fixed_points] = 0 if of_points is None else of_points.labels
    losses.add("point data", *point_data)
    losses.add("face data", *mesh.face_data)
    losses.add("materials", *mesh.materials)
    return "".join(
        [
            f"MeshVersionFormatted 2\nDimension 3\nVertices\n{len(points)}\n",
            _lines("%r %r %r %d\n", points, vertices),
            f"Triangles\n{len(faces)}\n",
            _lines("%d %d %d %d\n", faces + 1, references),
            _edges(mesh.features, held_division(mesh.feature_regions, OF_FEATURES, losses, REFERENCE)),
            _points(mesh.fixed_points),
            _normals(normals, losses),
            "End\n",
        ]
    ).encode()


def _lines(pattern: str, rows: Array, references: Integers) -> str:
    """Return rows, each with a reference."""
    columns = [*rows.T.tolist(), references.tolist()]
    return "".join(map(pattern.__mod__, zip(*columns, strict=True)))


def _edges(features: Integers, division: Regions | None) -> str:
    if len(features) == 0:
        return ""
    edges = _lines("%d %d %d\n", features + 1, np.zeros(len(features), int) if division is None else division.labels)
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

"""Writing of MEDIT's mesh files, text and binary, in float64."""

from __future__ import annotations

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import NORMAL, Array
from anisomesh.io.formats.medit.content import Rows, binary_content, of_integers, of_reals, text_content
from anisomesh.io.formats.medit.read import REFERENCE
from anisomesh.io.holding.corners import continuous_corner_data
from anisomesh.io.holding.divisions import held_division, main_division
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, Losses
from anisomesh.io.holding.normals import has_direction


def medit_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a text file."""
    return text_content(_sections(mesh, losses))


def meditb_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a binary file."""
    return binary_content(_sections(mesh, losses))


def _sections(mesh: Mesh, losses: Losses) -> list[Rows]:
    """Return the sections of a mesh.

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
    if given is not None and given.dtype.kind == "u" and given.max() > np.iinfo(np.int64).max:
        losses.because("point data", REFERENCE, "whose integers are too large for int64")
        given = None
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
    return [
        of_reals("Vertices", points, vertices),
        of_integers("Triangles", faces + 1, references),
        *([of_integers("RequiredTriangles", mesh.fixed_faces + 1)] if len(mesh.fixed_faces) else []),
        *_edges(mesh, losses),
        *_fixed_points(mesh),
        *_normals(normals, losses),
    ]


def _edges(mesh: Mesh, losses: Losses) -> list[Rows]:
    """Return the features as required edges, with their references."""
    division = held_division(mesh.feature_regions, OF_FEATURES, losses, REFERENCE)
    count = len(mesh.features)
    if count == 0:
        return []
    references = np.zeros(count, dtype=np.int64) if division is None else division.labels
    numbers = np.arange(1, count + 1)
    return [of_integers("Edges", mesh.features + 1, references), of_integers("RequiredEdges", numbers)]


def _fixed_points(mesh: Mesh) -> list[Rows]:
    """Return the fixed points as corners and required vertices."""
    names = ("Corners", "RequiredVertices") if len(mesh.fixed_points) else ()
    return [of_integers(name, mesh.fixed_points + 1) for name in names]


def _normals(normals: Array | None, losses: Losses) -> list[Rows]:
    """Return the normals of the vertices that have one."""
    if normals is None:
        return []
    if normals.dtype.kind != "f" or normals.shape[1:] != (3,):
        losses.add("point data", NORMAL)
        return []
    given = has_direction(normals)
    numbers = np.arange(1, np.count_nonzero(given) + 1)
    return [of_reals("Normals", normals[given]), of_integers("NormalAtVertices", np.flatnonzero(given) + 1, numbers)]

"""Mesh objects of other libraries as polygon soups, told apart by their attributes, so that no library is imported."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from anisomesh.io.cells import Shape, SurfaceCells
from anisomesh.io.polygons import PolygonSoup
from anisomesh.io.vtk_cells import add_vtk_cells

_MESHIO_SURFACE = re.compile(r"(?:VTK_LAGRANGE_)?(TRIANGLE|QUAD|POLYGON)(?:RILATERAL)?\d*", re.IGNORECASE)
_MESHIO_OTHER = re.compile(
    r"vertex|line\d*|tetra\d*|hexahedron\d*|wedge\d*|pyramid\d*|penta_prism|hexa_prism|polyhedron\d*"
    r"|VTK_LAGRANGE_(?:CURVE|TETRAHEDRON|HEXAHEDRON|WEDGE|PYRAMID)"
)


def polygon_soup(mesh: Any) -> PolygonSoup | None:
    """Return a mesh object as polygons; None if it is of another type.

    Parameters
    ----------
    mesh
        A ``trimesh.Scene``, with its transformations applied; a ``meshio.Mesh``; a ``pyvista.MultiBlock``, or any data
        set of PyVista that can become an unstructured grid.

    Raises
    ------
    ValueError
        If there are only cells that are not part of a surface, or some of unknown type.
    """
    readers: list[tuple[tuple[str, ...], Callable[[Any], PolygonSoup]]] = [
        (("n_blocks",), _from_blocks),
        (("cast_to_unstructured_grid",), _from_blocks),
        (("geometry", "graph", "dump"), _from_scene),
        (("points", "cells", "cell_data"), _from_meshio),
    ]
    for attributes, read in readers:
        if all(hasattr(mesh, name) for name in attributes):
            return read(mesh)
    return None


def _from_blocks(mesh: Any) -> PolygonSoup:
    """Return a data set of PyVista, or all data sets in blocks of blocks."""
    cells, points, remarks = SurfaceCells(), _PointList(), []
    blocks = [mesh]
    while blocks:
        block = blocks.pop(0)
        if block is None:
            continue
        if hasattr(block, "n_blocks"):
            blocks = [*block, *blocks]
        elif hasattr(block, "cast_to_unstructured_grid"):
            grid = block.cast_to_unstructured_grid()
            first = points.add(grid.points)
            offsets = grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset  # older versions
            add_vtk_cells(cells, grid.celltypes, np.asarray(grid.cell_connectivity) + first, offsets[1:])
        else:
            remarks.append(f"left out a block of type {type(block).__name__}, which has no cells")
    return cells.soup(points.all(), tuple(remarks))


def _from_scene(scene: Any) -> PolygonSoup:
    """Return the meshes of a scene of trimesh, moved to their places."""
    cells, points, remarks = SurfaceCells(), _PointList(), []
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        geometry = scene.geometry[name]
        if not hasattr(geometry, "faces"):
            remarks.append(f"left out {name!r} of type {type(geometry).__name__}, which is not a surface")
            continue
        faces = np.asarray(geometry.faces)
        if np.linalg.det(matrix[:3, :3]) < 0.0:
            faces = faces[:, ::-1]  # a reflection turns triangles inside out
        first = points.add(np.asarray(geometry.vertices) @ matrix[:3, :3].T + matrix[:3, 3])
        cells.add("triangle", faces + first)
    return cells.soup(points.all(), tuple(remarks))


def _from_meshio(mesh: Any) -> PolygonSoup:
    cells = SurfaceCells()
    for block in mesh.cells:
        surface = _MESHIO_SURFACE.fullmatch(block.type)
        if surface is not None and surface[1].lower() == "polygon":
            sizes = np.array([len(row) for row in block.data], dtype=np.int64)
            corners = [np.asarray(row, dtype=np.int64) for row in block.data]
            cells.add_polygons(np.concatenate([np.zeros(0, dtype=np.int64), *corners]), sizes)
        elif surface is not None:
            cells.add(cast(Shape, surface[1].lower()), np.asarray(block.data))
        elif _MESHIO_OTHER.fullmatch(block.type):
            cells.ignore(block.type, len(block.data))
            cells.take_numbers(len(block.data))
        else:
            raise ValueError(f"it has cells of type {block.type!r}, which is not known; convert them to triangles")
    points = _PointList()
    points.add(mesh.points)
    return cells.soup(points.all())


class _PointList:
    """Points of several meshes, one after the other."""

    def __init__(self) -> None:
        self._parts: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]

    def add(self, points: Any) -> int:
        """Add points (n, 3) or (n, 2); return the number of points before them."""
        first = sum(map(len, self._parts))
        array = np.asarray(points, dtype=np.float64)
        self._parts.append(np.pad(array, ((0, 0), (0, 3 - array.shape[1]))))
        return first

    def all(self) -> npt.NDArray[np.float64]:
        """Return all points."""
        return np.concatenate(self._parts)

"""Export of restricted Voronoi cells as coloured polygons."""

from __future__ import annotations

import colorsys
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.errors import MeshFileError
from anisomesh.io.atomic import atomic_path
from anisomesh.io.formats.vtk.write import vtu_bytes

N_COLOURS = 12  # colours of the palette; heuristic
_HASH_MULTIPLIER = 2654435761  # near 2^32 / golden ratio: multiplicative hashing, Knuth, TAOCP vol. 3, section 6.4


@dataclass(frozen=True, kw_only=True, eq=False)
class PolygonMesh:
    """Convex polygons in 3-D, each a part of a Voronoi cell.

    Attributes
    ----------
    points
        Points (Q, 3) in model units; polygon p has the points ``offset[p]`` to ``offset[p + 1] - 1`` in order.
    offset
        First point of each polygon (P + 1,).
    cell
        Cell component of each polygon (P,), which is also its vertex of the dual mesh.
    """

    points: Points
    offset: npt.NDArray[np.int64]
    cell: npt.NDArray[np.int32]

    @property
    def colour(self) -> npt.NDArray[np.int32]:
        """Index of the colour of each polygon (P,), a hash of its cell: neighbouring cells rarely share a colour."""
        return (self.cell.astype(np.int64) * _HASH_MULTIPLIER % 2**32 % N_COLOURS).astype(np.int32)


def save_polygons(mesh: PolygonMesh, path: str | os.PathLike[str]) -> None:
    """Write polygons as VTU (cell data ``cell`` and ``colour``) or OBJ (a group per cell, a material per colour).

    Raises
    ------
    MeshFileError
        If the extension is neither .vtu nor .obj, or the file cannot be written.
    """
    path = Path(path)
    writers = {".vtu": _write_vtu, ".obj": _write_obj}
    if path.suffix.lower() not in writers:
        raise MeshFileError(f"{path}: unknown format {path.suffix or '(no extension)'}; expected .vtu or .obj")
    with atomic_path(path) as temporary:
        writers[path.suffix.lower()](mesh, Path(temporary))


def _write_vtu(mesh: PolygonMesh, path: Path) -> None:
    corners, sizes = np.arange(mesh.offset[-1]), np.diff(mesh.offset)
    path.write_bytes(vtu_bytes(mesh.points, corners, sizes, {}, {"cell": mesh.cell, "colour": mesh.colour}))


def _write_obj(mesh: PolygonMesh, path: Path) -> None:
    lines = ["# restricted Voronoi cells; materials colour0 .. are defined here by comment: r g b"]
    for number in range(N_COLOURS):
        red, green, blue = colorsys.hsv_to_rgb(number / N_COLOURS, 0.45, 0.95)
        lines.append(f"# colour{number} {red:.3f} {green:.3f} {blue:.3f}")
    lines.extend("v {!r} {!r} {!r}".format(*row) for row in mesh.points.tolist())
    colour = mesh.colour
    order = np.lexsort((mesh.cell, colour))
    last_colour, last_cell = -1, -1
    for p in order.tolist():
        if colour[p] != last_colour:
            last_colour = int(colour[p])
            lines.append(f"usemtl colour{last_colour}")
        if mesh.cell[p] != last_cell:
            last_cell = int(mesh.cell[p])
            lines.append(f"g cell{last_cell}")
        lines.append("f " + " ".join(str(q + 1) for q in range(mesh.offset[p], mesh.offset[p + 1])))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")

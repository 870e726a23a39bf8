"""Drawing one panel as an array of pixels: a surface with its edges, in grey or in colours, or Voronoi cells."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View
from anisomesh.viz.cells import POINT_MERGE_TOLERANCE, CellPolygons
from anisomesh.viz.colouring import Colouring
from anisomesh.viz.edges import edge_style

GREY, INK = "#dfe2e7", "#14171c"
_MAX_SMOOTH_ANGLE = 30.0  # degrees; edges that bend more are shaded as sharp
_SHADING: dict[str, Any] = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": _MAX_SMOOTH_ANGLE}
_GREY_MATERIAL: dict[str, Any] = {"ambient": 0.3, "diffuse": 0.7, "specular": 0.0}
_COLOUR_MATERIAL: dict[str, Any] = {"ambient": 0.5, "diffuse": 0.5, "specular": 0.0}
_LIGHTS = (((0.0, 0.0, 1.0), 0.68), ((-1.0, 1.4, 1.0), 0.5), ((1.5, -0.3, 0.6), 0.25))  # position, intensity
_CELL_OUTLINE_LIFT = 4e-3  # half heights of the picture, towards the viewer; heuristic
_CELL_OUTLINE_WIDTH = 1.2  # pixels of a picture of normal size
_N_CELL_COLOURS = 64  # enough that few neighbours have the same colour; heuristic

Pixels = npt.NDArray[np.uint8]


def render(
    shown: Surface | CellPolygons,
    view: View,
    size: tuple[int, int],
    *,
    colouring: Colouring | None = None,
    scale: float = 1.0,
) -> Pixels:
    """Return a picture (height, width, 3) of a surface or of cells on white.

    Parameters
    ----------
    shown
        The surface or the cells to draw.
    view
        The projection.
    size
        Width and height in pixels.
    colouring
        Colours of the faces of a surface; light grey if None.
    scale
        Pixels per pixel of a picture of normal size; lines are wider by this factor.
    """
    plotter = _plotter(size)
    try:
        if isinstance(shown, CellPolygons):
            _draw_cells(plotter, shown, view, scale)
        else:
            _draw_surface(plotter, shown, colouring, edges=_edges(shown, view, size, scale))
        _look(plotter, view, reach=float(np.linalg.norm(shown.points - view.centre, axis=1).max()))
        return np.asarray(plotter.screenshot(return_img=True), dtype=np.uint8)
    finally:
        plotter.close()


def _plotter(size: tuple[int, int]) -> Any:
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    plotter: Any = pyvista.Plotter(off_screen=True, border=False, lighting="none", window_size=list(size))
    plotter.set_background("white")
    for position, intensity in _LIGHTS:
        plotter.add_light(pyvista.Light(light_type="camera light", position=position, intensity=intensity))
    plotter.enable_anti_aliasing("ssaa")
    return plotter


def _look(plotter: Any, view: View, reach: float) -> None:
    """Place the camera outside the model, which reaches this far from the centre of the view."""
    camera = plotter.camera
    camera.focal_point = view.centre
    camera.position = view.centre + 1.1 * (reach or 1.0) * view.axes[2]
    camera.up = view.axes[1]
    camera.parallel_projection = True
    camera.parallel_scale = view.half_height
    plotter.renderer.ResetCameraClippingRange()


def _draw_surface(plotter: Any, surface: Surface, colouring: Colouring | None, edges: dict[str, Any]) -> None:
    """Draw a surface with smooth shading except at creases."""
    import pyvista

    mesh = pyvista.PolyData.from_regular_faces(surface.points, surface.faces)
    look: dict[str, Any] = {"color": GREY, **_GREY_MATERIAL}
    if colouring is not None:
        mesh.cell_data["rgb"] = colouring.rgb()
        look = {"scalars": "rgb", "rgb": True, **_COLOUR_MATERIAL}
    plotter.add_mesh(mesh, **look, **edges, **_SHADING)


def _edges(surface: Surface, view: View, size: tuple[int, int], scale: float) -> dict[str, Any]:
    style = edge_style(surface, view, size, scale)
    if style is None:
        return {"show_edges": False}
    return {"show_edges": True, "edge_color": INK, "line_width": style.width, "edge_opacity": style.opacity}


def _draw_cells(plotter: Any, cells: CellPolygons, view: View, scale: float) -> None:
    """Draw polygons in pale colours, one per cell, and lines between the cells.

    The lines are moved slightly towards the viewer, which a parallel projection does not show, so that the polygons do
    not hide them.
    """
    import pyvista

    mesh = pyvista.PolyData()
    mesh.points = cells.points
    mesh.SetPolys(pyvista.CellArray.from_arrays(cells.offsets, cells.corners))
    palette = np.random.default_rng(0).permutation(_N_CELL_COLOURS) / _N_CELL_COLOURS
    mesh.cell_data["cell"] = palette[np.asarray(cells.labels) % _N_CELL_COLOURS]
    mesh = mesh.clean(tolerance=POINT_MERGE_TOLERANCE)
    plotter.add_mesh(mesh, scalars="cell", cmap="Pastel1", show_scalar_bar=False, **_SHADING, **_COLOUR_MATERIAL)
    sides = cells.outlines()
    if len(sides):
        lines = pyvista.PolyData()
        lines.points = cells.points + _CELL_OUTLINE_LIFT * view.half_height * view.axes[2]
        lines.SetLines(pyvista.CellArray.from_regular_cells(sides.astype(int)))
        plotter.add_mesh(lines, color=INK, line_width=_CELL_OUTLINE_WIDTH * scale, opacity=0.7, lighting=False)

"""Drawing into one panel: a surface with its edges, values in colour, cells, the frame of the close-up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Indices, Points
from anisomesh.picture.view import View
from anisomesh.surface.mesh import Surface

GREY, INK, ACCENT = "#dfe2e7", "#14171c", "#c8321e"
BAR: dict[str, Any] = {
    "vertical": True,
    "position_x": 0.88,
    "position_y": 0.03,
    "width": 0.08,
    "height": 0.35,
    "n_labels": 4,
    "fmt": "%.1f",
    "color": INK,
    "title_font_size": 18,
    "label_font_size": 16,
}


@dataclass(frozen=True, kw_only=True)
class Cells:
    """Polygons to draw with one colour per cell.

    Parameters
    ----------
    points
        Corners (P, 3) in model units.
    offsets
        Where each polygon starts in ``corners``, and the end of the last (polygons + 1,).
    corners
        The point at each corner of each polygon, one polygon after the other.
    labels
        The cell of each polygon (polygons,).
    """

    points: Points
    offsets: Indices
    corners: Indices
    labels: Indices


def look(plotter: Any, view: View, reach: float) -> None:
    """Point the camera of the current panel, from a distance beyond everything in it."""
    camera = plotter.camera
    camera.focal_point = view.centre
    camera.position = view.centre + reach * view.axes[2]
    camera.up = view.axes[1]
    camera.parallel_projection = True
    camera.parallel_scale = view.half_height
    plotter.renderer.ResetCameraClippingRange()


def draw_surface(plotter: Any, surface: Surface, pixels: float) -> None:
    """Draw a surface in light grey, smooth but for its creases, with its edges.

    Parameters
    ----------
    plotter
        Draws into its current panel.
    surface
        What to draw.
    pixels
        Pixels per model unit; the smaller the triangles, the thinner and paler their edges.
    """
    style = {"color": GREY, "smooth_shading": True, "split_sharp_edges": True, "feature_angle": 30.0}
    plotter.add_mesh(_mesh(surface), **style, **_edges(surface, pixels), ambient=0.25, diffuse=0.75, specular=0.0)


def draw_values(
    plotter: Any, surface: Surface, values: npt.NDArray[Any], *, name: str, bar: bool, pixels: float
) -> None:
    """Draw a surface coloured by a value per face, up to the 99 % quantile, with or without a colour bar."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(np.quantile(finite, 0.99))) if len(finite) else (0.0, 1.0)
    mesh = _mesh(surface)
    mesh.cell_data[name] = np.clip(values, low, high)
    plotter.add_mesh(
        mesh,
        scalars=name,
        cmap="YlOrRd",
        clim=(low, max(high, low + 1e-3 * (abs(low) or 1.0))),
        show_scalar_bar=bar,
        scalar_bar_args=BAR | {"title": name},
        **_edges(surface, pixels),
        ambient=0.4,
        diffuse=0.6,
    )


def draw_cells(plotter: Any, cells: Cells) -> None:
    """Draw polygons in pale colours, one per cell."""
    import pyvista

    mesh = pyvista.PolyData()
    mesh.points = cells.points
    mesh.SetPolys(pyvista.CellArray.from_arrays(cells.offsets, cells.corners))
    palette = np.random.default_rng(0).permutation(64) / 64
    mesh.cell_data["cell"] = palette[np.asarray(cells.labels) % 64]
    plotter.add_mesh(mesh, scalars="cell", cmap="Pastel1", show_scalar_bar=False, ambient=0.3, diffuse=0.7)


def draw_frame(plotter: Any, view: View, aspect: float, reach: float) -> None:
    """Mark what the close-up shows; the projection is parallel, so the frame can float before the surface."""
    import pyvista

    right, up, towards = view.axes
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    offsets = signs * view.half_height * np.array([aspect, 1.0])
    corners = view.centre + offsets @ np.stack([right, up]) + reach * towards
    plotter.add_mesh(pyvista.MultipleLines(corners), color=ACCENT, line_width=3.0, lighting=False)
    plotter.renderer.ResetCameraClippingRange()


def _mesh(surface: Surface) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(surface.points, surface.faces)


def _edges(surface: Surface, pixels: float) -> dict[str, Any]:
    side = pixels * np.sqrt(surface.area / surface.n_faces)
    return {
        "show_edges": True,
        "edge_color": INK,
        "line_width": float(np.clip(side / 12.0, 0.6, 1.3)),
        "edge_opacity": float(np.clip(side / 14.0, 0.25, 0.9)),
    }

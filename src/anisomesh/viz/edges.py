"""Width and opacity of triangle edges: visible, but not a black picture of a dense mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import FaceMask
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View

_MAX_EDGE_COVERAGE = 0.22  # share of the picture that edges may darken; heuristic
_MIN_INRADIUS = 0.9  # pixels; edges of smaller triangles merge; heuristic
_EDGE_WIDTHS = (0.7, 1.5)  # pixels, smallest and largest; heuristic
_INRADIUS_PER_WIDTH = 4.0  # inradius over edge width within these limits; heuristic
_MAX_EDGE_OPACITY = 0.9  # heuristic


@dataclass(frozen=True, kw_only=True)
class EdgeStyle:
    """Width of edges in pixels and opacity from 0 to 1."""

    width: float
    opacity: float


def edge_style(surface: Surface, view: View, size: tuple[int, int], scale: float = 1.0) -> EdgeStyle | None:
    """Return how to draw the edges of the triangles in view, None if the triangles are too small for edges.

    Parameters
    ----------
    surface
        The surface in the picture.
    view
        The projection.
    size
        Width and height of the picture in pixels.
    scale
        Pixels per pixel of a picture of normal size; lines are wider by this factor.

    Notes
    -----
    Lines of width w along the sides of a triangle of inradius r cover w / r of its area, half of it shared with the
    neighbours. The opacity is therefore proportional to r / w, with r = 2 area / perimeter summed over the triangles in
    view.
    """
    faces = in_view(surface, view, size[0] / size[1])
    if not faces.any():
        faces = np.ones(surface.n_faces, dtype=bool)
    perimeter = surface.edge_lengths[surface.face_edges[faces]].sum()
    pixels = 0.5 * size[1] / view.half_height
    radius = float(pixels * 2.0 * surface.face_areas[faces].sum() / perimeter) if perimeter > 0.0 else 0.0
    if radius < _MIN_INRADIUS:
        return None
    width = float(np.clip(radius / _INRADIUS_PER_WIDTH, _EDGE_WIDTHS[0], _EDGE_WIDTHS[1] * scale))
    return EdgeStyle(width=width, opacity=min(_MAX_EDGE_OPACITY, _MAX_EDGE_COVERAGE * radius / width))


def in_view(surface: Surface, view: View, aspect: float) -> FaceMask:
    """Return which faces (F,) face the viewer and have their barycentre inside the picture."""
    across = np.abs(view.project(surface.points[surface.faces].mean(axis=1))[:, :2])
    inside = (across <= view.half_height * np.array([aspect, 1.0])).all(axis=1)
    return np.asarray(inside & (surface.face_normals @ view.axes[2] > 0.0))

"""How strongly to draw the edges of triangles, so that they are seen but do not blacken a dense mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import FaceMask
from anisomesh.mesh.surface import Surface
from anisomesh.viz.camera import View

_INK = 0.22  # of the picture may be darkened by edges
_LEAST_RADIUS = 0.9  # pixels; edges of smaller triangles run into one another
_WIDTHS = (0.7, 1.5)
_OPAQUE = 0.9


@dataclass(frozen=True, kw_only=True)
class EdgeStyle:
    """How to draw edges: width in pixels, opacity from 0 to 1."""

    width: float
    opacity: float


def edge_style(surface: Surface, view: View, size: tuple[int, int], scale: float = 1.0) -> EdgeStyle | None:
    """Return how to draw the edges of the triangles in view, None where they are too small for it.

    Parameters
    ----------
    surface
        What is drawn.
    view
        From where.
    size
        Width and height of the picture in pixels.
    scale
        Pixels per pixel of a picture of normal size; lines get so much wider.

    Notes
    -----
    A line of width w along the sides of a triangle with radius r of the inscribed circle darkens w / r of its area,
    half of that for its neighbour. So opacity falls with r, taken as twice the area over the perimeter of all that is
    in view.
    """
    faces = in_view(surface, view, size[0] / size[1])
    if not faces.any():
        faces = np.ones(surface.n_faces, dtype=bool)
    perimeter = surface.edge_lengths[surface.face_edges[faces]].sum()
    pixels = 0.5 * size[1] / view.half_height
    radius = float(pixels * 2.0 * surface.face_areas[faces].sum() / perimeter) if perimeter > 0.0 else 0.0
    if radius < _LEAST_RADIUS:
        return None
    width = float(np.clip(radius / 4.0, _WIDTHS[0], _WIDTHS[1] * scale))
    return EdgeStyle(width=width, opacity=min(_OPAQUE, _INK * radius / width))


def in_view(surface: Surface, view: View, aspect: float) -> FaceMask:
    """Return which faces (F,) face the viewer with their barycentre inside the picture."""
    across = np.abs(view.project(surface.points[surface.faces].mean(axis=1))[:, :2])
    inside = (across <= view.half_height * np.array([aspect, 1.0])).all(axis=1)
    return np.asarray(inside & (surface.face_normals @ view.axes[2] > 0.0))

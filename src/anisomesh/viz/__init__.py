"""Pictures without a display, as PNG or PDF: input and result with a close-up, galleries, strips."""

from anisomesh.viz.cells import Cells, voronoi_cells
from anisomesh.viz.colouring import Colouring, distance_colouring, quality_colouring, stretch_colouring
from anisomesh.viz.gallery import Panel, gallery
from anisomesh.viz.page import FORMATS
from anisomesh.viz.renderer import require_renderer
from anisomesh.viz.scene import side_by_side
from anisomesh.viz.view import triangle_stretch

__all__ = [
    "FORMATS",
    "Cells",
    "Colouring",
    "Panel",
    "distance_colouring",
    "gallery",
    "quality_colouring",
    "require_renderer",
    "side_by_side",
    "stretch_colouring",
    "triangle_stretch",
    "voronoi_cells",
]

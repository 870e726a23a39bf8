"""Pictures without a display, as PNG or PDF: input and result with a close-up, galleries, strips."""

from anisomesh.picture.cells import Cells, voronoi_cells
from anisomesh.picture.colouring import Colouring, distance_colouring, quality_colouring, stretch_colouring
from anisomesh.picture.gallery import Panel, gallery
from anisomesh.picture.page import FORMATS
from anisomesh.picture.renderer import require_renderer
from anisomesh.picture.scene import side_by_side
from anisomesh.picture.view import triangle_stretch

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

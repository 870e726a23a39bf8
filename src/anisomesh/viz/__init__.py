"""Pictures as PNG or PDF, drawn without a display: input beside result with a close-up, galleries."""

from anisomesh.viz.camera import PictureOptions
from anisomesh.viz.cells import CellPolygons, voronoi_cells
from anisomesh.viz.colouring import Colouring, distance_colouring, quality_colouring, stretch_colouring
from anisomesh.viz.gallery import Panel, gallery
from anisomesh.viz.page import PICTURE_FORMATS
from anisomesh.viz.renderer import require_renderer
from anisomesh.viz.scene import side_by_side

__all__ = [
    "PICTURE_FORMATS",
    "CellPolygons",
    "Colouring",
    "Panel",
    "PictureOptions",
    "distance_colouring",
    "gallery",
    "quality_colouring",
    "require_renderer",
    "side_by_side",
    "stretch_colouring",
    "voronoi_cells",
]

"""Pictures without a display: two surfaces side by side, with a close-up, in one PNG file."""

from anisomesh.picture.draw import Cells
from anisomesh.picture.renderer import require_renderer
from anisomesh.picture.scene import side_by_side
from anisomesh.picture.view import triangle_stretch

__all__ = ["Cells", "require_renderer", "side_by_side", "triangle_stretch"]

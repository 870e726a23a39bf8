"""Networks that predict the metric of a mesh and remove its noise, their training, and a differentiable tessellation.

:mod:`.inference` applies networks, pretrained ones among them; :mod:`.models` has the networks, :mod:`.data` the data
sets and :mod:`.training` the training; ``weights`` has the pretrained networks. Networks run without torch. Only
:mod:`.models`, :mod:`.training`, :mod:`.tessellation`, :mod:`.inference.on_device` and the examples of :mod:`.data`
import it. ``tessellation_energy`` and ``embedded_area`` of :mod:`.tessellation` are names of this package too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from anisomesh.errors import AnisomeshError

if TYPE_CHECKING:
    from anisomesh.learn.tessellation import embedded_area, tessellation_energy

__all__ = ["LearningError", "embedded_area", "require_torch", "tessellation_energy"]


class LearningError(AnisomeshError):
    """A package that training, or a network on another device than the CPU, needs is not installed."""


def require_torch() -> None:
    """Import torch and safetensors.

    Raises
    ------
    LearningError
        If one of them is not installed; the message names the extra to install.
    """
    try:
        import safetensors  # noqa: F401
        import torch  # noqa: F401
    except ImportError as error:
        raise LearningError(
            f"{error.name or error} is not installed; training and networks on other devices than the CPU need it: "
            'pip install "anisomesh[train]"'
        ) from error


def __getattr__(name: str) -> Any:
    """Import the differentiable functions, and torch with them, on first use (PEP 562)."""
    if name not in ("embedded_area", "tessellation_energy"):
        raise AttributeError(f"module 'anisomesh.learn' has no attribute {name!r}")
    require_torch()
    from anisomesh.learn import tessellation

    return getattr(tessellation, name)

"""Learning the metric: items, graphs, the network, its training. Only modules of this package import torch."""

import importlib.util

from anisomesh.errors import AnisomeshError


class LearningError(AnisomeshError):
    """What learning needs is not installed."""


def torch_is_there() -> bool:
    """Return whether what a trained network needs is installed, without loading it."""
    return all(importlib.util.find_spec(name) is not None for name in ("torch", "safetensors"))


def require_torch() -> None:
    """Raise LearningError if torch or safetensors is not installed; the message names the extra."""
    try:
        import safetensors  # noqa: F401
        import torch  # noqa: F401
    except ImportError as error:
        raise LearningError(
            f"{error.name} is not installed; the neural embedding and its training need it: "
            'pip install "anisomesh[learn]"'
        ) from error

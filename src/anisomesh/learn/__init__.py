"""Networks that predict the metric of a mesh and remove its noise, and their training.

:mod:`.inference` applies networks, pretrained ones among them; :mod:`.models` has the networks, :mod:`.data` the data
sets and :mod:`.training` the training; ``weights`` has the pretrained networks. Only modules of this package import
torch, and this one does not.
"""

import importlib.util

from anisomesh.errors import AnisomeshError


class LearningError(AnisomeshError):
    """A package that networks need is not installed."""


def torch_is_there() -> bool:
    """Return whether torch and safetensors are installed, without importing them."""
    return all(importlib.util.find_spec(name) is not None for name in ("torch", "safetensors"))


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
            f"{error.name} is not installed; the neural embedding and its training need it: "
            'pip install "anisomesh[learn]"'
        ) from error

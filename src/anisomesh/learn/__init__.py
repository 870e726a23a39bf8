"""Networks that predict the metric of a mesh and remove its noise, and their training.

:mod:`.inference` applies networks, pretrained ones among them; :mod:`.models` has the networks, :mod:`.data` the data
sets and :mod:`.training` the training; ``weights`` has the pretrained networks. Networks run without torch. Only
:mod:`.models`, :mod:`.training`, :mod:`.inference.on_device` and the examples of :mod:`.data` import it.
"""

from anisomesh.errors import AnisomeshError


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

"""Pretrained networks of the package, and the configurations of their training."""

from __future__ import annotations

import os
from pathlib import Path

from anisomesh.errors import OptionError, missing_folder
from anisomesh.toml import hint

DEFAULT_NETWORK, NORMAL_FILTER = "default", "filter"
_WEIGHTS_FOLDER = Path(__file__).parents[1] / "weights"


def pretrained_weights() -> list[str]:
    """Return the names of all pretrained weights: of the networks, and of the filter of normals."""
    return sorted(path.stem for path in _WEIGHTS_FOLDER.glob("*.safetensors"))


def pretrained_networks() -> list[str]:
    """Return the names of the pretrained networks."""
    return [name for name in pretrained_weights() if name != NORMAL_FILTER]


def pretrained_configurations() -> list[str]:
    """Return the names of the training configurations of the pretrained networks."""
    return sorted(path.stem for path in _WEIGHTS_FOLDER.glob("*.toml"))


def configuration_path(name: str) -> Path:
    """Return the TOML file of a training configuration by its name."""
    return _WEIGHTS_FOLDER / f"{name}.toml"


def weights_path(weights: str | os.PathLike[str] | None) -> Path:
    """Return the file of weights for the name of pretrained ones, a path, or None for the default network.

    Raises
    ------
    OptionError
        If there is no such file.
    """
    name = DEFAULT_NETWORK if weights is None else os.fspath(weights)
    known = pretrained_networks()
    path = _WEIGHTS_FOLDER / f"{name}.safetensors" if name in pretrained_weights() else Path(name)
    if not path.is_file():
        folder = missing_folder(path)
        missing = f"; the folder {folder} does not exist" if folder else ""
        raise OptionError(
            f"{name} is neither a file of weights nor a pretrained network ({', '.join(known)})"
            f"{missing or hint(name, known)}"
        )
    return path

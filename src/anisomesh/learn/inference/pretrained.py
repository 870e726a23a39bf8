"""Trained networks that come with the package, and how they were trained."""

from __future__ import annotations

import os
from pathlib import Path

from anisomesh.errors import OptionError
from anisomesh.toml import hint

DEFAULT = "default"
_FOLDER = Path(__file__).parents[1] / "weights"


def shipped_weights() -> list[str]:
    """Return the names of the networks that come with the package."""
    return sorted(path.stem for path in _FOLDER.glob("*.safetensors"))


def configurations() -> list[str]:
    """Return the names of the trainings that made them."""
    return sorted(path.stem for path in _FOLDER.glob("*.toml"))


def configuration_path(name: str) -> Path:
    """Return the file of a training by its name."""
    return _FOLDER / f"{name}.toml"


def weights_path(weights: str | os.PathLike[str] | None) -> Path:
    """Return the file of weights: of a shipped network by its name, of the default one for None, or the file named.

    Raises
    ------
    OptionError
        If there is no such file.
    """
    name = DEFAULT if weights is None else os.fspath(weights)
    path = _FOLDER / f"{name}.safetensors" if name in shipped_weights() else Path(name)
    if not path.is_file():
        known = shipped_weights()
        raise OptionError(
            f"{name}: no file of weights, and no network of the package ({', '.join(known)}){hint(name, known)}"
        )
    return path

"""Exceptions, all derived from :class:`AnisomeshError`.

A message says what is wrong, where, the value, what was expected and the remedy. The command line prints it as one
line and exits with status 1.
"""

from __future__ import annotations

import os
from pathlib import Path


def why_unreadable(path: str | os.PathLike[str], error: OSError) -> str:
    """Return why a file cannot be read; of a missing one, the first folder of its path that is missing, if one is."""
    if not isinstance(error, FileNotFoundError):
        return f"cannot be read: {error.strerror or error}"
    folder = missing_folder(path)
    return f"no such file: the folder {folder} does not exist" if folder else "no such file"


def missing_folder(path: str | os.PathLike[str]) -> Path | None:
    """Return the first folder of a path that does not exist, None if there is none."""
    return next((folder for folder in reversed(Path(path).parents) if not folder.exists()), None)


class AnisomeshError(Exception):
    """Base class of all errors that anisomesh raises."""


class MeshFileError(AnisomeshError):
    """A mesh file cannot be read or written (missing, unknown format, truncated, malformed)."""


class MeshError(AnisomeshError, ValueError):
    """Arrays or objects are not a mesh (index out of range, coordinates not finite, no face)."""


class MetricError(AnisomeshError, ValueError):
    """A metric field has the wrong shape, or its tensors are not symmetric positive definite."""


class OptionError(AnisomeshError, ValueError):
    """The value of an option is out of range."""


class TimeLimitError(AnisomeshError):
    """The time limit expired before there was a result."""

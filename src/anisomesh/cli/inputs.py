"""The files that a command reads, looked for before any of them is read."""

from __future__ import annotations

from pathlib import Path

from anisomesh.errors import MeshFileError, why_unreadable


def check_present(*files: Path | None) -> None:
    """Check that the files that a command was given are there.

    Parameters
    ----------
    *files
        The files, in the order in which they are named; None for none, and ``-`` for standard input.

    Raises
    ------
    MeshFileError
        If several are missing; it names all of them. A single one is named by what reads it, together with what is
        expected of it.
    """
    missing = [path for path in files if path is not None and path != Path("-") and not path.exists()]
    if len(missing) > 1:
        raise MeshFileError("; ".join(f"{path}: {why_unreadable(path, FileNotFoundError())}" for path in missing))

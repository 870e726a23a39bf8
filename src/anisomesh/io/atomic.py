"""Atomic writing: a reader never sees an incomplete file, and a line list survives a killed process."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from anisomesh.errors import MeshFileError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside ``path`` and rename it to ``path`` when the block succeeds.

    Parameters
    ----------
    path
        The file to write. Symbolic links are followed; the mode of an existing file is kept.

    Raises
    ------
    MeshFileError
        If the folder does not exist or cannot be written, the disk is full, or ``path`` is not a regular file.

    Notes
    -----
    The temporary path has the suffix of ``path``, since libraries choose the format by it. If the block raises,
    KeyboardInterrupt included, the temporary file is removed and ``path`` is unchanged.
    """
    try:
        target = Path(path).resolve()
        is_other = target.exists() and not target.is_file()
    except (OSError, RuntimeError) as error:  # RuntimeError before Python 3.13
        raise MeshFileError(f"{path}: cannot be written: {error}") from error
    if not target.parent.is_dir():
        raise MeshFileError(f"{path}: cannot be written: the folder {target.parent} does not exist; create it first")
    if is_other:
        raise MeshFileError(f"{path}: cannot be written: it exists and is not a plain file; choose another name")
    temporary = target.with_name(f".{target.stem[:80]}.{secrets.token_hex(4)}{target.suffix}")
    try:
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def append_line(path: Path, line: str) -> None:
    """Append a line to a file, which is created if missing, and flush it to the disk."""
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
        file.flush()
        os.fsync(file.fileno())


def drop_cut_line(path: Path) -> None:
    """Remove an incomplete last line, left by a process that was killed while writing it."""
    if path.exists():
        content = path.read_bytes()
        if content and not content.endswith(b"\n"):
            os.truncate(path, content.rfind(b"\n") + 1)

"""Writing files so that a reader never sees half of one."""

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
    """Yield a temporary path beside ``path`` and rename it to ``path`` when the block ends well.

    Parameters
    ----------
    path
        The file to write. Symbolic links are followed; the mode of an existing file is kept.

    Raises
    ------
    MeshFileError
        If the folder does not exist or cannot be written, the disk is full, or ``path`` is not a plain file.

    Notes
    -----
    The temporary path has the suffix of ``path``, since libraries choose the format by it. When the block
    raises anything, KeyboardInterrupt included, the temporary file is removed and ``path`` is left as it was.
    """
    target = Path(path).resolve()
    if not target.parent.is_dir():
        raise MeshFileError(f"{path}: cannot be written: there is no folder {target.parent}; create it first")
    if target.exists() and not target.is_file():
        raise MeshFileError(f"{path}: cannot be written: it exists and is not a plain file")
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
    """Write a line at the end of a file, to the disk; the file is made if it is not there."""
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
        file.flush()
        os.fsync(file.fileno())


def drop_cut_line(path: Path) -> None:
    """Take away what is left of a last line that was being written when the process ended."""
    if path.exists():
        content = path.read_bytes()
        if content and not content.endswith(b"\n"):
            os.truncate(path, content.rfind(b"\n") + 1)

"""Atomic writing: a reader never sees an incomplete file, and a line list survives a killed process."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path

from anisomesh.errors import MeshFileError

_MAX_STEM = 80  # characters of the name of a file in the name of its temporary file
_RANDOM = re.compile("[0-9a-f]{8}")  # in the name of a temporary file


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
    temporary = target.with_name(_temporary_name(target, secrets.token_hex(4)))
    try:
        yield temporary
        if target.exists():
            shutil.copymode(target, temporary)
        temporary.replace(target)
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def remove_leftovers(paths: Iterable[Path]) -> None:
    """Remove the temporary files that killed processes left beside files that they were writing.

    Parameters
    ----------
    paths
        The files that were to be written; nothing may be writing them now.
    """
    folders = defaultdict(list)
    for path in paths:
        folders[path.resolve().parent].append(path.resolve())
    for folder, targets in folders.items():
        hidden = [path.name for path in folder.glob(".*")] if folder.is_dir() else []
        for target, name in product(targets, hidden):
            random = name.removeprefix(f".{target.stem[:_MAX_STEM]}.").removesuffix(target.suffix)
            if re.fullmatch(_RANDOM, random) and name == _temporary_name(target, random):
                (folder / name).unlink(missing_ok=True)


def _temporary_name(target: Path, random: str) -> str:
    return f".{target.stem[:_MAX_STEM]}.{random}{target.suffix}"


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

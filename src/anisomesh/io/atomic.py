"""Atomic writing: a reader never sees an incomplete file."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
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
    target, temporary = _places(path)
    try:
        yield temporary
        _put(temporary, target)
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_paths(paths: Sequence[str | os.PathLike[str]]) -> Iterator[list[Path]]:
    """Yield temporary paths beside some paths and rename all to these when the block succeeds, or none.

    Parameters
    ----------
    paths
        The files to write, as for :func:`atomic_path`.

    Raises
    ------
    MeshFileError
        As for :func:`atomic_path`.

    Notes
    -----
    If the block or a renaming raises, KeyboardInterrupt included, files that were there are there again and others are
    not. A process that is killed between two renamings leaves files of both kinds, each of them whole.
    """
    pairs = [_places(path) for path in paths]
    old = [target.with_name(f".{secrets.token_hex(4)}{target.suffix}") for target, _ in pairs]
    begun, current = 0, paths[0]
    try:
        yield [temporary for _, temporary in pairs]
        for (target, _), copy in zip(pairs, old, strict=True):
            if target.exists():
                _second_name(target, copy)
        for begun, (target, temporary) in enumerate(pairs, 1):
            current = paths[begun - 1]
            _put(temporary, target)
        begun = 0
    except OSError as error:
        raise MeshFileError(f"{current}: cannot be written: {error.strerror or error}") from error
    finally:
        for (target, temporary), copy in zip(pairs[:begun], old, strict=False):
            if copy.exists():
                copy.replace(target)
            elif not temporary.exists():
                target.unlink(missing_ok=True)
        for path in (*(temporary for _, temporary in pairs), *old):
            path.unlink(missing_ok=True)


def _places(path: str | os.PathLike[str]) -> tuple[Path, Path]:
    """Return a file without links and a temporary path beside it, or raise MeshFileError if it cannot be written."""
    try:
        target = Path(path).resolve()
        is_other = target.exists() and not target.is_file()
    except (OSError, RuntimeError) as error:  # RuntimeError before Python 3.13
        raise MeshFileError(f"{path}: cannot be written: {error}") from error
    if not target.parent.is_dir():
        raise MeshFileError(f"{path}: cannot be written: the folder {target.parent} does not exist; create it first")
    if is_other:
        raise MeshFileError(f"{path}: cannot be written: it exists and is not a plain file; choose another name")
    return target, target.with_name(_temporary_name(target, secrets.token_hex(4)))


def _put(temporary: Path, target: Path) -> None:
    """Put a complete temporary file in the place of another, with the mode of that."""
    if target.exists():
        shutil.copymode(target, temporary)
    temporary.replace(target)


def _second_name(file: Path, name: Path) -> None:
    """Give a file a second name, or copy it where the file system has no links."""
    try:
        os.link(file, name)
    except OSError:
        shutil.copy2(file, name)


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

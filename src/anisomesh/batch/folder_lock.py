"""A lock on the folder of a batch, so that one works in it at a time; it ends with the process, however that ends."""

from __future__ import annotations

import errno
import logging
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from anisomesh.batch.places import make_folder
from anisomesh.errors import AnisomeshError, MeshFileError

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

logger = logging.getLogger(__name__)

_LOCK_OF_SHARD = re.compile(r"\.batch\.(\d+)-of-(\d+)\.lock")
_WITHOUT_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)  # of some network file systems


@contextmanager
def locked_folder(folder: Path, shard: tuple[int, int] | None) -> Iterator[None]:
    """Hold a folder for a batch, or for a shard of one beside the others; the folder is made if missing.

    Parameters
    ----------
    folder
        The folder of the results.
    shard
        Number of the shard, from 1, and how many there are; None for a batch in one piece.

    Raises
    ------
    AnisomeshError
        If a batch is at work there, the same shard of one, or one of another number of shards.
    MeshFileError
        If the folder cannot be made or written.

    Notes
    -----
    The locks (flock) are of the open files, so nothing is left of a process that was killed but empty hidden files.
    Shards share the lock of the folder, and each has one of its own, which others try that have another number of
    shards. Windows has no such locks, and on file systems without them a warning says so.
    """
    wanted = [(".batch.lock", shard is None, "a batch, or a shard of one, is")]
    if shard is not None:
        wanted.append((f".batch.{shard[0]}-of-{shard[1]}.lock", True, f"shard {shard[0]} of {shard[1]} is"))
    held: list[int] = []
    try:
        make_folder(folder)
        for name, alone, what in wanted if fcntl is not None else []:
            held.append(_opened(folder / name))
            if not _locked(held[-1], folder, alone=alone):
                raise AnisomeshError(f"{folder}: {what} at work in this folder; wait for its end, or name another")
        if shard is not None and fcntl is not None:
            _check_others(folder, shard)
        yield
    finally:
        for file in held:
            os.close(file)


def _check_others(folder: Path, shard: tuple[int, int]) -> None:
    """Raise AnisomeshError if a shard of another number of shards, which has some of the same jobs, is at work."""
    for path in sorted(folder.glob(".batch.*-of-*.lock")):
        found = _LOCK_OF_SHARD.fullmatch(path.name)
        if found is None or int(found[2]) == shard[1]:
            continue
        file = _opened(path)
        try:
            if not _locked(file, folder, alone=False):
                raise AnisomeshError(
                    f"{folder}: shard {found[1]} of {found[2]} is at work in this folder, and shard {shard[0]} of "
                    f"{shard[1]} has some of its jobs; wait for its end, or name another"
                )
        finally:
            os.close(file)


def _opened(path: Path) -> int:
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be written: {error.strerror or error}") from error


def _locked(file: int, folder: Path, *, alone: bool) -> bool:
    """Return whether an open file was locked, for this process alone or with others; so too if it cannot be."""
    try:
        fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        if error.errno not in _WITHOUT_LOCKS:
            raise MeshFileError(f"{folder}: cannot be locked: {error.strerror or error}") from error
        logger.warning("%s: its file system has no locks; see that no other batch is at work in it", folder)
    return True

"""Files by path, or by the address of a file system that fsspec knows, such as ``s3://bucket/part.ply``."""

from __future__ import annotations

import hashlib
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from anisomesh.errors import AnisomeshError, MeshFileError, why_unreadable

_LOCAL = "file://"
_PATTERN_SIGNS = re.compile(r"[*?\[]")
_WHOLE_AT_ONCE = frozenset({"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oss", "memory"})
"""File systems on which a file appears when it is complete."""


def is_address(place: str) -> bool:
    """Return whether a place is the address of a file system, and not a path of this machine."""
    return "://" in place and not place.startswith(_LOCAL)


def absolute(place: str) -> str:
    """Return a place that means the same from everywhere: an address, or an absolute path."""
    return place if is_address(place) else str(Path(place.removeprefix(_LOCAL)).absolute())


def joined(folder: str, name: str) -> str:
    """Return a name in a folder; the name alone if it is absolute or an address."""
    if is_address(name) or Path(name.removeprefix(_LOCAL)).is_absolute():
        return absolute(name)
    return f"{folder.rstrip('/')}/{Path(name).as_posix()}" if is_address(folder) else str(Path(folder, name))


def suffix_of(place: str) -> str:
    """Return the suffix of a file in lower case."""
    return Path(place).suffix.lower()


def exists(place: str) -> bool:
    """Return whether there is a file at a place."""
    return _on(place, lambda fs, path: bool(fs.isfile(path))) if is_address(place) else Path(place).is_file()


def make_folder(folder: Path) -> None:
    """Make a folder of this machine and the ones above it, if they are missing.

    Raises
    ------
    MeshFileError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise MeshFileError(f"{folder}: cannot be made: {error.strerror or error}") from error


def stamp_of(place: str) -> str:
    """Return what changes whenever a file does: its size and the time of its change, or what the file system tells.

    Raises
    ------
    MeshFileError
        If the file cannot be read.
    """
    if is_address(place):
        return str(_on(place, lambda fs, path: fs.ukey(path)))
    try:
        facts = Path(place).stat()
    except OSError as error:
        link = f"a link to {Path(place).readlink()}: " if Path(place).is_symlink() else ""
        raise MeshFileError(f"{place}: {link}{why_unreadable(place, error)}") from error
    return f"{facts.st_size} {facts.st_mtime_ns}"


def hash_of(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of the content of a local file.

    Raises
    ------
    MeshFileError
        If the file cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise MeshFileError(f"{path}: {why_unreadable(path, error)}") from error


@contextmanager
def local_copy(place: str) -> Iterator[str]:
    """Yield the path of a file, or of a temporary copy of a file that is elsewhere.

    Raises
    ------
    MeshFileError
        If the file cannot be fetched.
    """
    if not is_address(place):
        yield place
        return
    with tempfile.TemporaryDirectory(prefix="anisomesh-") as folder:
        copy = str(Path(folder, Path(place).name))
        _on(place, lambda fs, path: fs.get_file(path, copy))
        yield copy


@contextmanager
def local_output(place: str) -> Iterator[str]:
    """Yield the path at which to write a file; what is written beside a temporary one is put in its place afterwards.

    Folders are made. On file systems where a file can be seen before it is complete it gets its name at the end.

    Raises
    ------
    MeshFileError
        If the file cannot be put in its place.
    """
    if not is_address(place):
        try:
            Path(place).parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MeshFileError(f"{place}: cannot be written: {error.strerror or error}") from error
        yield place
        return
    with tempfile.TemporaryDirectory(prefix="anisomesh-") as folder:
        yield str(Path(folder, Path(place).name))
        above = place.rpartition("/")[0]
        for path in sorted(Path(folder).iterdir()):
            _on(f"{above}/{path.name}", lambda fs, target, path=path: _put(fs, str(path), target))


def files_below(place: str, without: str | None = None) -> list[tuple[str, str]] | None:
    """Return all files below an address, or that match one with ``*``, ``?`` or ``[``; None if it is a single file.

    Parameters
    ----------
    place
        The address.
    without
        A folder whose files are left out, wherever it is.

    Returns
    -------
    files
        The address of each file, and its path below the folder, or below the folders of a pattern before the first
        that has such a sign.

    Raises
    ------
    MeshFileError
        If a file system cannot be read, or is unknown.
    """
    protocol = place.partition("://")[0]

    def found(fs: Any, path: str) -> list[tuple[str, str]] | None:
        sign = _PATTERN_SIGNS.search(path)
        if sign is not None:
            base, names = path[: sign.start()].rpartition("/")[0], [name for name in fs.glob(path) if fs.isfile(name)]
        elif fs.isdir(path):
            base, names = path, fs.find(path)
        else:
            return None
        hidden = _path_on(fs, protocol, without)
        kept = [name for name in sorted(names) if hidden is None or not name.startswith(hidden)]
        return [(f"{protocol}://{name.lstrip('/')}", name.removeprefix(base).lstrip("/")) for name in kept]

    result: list[tuple[str, str]] | None = _on(place, found)
    return result


def _path_on(fs: Any, protocol: str, folder: str | None) -> str | None:
    """Return the path of a folder on a file system, with a slash at its end; None if it is not on this one."""
    if folder is None or folder.partition("://")[0] != protocol:
        return None
    found: str | None = _on(folder, lambda other, path: f"{path.rstrip('/')}/" if other == fs else None)
    return found


def _put(fs: Any, path: str, target: str) -> None:
    protocols = {fs.protocol} if isinstance(fs.protocol, str) else set(fs.protocol)
    fs.makedirs(target.rpartition("/")[0], exist_ok=True)
    if protocols & _WHOLE_AT_ONCE:
        fs.put_file(path, target)
        return
    folder, _, name = target.rpartition("/")
    temporary = f"{folder}/.{name}.part"
    fs.put_file(path, temporary)
    fs.mv(temporary, target)


def _on(place: str, action: Any) -> Any:
    """Return what an action does with the file system of an address and the path on it."""
    try:
        import fsspec
    except ImportError:
        raise AnisomeshError(
            f'{place}: addresses need fsspec, which is not installed; run: pip install "anisomesh[batch]"'
        ) from None
    try:
        fs, path = fsspec.core.url_to_fs(place)
        return action(fs, path)
    except AnisomeshError:
        raise
    except Exception as error:  # every file system has its own
        raise MeshFileError(f"{place}: {type(error).__name__}: {error}") from error

"""Jobs from names on the command line: files, folders, patterns and addresses."""

from __future__ import annotations

import glob
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from anisomesh.batch.jobs import Job
from anisomesh.batch.options import Options, plain_options
from anisomesh.batch.places import absolute, files_below, is_address, suffix_of
from anisomesh.errors import OptionError, why_unreadable
from anisomesh.io.known_formats import MESH_FORMATS


def jobs_of(
    names: Sequence[str], options: Options, *, output_format: str | None = None, without: str | None = None
) -> list[Job]:
    """Return the jobs for files, folders with all meshes below them, and patterns such as ``scans/**/*.ply``.

    Parameters
    ----------
    names
        The files, folders and patterns, also as addresses such as ``s3://bucket/scans``.
    options
        Options of every job.
    output_format
        Format of the outputs, such as ``ply``; by default the one of each input.
    without
        A folder, also as an address, whose meshes are left out: the one that the outputs are written to.

    Returns
    -------
    jobs
        Each mesh once, however often and by whatever path it is named. The output has the name of the input, and keeps
        the folders below the one that was named, or below the folders of a pattern before the first that has one of
        ``*``, ``?`` and ``[``. Hidden files and folders below it (names that begin with a dot) are left out; broken
        links are not.

    Raises
    ------
    OptionError
        If a file, folder or pattern has no mesh, or an option is unknown or out of range.
    MeshFileError
        If an address cannot be read.
    """
    if names:
        plain_options(options, "")  # the first job would be blamed for what is wrong in all
    found: list[Job] = []
    seen: set[tuple[str, ...]] = set()
    for path, relative in (mesh for name in names for mesh in _meshes(name, without)):
        output = in_format(relative, output_format)
        real = path if is_address(path) else str(Path(path).parent.resolve() / Path(path).name)
        same = {(path,), (real, output)}
        if seen.isdisjoint(same):
            found.append(Job(input=path, output=output, options=options))
        seen |= same
    return found


def _meshes(name: str, without: str | None) -> list[tuple[str, str]]:
    """Return the meshes that are meant by a name, each with its path below the folder that was named."""
    meshes = _addresses(name, without) if is_address(name) else _paths(name, without)
    if not meshes:
        raise OptionError(f"{name}: no meshes found; expected files ending in {', '.join(sorted(MESH_FORMATS))}")
    return meshes


def _paths(name: str, without: str | None) -> list[tuple[str, str]]:
    path = _without_steps_up(Path(absolute(name)))
    if path.is_file():
        return [(str(path), path.name)]
    if path.is_dir():
        base, paths = path, sorted(path.rglob("*"))
    elif glob.has_magic(name):
        base = _fixed_part(path)
        paths = sorted(base.glob(str(path.relative_to(base))))
    else:
        raise OptionError(
            f"{name}: {why_unreadable(path, FileNotFoundError())}; expected a mesh, a folder or a pattern"
        )
    outputs = None if without is None or is_address(without) else Path(absolute(without)).resolve()
    files = ((p, p.relative_to(base).as_posix()) for p in paths)
    meshes = [(p, below) for p, below in files if _is_shown_mesh(below) and _is_file(p)]
    return [(str(p), below) for p, below in meshes if outputs is None or outputs not in p.resolve().parents]


def _addresses(name: str, without: str | None) -> list[tuple[str, str]]:
    files = files_below(name, without)
    return [(name, Path(name).name)] if files is None else [file for file in files if _is_shown_mesh(file[1])]


def _is_shown_mesh(path: str) -> bool:
    """Return whether a file has the suffix of a mesh, and neither it nor a folder above it a name with a dot first."""
    return suffix_of(path) in MESH_FORMATS and not any(part.startswith(".") for part in PurePosixPath(path).parts)


def _without_steps_up(path: Path) -> Path:
    """Return an absolute path without ``..``, so that a mesh that is named twice has one path."""
    if ".." not in path.parts or glob.has_magic(str(path.parent)):
        return path
    return path.resolve() if path.name == ".." else path.parent.resolve() / path.name


def _is_file(path: Path) -> bool:
    """Return whether a path is a file, or a link that leads nowhere, of which a row is to say so."""
    return path.is_file() or (path.is_symlink() and not path.exists())


def _fixed_part(pattern: Path) -> Path:
    """Return the folders of a pattern before the first that has a sign of a pattern."""
    parts = list(pattern.parts[:-1])
    first = next((k for k, part in enumerate(parts) if glob.has_magic(part)), len(parts))
    return Path(*parts[:first])


def in_format(name: str, output_format: str | None) -> str:
    """Return the name of an output with the suffix of a format, such as ``ply``; None for the suffix that it has."""
    return (
        name if output_format is None else str(PurePosixPath(name).with_suffix("." + output_format.lower().lstrip(".")))
    )

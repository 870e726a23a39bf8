"""One remesh as the commands run it: read, remesh with progress, write each file in full or not at all."""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import typer

from anisomesh.cli.progress import Display, announce_remesh
from anisomesh.cli.report import write_json

if TYPE_CHECKING:
    from anisomesh.attributes.model import Mesh
    from anisomesh.mesh.surface import Surface
    from anisomesh.result import RemeshResult


STANDARD_STREAM = Path("-")
"""Stands for standard input and standard output in place of a file."""


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """The files that a remesh writes; None for each file that was not requested.

    Attributes
    ----------
    mesh
        The result; :data:`STANDARD_STREAM` for standard output.
    mesh_format
        Its format, if the suffix does not name it.
    report, rvd, metric, picture
        The others.
    """

    mesh: Path
    mesh_format: str | None = None
    report: Path | None = None
    rvd: Path | None = None
    metric: Path | None = None
    picture: Path | None = None

    @property
    def paths(self) -> list[Path]:
        """The requested files, in the order of writing, without standard output."""
        paths = (self.mesh, *self._others.values())
        return [path for path in paths if path not in (None, STANDARD_STREAM)]

    @property
    def _others(self) -> dict[str, Path | None]:
        """The files besides the mesh by their options."""
        options = ("--report", "--rvd", "--save-metric", "--picture")
        return dict(zip(options, (self.report, self.rvd, self.metric, self.picture), strict=True))

    def check(self, *inputs: Path | None) -> None:
        """Check before a long computation that every file can be written and none replaces an input by accident.

        Parameters
        ----------
        *inputs
            Files that the command reads. Only the mesh may have the name of one, its own input, and replaces it.

        Raises
        ------
        typer.BadParameter
            If a folder does not exist or cannot be written, a path is a folder or used twice, or a suffix is wrong.
        AnisomeshError
            If a picture was requested and nothing can be drawn on this machine.
        """
        from anisomesh.io.fields.save import TENSOR_FORMATS

        for option, path in self._others.items():
            if path == STANDARD_STREAM:
                raise typer.BadParameter(f"{option} -: only the mesh goes to standard output; give the name of a file")
        for path in self.paths:
            check_output_path(path)
        if len({path.resolve() for path in self.paths}) < len(self.paths):
            raise typer.BadParameter("two outputs have the same file name; give each its own")
        for path in self.paths:
            refuse_to_overwrite(path, *(inputs[1:] if path == self.mesh else inputs))
        if self.mesh_format is not None:
            check_format(self.mesh_format, "--output-format")
        elif self.mesh == STANDARD_STREAM:
            raise typer.BadParameter("-o -: give --output-format, such as ply")
        else:
            check_format(self.mesh.suffix, str(self.mesh))
        _check_suffix("--rvd", self.rvd, (".vtu", ".obj"))
        _check_suffix("--save-metric", self.metric, TENSOR_FORMATS)
        if self.picture is not None:
            check_picture_path(self.picture, "--picture")

    def check_new(self) -> None:
        """Raise typer.BadParameter if the mesh, for which no name was given, exists already."""
        check_not_there(self.mesh, self.mesh)

    def write(self, result: RemeshResult, facts: dict[str, Any], display: Display) -> None:
        """Write the files, each to a temporary file that is renamed when it is complete."""
        from anisomesh.io.meshes import save
        from anisomesh.result import save_metric, save_rvd

        if self.paths:
            display.note(f"writing {', '.join(str(path) for path in self.paths)}")
        if self.mesh != STANDARD_STREAM:
            save(result.mesh, self.mesh, file_format=self.mesh_format)
        if self.report is not None:
            write_json(facts, self.report)
        for save_data, path in ((save_rvd, self.rvd), (save_metric, self.metric)):
            if path is not None:
                save_data(result, path)
        if self.picture is not None:
            from anisomesh.viz import side_by_side

            side_by_side(result.prepared, result.surface, self.picture)
        if self.mesh == STANDARD_STREAM:
            save(result.mesh, sys.stdout.buffer, file_format=self.mesh_format)


def default_output(source: Path, input_format: str | None, output_format: str | None) -> Path:
    """Return the file for a result for which none was named: ``part_remeshed.ply`` beside ``part.ply``.

    Parameters
    ----------
    source
        The input, or :data:`STANDARD_STREAM`.
    input_format, output_format
        The formats of input and result, if they are given; one of them is the suffix in place of the input's.

    Raises
    ------
    typer.BadParameter
        If the input is standard input or has no known suffix.
    """
    if source == STANDARD_STREAM:
        raise typer.BadParameter("give -o OUT: standard input has no name to make one from")
    given = output_format or input_format
    if given is None:
        check_format(source.suffix, str(source))
    suffix = source.suffix if given is None else "." + given.lower().removeprefix(".")
    return source.parent / f"{source.stem}_remeshed{suffix}"


def check_not_there(path: Path, out: Path) -> None:
    """Raise typer.BadParameter if a file that was not named exists; ``out`` is the name that replaces it."""
    if path.exists():
        raise typer.BadParameter(f"{path} exists; give -o {out} to replace it, or another name")


def check_format(name: str, where: str) -> None:
    """Raise typer.BadParameter if a name, such as ply or .ply, is not a mesh format; ``where`` begins the message."""
    from anisomesh.io.known_formats import MESH_FORMATS

    if "." + name.lower().removeprefix(".") not in MESH_FORMATS:
        expected = ", ".join(sorted(MESH_FORMATS))
        if where.startswith("--"):
            raise typer.BadParameter(f"{where} {name}: expected one of {expected}")
        raise typer.BadParameter(f"{where}: expected a file name ending in one of {expected}")


def check_output_path(path: Path) -> None:
    """Check that a file can be written to a path.

    Raises
    ------
    typer.BadParameter
        If its folder does not exist or cannot be written, or the path is a folder.
    """
    try:
        target = path.resolve()
        if target.is_dir():
            raise typer.BadParameter(f"{path} is a folder; give the name of a file in it")
        if target.exists() and not target.is_file():
            raise typer.BadParameter(f"{path} is not a plain file; give another name")
        if not target.parent.is_dir():
            folder = path.parent if target.parent == path.parent.resolve() else target.parent
            raise typer.BadParameter(f"{path}: the folder {folder} does not exist; create it first")
        with tempfile.NamedTemporaryFile(dir=target.parent, prefix="."):
            pass
    except (OSError, RuntimeError, UnicodeError) as error:  # RuntimeError: a loop of links, before Python 3.13
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise typer.BadParameter(f"{path} cannot be written: {reason}") from None


def refuse_to_overwrite(path: Path, *inputs: Path | None) -> None:
    """Raise typer.BadParameter if a file to be written is one of the inputs, under whatever name."""
    if any(other and path.exists() and other.exists() and path.samefile(other) for other in inputs):
        raise typer.BadParameter(f"{path} is an input and would be overwritten; give another name")


def _check_suffix(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    if path is not None and path.suffix.lower() not in suffixes:
        expected = f"{', '.join(suffixes[:-1])} or {suffixes[-1]}"
        raise typer.BadParameter(f"{option} {path}: expected a file name ending in {expected}")


def check_picture_path(path: Path, option: str) -> None:
    """Check that a picture can be drawn on this machine and has a supported suffix.

    Parameters
    ----------
    path
        The picture.
    option
        Name of the option that has this path, for the message.

    Raises
    ------
    typer.BadParameter
        If the suffix is wrong.
    AnisomeshError
        If nothing can be drawn on this machine.
    """
    from anisomesh.viz import PICTURE_FORMATS, require_renderer

    _check_suffix(option, path, PICTURE_FORMATS)
    require_renderer()


def read(path: Path, file_format: str | None = None) -> tuple[Surface, float]:
    """Read a mesh file, or standard input, and return the surface and the time in seconds.

    Parameters
    ----------
    path
        The file; :data:`STANDARD_STREAM` together with a format for standard input.
    file_format
        The format, if the suffix does not name it.
    """
    from anisomesh.io.meshes import load

    start = time.perf_counter()
    surface = load(_source(path, file_format), file_format=file_format)
    return surface, time.perf_counter() - start


def read_mesh(path: Path, file_format: str | None = None) -> tuple[Mesh, float]:
    """Read a mesh with everything that it carries; otherwise as :func:`read`."""
    from anisomesh.io.meshes import load_mesh

    start = time.perf_counter()
    mesh = load_mesh(_source(path, file_format), file_format=file_format)
    return mesh, time.perf_counter() - start


def _source(path: Path, file_format: str | None) -> Path | BinaryIO:
    is_stream = path == STANDARD_STREAM and file_format is not None
    return sys.stdin.buffer if is_stream else path


def check_input_format(path: Path, file_format: str | None) -> None:
    """Raise typer.BadParameter if a format is unknown, or none is given for standard input."""
    if file_format is not None:
        check_format(file_format, "--input-format")
    elif path == STANDARD_STREAM:
        raise typer.BadParameter("-: give --input-format, such as ply")


def run_remesh(
    mesh: Surface | Mesh, display: Display, *, name: str, load_seconds: float, **options: Any
) -> tuple[RemeshResult, dict[str, Any]]:
    """Remesh with progress and return the result and its report.

    Parameters
    ----------
    mesh
        The input, in model units.
    display
        Shows the progress.
    name, load_seconds
        Name of the input and time of reading it, in seconds, for the report.
    **options
        Arguments of :func:`anisomesh.pipeline.remesh`.

    Returns
    -------
    result, report
        The report is ``RemeshResult.report()`` with the keys ``version``, ``input`` and ``options`` added.
    """
    from importlib.metadata import version

    from anisomesh.pipeline import remesh

    announce_remesh(display, options)
    result = remesh(mesh, on_step=display, **options)
    report = result.report()
    seconds = report["seconds"]
    seconds |= {"load": load_seconds, "total": seconds["total"] - seconds.get("load", 0.0) + load_seconds}
    return result, {"version": version("anisomesh"), "input": name, "options": options, **report}

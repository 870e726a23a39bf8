"""One remesh as the commands run it: read, remesh with progress, write every file in full or not at all."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from anisomesh.cli.progress import Display, announce_compilation
from anisomesh.cli.report import write_json

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface
    from anisomesh.result import RemeshResult


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """The files that a remesh writes; None for those that were not asked for."""

    mesh: Path
    report: Path | None = None
    rvd: Path | None = None
    picture: Path | None = None

    @property
    def paths(self) -> list[Path]:
        """The files that were asked for, in the order of writing."""
        return [path for path in (self.mesh, self.report, self.rvd, self.picture) if path is not None]

    def check(self) -> None:
        """Find out before a long computation that a file cannot be written.

        Raises
        ------
        typer.BadParameter
            If a folder does not exist, a name is that of a folder or given twice, or a suffix is wrong.
        AnisomeshError
            If a picture was asked for and cannot be made here.
        """
        for path in self.paths:
            check_place(path)
        if len({path.resolve() for path in self.paths}) < len(self.paths):
            raise typer.BadParameter("two outputs have the same file name; give each its own")
        from anisomesh.io.meshes import FORMATS

        if self.mesh.suffix.lower() not in FORMATS:
            raise typer.BadParameter(f"{self.mesh}: expected a file name ending in one of {', '.join(sorted(FORMATS))}")
        if self.rvd is not None and self.rvd.suffix.lower() not in (".vtu", ".obj"):
            raise typer.BadParameter(f"--rvd {self.rvd}: expected a file name ending in .vtu or .obj")
        if self.picture is not None:
            check_picture(self.picture, "--picture")

    def write(self, result: RemeshResult, facts: dict[str, Any], display: Display) -> None:
        """Write the files, each by way of a temporary file that is renamed when it is complete."""
        from anisomesh.io.meshes import save

        display.note(f"writing {', '.join(str(path) for path in self.paths)}")
        save(result.surface, self.mesh)
        if self.report is not None:
            write_json(facts, self.report)
        if self.rvd is not None:
            from anisomesh.result import save_rvd

            save_rvd(result, self.rvd)
        if self.picture is not None:
            from anisomesh.viz import side_by_side

            side_by_side(result.prepared, result.surface, self.picture)


def check_place(path: Path) -> None:
    """Find out that a file cannot be where it is wanted.

    Raises
    ------
    typer.BadParameter
        If its folder does not exist or its name is that of a folder.
    """
    if path.is_dir():
        raise typer.BadParameter(f"{path} is a folder; give the name of a file in it")
    if not path.parent.is_dir():
        raise typer.BadParameter(f"{path}: there is no folder {path.parent}; create it first")


def check_picture(path: Path, option: str) -> None:
    """Find out that a picture cannot be drawn here, or not into this file, named by this option.

    Raises
    ------
    typer.BadParameter
        If the suffix is wrong.
    AnisomeshError
        If nothing can be drawn on this machine.
    """
    from anisomesh.viz import FORMATS, require_renderer

    if path.suffix.lower() not in FORMATS:
        raise typer.BadParameter(f"{option} {path}: expected a file name ending in {' or '.join(FORMATS)}")
    require_renderer()


def read(path: Path) -> tuple[Surface, float]:
    """Read a mesh file; return it and the seconds it took."""
    from anisomesh.io.meshes import load

    start = time.perf_counter()
    surface = load(path)
    return surface, time.perf_counter() - start


def run_remesh(
    surface: Surface, display: Display, *, name: str, load_seconds: float, **options: Any
) -> tuple[RemeshResult, dict[str, Any]]:
    """Remesh with progress and return the result and its report.

    Parameters
    ----------
    surface
        The input, in model units.
    display
        Where progress goes.
    name
        Name of the input, for the report.
    load_seconds
        Time that reading the input took.
    **options
        Passed to :func:`anisomesh.pipeline.remesh`.

    Returns
    -------
    result, report
        The report has the keys of ``RemeshResult.report()`` and ``version``, ``input`` and ``options``.
    """
    from importlib.metadata import version

    from anisomesh.estimate import chosen_embedding
    from anisomesh.options import RemeshOptions
    from anisomesh.pipeline import remesh

    source = RemeshOptions(**{name: options[name] for name in ("metric", "embedding", "weights") if name in options})
    announce_compilation(display, "remesh", *(() if chosen_embedding(source) == "direct" else ("network",)))
    result = remesh(surface, on_step=display, **options)
    report = result.report()
    seconds = report["seconds"]
    seconds |= {"load": load_seconds, "total": seconds["total"] - seconds.get("load", 0.0) + load_seconds}
    return result, {"version": version("anisomesh"), "input": name, "options": options, **report}

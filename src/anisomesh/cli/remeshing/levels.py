"""Levels of detail on the command line: their numbers of vertices, their run, their files and their table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from anisomesh.cli.job import STANDARD_STREAM, Outputs, check_format, check_not_there, check_output_path
from anisomesh.cli.progress import Display, announce_remesh
from anisomesh.cli.ratios import shares
from anisomesh.cli.report import table, warnings_in, write_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from anisomesh.attributes.model import Mesh
    from anisomesh.levels.model import Levels
    from anisomesh.mesh.surface import Surface

_SAMPLES = 50_000  # points on each surface, for the distances of the table
_HEADER = ("level", "vertices", "faces", "G", "RMS", "HD", "seconds")


def targets_of(
    n_vertices: list[int] | None, ratio: list[float] | None, ratios: str | None
) -> tuple[dict[str, Any], int]:
    """Return how many vertices are asked for, as arguments of a remesh, and the number of levels, 0 for one mesh."""
    if ratios is not None:
        ratio = shares(ratios)
    n_levels = len(n_vertices or ratio or [])
    if ratios is None and n_levels < 2:
        return {"n_vertices": n_vertices[0] if n_vertices else None, "ratio": ratio[0] if ratio else None}, 0
    return {"n_vertices": n_vertices or None, "ratios": ratio or None}, n_levels


@dataclass(frozen=True, kw_only=True)
class LevelOutputs(Outputs):
    """The files that a remesh to levels of detail writes; ``mesh`` is the name that their names are made from.

    Attributes
    ----------
    levels
        Number of levels.
    """

    levels: int

    @property
    def paths(self) -> list[Path]:
        """The requested files, in the order of writing."""
        from anisomesh.levels.files import level_paths

        own = level_paths(self.mesh, self.levels, self.mesh_format)
        return [*own, *(path for path in (self.report, self.picture) if path is not None)]

    def check(self, *inputs: Path | None) -> None:
        """Check before a long computation that every file can be written and none replaces an input.

        Raises
        ------
        typer.BadParameter
            As for :class:`~anisomesh.cli.job.Outputs`, and for files that only one mesh has.
        """
        if self.mesh == STANDARD_STREAM:
            raise typer.BadParameter("-o -: levels of detail do not go to standard output; give the name of a file")
        for option, path in (("--rvd", self.rvd), ("--save-metric", self.metric)):
            if path is not None:
                raise typer.BadParameter(
                    f"{option} writes what belongs to one mesh; leave it out with levels of detail"
                )
        check_output_path(self.mesh.with_name(f"{self.mesh.stem}.lod0{self.mesh.suffix}"))
        check_format(self.mesh_format or self.mesh.suffix, str(self.mesh))
        super().check(*inputs)

    def check_new(self) -> None:
        """Raise typer.BadParameter if a file of a level exists already."""
        from anisomesh.levels.files import level_paths

        for path in level_paths(self.mesh, self.levels, self.mesh_format):
            check_not_there(path, self.mesh)

    def write(self, result: Levels, facts: dict[str, Any], display: Display) -> None:  # type: ignore[override]
        """Write the levels, all or none of them, then the other files."""
        from anisomesh.levels.files import level_paths

        display.note(f"writing {', '.join(str(path) for path in self.paths)}")
        result.save(self.mesh, file_format=self.mesh_format)
        after = level_paths(self.mesh, self.levels + 1, self.mesh_format)[-1]
        if after not in self.paths and after.exists():
            display.note(f"{after} and coarser levels are of an earlier run")
        if self.report is not None:
            write_json(facts, self.report)
        if self.picture is not None:
            from anisomesh.viz import Panel, gallery

            panels = [Panel(surface=result[0].prepared, name="input", note=_size(result[0].prepared))]
            panels += [Panel(surface=x.surface, name=f"level {k}", note=_size(x.surface)) for k, x in enumerate(result)]
            gallery(panels, self.picture, same_view=True)


def _size(surface: Surface) -> str:
    return f"{surface.n_points:,} vertices"


def run_levels(
    mesh: Surface | Mesh, display: Display, *, name: str, load_seconds: float, **options: Any
) -> tuple[Levels, dict[str, Any]]:
    """Remesh to levels of detail with progress and return them and their report; see :func:`run_remesh` for both."""
    from importlib.metadata import version

    from anisomesh.levels.remesh import remesh_levels

    announce_remesh(display, options)
    levels = remesh_levels(mesh, on_step=display, **options)
    display.note("measuring the levels")
    report = levels.report()
    for facts, measures in zip(report["levels"], _measures(levels), strict=True):
        facts |= measures
    report["seconds"] += load_seconds
    first = report["levels"][0]["seconds"]
    first |= {"load": load_seconds, "total": first["total"] + load_seconds}
    return levels, {"version": version("anisomesh"), "input": name, "options": options, **report}


def _measures(levels: Levels) -> list[dict[str, float]]:
    """Return the mean quality of each level, and its distances from the input at bounding-box diagonal 1."""
    from anisomesh.evaluation.shape import quality_in_metric, reference_metric
    from anisomesh.mesh.distance import surface_distance
    from anisomesh.mesh.geometry import unit_frame
    from anisomesh.mesh.surface import Surface
    from anisomesh.repair.prepare import prepare

    prepared = prepare(levels[0].prepared).surface  # sheets apart, as in an evaluation
    frame = unit_frame(prepared.points)
    reference = prepared.with_points(frame.to_unit(prepared.points))
    metric, rows = reference_metric(reference), []
    for level in levels:
        surface = Surface(frame.to_unit(level.surface.points), level.surface.faces)
        distance = surface_distance(reference, surface, samples=_SAMPLES)
        quality = float(quality_in_metric(*metric, surface).mean())
        rows.append({"quality": quality, "rms": distance.rms, "hausdorff": distance.hausdorff})
    return rows


def levels_summary(report: dict[str, Any], written: Sequence[Path], notes: Sequence[str]) -> str:
    """Return the readable summary of levels of detail; the parameters are the ones of :func:`summary`."""
    levels = report["levels"]
    cells = [
        (
            str(k),
            f"{level['vertices']:,}",
            f"{level['faces']:,}",
            f"{level['quality']:.3f}",
            f"{level['rms']:.2e}",
            f"{level['hausdorff']:.2e}",
            f"{level['seconds']['total']:.2f}",
        )
        for k, level in enumerate(levels)
    ]
    widths = [max(map(len, column)) for column in zip(_HEADER, *cells, strict=True)]
    lines = ["  " + "  ".join(word.rjust(w) for word, w in zip(row, widths, strict=True)) for row in (_HEADER, *cells)]
    rows = [
        ("G, RMS, HD", "mean quality; distances from the input over its bounding-box diagonal"),
        ("seconds", f"{report['seconds']:.2f}"),
        *(("prepared", note) for note in notes),
        *warnings_in(report),
        *(("hint", text) for text in report.get("hints", [])),
        *(("wrote", str(path)) for path in written),
    ]
    return "\n".join([*lines, table(rows)])

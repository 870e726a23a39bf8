"""``anisomesh dataset``: build a data set of a folder of meshes, and say what is in one."""

from __future__ import annotations

import sys
from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from anisomesh.cli.progress import announce_compilation, progress
from anisomesh.cli.report import counted, table

if TYPE_CHECKING:
    from anisomesh.learn.data.manifest import ManifestRow


class Variant(StrEnum):
    """Other meshes of a shape."""

    given = "given"
    decimated = "decimated"
    stretched = "stretched"


class Evening(StrEnum):
    """How meshes are made even."""

    cvt = "cvt"
    tetwild = "tetwild"


app = typer.Typer(help="Data sets that a network learns the metric from.", no_args_is_help=True)


@app.command("build")
def build_command(
    source: Annotated[Path, typer.Argument(metavar="SRC", help="Folder of meshes.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of the data set; made if it is not there.")],
    target: Annotated[int, typer.Option(min=100, help="Points of the even mesh of a shape.")] = 5_000,
    blobs: Annotated[int, typer.Option(min=0, help="Smooth shapes made by code, with exact curvature, besides.")] = 40,
    parts: Annotated[int, typer.Option(min=0, help="Machine parts made by code besides.")] = 40,
    variant: Annotated[
        list[Variant] | None,
        typer.Option(help="Meshes of every shape beside the even one; may be given again.", show_default="all"),
    ] = None,
    no_variants: Annotated[bool, typer.Option("--no-variants", help="Even meshes only.")] = False,
    evening: Annotated[
        Evening, typer.Option(help="cvt: a uniform remesh; tetwild: pytetwild before it.")
    ] = Evening.cvt,
    validation: Annotated[float, typer.Option(min=0.0, max=0.9, help="Share of the families for validation.")] = 0.12,
    workers: Annotated[int, typer.Option(min=1, help="Meshes worked on at once.")] = 2,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Make training items of the meshes of SRC in OUT; a build that was stopped goes on where it was."""
    from anisomesh.learn.data.build import build, sources_of
    from anisomesh.learn.data.recipe import Recipe

    if no_variants and variant:
        raise typer.BadParameter("give either --variant or --no-variants")
    variants = () if no_variants else tuple(kind.value for kind in Variant if kind in (variant or Variant))
    recipe = Recipe(target=target, variants=variants, evening=evening.value)
    sources = sources_of(source, blobs, parts)
    with progress(quiet) as display:
        announce_compilation(display, "remesh")
    on_row = _ignore if quiet else _print
    rows = build(sources, out, recipe, validation=validation, workers=workers, on_row=on_row)
    typer.echo(_summary(rows))


@app.command("info")
def info_command(folder: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder of a data set.")]) -> None:
    """Say what is in a data set, and what was left out of it and why."""
    from anisomesh.errors import MeshFileError
    from anisomesh.learn.data.manifest import MANIFEST, read_manifest

    rows = read_manifest(folder)
    if not rows:
        raise MeshFileError(f"{folder}: there is no data set here (no {MANIFEST})")
    typer.echo(_summary(rows))
    for row in rows:
        if row["status"] != "kept":
            typer.echo(f"  {row['status']:<8} {row['name']}: {row['reason']}")


def _summary(rows: list[ManifestRow]) -> str:
    status = Counter(row["status"] for row in rows)
    kept = [row for row in rows if row["status"] == "kept"]
    lines = [
        ("shapes", f"{counted(status['kept'], 'kept', 'kept')}, {status['dropped']} dropped, {status['failed']} failed")
    ]
    for split in ("training", "validation"):
        group = [row for row in kept if row["split"] == split]
        kinds = Counter(item["kind"] for row in group for item in row["items"])
        families = len({row["family"] for row in group})
        said = ", ".join(f"{count} {kind}" for kind, count in kinds.items()) or "none"
        lines.append((split, f"{counted(families, 'family', 'families')}; items: {said}"))
    return table(lines)


def _print(row: ManifestRow, number: int, total: int) -> None:
    said = ", ".join(item["kind"] for item in row["items"]) if row["status"] == "kept" else row["reason"]
    print(f"[{number}/{total}] {row['name'][:48]:<48} {row['status']:<8} {said}", file=sys.stderr, flush=True)


def _ignore(row: ManifestRow, number: int, total: int) -> None:
    """Say nothing."""

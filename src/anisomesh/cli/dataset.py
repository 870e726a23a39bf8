"""``anisomesh dataset``: build a data set from a folder of meshes, and describe a data set."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from anisomesh.cli.arguments import Workers
from anisomesh.cli.ending import exit_at_sigterm
from anisomesh.cli.log import logs
from anisomesh.cli.progress import announce_compilation, progress
from anisomesh.cli.report import counted, table
from anisomesh.learn.data.recipe import VARIANTS, EveningName, Recipe

if TYPE_CHECKING:
    from anisomesh.learn.data.manifest import ManifestRow


DEFAULT_RECIPE = Recipe()


def _known_variants(names: list[str] | None) -> list[str] | None:
    for name in names or ():
        if name not in VARIANTS:
            raise typer.BadParameter(f"{name!r} is not one of {', '.join(VARIANTS)}")
    return names


app = typer.Typer(help="Build and describe data sets for training networks.", no_args_is_help=True)


@app.command("build")
@logs
def build_command(
    source: Annotated[Path, typer.Argument(metavar="SRC", help="Folder of meshes.")],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Folder of the data set; created if missing.")],
    target: Annotated[int, typer.Option(min=100, help="Vertices of the even mesh of a shape.")] = DEFAULT_RECIPE.target,
    blobs: Annotated[int, typer.Option(min=0, help="Number of procedural smooth shapes, with exact curvature.")] = 40,
    parts: Annotated[int, typer.Option(min=0, help="Number of procedural machine parts.")] = 40,
    variant: Annotated[
        list[str] | None,
        typer.Option(
            callback=_known_variants,
            metavar="|".join(VARIANTS),
            help="Other mesh of every shape besides the even one; repeatable.",
            show_default="all",
        ),
    ] = None,
    no_variants: Annotated[bool, typer.Option("--no-variants", help="Even meshes only.")] = False,
    evening: Annotated[
        EveningName,
        typer.Option(
            help="How to make meshes even. cvt: uniform remesh; tetwild: pytetwild, then a uniform remesh; "
            "working: only bad triangles are made anew."
        ),
    ] = DEFAULT_RECIPE.evening,
    validation: Annotated[
        float, typer.Option(min=0.0, max=0.9, help="Share of the shape families for validation.")
    ] = 0.12,
    workers: Workers = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Build a data set from the meshes in SRC. A stopped build is resumed by the same command."""
    from anisomesh.execution.engine import WorkerPool
    from anisomesh.learn.data.build import build
    from anisomesh.learn.data.sources import sources_of
    from anisomesh.pipeline import remesh

    if no_variants and variant:
        raise typer.BadParameter("give either --variant or --no-variants")
    pool = WorkerPool(count=workers)
    variants = () if no_variants else tuple(kind for kind in VARIANTS if kind in (variant or VARIANTS))
    recipe = Recipe(target=target, variants=variants, evening=evening)
    sources = sources_of(source, blobs, parts, validation=validation)
    with progress(quiet) as display:
        announce_compilation(display, "remesh")
    on_row = _ignore if quiet else _print
    with exit_at_sigterm():
        rows = build(sources, out, recipe, remesh, workers=pool, on_row=on_row)
    typer.echo(_summary(rows))


@app.command("info")
@logs
def info_command(folder: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder of a data set.")]) -> None:
    """Describe a data set, and the shapes that were dropped or failed, with the reason."""
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
    """Print nothing."""

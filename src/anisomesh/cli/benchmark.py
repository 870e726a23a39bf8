"""``anisomesh benchmark``: run or resume a suite, write rows and reports."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from anisomesh.cli.arguments import share
from anisomesh.cli.ending import exit_at_sigterm
from anisomesh.cli.progress import announce_compilation, progress

if TYPE_CHECKING:
    from anisomesh.bench.runs import RunRow, SuiteProgress
    from anisomesh.bench.suite import Suite


def command(
    suite: Annotated[
        str | None,
        typer.Argument(metavar="SUITE", help="Name of a suite of the package (see --list), or a .toml file."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for rows and reports.")] = Path("benchmark"),
    data: Annotated[
        Path | None,
        typer.Option(envvar="ANISOMESH_DATA", help="Folder of the mesh files of the suite."),
    ] = None,
    items: Annotated[
        Path | None, typer.Option(help="Data set for suites that train networks; anisomesh dataset build makes one.")
    ] = None,
    ratios: Annotated[
        list[float] | None,
        typer.Option(
            "--ratio",
            parser=share,
            metavar="SHARE",
            help="Run only this ratio (result vertices per input vertex), not all of the suite; repeatable.",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="N",
            help="Processes (extra: batch), of which several slow each other; 0 for none but this one.",
            show_default="1, or 0 without the extra",
        ),
    ] = None,
    show_list: Annotated[bool, typer.Option("--list", help="List the suites and exit.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Run a SUITE of methods on meshes. A stopped run is resumed by the same command."""
    from anisomesh.bench.suite import load_suite, suite_names

    if show_list:
        for name in suite_names():
            typer.echo(f"{name:<18} {load_suite(name).description.strip().splitlines()[0]}")
        return
    if suite is None:
        raise typer.BadParameter("name a suite, or list them with --list")
    wanted = load_suite(suite)
    if ratios:
        wanted = replace(wanted, ratios=tuple(ratios))
    from anisomesh.bench.runs import run_suite
    from anisomesh.bench.tables import markdown, web_page
    from anisomesh.execution.engine import WorkerPool, has_dask
    from anisomesh.io.atomic import atomic_path

    pool = WorkerPool(count=int(has_dask()) if workers is None else workers)
    with progress(quiet) as display:
        announce_compilation(display, "remesh", "evaluate")
    out.mkdir(parents=True, exist_ok=True)
    stem = out / wanted.name
    with exit_at_sigterm():
        rows = run_suite(
            wanted,
            stem.with_suffix(".jsonl"),
            data=data,
            items=items,
            workers=pool,
            on_step=lambda step: None if quiet else _print(step),
        )
    chart = _chart(wanted, rows)
    texts = {".svg": chart} if chart else {}
    texts[".md"] = markdown(wanted, rows, f"{wanted.name}.svg" if chart else "")
    texts[".html"] = web_page(wanted, rows, chart)
    for suffix, text in texts.items():
        with atomic_path(stem.with_suffix(suffix)) as temporary:
            Path(temporary).write_text(text, encoding="utf-8")
    typer.echo(f"{len(rows):,} runs; wrote " + ", ".join(f"{stem}{suffix}" for suffix in (".jsonl", *texts)))


def _chart(suite: Suite, rows: list[RunRow]) -> str:
    """Return the chart of the report as SVG, empty if matplotlib is missing."""
    from anisomesh.bench.charts import trade_off

    try:
        return trade_off(suite, rows)
    except ImportError:
        print("the report has no chart: matplotlib is not installed (extra: picture)", file=sys.stderr)
        return ""


def _print(step: SuiteProgress | str) -> None:
    if isinstance(step, str):
        print(step, file=sys.stderr, flush=True)
        return
    row = step.row
    name = f"{Path(row['mesh']).name[:32]:<32} {row['ratio']:>4.0%} {row['input']:<9} {row['method']:<20}"
    if row["status"] == "done":
        found = row["evaluation"]
        said = f"G {found['shape']['g_mean']:.3f} RMS {found['distance']['rms']:.2e} {row['seconds']:.2f} s"
    else:
        said = f"{row['status']}: {row['error']}"
    left = f"{step.seconds_left / 60:.0f} min left" if step.seconds_left >= 60 else f"{step.seconds_left:.0f} s left"
    print(f"[{step.number}/{step.total}] {name} {said} ({left})", file=sys.stderr, flush=True)

"""``anisomesh batch``: many meshes in, many anisotropic meshes out, on all cores or a cluster."""

from __future__ import annotations

import glob
import importlib.util
import re
import time
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.arguments import (
    DEFAULT_OPTIONS,
    REMESH_OPTIONS,
    Quiet,
    Ratio,
    Vertices,
    Workers,
    length,
    takes_remesh_options,
    target_option,
)
from anisomesh.cli.ending import exit_at_sigterm
from anisomesh.cli.inputs import check_present
from anisomesh.cli.job import check_format
from anisomesh.cli.progress import Display, announce_compilation, progress
from anisomesh.cli.ratios import shares
from anisomesh.cli.remeshing.prescribed_metric import check_targets
from anisomesh.cli.remeshing.shared_options import (
    AdaptedTo,
    Gradation,
    MaxSize,
    MetricFileName,
    MinSize,
    NormOfAdaption,
    Ratios,
)
from anisomesh.cli.spelling import as_options, in_one_line, spelled
from anisomesh.options import MAX_THREADS

if TYPE_CHECKING:
    from anisomesh.batch.jobs import Job
    from anisomesh.batch.running import Batch, Progress, Settings

SOME_FAILED = 3
"""Exit code if jobs were refused or failed."""
STATUSES = ("done", "refused", "failed")


@takes_remesh_options(*(name for name in REMESH_OPTIONS if name != "threads"))
def command(
    out: Annotated[
        str, typer.Option("--out", "-o", metavar="DIR", help="Folder of the meshes to write, and of the results.")
    ],
    sources: Annotated[
        list[str] | None,
        typer.Argument(metavar="[IN...]", help="Meshes, folders with all meshes below them, patterns, addresses."),
    ] = None,
    manifest: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Jobs with options of their own: .jsonl, or .csv with a heading."),
    ] = None,
    results: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results, if the meshes go elsewhere.")
    ] = None,
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    ratios: Ratios = None,
    max_error: Annotated[
        str | None,
        target_option(metavar="LENGTH", help="As few vertices as keep within this distance, such as 0.2 or 0.1%."),
    ] = None,
    edge_length: Annotated[
        str | None, target_option(metavar="LENGTH", help="As many vertices as edges of this length take.")
    ] = None,
    metric_file: MetricFileName = None,
    min_size: MinSize = None,
    max_size: MaxSize = None,
    gradation: Gradation = None,
    adapt_to: AdaptedTo = None,
    norm: NormOfAdaption = None,
    weld: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Join points of the inputs up to this distance, or auto.")
    ] = None,
    output_format: Annotated[
        str | None, typer.Option(metavar="FORMAT", help="Format of the meshes to write; by default of each input.")
    ] = None,
    workers: Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Scheduler of a running Dask cluster, such as tcp://host:8786."),
    ] = None,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Do the I-th of N parts of the jobs, without any scheduler.")
    ] = None,
    threads: Annotated[int, typer.Option(min=1, max=MAX_THREADS, metavar="N", help="Threads of each worker.")] = 1,
    thumbnails: Annotated[
        bool, typer.Option("--thumbnails/--no-thumbnails", help="Small pictures on the page (extra: picture).")
    ] = True,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Remesh many meshes. A stopped batch is resumed by the same command, which does what is left.

    Give -n, --ratio, --ratios, --max-error or --edge-length, or a manifest whose rows do. Exit code 3 if some failed.
    """
    from anisomesh.batch.places import is_address
    from anisomesh.batch.running import Settings
    from anisomesh.execution.engine import WorkerPool

    out = out.removeprefix("file://")
    if is_address(out) and results is None:
        raise typer.BadParameter(f"--out {out} is not on this machine; give --results DIR, a folder that is")
    if output_format is not None:
        check_format(output_format, "--output-format")
    counts = {"n_vertices": n_vertices, "ratio": ratio, "ratios": None if ratios is None else shares(ratios)}
    targets = {**counts, "max_error": max_error, "edge_length": edge_length}
    fields = {"metric_file": metric_file, "adapt_to": adapt_to, "norm": norm}
    limits = {"min_size": min_size, "max_size": max_size}
    for name, text in {"max_error": max_error, "edge_length": edge_length, **limits}.items():
        if text is not None:
            length(text, f"--{name.replace('_', '-')}")
    if weld not in (None, "auto"):
        length(str(weld), "--weld")
    given = {name: value for name, value in options.items() if value != getattr(DEFAULT_OPTIONS, name)}
    given |= {"threads": threads, "weld_tolerance": weld, "gradation": gradation} | targets | fields | limits
    jobs = _jobs(sources or [], manifest, {k: v for k, v in given.items() if v is not None}, output_format, out)
    settings = Settings(
        workers=WorkerPool(count=workers, scheduler=scheduler),
        shard=None if shard is None else _shard(shard),
        outputs=out,
        thumbnails=thumbnails,
    )
    _run(jobs, Path(results or out), settings, quiet)


def _jobs(
    sources: list[str], manifest: Path | None, options: dict[str, Any], output_format: str | None, out: str
) -> list[Job]:
    from anisomesh.batch.inputs import jobs_of
    from anisomesh.batch.manifest import read_manifest
    from anisomesh.batch.options import TARGETS
    from anisomesh.batch.places import is_address

    if not sources and manifest is None:
        raise typer.BadParameter("name meshes, folders or patterns, or a --manifest")
    targets = {spelled(name): options[name] for name in TARGETS if name in options}
    if sources or len(targets) > 1:
        check_targets(targets, options.get("metric_file"), options.get("adapt_to"))
    check_present(manifest, *(Path(name) for name in sources if not is_address(name) and not glob.has_magic(name)))
    listed = [] if manifest is None else read_manifest(manifest, options, output_format=output_format)
    return [*listed, *jobs_of(sources, options, output_format=output_format, without=out)]


def _shard(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)/(\d+)", text)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise typer.BadParameter(f"--shard {text}: expected I/N with I from 1 to N, such as 2/8")
    return int(found[1]), int(found[2])


def _can_draw(display: Display) -> bool:
    """Return whether pictures can be drawn; say so if the extra is there and they cannot."""
    if any(importlib.util.find_spec(name) is None for name in ("pyvista", "matplotlib")):
        return False
    from anisomesh.errors import AnisomeshError
    from anisomesh.viz import require_renderer

    try:
        require_renderer()
    except AnisomeshError as error:
        display.note(f"no thumbnails: {error}")
        return False
    return True


def _run(jobs: list[Job], folder: Path, settings: Settings, quiet: bool) -> None:
    """Run a batch with progress, print its summary, and exit with 3 if jobs failed."""
    from anisomesh.batch.reports import PAGE, PARQUET
    from anisomesh.batch.running import Batch

    start = time.monotonic()
    batch = Batch(jobs, folder, settings)
    with exit_at_sigterm(), progress(quiet) as display:
        if batch.left:
            _begin(display, batch)
        rows = batch.run(partial(_show, display, {job.output for job in jobs if job.place}))
    counts = Counter(row["status"] for row in rows)
    if not quiet:
        said = ", ".join(f"{counts[status]:,} {status}" for status in STATUSES if counts[status])
        names = [name for name in (batch.results.name, PAGE, PARQUET) if (folder / name).exists()]
        typer.echo(f"{said}; {len(batch.left):,} of them now, in {time.monotonic() - start:.1f} s")
        typer.echo(f"wrote {', '.join(str(folder / name) for name in names)}")
        if PARQUET not in names:
            typer.echo(f"no {PARQUET}: pyarrow is not installed")
    if len(rows) > counts["done"]:
        raise typer.Exit(SOME_FAILED)


def _begin(display: Display, batch: Batch) -> None:
    """Say how many jobs are left, and what runs them; see whether thumbnails can be drawn."""
    if len(batch.left) < len(batch.jobs):
        display.note(f"{len(batch.left):,} of {len(batch.jobs):,} jobs are left")
    batch.settings = replace(batch.settings, thumbnails=batch.settings.thumbnails and _can_draw(display))
    workers = batch.settings.workers
    if workers.in_this_process and workers.count != 0:
        display.note(
            "jobs run in this process, one after the other; "
            'for several workers, and if jobs crash or hang, run: pip install "anisomesh[batch]"'
        )
    announce_compilation(display, "remesh", "fit")


def _show(display: Display, listed: set[str], step: Progress) -> None:
    """Show how many jobs have ended, the time left, and what became of a job unless it is done.

    Options of jobs whose outputs are ``listed`` in a manifest are called as there.
    """
    from anisomesh.execution.progress import StepInfo

    row = step.row
    if row["status"] != "done":
        error = in_one_line(row["error"])
        display.note(f"{row['status']}: {row['output']}: {error if row['output'] in listed else as_options(error)}")
    left = f"{step.seconds_left / 60:.0f} min left" if step.seconds_left >= 60 else f"{step.seconds_left:.0f} s left"
    display(StepInfo(stage="batch", iteration=step.number, total=step.total, message=left))

"""``anisomesh train``: train a network on a data set, or resume a run."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from anisomesh.cli.progress import announce_compilation, progress
from anisomesh.cli.report import counted


def command(
    config: Annotated[
        Path,
        typer.Argument(
            metavar="CONFIG", help="Training run: a TOML file, or default or paper for the runs of the package."
        ),
    ],
    resume: Annotated[bool, typer.Option("--resume", help="Continue from the checkpoint of the run.")] = False,
    threads: Annotated[int, typer.Option("--threads", min=1, help="Worker threads of torch.")] = 1,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Train a network on a data set. SIGTERM and Ctrl-C save a checkpoint and stop; --resume continues."""
    from anisomesh.learn import require_torch

    require_torch()
    import torch

    from anisomesh.learn.data.manifest import files_of
    from anisomesh.learn.training.config import load_training
    from anisomesh.learn.training.run import WEIGHTS
    from anisomesh.learn.training.train import train

    torch.set_num_threads(threads)
    first = int(os.environ.get("RANK", "0")) == 0  # torchrun starts several processes; only the first prints
    quiet = quiet or not first
    options = load_training(config)
    files = files_of(Path(options.data))
    if not quiet:
        counts = counted(len(files.training), "training item"), counted(len(files.validation), "validation item")
        print(f"{counts[0]}, {counts[1]}", file=sys.stderr, flush=True)
    with progress(quiet) as display:
        announce_compilation(display, "train")
    rows = train(options, files, resume=resume, on_row=lambda row: None if quiet else _print(row))
    if first:
        typer.echo(f"{counted(len(rows), 'epoch')}; wrote {Path(options.out) / WEIGHTS}")


def _print(row: dict[str, Any]) -> None:
    checks = ", ".join(f"{name} {value:.3f}" for name, value in row.items() if name.startswith("validation"))
    print(
        f"epoch {row['epoch']}: loss {row['loss']:.4f}, {checks} ({row['seconds']:.0f} s)", file=sys.stderr, flush=True
    )

"""Training a network on a data set, from the start or from a checkpoint."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from anisomesh.errors import OptionError
from anisomesh.learn.data.manifest import Files
from anisomesh.learn.inference.pretrained import weights_path
from anisomesh.learn.models.checkpoint import WeightsError, load_weights
from anisomesh.learn.models.device import deterministic, device_of
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.processes import workers
from anisomesh.learn.training.run import CHECKPOINT, EpochRow, Interruption, Run
from anisomesh.learn.training.tasks import Task, task_of


def train(
    options: TrainingOptions,
    files: Files,
    *,
    resume: bool = False,
    on_row: Callable[[EpochRow], None] = lambda row: None,
) -> list[EpochRow]:
    """Train a network and return what was measured after each epoch.

    Parameters
    ----------
    options
        How.
    files
        What on.
    resume
        Go on from the checkpoint in the folder of the run; the losses are those of a run that was never interrupted.
    on_row
        Called after every epoch with its row.

    Returns
    -------
    rows
        One an epoch, also in ``metrics.jsonl``, and for TensorBoard in ``events``: ``epoch``, mean training ``loss``,
        learning ``rate``, ``seconds``, and of each noise the ``validation`` loss, as a share of that of predicting
        nothing, and its parts.

    Raises
    ------
    OptionError
        If there are no items, the folder has a run and ``resume`` is not given, or it has none and it is.
    WeightsError
        If the checkpoint is damaged or of another run, or the weights to start from are of another network.
    DivergedError
        If a loss is not finite; the last checkpoint stays.
    MeshFileError
        If an item cannot be read, or a file not be written.
    KeyboardInterrupt
        After SIGTERM or Ctrl-C, once the state is saved.

    Notes
    -----
    It runs in the main thread, since it handles signals.
    The order of items and their noise depend on the seed, the epoch and the step alone, so a checkpoint needs no state
    of a generator. Checkpoints are written every few minutes, after every epoch, and on SIGTERM and Ctrl-C, which end
    the run. ``weights.safetensors`` are those of the best epoch on the validation items. Under torchrun every process
    takes its part of each batch, and the first one writes the files.
    """
    out = Path(options.out)
    if not files.training or not files.validation:
        raise OptionError("the data set has no items for training, or none for validation")
    if (out / CHECKPOINT).exists() and not resume:
        raise OptionError(f"{out} has a run already; go on with --resume, or name another folder")
    if resume and not (out / CHECKPOINT).exists():
        raise OptionError(f"{out} has no run to go on with; start it without --resume")
    out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(options.seed)
    task = task_of(options)
    with Interruption() as interrupted, deterministic(), workers() as group:
        network = _network(task, "" if resume else options.start).to(device_of(options.device, group.local_rank))
        optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.weight_decay)
        run = Run(options, task, files, network, optimiser, out, group)
        if resume:
            run.load()
        group.wait()  # before the first writes what others look for
        while run.at.epoch < options.epochs:
            row = run.epoch(interrupted)
            if group.is_first:
                on_row(row)
        return run.rows()


def _network(task: Task, start: str) -> Any:
    """Return a network with random weights, or with those that it is to start from.

    Raises
    ------
    WeightsError
        If these are of another kind or size.
    """
    network = task.network()
    if start:
        other = load_weights(weights_path(start))[0]
        if other.options != network.options:
            raise WeightsError(f"{start} has weights of a network of another kind or size: {other.options}")
        network.load_state_dict(other.state_dict())
    return network

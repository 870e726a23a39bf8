"""Train a network on a data set, from the start or from a checkpoint."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from anisomesh.errors import OptionError
from anisomesh.learn.data.manifest import ItemFiles
from anisomesh.learn.inference.pretrained import weights_path
from anisomesh.learn.models.checkpoint import load_weights
from anisomesh.learn.models.device import deterministic, resolve_device
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.processes import training_process
from anisomesh.learn.training.run import CHECKPOINT, EpochRow, Interruption, TrainingRun
from anisomesh.learn.training.tasks import Task, task_of
from anisomesh.learn.weights_file import WeightsError


def train(
    options: TrainingOptions,
    files: ItemFiles,
    *,
    resume: bool = False,
    on_row: Callable[[EpochRow], None] = lambda row: None,
) -> list[EpochRow]:
    """Train a network and return the measurements of all epochs.

    Parameters
    ----------
    options
        Options of the run.
    files
        Items for training and for validation.
    resume
        Continue from the checkpoint in the folder of the run, with the same losses as an uninterrupted run.
    on_row
        Called after each epoch with its row.

    Returns
    -------
    rows
        One per epoch, also in ``metrics.jsonl`` and, for TensorBoard, in ``events``: ``epoch``, mean training ``loss``,
        learning ``rate``, ``seconds``, and for each noise the ``validation`` loss over the loss of the constant
        prediction of no stretch and no noise, with its parts.

    Raises
    ------
    OptionError
        If there are no items, the folder has a run and ``resume`` is false, or has none and ``resume`` is true.
    WeightsError
        If the checkpoint is damaged or of another run, or the initial weights are of another network.
    DivergedError
        If a loss is not finite; the last checkpoint is kept.
    MeshFileError
        If an item cannot be read, or a file cannot be written.
    KeyboardInterrupt
        After SIGTERM or Ctrl-C, once the state is saved.

    Notes
    -----
    It handles signals, so it must be called in the main thread. The order and noise of items depend only on the seed,
    the epoch and the step, so a checkpoint has no generator state. Checkpoints are written every few minutes, after
    each epoch, and on SIGTERM and Ctrl-C. ``weights.safetensors`` is of the epoch with the best validation, or of the
    last one. Under torchrun every process takes a share of each batch, and the first one validates and writes the
    files.
    """
    out = Path(options.out)
    if not files.training or not files.validation:
        raise OptionError("the data set has no items for training, or none for validation")
    if (out / CHECKPOINT).exists() and not resume:
        raise OptionError(f"{out} has a run already; continue it with --resume, or name another folder")
    if resume and not (out / CHECKPOINT).exists():
        raise OptionError(f"{out} has no run to continue; start it without --resume")
    out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(options.seed)
    task = task_of(options)
    with Interruption() as interruption, deterministic(), training_process() as process:
        network = _initial_network(task, "" if resume else options.start)
        network = network.to(resolve_device(options.device, process.local_rank))
        optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.weight_decay)
        run = TrainingRun(options, task, files, network, optimiser, process)
        if resume:
            run.load()
        process.wait()  # before the first process writes the files that the others look for
        while run.at.epoch < options.epochs:
            row = run.epoch(interruption)
            if process.is_first:
                on_row(row)
        return run.rows()


def _initial_network(task: Task, start: str) -> Any:
    """Return a network with random weights, or with the weights ``start`` if it is not empty.

    Raises
    ------
    WeightsError
        If these are weights of a network of another kind or size.
    """
    network = task.network()
    if start:
        other = load_weights(weights_path(start))[0]
        if other.options != network.options:
            raise WeightsError(f"{start} has the weights of a network of another kind or size: {other.options}")
        network.load_state_dict(other.state_dict())
    return network

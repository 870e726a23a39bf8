"""Training: epochs of steps, checkpoints, validation, and a list of what was measured."""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import torch

from anisomesh.errors import OptionError
from anisomesh.learn.checkpoint import WeightsError, load_state, load_weights, save_state, save_weights
from anisomesh.learn.config import TrainingOptions
from anisomesh.learn.device import device_of
from anisomesh.learn.events import Events
from anisomesh.learn.items import load_item
from anisomesh.learn.manifest import Files
from anisomesh.learn.shipped import weights_path
from anisomesh.learn.tasks import Task, task_of
from anisomesh.learn.workers import Workers, workers
from anisomesh.surface.files import atomic_path

CHECKPOINT, WEIGHTS = "checkpoint.safetensors", "weights.safetensors"
METRICS, EVENTS = "metrics.jsonl", "events"
VALIDATION_NOISE = (0.0, 0.3)  # mean edge lengths

Row = dict[str, Any]


@dataclass
class _Position:
    """Where a run is: epochs done, steps done of the next one, the sum of their losses, and the best validation."""

    epoch: int = 0
    step: int = 0
    total: float = 0.0
    best: float = math.inf


def train(
    options: TrainingOptions, files: Files, *, resume: bool = False, on_row: Callable[[Row], None] = lambda row: None
) -> list[Row]:
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
        If there are no items, or the folder has a run and ``resume`` is not given.

    Notes
    -----
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
    out.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(options.seed)
    task = task_of(options)
    with _Interruption() as interrupted, _deterministic(), workers() as group:
        network = _network(task, options.start).to(device_of(options.device, group.local_rank))
        optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.weight_decay)
        run = _Run(options, task, files, network, optimiser, out, group)
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


@contextmanager
def _deterministic() -> Iterator[None]:
    """Have torch take sums in the same order every time, for any number of threads, until the end of the block.

    On a GPU it warns where it cannot.
    """
    before = torch.are_deterministic_algorithms_enabled()
    torch.use_deterministic_algorithms(True, warn_only=torch.cuda.is_available())
    try:
        yield
    finally:
        torch.use_deterministic_algorithms(before)


class _Interruption:
    """Whether SIGTERM or SIGINT has come; until the end of the block they do nothing else."""

    def __init__(self) -> None:
        self.came = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> _Interruption:
        for number in (signal.SIGTERM, signal.SIGINT):
            self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True


class _Run:
    """The state of a run and its files."""

    def __init__(
        self,
        options: TrainingOptions,
        task: Task,
        files: Files,
        network: Any,
        optimiser: torch.optim.Optimizer,
        out: Path,
        group: Workers,
    ) -> None:
        self.options, self.task, self.files, self.out = options, task, files, out
        self.network, self.optimiser, self.group = network, optimiser, group
        self.at = _Position()
        self._events = Events(out / EVENTS)
        self._steps = max(1, math.ceil(len(files.training) / options.batch))

    def epoch(self, interrupted: _Interruption) -> Row:
        """Go to the end of the epoch, save what it takes to go on, and return its row."""
        options, start = self.options, time.monotonic()
        saved = start
        order = np.random.default_rng([options.seed, self.at.epoch]).permutation(len(self.files.training))
        while self.at.step < self._steps:
            chosen = order[self.at.step * options.batch : (self.at.step + 1) * options.batch]
            self.at.total += self._step(chosen)
            self.at.step += 1
            came = self.group.total(interrupted.came) > 0.0
            if came or time.monotonic() - saved > 60.0 * options.minutes:
                self.save()
                saved = time.monotonic()
            if came:
                raise KeyboardInterrupt
        row: Row = {
            "epoch": self.at.epoch + 1,
            "loss": self.at.total / self._steps,
            "rate": self._rate(self.at.epoch * self._steps + self._steps),
        }
        self.at.epoch, self.at.step, self.at.total = self.at.epoch + 1, 0, 0.0
        if self.group.is_first:
            self._conclude(row, start)
        self.group.wait()
        return row

    def _conclude(self, row: Row, start: float) -> None:
        """Validate, and write weights, measurements and checkpoint at the end of an epoch."""
        row |= {**self.validate(), "seconds": round(time.monotonic() - start, 1)}
        score = sum(value for name, value in row.items() if name.startswith("validation"))
        if score < self.at.best:
            self.at.best = score
            facts = {name: row[name] for name in row if name != "seconds"} | {"training": asdict(self.options)}
            save_weights(self.network, self.out / WEIGHTS, facts)
        rows = [*(known for known in self.rows() if known["epoch"] < row["epoch"]), row]
        with atomic_path(self.out / METRICS) as temporary:
            Path(temporary).write_text("".join(json.dumps(entry) + "\n" for entry in rows), encoding="utf-8")
        self._events.add(row)
        self.save()

    def validate(self) -> Row:
        """Return the mean losses on the validation items at each noise.

        Of each noise the sum, over that of predicting nothing, and then every loss as it is.
        """
        self.network.eval()
        found = {}
        with torch.no_grad():
            for noise in VALIDATION_NOISE:
                sums: dict[str, float] = {}
                nothing = 0.0
                for number, path in enumerate(self.files.validation):
                    rng = np.random.default_rng([self.options.seed, number])
                    example = self.task.example(load_item(path), noise, rng, training=False)
                    for name, value in self.task.losses(self.network, example).items():
                        sums[name] = sums.get(name, 0.0) + float(value)
                    nothing += sum(map(float, self.task.losses_of_nothing(example).values()))
                found[f"validation {noise:g}"] = sum(sums.values()) / max(nothing, 1e-30)
                found |= {f"{name} {noise:g}": value / len(self.files.validation) for name, value in sums.items()}
        self.network.train()
        return found

    def rows(self) -> list[Row]:
        """Return the rows of the epochs done."""
        path = self.out / METRICS
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        return [row for row in map(json.loads, lines) if row["epoch"] <= self.at.epoch]

    def save(self) -> None:
        """Write the checkpoint, in the first process."""
        if not self.group.is_first:
            return
        state = {"at": asdict(self.at), "training": asdict(self.options), "items": self._items()}
        save_state(self.out / CHECKPOINT, self.network, self.optimiser, state)

    def load(self) -> None:
        """Go to where the checkpoint is.

        Raises
        ------
        WeightsError
            If it is of another run.
        """
        state = load_state(self.out / CHECKPOINT, self.network, self.optimiser)
        mine = asdict(self.options)
        other = [
            name
            for name, value in state["training"].items()
            if name not in ("out", "data", "device") and mine.get(name) != value
        ]
        if other or state["items"] != self._items():
            what = f"another {', '.join(other)}" if other else "other items"
            raise WeightsError(f"{self.out / CHECKPOINT} is of a run with {what}; name another folder")
        self.at = _Position(**state["at"])

    def _step(self, chosen: np.ndarray[Any, Any]) -> float:
        """Make one step with these items and return their mean loss."""
        options = self.options
        self.optimiser.zero_grad()
        total = 0.0
        for number in chosen.tolist()[self.group.rank :: self.group.size]:
            rng = np.random.default_rng([options.seed, self.at.epoch, number])
            noise = options.noise * rng.random() if rng.random() < options.noise_share else 0.0
            example = self.task.example(load_item(self.files.training[number]), noise, rng, training=True)
            losses = self.task.losses(self.network, example)
            loss = torch.stack(list(losses.values())).sum() / len(chosen)
            loss.backward()  # type: ignore[no-untyped-call]
            total += float(loss.detach())
        self.group.sum_gradients(self.network.parameters())
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), options.clip)
        for group in self.optimiser.param_groups:
            group["lr"] = self._rate(self.at.epoch * self._steps + self.at.step)
        self.optimiser.step()
        return self.group.total(total)

    def _rate(self, step: int) -> float:
        """Return the learning rate at a step of the whole run."""
        total = max(self.options.epochs * self._steps, 1)
        rise = min(1.0, (step + 1) / max(self.options.warmup, 1))
        return self.options.rate * rise * 0.5 * (1.0 + math.cos(math.pi * min(step / total, 1.0)))

    def _items(self) -> list[str]:
        return sorted(path.name for path in [*self.files.training, *self.files.validation])

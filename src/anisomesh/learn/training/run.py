"""One training run: optimisation steps, epochs, checkpoints, validation, and the rows of measurements."""

from __future__ import annotations

import json
import math
import signal
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import torch

from anisomesh.errors import AnisomeshError
from anisomesh.io.atomic import atomic_path
from anisomesh.learn.data.items import load_item
from anisomesh.learn.data.manifest import ItemFiles
from anisomesh.learn.models.checkpoint import load_state, save_state, save_weights
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.events import EventLog
from anisomesh.learn.training.processes import TrainingProcess
from anisomesh.learn.training.tasks import Task
from anisomesh.learn.weights_file import WeightsError

CHECKPOINT, WEIGHTS = "checkpoint.safetensors", "weights.safetensors"
METRICS, EVENTS = "metrics.jsonl", "events"
HALVING_PERIODS = 6
"""Parts of a run with a constant learning rate: the paper halves it each 100 of 600 epochs."""

_PATH_OPTIONS = ("data", "out", "start")  # may differ between machines
_FREE_OPTIONS = (*_PATH_OPTIONS, "device", "minutes")  # may differ when a run is resumed

EpochRow = dict[str, Any]
"""Measurements of an epoch by name, see :func:`anisomesh.learn.training.train.train`."""


class DivergedError(AnisomeshError):
    """The loss of a training run is not finite."""


@dataclass
class _Position:
    """Finished epochs, finished steps of the next epoch, the sum of their losses, and the best validation score."""

    epoch: int = 0
    step: int = 0
    total: float = 0.0
    best: float = math.inf


class Interruption:
    """Context in which SIGTERM and SIGINT only set the flag ``requested``."""

    def __init__(self) -> None:
        self.requested = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        for number in (signal.SIGTERM, signal.SIGINT):
            self._before[number] = signal.signal(number, self._request)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _request(self, number: int, frame: FrameType | None) -> None:
        self.requested = True


class TrainingRun:
    """The state of a run, with its files in the folder ``options.out``."""

    def __init__(
        self,
        options: TrainingOptions,
        task: Task,
        files: ItemFiles,
        network: Any,
        optimiser: torch.optim.Optimizer,
        process: TrainingProcess,
    ) -> None:
        self.options, self.task, self.files, self.out = options, task, files, Path(options.out)
        self.network, self.optimiser, self.process = network, optimiser, process
        self.at = _Position()
        self._events = EventLog(self.out / EVENTS)
        self._n_examples = len(files.training) * task.copies
        self._steps = max(1, math.ceil(self._n_examples / options.batch))

    def epoch(self, interruption: Interruption) -> EpochRow:
        """Train to the end of the epoch, validate, save, and return the row of the epoch.

        Raises
        ------
        KeyboardInterrupt
            After an interruption, once the state is saved.
        DivergedError
            If the loss is not finite.
        """
        options, start = self.options, time.monotonic()
        saved = start
        order = np.random.default_rng([options.seed, self.at.epoch]).permutation(self._n_examples)
        while self.at.step < self._steps:
            chosen = order[self.at.step * options.batch : (self.at.step + 1) * options.batch]
            self.at.total += self._step(chosen)
            self.at.step += 1
            stop = self.process.total(interruption.requested) > 0.0
            if stop or time.monotonic() - saved > 60.0 * options.minutes:
                self.save()
                saved = time.monotonic()
            if stop:
                raise KeyboardInterrupt
        row: EpochRow = {
            "epoch": self.at.epoch + 1,
            "loss": self.at.total / self._steps,
            "rate": self.rate(self.at.epoch * self._steps + self._steps),
        }
        self.save()  # before the validation, which may take long
        self.at.epoch, self.at.step, self.at.total = self.at.epoch + 1, 0, 0.0
        if self.process.is_first:
            self._finish_epoch(row, start, interruption)
        self.process.wait()
        return row

    def validate(self, interruption: Interruption) -> EpochRow:
        """Return the losses on the validation items for each noise.

        For each noise the sum of the losses over the sum of the baseline losses, and the mean of each loss.

        Raises
        ------
        KeyboardInterrupt
            After an interruption.
        """
        self.network.eval()
        found = {}
        with torch.no_grad():
            for noise in self.task.validation_noise:
                sums: dict[str, float] = {}
                baseline = 0.0
                for number, path in enumerate(self.files.validation):
                    if interruption.requested:
                        raise KeyboardInterrupt
                    rng = np.random.default_rng([self.options.seed, number])
                    example = self.task.example(load_item(path), noise, rng, training=False)
                    for name, value in self.task.losses(self.network, example).items():
                        sums[name] = sums.get(name, 0.0) + float(value)
                    baseline += sum(map(float, self.task.baseline_losses(example).values()))
                found[f"validation {noise:g}"] = sum(sums.values()) / max(baseline, 1e-30)
                found |= {f"{name} {noise:g}": value / len(self.files.validation) for name, value in sums.items()}
        self.network.train()
        return found

    def rows(self) -> list[EpochRow]:
        """Return the rows of the finished epochs."""
        path = self.out / METRICS
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        return [row for row in map(json.loads, lines) if row["epoch"] <= self.at.epoch]

    def rate(self, step: int) -> float:
        """Return the learning rate at a step, counted from the start of the run: linear warm-up times the schedule."""
        total = max(self.options.epochs * self._steps, 1)
        rise = min(1.0, (step + 1) / max(self.options.warmup, 1))
        if self.options.schedule == "halving":
            fall = 0.5 ** min(HALVING_PERIODS * step // total, HALVING_PERIODS - 1)
        else:
            fall = 0.5 * (1.0 + math.cos(math.pi * min(step / total, 1.0)))
        return self.options.rate * rise * fall

    def save(self) -> None:
        """Write the checkpoint, in the first process."""
        if not self.process.is_first:
            return
        state = {"at": asdict(self.at), "training": asdict(self.options), "items": self._item_names()}
        save_state(self.out / CHECKPOINT, self.network, self.optimiser, state)

    def load(self) -> None:
        """Restore the state from the checkpoint.

        Raises
        ------
        WeightsError
            If the checkpoint is damaged, or of a run with other options or items.
        """
        state = load_state(self.out / CHECKPOINT, self.network, self.optimiser)
        mine = asdict(self.options)
        other = [
            name for name, value in state["training"].items() if name not in _FREE_OPTIONS and mine.get(name) != value
        ]
        if other or state["items"] != self._item_names():
            what = f"another {', '.join(other)}" if other else "other items"
            raise WeightsError(f"{self.out / CHECKPOINT} is of a run with {what}; name another folder")
        self.at = _Position(**state["at"])

    def _finish_epoch(self, row: EpochRow, start: float, interruption: Interruption) -> None:
        """Validate, complete the row, and write the weights if they are the best, the rows and the checkpoint."""
        row |= {**self.validate(interruption), "seconds": round(time.monotonic() - start, 1)}
        score = sum(value for name, value in row.items() if name.startswith("validation"))
        better = score < self.at.best
        self.at.best = min(self.at.best, score)
        if better or self.options.keep == "last":
            training = {name: value for name, value in asdict(self.options).items() if name not in _PATH_OPTIONS}
            facts = {name: row[name] for name in row if name != "seconds"} | {"training": training}
            save_weights(self.network, self.out / WEIGHTS, facts)
        rows = [*(known for known in self.rows() if known["epoch"] < row["epoch"]), row]
        with atomic_path(self.out / METRICS) as temporary:
            Path(temporary).write_text("".join(json.dumps(entry) + "\n" for entry in rows), encoding="utf-8")
        self.save()
        self._events.add(row)

    def _example(self, number: int) -> Any:
        """Return an example of this epoch, by its number among all items and copies of them."""
        options = self.options
        rng = np.random.default_rng([options.seed, self.at.epoch, number])
        noise = options.noise * rng.random() if rng.random() < options.noise_share else 0.0
        item, copy = divmod(number, self.task.copies)
        return self.task.example(load_item(self.files.training[item]), noise, rng, training=True, copy=copy)

    def _step(self, chosen: np.ndarray[Any, Any]) -> float:
        """Take one optimisation step on the items with these numbers and return their mean loss."""
        options = self.options
        self.optimiser.zero_grad()
        total = 0.0
        examples = map(self._example, chosen.tolist()[self.process.rank :: self.process.size])
        for losses in self.task.training_losses(self.network, examples):
            loss = torch.stack(list(losses.values())).sum() / len(chosen)
            loss.backward()  # type: ignore[no-untyped-call]
            total += float(loss.detach())
        mean = self.process.total(total)
        if not math.isfinite(mean):
            where = f"epoch {self.at.epoch + 1}, step {self.at.step + 1} of {self._steps}"
            raise DivergedError(f"the loss is {mean} in {where}; train with a lower rate or a smaller clip")
        self.process.sum_gradients(self.network.parameters())
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), options.clip)
        for group in self.optimiser.param_groups:
            group["lr"] = self.rate(self.at.epoch * self._steps + self.at.step)
        self.optimiser.step()
        return mean

    def _item_names(self) -> list[list[str]]:
        return [[path.name for path in paths] for paths in (self.files.training, self.files.validation)]

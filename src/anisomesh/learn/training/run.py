"""One training run: steps and epochs, checkpoints, validation, and the list of what was measured."""

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
from anisomesh.learn.data.manifest import Files
from anisomesh.learn.models.checkpoint import WeightsError, load_state, save_state, save_weights
from anisomesh.learn.training.config import TrainingOptions
from anisomesh.learn.training.events import Events
from anisomesh.learn.training.processes import Workers
from anisomesh.learn.training.tasks import Task

CHECKPOINT, WEIGHTS = "checkpoint.safetensors", "weights.safetensors"
METRICS, EVENTS = "metrics.jsonl", "events"
VALIDATION_NOISE = (0.0, 0.3)  # mean edge lengths

_PLACES = ("data", "out", "start")  # of one machine

EpochRow = dict[str, Any]


class DivergedError(AnisomeshError):
    """The loss of a training run is not a number any more."""


@dataclass
class _Position:
    """Where a run is: epochs done, steps done of the next one, the sum of their losses, and the best validation."""

    epoch: int = 0
    step: int = 0
    total: float = 0.0
    best: float = math.inf


class Interruption:
    """Whether SIGTERM or SIGINT has come; until the end of the block they do nothing else."""

    def __init__(self) -> None:
        self.came = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Interruption:
        for number in (signal.SIGTERM, signal.SIGINT):
            self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *error: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.came = True


class Run:
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

    def epoch(self, interrupted: Interruption) -> EpochRow:
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
        row: EpochRow = {
            "epoch": self.at.epoch + 1,
            "loss": self.at.total / self._steps,
            "rate": self._rate(self.at.epoch * self._steps + self._steps),
        }
        self.save()  # before the validation, which may take long
        self.at.epoch, self.at.step, self.at.total = self.at.epoch + 1, 0, 0.0
        if self.group.is_first:
            self._conclude(row, start, interrupted)
        self.group.wait()
        return row

    def _conclude(self, row: EpochRow, start: float, interrupted: Interruption) -> None:
        """Validate, and write weights, measurements and checkpoint at the end of an epoch."""
        row |= {**self.validate(interrupted), "seconds": round(time.monotonic() - start, 1)}
        score = sum(value for name, value in row.items() if name.startswith("validation"))
        if score < self.at.best:
            self.at.best = score
            how = {name: value for name, value in asdict(self.options).items() if name not in _PLACES}
            facts = {name: row[name] for name in row if name != "seconds"} | {"training": how}
            save_weights(self.network, self.out / WEIGHTS, facts)
        rows = [*(known for known in self.rows() if known["epoch"] < row["epoch"]), row]
        with atomic_path(self.out / METRICS) as temporary:
            Path(temporary).write_text("".join(json.dumps(entry) + "\n" for entry in rows), encoding="utf-8")
        self.save()
        self._events.add(row)

    def validate(self, interrupted: Interruption) -> EpochRow:
        """Return the mean losses on the validation items at each noise, unless a signal comes meanwhile.

        Of each noise the sum, over that of predicting nothing, and then every loss as it is.
        """
        self.network.eval()
        found = {}
        with torch.no_grad():
            for noise in VALIDATION_NOISE:
                sums: dict[str, float] = {}
                nothing = 0.0
                for number, path in enumerate(self.files.validation):
                    if interrupted.came:
                        raise KeyboardInterrupt
                    rng = np.random.default_rng([self.options.seed, number])
                    example = self.task.example(load_item(path), noise, rng, training=False)
                    for name, value in self.task.losses(self.network, example).items():
                        sums[name] = sums.get(name, 0.0) + float(value)
                    nothing += sum(map(float, self.task.losses_of_nothing(example).values()))
                found[f"validation {noise:g}"] = sum(sums.values()) / max(nothing, 1e-30)
                found |= {f"{name} {noise:g}": value / len(self.files.validation) for name, value in sums.items()}
        self.network.train()
        return found

    def rows(self) -> list[EpochRow]:
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
            if name not in (*_PLACES, "device", "minutes") and mine.get(name) != value
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
        mean = self.group.total(total)
        if not math.isfinite(mean):
            where = f"epoch {self.at.epoch + 1}, step {self.at.step + 1} of {self._steps}"
            raise DivergedError(f"the loss is {mean} in {where}; train with a lower rate, or a smaller clip")
        self.group.sum_gradients(self.network.parameters())
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), options.clip)
        for group in self.optimiser.param_groups:
            group["lr"] = self._rate(self.at.epoch * self._steps + self.at.step)
        self.optimiser.step()
        return mean

    def _rate(self, step: int) -> float:
        """Return the learning rate at a step of the whole run."""
        total = max(self.options.epochs * self._steps, 1)
        rise = min(1.0, (step + 1) / max(self.options.warmup, 1))
        return self.options.rate * rise * 0.5 * (1.0 + math.cos(math.pi * min(step / total, 1.0)))

    def _items(self) -> list[list[str]]:
        return [[path.name for path in paths] for paths in (self.files.training, self.files.validation)]

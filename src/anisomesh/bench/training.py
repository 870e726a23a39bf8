"""Training of the networks that a suite compares, before its first run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from anisomesh.bench.suite import Suite, SuiteMethod
from anisomesh.errors import OptionError
from anisomesh.learn import require_torch


def train_networks(
    suite: Suite, out: Path, items: Path | None, on_epoch: Callable[[str], None] = lambda text: None
) -> dict[str, Path]:
    """Train the networks of a suite unless they are trained already; return their weights by method name.

    Parameters
    ----------
    suite
        The suite; only methods with a training have weights.
    out
        Folder with a folder for each training; stopped trainings are resumed.
    items
        Folder of the data set.
    on_epoch
        Called with a line of text after every epoch.

    Raises
    ------
    OptionError
        If there is a network to train but no data set, or a training has an unknown key.
    LearningError, WeightsError, DivergedError, MeshFileError
        If torch is missing, a checkpoint or the data set is damaged, or a loss is not finite.
    """
    methods = [method for method in suite.methods if method.training is not None]
    if not methods:
        return {}
    if items is None:
        raise OptionError(f"suite {suite.name} trains networks; name a data set with --items")
    require_torch()
    from anisomesh.learn.data.manifest import files_of
    from anisomesh.learn.training.config import TrainingOptions, parse_training
    from anisomesh.learn.training.run import CHECKPOINT, WEIGHTS
    from anisomesh.learn.training.train import train

    files = files_of(items)
    runs: dict[str, TrainingOptions] = {}
    for method in methods:  # check all tables before the first training
        table = {"data": str(items), "out": "", **(method.training or {})}
        options = parse_training(f"{suite.name}: training of {method.name!r}", table)
        runs[method.name] = replace(options, out=str(out / _folder(method)))
    found = {}
    for name, options in runs.items():

        def tell(row: dict[str, object], name: str = name, epochs: int = options.epochs) -> None:
            on_epoch(f"{name}: epoch {row['epoch']} of {epochs}, loss {row['loss']:.4f}")

        folder = Path(options.out)
        train(options, files, resume=(folder / CHECKPOINT).exists(), on_row=tell)
        found[name] = folder / WEIGHTS
    return found


def _folder(method: SuiteMethod) -> str:
    """Return a folder name that depends on all settings of the training."""
    mark = hashlib.sha256(json.dumps([method.name, method.training], sort_keys=True).encode()).hexdigest()[:8]
    return "".join(letter if letter.isalnum() else "-" for letter in method.name) + "-" + mark

"""Networks that a suite compares: trained before the first run, each in a folder of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from anisomesh.batch.suite import Suite
from anisomesh.errors import OptionError
from anisomesh.learn import require_torch


def trained(
    suite: Suite, out: Path, items: Path | None, on_epoch: Callable[[str], None] = lambda text: None
) -> dict[str, Path]:
    """Return the weights of the networks of a suite by the names of its methods, trained where they are not there.

    Parameters
    ----------
    suite
        The suite; methods without a training have no weights.
    out
        Folder of the trainings; those that were stopped go on.
    items
        Folder of the data set.
    on_epoch
        Called with a line of text after every epoch.

    Raises
    ------
    OptionError
        If there is something to train and no data set, or a training has an unknown key.
    """
    methods = [method for method in suite.methods if method.training is not None]
    if not methods:
        return {}
    if items is None:
        raise OptionError(f"suite {suite.name} trains networks; name a data set with --items")
    require_torch()
    from anisomesh.learn.config import parse_training
    from anisomesh.learn.manifest import files_of
    from anisomesh.learn.train import CHECKPOINT, WEIGHTS, train

    found = {}
    files = files_of(items)
    for method in methods:
        folder = out / "".join(letter if letter.isalnum() else "-" for letter in method.name)
        table = {"data": str(items), "out": str(folder), **(method.training or {})}
        options = parse_training(f"{suite.name}: training of {method.name!r}", table)

        def tell(row: dict[str, object], name: str = method.name, epochs: int = options.epochs) -> None:
            on_epoch(f"{name}: epoch {row['epoch']} of {epochs}, loss {row['loss']:.4f}")

        train(options, files, resume=(folder / CHECKPOINT).exists(), on_row=tell)
        found[method.name] = folder / WEIGHTS
    return found

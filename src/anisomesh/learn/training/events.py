"""Measurements of a training run for TensorBoard, where that is installed."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any


class Events:
    """Writes rows of measurements as scalars into a folder that TensorBoard reads; without TensorBoard, nothing."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._writer: Any = None

    def add(self, row: dict[str, Any]) -> None:
        """Write the numbers of a row at its epoch; what an earlier process wrote of later epochs is no longer shown."""
        if importlib.util.find_spec("tensorboard") is None:
            return
        if self._writer is None:
            from torch.utils.tensorboard import SummaryWriter

            self._writer = SummaryWriter(str(self._folder), purge_step=row["epoch"])
        for name, value in row.items():
            if name != "epoch":
                self._writer.add_scalar(name, value, row["epoch"])
        self._writer.flush()

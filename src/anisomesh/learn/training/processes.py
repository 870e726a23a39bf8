"""The processes that train a network together, as torchrun starts them, or a single one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta

import torch
import torch.distributed as distributed
from torch import nn

_COLLECTIVE_TIMEOUT = timedelta(days=1)  # heuristic: longer than a validation, which the first process does alone


@dataclass(frozen=True)
class TrainingProcess:
    """The calling process: its rank, the number of processes, and its rank on this machine."""

    rank: int = 0
    size: int = 1
    local_rank: int = 0

    @property
    def is_first(self) -> bool:
        """Whether this process validates and writes files."""
        return self.rank == 0

    def sum_gradients(self, parameters: Iterable[nn.Parameter]) -> None:
        """Replace the gradients by their sums over all processes; a missing gradient counts as zero."""
        if self.size == 1:
            return
        gradients = []
        for parameter in parameters:
            if parameter.grad is None:
                parameter.grad = torch.zeros_like(parameter)
            gradients.append(parameter.grad)
        flat = torch.cat([gradient.ravel() for gradient in gradients]).cpu()
        distributed.all_reduce(flat)
        start = 0
        for gradient in gradients:
            gradient.copy_(flat[start : start + gradient.numel()].view_as(gradient))
            start += gradient.numel()

    def total(self, value: float) -> float:
        """Return the sum of a number over all processes."""
        if self.size == 1:
            return value
        summed = torch.tensor([value], dtype=torch.float64)
        distributed.all_reduce(summed)
        return float(summed)

    def wait(self) -> None:
        """Wait until all processes call this."""
        if self.size > 1:
            distributed.barrier()


@contextmanager
def training_process() -> Iterator[TrainingProcess]:
    """Yield this process, connected by gloo to the others that torchrun has started, if any."""
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        yield TrainingProcess()
        return
    distributed.init_process_group("gloo", timeout=_COLLECTIVE_TIMEOUT)
    try:
        local_rank = int(os.environ.get("LOCAL_RANK", "0"))
        yield TrainingProcess(rank=distributed.get_rank(), size=size, local_rank=local_rank)
    finally:
        distributed.destroy_process_group()

"""Devices of torch, and reproducible sums on them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from anisomesh.errors import OptionError


def resolve_device(name: str, rank: int = 0) -> torch.device:
    """Return the device of a name.

    Parameters
    ----------
    name
        A torch device. ``"cuda"`` gives each process a GPU of its own as far as there are enough; ``"auto"`` does so
        where there is a GPU, and is the CPU elsewhere.
    rank
        Rank of this process on this machine.

    Raises
    ------
    OptionError
        If the device does not exist or cannot be used.
    """
    if name in ("auto", "cuda"):
        count = torch.cuda.device_count() if torch.cuda.is_available() else 0
        name = f"cuda:{rank % count}" if count else {"auto": "cpu"}.get(name, name)
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:  # torch without CUDA asserts
        reason = str(error).strip().splitlines()[0]
        raise OptionError(f"device {name!r} cannot be used here: {reason}") from error
    return device


@contextmanager
def deterministic() -> Iterator[None]:
    """Use deterministic torch algorithms within the block, so that results are reproducible for any number of threads.

    On a GPU torch warns about operations without such an algorithm.
    """
    before = torch.get_deterministic_debug_mode()
    # torch.use_deterministic_algorithms also imports the compiler of torch, which takes seconds
    torch.set_deterministic_debug_mode("warn" if torch.cuda.is_available() else "error")
    try:
        yield
    finally:
        torch.set_deterministic_debug_mode(before)

"""Where networks run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import torch

from anisomesh.errors import OptionError


def device_of(name: str, rank: int = 0) -> torch.device:
    """Return the device of this name.

    Parameters
    ----------
    name
        As torch names it; ``"cuda"`` is a GPU for each process, ``"auto"`` the same where there is one, else the CPU.
    rank
        Number of the process on this machine.

    Raises
    ------
    OptionError
        If there is no such device.
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
    """Have torch take sums in the same order every time, for any number of threads, until the end of the block.

    On a GPU it warns where it cannot.
    """
    before = torch.are_deterministic_algorithms_enabled()
    torch.use_deterministic_algorithms(True, warn_only=torch.cuda.is_available())
    try:
        yield
    finally:
        torch.use_deterministic_algorithms(before)

"""Where networks run."""

from __future__ import annotations

import torch

from anisomesh.errors import OptionError


def device_of(name: str, rank: int = 0) -> torch.device:
    """Return the device of this name.

    Parameters
    ----------
    name
        As torch names it, or ``"auto"``: a GPU where there is one, each process its own, else the CPU.
    rank
        Number of the process on this machine.

    Raises
    ------
    OptionError
        If there is no such device.
    """
    if name == "auto":
        count = torch.cuda.device_count() if torch.cuda.is_available() else 0
        name = f"cuda:{rank % count}" if count else "cpu"
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:  # torch without CUDA asserts
        reason = str(error).strip().splitlines()[0]
        raise OptionError(f"device {name!r} cannot be used here: {reason}") from error
    return device

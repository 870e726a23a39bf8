"""Selection of one member per group."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]


def first_of_each(groups: npt.NDArray[np.integer[Any]], order: Ints) -> tuple[Ints, Ints]:
    """Return the groups that occur (G,), ascending, and the member of each that is first in an order (G,).

    Parameters
    ----------
    groups
        Group of each member (n,).
    order
        Members in order of preference (m,); members that are not listed are never chosen.
    """
    names, first = np.unique(groups[order], return_index=True)
    return names.astype(np.int64), order[first]

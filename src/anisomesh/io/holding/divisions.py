"""Divisions into regions, for formats that hold one, and their labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Integers
from anisomesh.io.holding.losses import Losses

_PREFERRED = ("physical", "material", "group", "object", "solid", "node", "reference")  # divisions, if one is kept


def main_division(regions: Mapping[str, Regions], *preferred: str) -> tuple[str, Regions] | None:
    """Return the division for a format that holds one: one of these names, else the most telling one."""
    wanted = (*preferred, *_PREFERRED, *sorted(regions))
    return next(((name, regions[name]) for name in wanted if name in regions), None)


def held_division(
    regions: Mapping[str, Regions], what: str, losses: Losses, *preferred: str, with_names: bool = False
) -> Regions | None:
    """Return the one division of features or fixed points that a format holds, if any has a label; others are lost.

    Parameters
    ----------
    regions
        All divisions.
    what
        :data:`OF_FEATURES` or :data:`OF_FIXED_POINTS`.
    losses
        What is lost is added here.
    preferred
        Names of divisions as for :func:`main_division`.
    with_names
        Whether the format holds names.
    """
    given = {name: division for name, division in regions.items() if division.labels.any()}
    found = main_division(given, *preferred)
    losses.add(what, *(name for name in given if found is None or name != found[0]))
    if found is not None and found[1].names and not with_names:
        losses.add(f"names of {what}", found[0])
    return None if found is None else found[1]


def by_label(*labels: Integers) -> list[tuple[tuple[int, ...], Integers]]:
    """Return the faces (n,) with each combination of labels (F,), in the order of the labels."""
    order = np.lexsort(labels[::-1])
    table = np.stack(labels, axis=1)[order]
    begin = np.flatnonzero((np.diff(table, axis=0, prepend=table[:1] - 1) != 0).any(axis=1))
    keys = [tuple(row) for row in table[begin].tolist()]
    return list(zip(keys, np.split(order.astype(np.int64), begin[1:]), strict=True))


def regions_as_integers(mesh: Mesh, divisions: Sequence[str]) -> dict[str, Integers]:
    """Return the labels of divisions in the smallest of int32 and int64 that holds them."""
    return {name: narrowed(mesh.regions[name].labels) for name in divisions}


def narrowed(labels: Integers) -> Integers:
    """Return labels (n,) in the smallest of int32 and int64 that holds them."""
    return labels.astype(np.int32) if fits_int32(labels) else labels


def fits_int32(labels: Integers) -> bool:
    """Return whether int32 holds all labels (n,)."""
    limits = np.iinfo(np.int32)
    return len(labels) == 0 or bool(labels.min() >= limits.min and labels.max() <= limits.max)

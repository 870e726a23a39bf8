"""Physical groups of elements that are in several of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Integers

PHYSICAL = "physical"
"""Name of the division into physical groups."""

_MOST_DIVISIONS = 8  # into physical groups that overlap; heuristic
_FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F], dtype=np.uint64)  # odd numbers with mixed bits
_SHIFT = np.uint64(31)


class Block(NamedTuple):
    """Elements of a type.

    Attributes
    ----------
    kind
        The type.
    nodes
        Tags of nodes (n, k).
    source
        Numbers of the cells (n,) of the file.
    tags
        Number and geometrical entity (n, 2).
    groups
        Physical groups (n, g), 0 for none.
    """

    kind: int
    nodes: Integers
    source: Integers
    tags: Integers
    groups: Integers


def division_name(number: int) -> str:
    """Return the name of a division into physical groups, by its number from 0."""
    return PHYSICAL if number == 0 else f"{PHYSICAL}_{number + 1}"


def stacked(groups: Sequence[Integers]) -> Integers:
    """Return physical groups of several blocks (n, g) as one array, as wide as the widest of them."""
    width = max([1, *(rows.shape[1] for rows in groups)])
    padded = [np.pad(rows, ((0, 0), (0, width - rows.shape[1]))) for rows in groups]
    return np.concatenate([np.zeros((0, width), dtype=np.int64), *padded])


def each_once(blocks: Sequence[Block]) -> tuple[list[Block], Integers]:
    """Return elements with all physical groups that they are in, each once.

    Also return the tags (n, 2) of the elements that are left out, and of the ones that they repeat.

    Version 2 has an element once for each of its groups. Elements are the same if they have a type, an entity and all
    nodes in common, but different groups; the first one is kept.
    """
    merged, repeats = [], [np.zeros((0, 2), dtype=np.int64)]
    for kind in dict.fromkeys(block.kind for block in blocks):
        chosen = [block for block in blocks if block.kind == kind]
        block = Block(
            kind=kind,
            nodes=np.concatenate([block.nodes for block in chosen]),
            source=np.concatenate([block.source for block in chosen]),
            tags=np.concatenate([block.tags for block in chosen]),
            groups=stacked([block.groups for block in chosen]),
        )
        candidates = _alike(block)
        if len(candidates):
            block, pairs = _joined(block, candidates)
            repeats.append(pairs)
        merged.append(block)
    return merged, np.concatenate(repeats)


def _alike(block: Block) -> Integers:
    """Return the rows (n,) of elements that may have entity and nodes in common with another, by a hash."""
    hashes = _hash(block.nodes).sum(axis=1, dtype=np.uint64) + _hash(-block.tags[:, 1])
    in_order = np.sort(hashes)
    repeated = in_order[1:][in_order[1:] == in_order[:-1]]
    return np.flatnonzero(np.isin(hashes, repeated)) if len(repeated) else np.zeros(0, dtype=np.int64)


def _hash(numbers: Integers) -> npt.NDArray[np.uint64]:
    """Return numbers with mixed bits, whose sums hardly ever agree by chance."""
    mixed = numbers.astype(np.uint64)
    for factor in _FACTORS:
        mixed = mixed * factor
        mixed ^= mixed >> _SHIFT
    return mixed


def _joined(block: Block, rows: Integers) -> tuple[Block, Integers]:
    """Return a block with the elements of these rows joined that are the same, and tags as of :func:`each_once`."""
    keys = np.column_stack([np.sort(block.nodes[rows], axis=1), block.tags[rows, 1]])
    key = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    group = block.groups[rows, 0]
    repetition = _place_among_equal(key, group)  # 0 unless an element is repeated with its group
    slot = _place_among_equal(key, repetition)
    order = np.lexsort((slot, repetition, key))
    starts = np.flatnonzero(slot[order] == 0)
    first = np.empty(len(rows), dtype=np.int64)
    first[order] = np.repeat(rows[order[starts]], np.diff(starts, append=len(rows)))
    groups = np.zeros((len(block.nodes), int(slot.max()) + 1), dtype=np.int64)
    groups[:, 0] = block.groups[:, 0]
    groups[first, slot] = group
    kept = np.ones(len(block.nodes), dtype=bool)
    kept[rows[slot > 0]] = False
    pairs = np.column_stack([block.tags[rows, 0], block.tags[first, 0]])[slot > 0]
    return Block(block.kind, block.nodes[kept], block.source[kept], block.tags[kept], groups[kept]), pairs


def _place_among_equal(*keys: Integers) -> Integers:
    """Return the place (n,), from 0, of each row among the ones that have the same keys (n,), in order."""
    order = np.lexsort(keys[::-1])
    is_first = np.ones(len(order), dtype=bool)
    is_first[1:] = np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)
    starts = np.flatnonzero(is_first)
    places = np.empty(len(order), dtype=np.int64)
    places[order] = np.arange(len(order)) - np.repeat(starts, np.diff(starts, append=len(order)))
    return places


def separate(groups: Integers) -> tuple[list[Integers], list[int]]:
    """Divide elements by their physical groups so that each group is as a whole in one division.

    Parameters
    ----------
    groups
        Physical groups (n, g), 0 for none.

    Returns
    -------
    divisions
        Labels (n,), one array for each division. Groups that do not overlap others are in the first one, as is what
        elements name first.
    left_out
        Groups that overlap too many others.
    """
    if not groups[:, 1:].any():
        return [groups[:, 0]], []
    overlapping: dict[int, set[int]] = {}
    for row in np.unique(groups, axis=0).tolist():
        for group in row:
            overlapping.setdefault(group, set()).update(row)
    numbers, first = np.unique(groups.T.ravel(), return_index=True)
    division_of = {0: 0}
    for group in numbers[np.argsort(first)].tolist():
        taken = {division_of[other] for other in overlapping[group] - {group, 0} if other in division_of}
        division_of.setdefault(group, next(k for k in range(len(taken) + 1) if k not in taken))
    place = np.array([division_of[group] for group in numbers.tolist()])[np.searchsorted(numbers, groups)]
    n_divisions = min(max(division_of.values()) + 1, _MOST_DIVISIONS)
    divisions = []
    for k in range(n_divisions):
        is_in = (place == k) & (groups != 0)
        chosen = groups[np.arange(len(groups)), is_in.argmax(axis=1)]
        divisions.append(np.where(is_in.any(axis=1), chosen, 0))
    left_out = [group for group, k in division_of.items() if k >= _MOST_DIVISIONS]
    return divisions, left_out

"""Regions as texts, for formats that have no numbers of regions, or not every name."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from anisomesh.attributes.model import Regions
from anisomesh.io.carried import Carried, Division, Integers
from anisomesh.io.holding.losses import EMPTY_REGIONS, Losses

_NUMBERED = "region_"  # in front of the number of a region without a name
_DIGITS = re.compile(r"-?\d{1,19}")  # of labels, which have 64 bits


def label_of(text: str) -> int | None:
    """Return the label that a text writes in digits, None if it is not an integer of 64 bits."""
    number = int(text) if _DIGITS.fullmatch(text) else None
    limits = np.iinfo(np.int64)
    return number if number is not None and limits.min <= number <= limits.max else None


def exactly(text: str) -> str:
    """Return a name as it is."""
    return text


def in_words(text: str) -> str:
    """Return a name with single blanks between its words, for formats that are read by words."""
    return " ".join(text.split()).rstrip("\\")


def in_a_line(text: str) -> str:
    """Return a name without line breaks."""
    return " ".join(text.split("\n"))


def also_named(carried: Carried, division: str, texts: Iterable[str]) -> None:
    """Add names of regions that a file gives, whether there is anything in these or not."""
    carried.named.setdefault(division, []).extend(text for text in texts if text and not is_number(text))


def empty_regions(regions: Regions) -> list[str]:
    """Return the names of regions that have no face, edge or point."""
    present = set(np.unique(regions.labels).tolist())
    return [text for label, text in regions.names.items() if text and label not in present]


def region_texts(
    regions: Regions, losses: Losses, written: Callable[[str], str] = exactly, *, distinct: bool = False
) -> dict[int, str]:
    """Return a text for each region, in the order of their labels: its name, or a text that has its number.

    Parameters
    ----------
    regions
        The regions.
    losses
        Names that the format changes are added, and names of regions with nothing in them.
    written
        Returns a name as the format can write it.
    distinct
        Whether regions with equal texts would become one, so that the second one's is made another.
    """
    texts: dict[int, str] = {}
    for label in np.unique(regions.labels).tolist():
        name = regions.names.get(label, "")
        text = written(name) or f"{_NUMBERED}{label}"
        is_taken = distinct and text in texts.values()
        texts[label] = f"{text}_{label}" if is_taken else text
        if name and is_taken:
            losses.renamed(name, texts[label])
        elif name and text != name:
            losses.changed(name)
    losses.add(EMPTY_REGIONS, *empty_regions(regions))
    return texts


def is_number(text: str) -> bool:
    """Return whether a text stands for a region without a name, by its number."""
    return _number(text) is not None


def _number(text: str) -> int | None:
    return label_of(text.removeprefix(_NUMBERED)) if text.startswith(_NUMBERED) else None


def numbered_regions(texts: Sequence[str], usual: Sequence[int]) -> tuple[list[int], dict[int, str]]:
    """Return the labels of regions with some texts, and the names of labels.

    Parameters
    ----------
    texts
        Their texts in the file, empty for none.
    usual
        The labels that they have unless their texts, as :func:`region_texts` makes them, say another.
    """
    given = [_number(text) for text in texts]
    given = [number if number not in given[:k] else None for k, number in enumerate(given)]
    taken = {number for number in given if number is not None}
    labels, names = [], {}
    for number, text, label in zip(given, texts, usual, strict=True):
        if number is None:
            while label in taken:
                label += 1
            taken.add(label)
            if text:
                names[label] = text
        labels.append(label if number is None else number)
    return labels, names


def quoted(text: str) -> str:
    """Return a text for the end of a line of words: as it is, or in quotes with escapes if it would not come back."""
    is_plain = text and text == " ".join(text.split()) and text.isprintable() and not text.startswith('"')
    return text if is_plain else json.dumps(text)


def unquoted(text: str) -> str:
    """Return the text that :func:`quoted` has made another of."""
    try:
        return str(json.loads(text)) if text.startswith('"') else text
    except ValueError:
        return text


def divide(carried: Carried, name: str, labels: Integers, texts: Sequence[str], usual: Sequence[int]) -> dict[int, int]:
    """Add a division of faces into regions that a file gives as texts.

    Parameters
    ----------
    carried
        The division is added here.
    name
        Name of the division.
    labels
        The region of each face (n,), as one of ``usual``.
    texts, usual
        As for :func:`numbered_regions`.

    Returns
    -------
    dict
        The label of each region by the usual one.
    """
    numbers, names = numbered_regions(texts, usual)
    label_of = dict(zip(usual, numbers, strict=True))
    codes, places = np.unique(labels, return_inverse=True)
    table = np.array([label_of.get(code, code) for code in codes.tolist()], dtype=np.int64)
    carried.divisions[name] = Division(labels=table[places.reshape(-1)], names=names)
    return label_of


def add_set(carried: Carried, division: str, name: str, chosen: Integers, n_cells: int) -> None:
    """Add a set of cells, which may overlap others, as a region of a division in which it does not.

    Parameters
    ----------
    carried
        The set is added here.
    division
        Name of the first division of such sets; further ones have a number. Cells in no set have the label 0.
    name
        Name of the set, empty for a region without a name.
    chosen
        Numbers of its cells (n,).
    n_cells
        Number of all cells.
    """
    number = 1
    while True:
        key = division if number == 1 else f"{division} {number}"
        found = carried.divisions.setdefault(key, Division(labels=np.zeros(n_cells, dtype=np.int64)))
        if not found.labels[chosen].any():
            label = int(found.labels.max(initial=0)) + 1
            found.labels[chosen] = label
            if name:
                found.names[label] = name
            return
        number += 1

"""Numbers in lines of text, with errors that name the line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.polygons import Integers

BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # of UTF-8
_LARGEST_WHOLE = 2.0**53  # beyond it, not every integer has a float64


def coordinates(
    lines: list[bytes], chosen: Integers, *, skip: int, numbers: Integers | None = None
) -> npt.NDArray[np.float64]:
    """Parse three coordinates (n, 3) after ``skip`` words of the chosen lines; ``numbers`` are the line numbers."""
    rows = [lines[k].partition(b"#")[0].split()[skip : skip + 3] for k in chosen]
    try:
        return np.array([list(map(float, row)) for row in rows], dtype=np.float64).reshape(len(rows), 3)
    except ValueError:
        bad = next(k for k, row in zip(chosen, rows, strict=True) if len(row) < 3 or not _all_numbers(row))
        number = bad if numbers is None else numbers[bad]
        raise ValueError(f"line {number + 1} should give three coordinates: {lines[bad][:60]!r}") from None


def integers(rows: list[list[bytes]], numbers: Integers) -> Integers:
    """Parse all words of rows with these line numbers as integers, concatenated."""
    try:
        return np.array([int(token) for row in rows for token in row], dtype=np.int64)
    except (ValueError, OverflowError):
        bad = next(k for k, row in enumerate(rows) if not all(re.fullmatch(rb"[+-]?\d{1,18}", word) for word in row))
        raise ValueError(f"line {numbers[bad] + 1} should give integers: {b' '.join(rows[bad])[:60]!r}") from None


def _all_numbers(words: Iterable[bytes]) -> bool:
    try:
        return len([float(word) for word in words]) > 0
    except ValueError:
        return False


def format_rows(pattern: str, table: npt.NDArray[Any]) -> str:
    """Return the rows of a table as lines; ``%r`` gives enough digits to restore the same float64."""
    return (pattern * len(table)) % tuple(table.ravel().tolist())


def whole(values: npt.NDArray[Any]) -> Integers:
    """Return numbers as int64; ValueError if one is not an integer or too large to be one."""
    if values.dtype.kind == "f" and not ((values == np.rint(values)) & (np.abs(values) < _LARGEST_WHOLE)).all():
        raise ValueError("malformed: a count, a tag or an index is not an integer")
    if values.dtype.kind == "u" and len(values) and values.max() > np.iinfo(np.int64).max:
        raise ValueError(f"malformed: a count or a tag is {values.max()}")
    return values.astype(np.int64)

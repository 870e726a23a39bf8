"""Texts and numbers of files: how they are decoded and parsed, with errors that name what is wrong."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.io.polygons import Integers

BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # of UTF-8
LINES_AT_ONCE = 100_000
"""Lines that are parsed at once, which limits memory."""

_END_MARKS = b"\0\x1a\t\n\r "
_MOST_CHARACTERS = 60  # characters of a text that a message repeats
_SPACE = ord(" ")  # codes up to it are white space, or make numbers malformed
_LARGEST_WHOLE = 2.0**53  # beyond it, not every integer has a float64


def text_of(data: bytes) -> str:
    """Return a text of a file, such as a name, that is in UTF-8, or else in Latin-1, as older programs write it."""
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def shown(data: bytes) -> str:
    """Return the beginning of a text of a file for a message, in quotes."""
    return repr(text_of(data)[:_MOST_CHARACTERS])


def span(counts: set[int]) -> str:
    """Return a number, or the smallest and the largest of several."""
    return str(min(counts)) if len(counts) == 1 else f"{min(counts)} to {max(counts)}"


def with_line_feeds(data: bytes) -> bytes:
    """Return a text with line feeds at the ends of its lines, of which some may be carriage returns."""
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in data else data


def without_end_marks(data: bytes) -> bytes:
    """Return a text without white space, end-of-file marks of DOS and null bytes at its end."""
    return data.rstrip(_END_MARKS)


def parsed_reals(words: Sequence[bytes]) -> npt.NDArray[np.float64]:
    """Return words (n,) as real numbers; ValueError if one is not."""
    return _numbers(words, float, np.float64, "a number")


def parsed_integers(words: Sequence[bytes]) -> Integers:
    """Return words (n,) as integers; ValueError if one is not, or is too large."""
    return _numbers(words, int, np.int64, "an integer")


def _numbers(words: Sequence[bytes], parse: type, dtype: type, expected: str) -> npt.NDArray[Any]:
    try:
        return np.array(list(map(parse, words)), dtype=dtype)
    except (ValueError, OverflowError):
        bad = next(word for word in words if not _is(word, parse, dtype))
        raise ValueError(f"{shown(bad)} is not {expected}") from None


def _is(word: bytes, parse: type, dtype: type) -> bool:
    try:
        np.array([parse(word)], dtype=dtype)
    except (ValueError, OverflowError):
        return False
    return True


def quick_numbers(text: bytes, dtype: type) -> npt.NDArray[Any] | None:
    """Return the numbers in a text, which only white space or a sign need be between; None if there is anything else.

    What is None is for the slow way, word by word, that names the line.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # what NumPy raises at the first other character
        try:
            return np.fromstring(text, dtype=dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def word_starts(text: bytes) -> Integers:
    """Return where the words of a text begin."""
    is_space = np.frombuffer(text, dtype=np.uint8) <= _SPACE
    return np.flatnonzero(np.diff(is_space.astype(np.int8), prepend=1) == -1)


def quick_table(lines: list[bytes], chosen: Integers, word: bytes = b"") -> npt.NDArray[np.float64] | None:
    """Return the numbers (n, k) of lines behind a first word; None if they are not equally many or there is more."""
    parts = []
    for first in range(0, len(chosen), LINES_AT_ONCE):
        rows = chosen[first : first + LINES_AT_ONCE].tolist()
        text = b"\n".join([lines[k] for k in rows])
        if any(text.count(bytes([letter])) != word.count(letter) * len(rows) for letter in set(word)):
            return None
        text = text.translate(bytes.maketrans(word, b" " * len(word)))
        values, starts = quick_numbers(text, np.float64), word_starts(text)
        if values is None or len(values) != len(starts) or len(values) % len(rows):
            return None
        ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
        width = len(values) // len(rows)
        if (np.searchsorted(starts, ends) != width * np.arange(1, len(rows))).any():
            return None
        parts.append(values.reshape(len(rows), width))
    widths = {part.shape[1] for part in parts}
    return np.concatenate(parts) if len(widths) == 1 else None


def coordinates(
    lines: list[bytes], chosen: Integers, *, word: bytes = b"", numbers: Integers | None = None
) -> tuple[npt.NDArray[np.float64], int | None]:
    """Parse three coordinates (n, 3) behind a word in the chosen lines; ``numbers`` are the line numbers.

    Also return how many numbers each of these lines has, None if they differ or have other content.
    """
    table = quick_table(lines, chosen, word)
    if table is not None and table.shape[1] >= 3:
        return table[:, :3].copy(), table.shape[1]
    skip = len(word.split())
    rows = [lines[k].partition(b"#")[0].split()[skip : skip + 3] for k in chosen]
    try:
        return np.array([list(map(float, row)) for row in rows], dtype=np.float64).reshape(len(rows), 3), None
    except ValueError:
        bad = next(
            k for k, row in zip(chosen, rows, strict=True) if len(row) < 3 or not all(_is(w, float, float) for w in row)
        )
        number = bad if numbers is None else numbers[bad]
        raise ValueError(f"line {number + 1} should give three coordinates: {shown(lines[bad])}") from None


def integers(rows: list[list[bytes]], numbers: Integers) -> Integers:
    """Parse all words of rows with these line numbers as integers, concatenated."""
    try:
        return np.array([int(token) for row in rows for token in row], dtype=np.int64)
    except (ValueError, OverflowError):
        bad = next(k for k, row in enumerate(rows) if not all(re.fullmatch(rb"[+-]?\d{1,18}", word) for word in row))
        raise ValueError(f"line {numbers[bad] + 1} should give integers: {shown(b' '.join(rows[bad]))}") from None


def format_rows(pattern: str, table: npt.NDArray[Any]) -> str:
    """Return the rows of a table as lines; ``%r`` gives enough digits to restore the same float64."""
    return (pattern * len(table)) % tuple(table.ravel().tolist())


def whole(values: npt.NDArray[Any]) -> Integers:
    """Return numbers as int64; ValueError if one is not an integer or too large to be one."""
    if values.dtype.kind == "f" and not ((values == np.rint(values)) & (np.abs(values) < _LARGEST_WHOLE)).all():
        raise ValueError("malformed: a count, a tag or an index is not an integer, or too large")
    if values.dtype.kind == "u" and len(values) and values.max() > np.iinfo(np.int64).max:
        raise ValueError(f"malformed: a count or a tag is {values.max()}")
    return values.astype(np.int64)

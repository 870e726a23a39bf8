"""Text files with a few numbers per line; ``#`` begins a comment."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from anisomesh.errors import MeshFileError, why_unreadable

_SHOWN = 40  # characters of a wrong line that a message repeats
_MAX_DIGITS = 18  # of a decimal number that fits in 64 bits


def load_pairs(path: str | os.PathLike[str]) -> npt.NDArray[np.int64]:
    """Return the pairs of point indices (n, 2) in a text file: two integers per line, from 0.

    Raises
    ------
    MeshFileError
        If the file cannot be read, or a line has other content.
    """
    return _vertex_numbers(path, 2, "two vertex numbers")


def load_points(path: str | os.PathLike[str]) -> npt.NDArray[np.int64]:
    """Return the point indices (n,) in a text file: an integer per line, from 0.

    Raises
    ------
    MeshFileError
        If the file cannot be read, or a line has other content.
    """
    return _vertex_numbers(path, 1, "one vertex number").ravel()


def load_numbers(path: str | os.PathLike[str]) -> npt.NDArray[np.float64]:
    """Return the numbers (n,) in a text file, one per line.

    Raises
    ------
    MeshFileError
        If the file cannot be read, or a line has other content than a finite number.
    """
    numbers = []
    for where, words in _lines(path, "a number per line"):
        if len(words) != 1 or not _is_finite(words[0]):
            raise MeshFileError(f"{where}: {' '.join(words)[:_SHOWN]!r}; expected one finite number")
        numbers.append(float(words[0]))
    return np.array(numbers, dtype=np.float64)


def _vertex_numbers(path: str | os.PathLike[str], width: int, expected: str) -> npt.NDArray[np.int64]:
    """Return the numbers in a text file (n, width), or an error for a line of other content than ``expected``."""
    rows = []
    for where, words in _lines(path, f"{expected} per line"):
        if len(words) != width or not all(word.isdecimal() and len(word) < _MAX_DIGITS for word in words):
            raise MeshFileError(f"{where}: {' '.join(words)[:_SHOWN]!r}; expected {expected}, from 0")
        rows.append([int(word) for word in words])
    return np.array(rows, dtype=np.int64).reshape(-1, width)


def _lines(path: str | os.PathLike[str], expected: str) -> Iterator[tuple[str, list[str]]]:
    """Yield where each line is that is not empty, for messages, and its words."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")  # with or without a byte order mark
    except OSError as error:
        raise MeshFileError(f"{path}: {why_unreadable(path, error)}; expected a text file, {expected}") from error
    except UnicodeDecodeError as error:
        raise MeshFileError(f"{path}: cannot be read as text; expected {expected}") from error
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#", 1)[0].split()
        if words:
            yield f"{path}, line {number}", words


def _is_finite(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False

"""The content of MEDIT files that are written, text and binary, in float64."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh.io.carried import Array, Integers
from anisomesh.io.formats.medit.keywords import END, KEYWORDS
from anisomesh.io.formats.medit.sections import SPACE
from anisomesh.io.holding.divisions import fits_int32

_SHORT, _LONG_POSITIONS, _LONG_INTEGERS = 2, 3, 4  # versions: in the first, integers and positions have 32 bits
_MOST_SHORT = 2**31 - 1  # bytes of a file whose positions have 32 bits


class Rows(NamedTuple):
    """Rows of a section: real numbers (n, k), integers (n, m), and the types of fields of a solution."""

    name: str
    reals: npt.NDArray[np.float64]
    integers: Integers
    types: tuple[int, ...] = ()


def of_integers(name: str, *columns: Array) -> Rows:
    """Return a section of integers, given as columns (n,) or as several in one (n, k)."""
    integers = np.column_stack(columns).astype(np.int64)
    return Rows(name, np.zeros((len(integers), 0)), integers)


def of_reals(name: str, reals: Array, *integers: Integers, types: tuple[int, ...] = ()) -> Rows:
    """Return a section of rows of real numbers (n, k) with integers (n,) behind them."""
    behind = np.column_stack(integers) if integers else np.zeros((len(reals), 0), dtype=np.int64)
    return Rows(name, np.asarray(reals, dtype=np.float64), behind, types)


def text_content(sections: Sequence[Rows]) -> bytes:
    """Return a file of text, of version 2 unless integers need 64 bits."""
    version = _SHORT if _are_short(sections) else _LONG_INTEGERS
    parts = [f"MeshVersionFormatted {version}\nDimension {SPACE}\n"]
    for name, reals, integers, types in sections:
        parts.append(f"{name}\n{len(reals)}\n")
        if types:
            parts.append(f"{' '.join(map(str, (len(types), *types)))}\n")
        pattern = " ".join(["%r"] * reals.shape[1] + ["%d"] * integers.shape[1]) + "\n"
        columns = [*reals.T.tolist(), *integers.T.tolist()]
        parts += map(pattern.__mod__, zip(*columns, strict=True))
    return "".join([*parts, f"{END}\n"]).encode()


def _are_short(sections: Sequence[Rows]) -> bool:
    """Return whether all integers have 32 bits."""
    return all(fits_int32(rows.integers.ravel()) for rows in sections)


def binary_content(sections: Sequence[Rows]) -> bytes:
    """Return a binary file, of version 2 unless positions or integers need 64 bits."""
    size = sum(64 + 8 * rows.reals.size + 4 * rows.integers.size for rows in sections)
    version = _SHORT if size <= _MOST_SHORT else _LONG_POSITIONS
    if not _are_short(sections):
        version = _LONG_INTEGERS
    position, integer = ("<i4" if version == _SHORT else "<i8"), ("<i8" if version == _LONG_INTEGERS else "<i4")
    parts, at = [np.array([1, version], dtype="<i4").tobytes()], 8

    def add(name: str, body: bytes) -> None:
        nonlocal at
        at += 4 + np.dtype(position).itemsize + len(body)
        after = 0 if name == END else at
        parts.extend([np.array([KEYWORDS[name]], "<i4").tobytes(), np.array([after], position).tobytes(), body])

    add("Dimension", np.array([SPACE], dtype="<i4").tobytes())
    for name, reals, integers, types in sections:
        rows = np.zeros(len(reals), [("reals", "<f8", (reals.shape[1],)), ("integers", integer, (integers.shape[1],))])
        rows["reals"], rows["integers"] = reals, integers
        head = np.array([len(types), *types] if types else [], dtype="<i4").tobytes()
        add(name, np.array([len(rows)], dtype=integer).tobytes() + head + rows.tobytes())
    add(END, b"")
    return b"".join(parts)

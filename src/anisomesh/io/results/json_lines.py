"""Files with a JSON object on each line, to which a row is added when its work is done."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from anisomesh.errors import AnisomeshError


def finite(value: Any) -> Any:
    """Return a value of dictionaries, lists and numbers with None in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def as_line(row: dict[str, Any]) -> str:
    """Return a row as strict JSON on one line, without the line break.

    Raises
    ------
    TypeError, ValueError
        If a value has no JSON form, or a number is not finite.
    """
    return json.dumps(row, default=_plain, allow_nan=False)


def read_rows(path: Path, what: str) -> Iterator[tuple[int, Any]]:
    """Yield the number of each line of a file, from 1, and its value; nothing if the file does not exist.

    A last line without an end, as a process is writing it or was killed while it did, is left out.

    Parameters
    ----------
    path
        The file.
    what
        What a line is, for messages, such as ``"row of a benchmark"``.

    Raises
    ------
    AnisomeshError
        If the file is not text, or a line is not JSON.
    """
    try:
        lines = path.read_text(encoding="utf-8").split("\n")[:-1] if path.exists() else []
    except UnicodeDecodeError as error:
        raise AnisomeshError(f"{path} is not a text file of which each line is a {what}; move it away") from error
    for number, line in enumerate(lines, 1):
        if line:
            try:
                yield number, json.loads(line)
            except json.JSONDecodeError as error:
                raise not_a_row(path, number, what) from error


def append_line(path: Path, line: str) -> None:
    """Append a line to a file, which is created if missing, and flush it to the disk."""
    with path.open("a", encoding="utf-8") as file:
        file.write(line + "\n")
        file.flush()
        os.fsync(file.fileno())


def drop_cut_line(path: Path) -> None:
    """Remove an incomplete last line, left by a process that was killed while writing it."""
    if path.exists():
        content = path.read_bytes()
        if content and not content.endswith(b"\n"):
            os.truncate(path, content.rfind(b"\n") + 1)


def not_a_row(path: Path, number: int, what: str) -> AnisomeshError:
    """Return the error that says that a line of a file is something else."""
    return AnisomeshError(f"{path}, line {number}: not a {what}; move the file away")


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} has no JSON form")

"""Manifests: files with a job on each line, as JSON lines or CSV."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from anisomesh.batch.inputs import in_format
from anisomesh.batch.jobs import Job
from anisomesh.batch.options import FIELDS, METRICS, OPTION_NAMES, TABLES, TARGETS, Options, file_and_field
from anisomesh.batch.places import exists, is_address, joined
from anisomesh.errors import OptionError, why_unreadable
from anisomesh.toml import check_keys

_KNOWN_COLUMNS = ("input", "output", *OPTION_NAMES)
_WORDS = {"true": True, "false": False, "yes": True, "no": False}
_TEXTS = ("input", "output", "weights", "lock", *TABLES, *FIELDS)
_OTHER_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars"}


def read_manifest(path: Path, options: Options, *, output_format: str | None = None) -> list[Job]:
    """Return the jobs of a manifest.

    Parameters
    ----------
    path
        A file ``.jsonl`` with an object on each line, or ``.csv`` with a heading. Each row has an ``input``, and may
        have an ``output`` and options of its own, by the keywords of a remesh; an empty cell is none. Paths are
        relative to the folder of the manifest, outputs to the one of the batch.
    options
        Options of every job that its row does not replace. A row with one of ``n_vertices``, ``ratio``, ``max_error``
        and ``edge_length`` replaces them all, and so does one of ``metric``, ``metric_file`` and ``adapt_to``.
    output_format
        Format of the outputs of rows that name none; by default the one of the input.

    Raises
    ------
    OptionError
        If the file cannot be read, has another suffix, a column is unknown or given twice, or a row has no input.
    """
    readers = {".jsonl": _json_rows, ".csv": _csv_rows}
    if path.suffix.lower() not in readers:
        raise OptionError(f"{path}: expected a manifest ending in .jsonl or .csv")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise OptionError(f"{path}: {why_unreadable(path, error)}; expected a manifest") from error
    except UnicodeDecodeError as error:
        raise OptionError(f"{path}: cannot be read as text in UTF-8; save it in UTF-8") from error
    jobs = []
    for where, row in readers[path.suffix.lower()](str(path), text):
        check_keys(where, row, _KNOWN_COLUMNS)
        jobs.append(_job(where, row, options, path.parent, output_format))
    if not jobs:
        raise OptionError(f"{path}: it has no rows; expected a row for each mesh")
    return jobs


def _job(where: str, row: dict[str, Any], options: Options, folder: Path, output_format: str | None) -> Job:
    given = {name: value for name, value in row.items() if value not in (None, "")}
    source, output = given.pop("input", None), given.pop("output", None)
    if not isinstance(source, str):
        raise OptionError(f"{where}: input is missing; expected the name of a mesh in the column input")
    if output is not None and not isinstance(output, str):
        raise OptionError(f"{where}: output = {output!r}; expected the name of a file")
    if output is None:
        is_elsewhere = is_address(source) or Path(source).is_absolute()
        output = in_format(Path(source).name if is_elsewhere else _below(source), output_format)
    replaced = {name for group in (TARGETS, METRICS) if any(name in given for name in group) for name in group}
    base = {name: value for name, value in options.items() if name not in replaced}
    return Job(
        input=joined(str(folder), source), output=output, options=base | _beside(str(folder), given), place=where
    )


def _beside(folder: str, given: Options) -> Options:
    """Return the options of a row with the files that they name in the folder of the manifest."""
    texts = {name: value for name, value in given.items() if isinstance(value, str)}  # others are refused later
    found = {name: joined(folder, texts[name]) for name in TABLES if name in texts}
    for name in FIELDS:
        if name in texts:
            file, field = file_and_field(name, texts[name])
            found[name] = field if file is None else joined(folder, file) + field
    if "weights" in texts and exists(network := joined(folder, texts["weights"])):  # else the name of a network
        found["weights"] = network
    return given | found


def _below(source: str) -> str:
    """Return a relative path without the parts that lead out of its folder."""
    return Path(*[part for part in Path(source).parts if part != ".."]).as_posix()


def _json_rows(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for number, line in enumerate(text.split("\n"), 1):
        if line.strip():
            where = f"{name}, line {number}"
            try:
                row = json.loads(line, object_pairs_hook=partial(_object, where), parse_float=_real)
            except OptionError:
                raise
            except (ValueError, RecursionError) as error:  # also a number of too many digits
                raise OptionError(f"{where}: not JSON: {error}") from error
            if not isinstance(row, dict):
                raise OptionError(f'{where}: expected an object such as {{"input": "part.ply"}}')
            yield where, row


def _object(where: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    _check_once(where, [name for name, _ in pairs])
    return dict(pairs)


def _csv_rows(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    reader = csv.reader(io.StringIO(text), skipinitialspace=True, strict=True)
    heading: list[str] = []
    try:
        for cells in filter(None, reader):
            where = f"{name}, line {reader.line_num}"
            if not heading:
                heading = _heading(where, cells)
                continue
            if len(cells) != len(heading):
                raise OptionError(f"{where}: expected {len(heading)} columns, as in the heading; found {len(cells)}")
            yield where, {column: _value(column, cell.strip()) for column, cell in zip(heading, cells, strict=True)}
    except csv.Error as error:
        raise OptionError(f"{name}, line {reader.line_num}: not CSV: {error}") from error


def _heading(where: str, cells: Sequence[str]) -> list[str]:
    """Return the names of the columns of a CSV file, after checking them."""
    names = [cell.strip() for cell in cells]
    for sign, words in _OTHER_SEPARATORS.items():
        if len(names) == 1 and sign in names[0]:
            raise OptionError(f"{where}: the columns are separated by {words}; expected commas")
    if "" in names:
        raise OptionError(f"{where}: column {names.index('') + 1} has no name; give it one, or leave it out")
    _check_once(where, names)
    check_keys(where, dict.fromkeys(names), _KNOWN_COLUMNS)
    return names


def _check_once(where: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise OptionError(f"{where}: {name} is given twice")


def _real(text: str) -> float | str:
    """Return a number, or its text if it is too large for float64, so that messages repeat what the file says."""
    number = float(text)
    return text if math.isinf(number) and any(map(str.isdigit, text)) else number


def _value(column: str, text: str) -> Any:
    """Return the value in a cell of a CSV file: a number, true or false, or a text."""
    if column in _TEXTS:
        return text
    for kind in (int, _real):
        try:
            return kind(text)
        except ValueError:
            continue
    return _WORDS.get(text.lower(), text)

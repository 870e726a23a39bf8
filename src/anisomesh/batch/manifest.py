"""Manifests: files with a job on each line, as JSON lines or CSV."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from anisomesh.batch.inputs import in_format
from anisomesh.batch.jobs import Job
from anisomesh.batch.options import FIELDS, METRICS, OPTION_NAMES, TABLES, TARGETS, Options, file_and_field
from anisomesh.batch.places import is_address, joined
from anisomesh.errors import OptionError, why_unreadable
from anisomesh.toml import check_keys

_KNOWN_COLUMNS = ("input", "output", *OPTION_NAMES)
_WORDS = {"true": True, "false": False, "yes": True, "no": False}
_TEXTS = ("input", "output", "weights", "lock", *TABLES, *FIELDS)


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
        If the file cannot be read, has another suffix, a column is unknown, or a row has no input.
    """
    readers = {".jsonl": _json_rows, ".csv": _csv_rows}
    if path.suffix.lower() not in readers:
        raise OptionError(f"{path}: expected a manifest ending in .jsonl or .csv")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise OptionError(f"{path}: {why_unreadable(path, error)}; expected a manifest") from error
    except UnicodeDecodeError as error:
        raise OptionError(f"{path} cannot be read as text: {error}") from error
    jobs = []
    for where, row in readers[path.suffix.lower()](str(path), text):
        check_keys(where, row, _KNOWN_COLUMNS)
        jobs.append(_job(where, row, options, path.parent, output_format))
    if not jobs:
        raise OptionError(f"{path}: the table is empty; expected one for each mesh")
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
    given |= {name: joined(str(folder), str(given[name])) for name in TABLES if name in given}
    for name in FIELDS:
        if name in given:
            file, field = file_and_field(name, str(given[name]))
            given[name] = field if file is None else joined(str(folder), file) + field
    return Job(input=joined(str(folder), source), output=output, options=base | given)


def _below(source: str) -> str:
    """Return a relative path without the parts that lead out of its folder."""
    return Path(*[part for part in Path(source).parts if part != ".."]).as_posix()


def _json_rows(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            try:
                row = json.loads(line)
            except json.JSONDecodeError as error:
                raise OptionError(f"{name}, line {number}: not JSON: {error}") from error
            if not isinstance(row, dict):
                raise OptionError(f'{name}, line {number}: expected an object such as {{"input": "part.ply"}}')
            yield f"{name}, line {number}", row


def _csv_rows(name: str, text: str) -> Iterator[tuple[str, dict[str, Any]]]:
    reader = csv.DictReader(text.splitlines(), skipinitialspace=True, strict=True)
    try:
        for row in reader:
            where = f"{name}, line {reader.line_num}"
            if None in row or None in row.values():
                raise OptionError(f"{where}: expected {len(reader.fieldnames or ())} columns, as in the heading")
            yield where, {key: _value(key, text.strip()) for key, text in row.items()}
    except csv.Error as error:
        raise OptionError(f"{name}, line {reader.line_num}: not CSV: {error}") from error


def _value(column: str, text: str) -> Any:
    """Return the value in a cell of a CSV file: a number, true or false, or a text."""
    if column in _TEXTS:
        return text
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return _WORDS.get(text.lower(), text)

"""The results of a batch as rows: one for each output, as JSON lines that a killed process leaves readable."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from anisomesh.batch.jobs import Job
from anisomesh.batch.keys import facts_of_files, key_of
from anisomesh.batch.places import exists, joined, make_folder
from anisomesh.errors import AnisomeshError
from anisomesh.io.atomic import atomic_path
from anisomesh.io.results.json_lines import append_line, as_line, drop_cut_line, finite, not_a_row, read_rows

Row = dict[str, Any]
_STEM, _SUFFIX = "results", ".jsonl"
_WHAT = "row of a batch"


class Results:
    """The rows in a folder: its own file, and the files of other shards of the same batch.

    Parameters
    ----------
    folder
        The folder, which is created if missing.
    shard
        Number of this shard, from 1, and how many there are; None for a batch in one piece.
    """

    def __init__(self, folder: Path, shard: tuple[int, int] | None = None) -> None:
        self.folder = folder
        self.name = (_STEM if shard is None else f"{_STEM}.{shard[0]}-of-{shard[1]}") + _SUFFIX
        self.path = folder / self.name
        make_folder(folder)
        drop_cut_line(self.path)

    def rows(self) -> dict[str, Row]:
        """Return the newest row of every output, by output.

        Raises
        ------
        AnisomeshError
            If a line of a file is not a row.
        """
        newest: dict[str, Row] = {}
        for path in sorted(self.folder.glob(f"{_STEM}*{_SUFFIX}")):
            for row in _rows_of(path):
                before = newest.get(row["output"])
                if before is None or before["finished"] <= row["finished"]:
                    newest[row["output"]] = row
        return newest

    def forget(self, outputs: Sequence[str]) -> None:
        """Remove the rows of these outputs, which are made again, from the own file."""
        gone, kept, n_rows = set(outputs), {}, 0
        for row in _rows_of(self.path):
            n_rows += 1
            if row["output"] not in gone:
                kept[row["output"]] = row
        if len(kept) < n_rows:
            with atomic_path(self.path) as temporary:
                temporary.write_text("".join(as_line(row) + "\n" for row in kept.values()), encoding="utf-8")

    def append(self, row: Row) -> Row:
        """Add a row and return it as it is read back, None in place of numbers that are not finite."""
        clean: Row = finite(row)
        append_line(self.path, as_line(clean))
        return clean


def picture_of(folder: Path, output: str) -> Path:
    """Return the file of the thumbnail of an output, in the folder of the results."""
    return folder / ".thumbnails" / f"{hashlib.sha256(output.encode()).hexdigest()[:16]}.png"


def is_done(job: Job, row: Row | None, outputs: str) -> bool:
    """Return whether a row says that a job is done as it is now, and its output is still there.

    Parameters
    ----------
    job, row
        The job and the newest row of its output, None if there is none.
    outputs
        The folder, or the address of one, that outputs are relative to.
    """
    if row is None or row["status"] != "done" or not all(exists(joined(outputs, name)) for name in job.outputs):
        return False
    try:
        return bool(key_of(job, facts_of_files(job, row["files"])) == row["key"])
    except AnisomeshError:  # a file cannot be read, which the worker will say in its row
        return False


def _rows_of(path: Path) -> list[Row]:
    """Return the rows of a file; without a last line that another process is just writing."""
    rows = []
    for number, row in read_rows(path, _WHAT):
        if not isinstance(row, dict) or not {"output", "status", "finished", "key", "files"} <= row.keys():
            raise not_a_row(path, number, _WHAT)
        rows.append(row)
    return rows

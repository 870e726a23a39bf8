"""Reports of a batch: a web page with small pictures, and a Parquet file."""

from __future__ import annotations

import base64
import importlib.util
import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from anisomesh.batch.places import is_address
from anisomesh.batch.rows import Row, picture_of
from anisomesh.io.atomic import atomic_path
from anisomesh.io.results.web_page import Html, table, web_page

PAGE, PARQUET = "index.html", "results.parquet"
_HEADING = (
    "picture", "output", "status", "vertices", "faces", "mean stretch", "largest stretch", "seconds", "tries", "input",
    "remarks",
)  # fmt: skip


def write_page(rows: Sequence[Row], folder: Path, outputs: str) -> Path:
    """Write the rows of a batch as one HTML file, whose table sorts by a heading that is clicked; return its path.

    Parameters
    ----------
    rows
        The rows.
    folder
        Folder of the results, with the thumbnails.
    outputs
        Folder, or address of one, that outputs are relative to.
    """
    counts = {status: sum(row["status"] == status for row in rows) for status in ("done", "refused", "failed")}
    said = ", ".join(f"{count:,} {status}" for status, count in counts.items() if count)
    lines = [_line(row, folder, outputs) for row in sorted(rows, key=lambda row: str(row["output"]))]
    page = web_page("Results of a batch", [f"<h1>Results of a batch</h1><p>{said}</p>", table(_HEADING, lines)])
    with atomic_path(folder / PAGE) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return folder / PAGE


def write_parquet(rows: Sequence[Row], folder: Path) -> Path | None:
    """Write the rows of a batch as a Parquet file and return its path; None if pyarrow is not installed.

    Keys of nested figures are joined by points, such as ``report.validity.closed``; options and levels of
    detail are JSON texts.
    """
    if importlib.util.find_spec("pyarrow") is None:
        return None
    import pyarrow
    import pyarrow.parquet

    flat = [_flat({**row, "options": json.dumps(row["options"], sort_keys=True), "files": None}) for row in rows]
    names = list(dict.fromkeys(name for row in flat for name in row))
    columns = {name: [row.get(name) for row in flat] for name in names}
    with atomic_path(folder / PARQUET) as temporary:
        pyarrow.parquet.write_table(pyarrow.table(columns), temporary)
    return folder / PARQUET


def remarks_of(row: Row) -> list[str]:
    """Return what a user should know of a job: the error, warnings of the result, and of readers and writers."""
    error = [row["error"]] if row.get("error") else []
    return [*error, *row.get("report", {}).get("warnings", []), *row.get("log", [])]


def _line(row: Row, folder: Path, outputs: str) -> list[str]:
    report: dict[str, Any] = row.get("report", {})
    stretch = report.get("stretch", {})
    return [
        _picture(picture_of(folder, row["output"])),
        _links(row, folder, outputs) if row["status"] == "done" else row["output"],
        row["status"],
        *(_shown(report.get(name), ",") for name in ("vertices", "faces")),
        *(_shown(stretch.get(name), ".2f") for name in ("mean", "max")),
        _shown(row.get("seconds"), ".2f"),
        str(row["tries"]),
        row["input"],
        " · ".join(remarks_of(row)),
    ]


def _picture(path: Path) -> Html:
    if not path.is_file():
        return Html("")
    return Html(f'<img alt="" src="data:image/png;base64,{base64.b64encode(path.read_bytes()).decode()}">')


def _links(row: Row, folder: Path, outputs: str) -> str:
    written = row.get("outputs", [row["output"]])  # rows of older versions have no list
    links = [_link(output, folder, outputs) for output in written]
    if not any(isinstance(link, Html) for link in links):
        return " ".join(links)
    return Html(" ".join(link if isinstance(link, Html) else escape(link) for link in links))


def _link(output: str, folder: Path, outputs: str) -> str:
    """Return a link to an output that is below the page."""
    if is_address(output) or is_address(outputs) or Path(outputs) != folder or Path(output).is_absolute():
        return output
    from urllib.parse import quote

    return Html(f'<a href="{quote(output)}">{escape(output)}</a>')


def _shown(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def _flat(row: Row, before: str = "") -> Row:
    found: Row = {}
    for name, value in row.items():
        if name == "levels":
            value = json.dumps(value)
        found |= _flat(value, f"{before}{name}.") if isinstance(value, dict) else {f"{before}{name}": value}
    return found

"""The list of what is in a data set: one row a source, as JSON lines."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anisomesh.errors import MeshFileError

MANIFEST = "manifest.jsonl"

ManifestRow = dict[str, Any]


@dataclass(frozen=True)
class Files:
    """Items of a data set for training and for validation."""

    training: list[Path]
    validation: list[Path]


def read_manifest(folder: Path) -> list[ManifestRow]:
    """Return the rows of a data set, the last one of each source; none if there is no list.

    Raises
    ------
    MeshFileError
        If a line but the last is no row. (The last may have been cut off when a build was killed.)
    """
    path = folder / MANIFEST
    lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
    rows: dict[str, ManifestRow] = {}
    for number, line in enumerate(lines, 1):
        if not line:
            continue
        try:
            row = json.loads(line)
            rows[row["name"]] = row
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            if number == len(lines):
                break
            raise MeshFileError(f"{path}, line {number}: no row of a data set; move the file away") from error
    return list(rows.values())


def files_of(folder: Path) -> Files:
    """Return the items of a data set, in the order of their names, whatever order they were made in.

    Raises
    ------
    MeshFileError
        If there is no data set.
    """
    rows = [row for row in read_manifest(folder) if row["status"] == "kept"]
    if not rows:
        raise MeshFileError(
            f"{folder}: there is no data set here (no {MANIFEST} with items); anisomesh dataset build makes one"
        )
    found: dict[str, list[Path]] = {"training": [], "validation": []}
    for row in rows:
        found[row["split"]] += [folder / item["file"] for item in row["items"]]
    return Files(training=sorted(found["training"]), validation=sorted(found["validation"]))

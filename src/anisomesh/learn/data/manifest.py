"""The manifest of a data set: one row per source, as JSON lines."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anisomesh.errors import MeshFileError

MANIFEST = "manifest.jsonl"

ManifestRow = dict[str, Any]
"""What became of a source, see :func:`anisomesh.learn.data.build.build`."""


@dataclass(frozen=True)
class ItemFiles:
    """Files of the items for training and for validation."""

    training: list[Path]
    validation: list[Path]


def read_manifest(folder: Path) -> list[ManifestRow]:
    """Return the last row of each source of a data set; none if there is no manifest.

    Raises
    ------
    MeshFileError
        If a line is not a row. The last line may be, as a killed build cuts it off.
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
            raise MeshFileError(f"{path}, line {number}: not a row of a manifest; move the file away") from error
    return list(rows.values())


def files_of(folder: Path) -> ItemFiles:
    """Return the item files of a data set, sorted by name.

    Raises
    ------
    MeshFileError
        If there is no data set in the folder.
    """
    rows = [row for row in read_manifest(folder) if row["status"] == "kept"]
    if not rows:
        raise MeshFileError(
            f"{folder}: there is no data set here (no {MANIFEST} with items); anisomesh dataset build makes one"
        )
    found: dict[str, list[Path]] = {"training": [], "validation": []}
    for row in rows:
        found[row["split"]] += [folder / item["file"] for item in row["items"]]
    return ItemFiles(training=sorted(found["training"]), validation=sorted(found["validation"]))

"""Shapes that a data set is built from: mesh files and procedural shapes, split into training and validation."""

from __future__ import annotations

import csv
import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from anisomesh.errors import OptionError
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.learn.data.recipe import Recipe

Split = Literal["training", "validation"]
SourceKind = Literal["mesh", "blobs", "part"]

VALIDATION_SHARE = 0.12
"""Share of the families that are for validation."""

_ITEM_VERSION = 1  # part of every fingerprint: a new number makes builds start anew


@dataclass(frozen=True, kw_only=True)
class Source:
    """A shape that items are made from.

    Attributes
    ----------
    name
        Unique in the data set; names of items start with it.
    family
        All shapes of a family (near-duplicates) are in the same split.
    split
        Whether the items are for training or for validation; only the family decides.
    path
        The mesh file, None for a procedural shape.
    kind
        A mesh file, or the kind of the procedural shape.
    """

    name: str
    family: str
    split: Split
    path: Path | None = None
    kind: SourceKind = "mesh"

    @property
    def seed(self) -> int:
        """Seed of the procedural shape and of the variants; only the name decides."""
        return _hash(self.name)

    def fingerprint(self, recipe: Recipe) -> str:
        """Return a hash of the file, the seed and the recipe."""
        text = json.dumps([_ITEM_VERSION, self.name, self.seed, asdict(recipe)], sort_keys=True).encode()
        content = self.path.read_bytes() if self.path is not None else b""
        return hashlib.sha256(text + content).hexdigest()[:16]


def sources_of(
    folder: Path | None, n_blobs: int, n_parts: int = 0, *, validation: float = VALIDATION_SHARE
) -> list[Source]:
    """Return the meshes in a folder and its subfolders, and procedural shapes.

    Parameters
    ----------
    folder
        Families are read from ``manifest.csv`` (columns ``file``, ``family``) in the folder or its parent; without it
        every mesh is a family of its own. None for no meshes.
    n_blobs, n_parts
        Numbers of procedural smooth shapes and machine parts.
    validation
        Share of the families that are for validation.

    Raises
    ------
    OptionError
        If there are no sources, two have the same name, or the share is not in [0, 1).
    """
    if not 0.0 <= validation < 1.0:
        raise OptionError(f"validation = {validation}; expected at least 0 and below 1")
    found = []
    if folder is not None:
        if not folder.is_dir():
            raise OptionError(f"{folder} is not a folder of meshes")
        families = _families(folder)
        for path in sorted(p for p in folder.rglob("*") if p.suffix.lower() in MESH_FORMATS and p.is_file()):
            name = "-".join(path.relative_to(folder).with_suffix("").parts)
            family = families.get(path.resolve(), name)
            found.append(Source(name=name, family=family, split=_split(family, validation), path=path))
    kinds: tuple[tuple[SourceKind, int], ...] = (("blobs", n_blobs), ("part", n_parts))
    for kind, count in kinds:
        names = [f"{kind}-{number:04d}" for number in range(count)]
        found += [Source(name=name, family=name, split=_split(name, validation), kind=kind) for name in names]
    if not found:
        formats = ", ".join(sorted(MESH_FORMATS))
        raise OptionError(f"{folder} has no mesh in one of {formats}, and no procedural shapes are asked for")
    names = [source.name for source in found]
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise OptionError(f"two meshes have the same name but for the format: {', '.join(sorted(repeated))}")
    return found


def _families(folder: Path) -> dict[Path, str]:
    """Return the families by mesh file, from ``manifest.csv`` in the folder or its parent."""
    for base in (folder, folder.parent):
        path = base / "manifest.csv"
        if path.is_file():
            with path.open(newline="", encoding="utf-8-sig") as file:
                rows = list(csv.DictReader(file))
            if rows and {"file", "family"} <= set(rows[0]):
                return {(base / row["file"]).resolve(): row["family"] for row in rows}
    return {}


def _split(family: str, validation: float) -> Split:
    return "validation" if _hash(family) / 2**32 < validation else "training"


def _hash(text: str) -> int:
    """Return a number below 2^32 that depends only on a text."""
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")

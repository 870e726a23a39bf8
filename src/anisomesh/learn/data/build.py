"""Building a data set: many shapes in parallel, each in a process of its own; a build that was stopped goes on."""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.io.atomic import append_line, atomic_path, drop_cut_line
from anisomesh.io.meshes import FORMATS, load
from anisomesh.isolation import isolated
from anisomesh.learn.data.items import save_item
from anisomesh.learn.data.make import Made, UnsuitableError, items_of_blobs, items_of_mesh, require_packages
from anisomesh.learn.data.manifest import MANIFEST, ManifestRow, read_manifest
from anisomesh.learn.data.recipe import Recipe
from anisomesh.shapes.implicit import Blobs
from anisomesh.shapes.lofts import random_part

_VERSION = 1  # of the items; another one makes a build start anew


@dataclass(frozen=True, kw_only=True)
class Source:
    """A shape that items are made of.

    Attributes
    ----------
    name
        Unique in the data set; the items are named after it.
    family
        Shapes of one family (near-duplicates) are either all for training or all for validation.
    path
        The mesh file, None for a shape made by code.
    seed
        Of the shape made by code and of the variants.
    kind
        Where the shape is from.
    """

    name: str
    family: str
    path: Path | None
    seed: int
    kind: Literal["mesh", "blobs", "part"] = "mesh"

    def fingerprint(self, recipe: Recipe) -> str:
        """Return a number that changes with the file, the seed and the recipe."""
        text = json.dumps([_VERSION, self.name, self.seed, asdict(recipe)], sort_keys=True).encode()
        content = self.path.read_bytes() if self.path is not None else b""
        return hashlib.sha256(text + content).hexdigest()[:16]


def sources_of(folder: Path | None, n_blobs: int, n_parts: int = 0) -> list[Source]:
    """Return the meshes of a folder and of those below it, and so many shapes made by code.

    Parameters
    ----------
    folder
        Its families are read from ``manifest.csv`` (columns ``file``, ``family``) there or one folder up, if there is
        one; else every mesh is its own family. None for no meshes.
    n_blobs, n_parts
        Numbers of smooth shapes and of machine parts made by code.

    Raises
    ------
    OptionError
        If there is nothing to build from.
    """
    found = []
    if folder is not None:
        if not folder.is_dir():
            raise OptionError(f"{folder} is no folder of meshes")
        families = _families(folder)
        for path in sorted(p for p in folder.rglob("*") if p.suffix.lower() in FORMATS and p.is_file()):
            name = "-".join(path.relative_to(folder).with_suffix("").parts)
            found.append(Source(name=name, family=families.get(path.resolve(), name), path=path, seed=_number(name)))
    kinds: tuple[tuple[Literal["blobs", "part"], int], ...] = (("blobs", n_blobs), ("part", n_parts))
    for kind, count in kinds:
        for number in range(count):
            name = f"{kind}-{number:04d}"
            found.append(Source(name=name, family=name, path=None, seed=_number(name), kind=kind))
    if not found:
        raise OptionError(
            f"{folder} has no mesh in one of {', '.join(sorted(FORMATS))}, and no shapes by code are asked for"
        )
    names = [source.name for source in found]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise OptionError(f"two meshes have the same name but for the format: {', '.join(sorted(twice))}")
    return found


def build(
    sources: list[Source],
    out: Path,
    recipe: Recipe,
    *,
    validation: float = 0.12,
    workers: int = 2,
    on_row: Callable[[ManifestRow, int, int], None] = lambda row, number, total: None,
) -> list[ManifestRow]:
    """Make the items that are not there yet and return the rows of all sources, in their order.

    Parameters
    ----------
    sources
        What to make items of.
    out
        Folder of the items and of ``manifest.jsonl``, one row a source; it is made if it is not there. Rows of other
        sources are taken out of the list.
    recipe
        How items are made.
    validation
        Share of the families that are for validation; which ones depends on their names alone.
    workers
        Sources worked on at once, each in a process of its own.
    on_row
        Called with a row, its number and the number of rows to come in all.

    Returns
    -------
    rows
        With ``name, family, split, fingerprint``; ``status`` ``kept`` with the ``items``, ``dropped`` with the
        ``reason`` where a shape is unsuitable, ``failed`` with the ``reason`` where it cannot be read or mended, or
        ended the process. None of these is tried again unless its file or the recipe changes.

    Raises
    ------
    OptionError
        If an option is out of range, or the package is missing that makes meshes even.
    MeshFileError
        If the list of an earlier build is damaged, or nothing can be written.

    Notes
    -----
    Processes are spawned, so a script that calls this needs ``if __name__ == "__main__"``.
    """
    if not 0.0 <= validation < 1.0 or workers < 1:
        raise OptionError(f"validation = {validation}, workers = {workers}; expected a share below 1, and 1 or more")
    require_packages(recipe)
    out.mkdir(parents=True, exist_ok=True)
    starts = {source.name: _start(source, recipe, validation) for source in sources}
    before = {row["name"]: row for row in read_manifest(out)}
    places = {name: {key: start[key] for key in ("family", "split")} for name, start in starts.items()}
    known = {name: {**row, **places[name]} for name, row in before.items() if name in places}
    if known != before:
        with atomic_path(out / MANIFEST) as temporary:
            Path(temporary).write_text("".join(map(_line, known.values())), encoding="utf-8")
    drop_cut_line(out / MANIFEST)
    jobs = [source for source in sources if not _is_done(known.get(source.name), starts[source.name], out)]
    for number, (source, row) in enumerate(_in_parallel(jobs, out, recipe, workers), 1):
        known[source.name] = {**starts[source.name], **row}
        append_line(out / MANIFEST, _line(known[source.name]).rstrip())
        on_row(known[source.name], number, len(jobs))
    return [known[name] for name in starts]


def _line(row: ManifestRow) -> str:
    return json.dumps(row, allow_nan=False) + "\n"


def _start(source: Source, recipe: Recipe, validation: float) -> ManifestRow:
    return {
        "name": source.name,
        "family": source.family,
        "split": "validation" if _number(source.family) / 2**32 < validation else "training",
        "fingerprint": source.fingerprint(recipe),
    }


def _is_done(row: ManifestRow | None, start: ManifestRow, out: Path) -> bool:
    if row is None or row["fingerprint"] != start["fingerprint"]:
        return False
    return all((out / item["file"]).is_file() for item in row.get("items", []))


def _in_parallel(jobs: list[Source], out: Path, recipe: Recipe, workers: int) -> Iterator[tuple[Source, ManifestRow]]:
    """Yield sources and what became of them as they end, never more than twice as many begun as there are workers."""
    waiting: dict[Future[ManifestRow], Source] = {}
    left = iter(jobs)
    with ThreadPoolExecutor(workers) as pool:
        try:
            while True:
                for source in left:
                    waiting[pool.submit(_guarded, source, out, recipe)] = source
                    if len(waiting) == 2 * workers:
                        break
                if not waiting:
                    return
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    yield waiting.pop(future), future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _guarded(source: Source, out: Path, recipe: Recipe) -> ManifestRow:
    """Make the items of a source in a new process; whatever goes wrong is its row."""
    try:
        return isolated(make)(source, out, recipe)
    except UnsuitableError as error:
        return {"status": "dropped", "reason": str(error)}
    except Exception as error:  # one bad mesh is not to end a build of hundreds
        known = isinstance(error, AnisomeshError)
        return {"status": "failed", "reason": str(error) if known else f"{type(error).__name__}: {error}"}


def make(source: Source, out: Path, recipe: Recipe) -> ManifestRow:
    """Make and write the items of a source; return the part of its row that says so."""
    rng = np.random.default_rng(source.seed)
    made: list[Made]
    if source.kind == "blobs":
        made = items_of_blobs(Blobs.random(rng), recipe, rng)
    else:
        made = items_of_mesh(random_part(rng) if source.path is None else load(source.path), recipe, rng)
    items = []
    for entry in made:
        name = f"{source.name}.{entry.kind}.npz"
        save_item(entry.item, out / name)
        items.append({"file": name, "kind": entry.kind, **entry.facts})
    return {"status": "kept", "items": items}


def _families(folder: Path) -> dict[Path, str]:
    for base in (folder, folder.parent):
        path = base / "manifest.csv"
        if path.is_file():
            with path.open(newline="", encoding="utf-8-sig") as file:
                rows = list(csv.DictReader(file))
            if rows and {"file", "family"} <= set(rows[0]):
                return {(base / row["file"]).resolve(): row["family"] for row in rows}
    return {}


def _number(text: str) -> int:
    """Return a number below 2^32 that depends on a text alone."""
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")

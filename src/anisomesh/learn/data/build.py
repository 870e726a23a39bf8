"""Build a data set of many shapes, in parallel if there are workers. A stopped build can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anisomesh.errors import AnisomeshError
from anisomesh.execution.engine import Work, WorkerPool
from anisomesh.io.atomic import atomic_path
from anisomesh.io.meshes import load
from anisomesh.io.results.json_lines import append_line, drop_cut_line
from anisomesh.learn.data.items import save_item
from anisomesh.learn.data.make import UnsuitableError, items_of_blobs, items_of_mesh, require_packages
from anisomesh.learn.data.manifest import MANIFEST, ManifestRow, read_manifest
from anisomesh.learn.data.recipe import Recipe
from anisomesh.learn.data.remesher import Remesher
from anisomesh.learn.data.sources import Source
from anisomesh.shapes.implicit import Blobs
from anisomesh.shapes.lofts import random_part


def build(
    sources: list[Source],
    out: Path,
    recipe: Recipe,
    remesher: Remesher,
    *,
    workers: WorkerPool | None = None,
    on_row: Callable[[ManifestRow, int, int], None] = lambda row, number, total: None,
) -> list[ManifestRow]:
    """Make the missing items of a data set and return the rows of all sources, in their order.

    Parameters
    ----------
    sources
        The shapes.
    out
        Folder of the items and of ``manifest.jsonl``, with one row per source; it is created if missing. Rows of other
        sources are removed.
    recipe
        How items are made.
    remesher
        Makes meshes even, and stretched.
    workers
        What processes the sources; by default this process, which a crash would end.
    on_row
        Called with each new row, its number, and the number of new rows in total.

    Returns
    -------
    rows
        With ``name, family, split, fingerprint`` and ``status``: ``kept`` with the ``items``; ``dropped`` with the
        ``reason`` if a shape is unsuitable; ``failed`` with the ``reason`` if it could not be read or repaired, or
        ended its process. A source is processed again only if its file or the recipe changes.

    Raises
    ------
    OptionError
        If an option is out of range, or a package that the recipe needs is not installed.
    MeshFileError
        If the manifest of an earlier build is damaged, or nothing can be written.

    Notes
    -----
    Processes are spawned, so a script that calls this needs ``if __name__ == "__main__"``.
    """
    require_packages(recipe)
    out.mkdir(parents=True, exist_ok=True)
    starts = {source.name: _start(source, recipe) for source in sources}
    before = {row["name"]: row for row in read_manifest(out)}
    splits = {name: {key: start[key] for key in ("family", "split")} for name, start in starts.items()}
    known = {name: {**row, **splits[name]} for name, row in before.items() if name in splits}
    if known != before:
        with atomic_path(out / MANIFEST) as temporary:
            Path(temporary).write_text("".join(map(_line, known.values())), encoding="utf-8")
    drop_cut_line(out / MANIFEST)
    jobs = [source for source in sources if not _is_done(known.get(source.name), starts[source.name], out)]
    tasks = [_SourceTask(source, out.absolute(), recipe, remesher) for source in jobs]
    with closing((workers or WorkerPool(count=0)).run(Work(do=_row), tasks)) as outcomes:
        for number, outcome in enumerate(outcomes, 1):
            source = jobs[outcome.number]
            row = outcome.result or {"status": "failed", "reason": outcome.error}
            known[source.name] = {**starts[source.name], **row}
            append_line(out / MANIFEST, _line(known[source.name]).rstrip())
            on_row(known[source.name], number, len(jobs))
    return [known[name] for name in starts]


def make(source: Source, out: Path, recipe: Recipe, remesher: Remesher) -> ManifestRow:
    """Make and write the items of a source; return their part of its row."""
    rng = np.random.default_rng(source.seed)
    if source.kind == "blobs":
        found = items_of_blobs(Blobs.random(rng), recipe, rng, remesher)
    else:
        surface = random_part(rng) if source.path is None else load(source.path)
        found = items_of_mesh(surface, recipe, rng, remesher)
    items = []
    for entry in found:
        name = f"{source.name}.{entry.kind}.npz"
        save_item(entry.item, out / name)
        items.append({"file": name, "kind": entry.kind, **entry.facts})
    return {"status": "kept", "items": items}


def _line(row: ManifestRow) -> str:
    return json.dumps(row, allow_nan=False) + "\n"


def _start(source: Source, recipe: Recipe) -> ManifestRow:
    """Return the part of a row that is known before the items are made."""
    known = {"name": source.name, "family": source.family, "split": source.split}
    return {**known, "fingerprint": source.fingerprint(recipe)}


def _is_done(row: ManifestRow | None, start: ManifestRow, out: Path) -> bool:
    if row is None or row["fingerprint"] != start["fingerprint"]:
        return False
    return all((out / item["file"]).is_file() for item in row.get("items", []))


@dataclass(frozen=True)
class _SourceTask:
    """A source for a worker, and how its items are made."""

    source: Source
    out: Path
    recipe: Recipe
    remesher: Remesher


def _row(task: _SourceTask, attempt: int) -> ManifestRow:
    """Make the items of a source and return their part of its row; an exception becomes a reason."""
    try:
        return make(task.source, task.out, task.recipe, task.remesher)
    except UnsuitableError as error:
        return {"status": "dropped", "reason": str(error)}
    except Exception as error:  # one bad mesh must not end a build of hundreds
        known = isinstance(error, AnisomeshError)
        return {"status": "failed", "reason": str(error) if known else f"{type(error).__name__}: {error}"}

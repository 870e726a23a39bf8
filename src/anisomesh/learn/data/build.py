"""Build a data set: many shapes in parallel, each in a process of its own. A stopped build can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from pathlib import Path

import numpy as np

from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.execution.isolation import isolated
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
    workers: int = 2,
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
        Number of sources processed in parallel, each in a process of its own.
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
    if workers < 1:
        raise OptionError(f"workers = {workers}; expected at least 1")
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

    def work(source: Source) -> ManifestRow:
        return _row_in_new_process(source, out, recipe, remesher)

    for number, (source, row) in enumerate(_in_parallel(jobs, work, workers), 1):
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


def _in_parallel(
    jobs: list[Source], work: Callable[[Source], ManifestRow], workers: int
) -> Iterator[tuple[Source, ManifestRow]]:
    """Yield sources with their rows as they finish; at most twice as many as there are workers are queued at a time."""
    waiting: dict[Future[ManifestRow], Source] = {}
    left = iter(jobs)
    with ThreadPoolExecutor(workers) as pool:
        try:
            while True:
                for source in left:
                    waiting[pool.submit(work, source)] = source
                    if len(waiting) == 2 * workers:
                        break
                if not waiting:
                    return
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    yield waiting.pop(future), future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def _row_in_new_process(source: Source, out: Path, recipe: Recipe, remesher: Remesher) -> ManifestRow:
    """Make the items of a source in a new process and return their part of its row; an exception becomes a reason."""
    try:
        return isolated(make)(source, out, recipe, remesher)
    except UnsuitableError as error:
        return {"status": "dropped", "reason": str(error)}
    except Exception as error:  # one bad mesh must not end a build of hundreds
        known = isinstance(error, AnisomeshError)
        return {"status": "failed", "reason": str(error) if known else f"{type(error).__name__}: {error}"}

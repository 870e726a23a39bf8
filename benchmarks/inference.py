"""Time and memory from a mesh to its embedding over its size, on one core: neural and direct.

Usage: python benchmarks/inference.py [--largest 1000000] [--data DIR] [--out benchmarks/out/inference.png]

Inputs are procedural rings, and the meshes in DIR/test and DIR/zeroshot (ANISOMESH_DATA). The picture is like the
timing figure of the paper, coloured by mean stretch.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from anisomesh.bench.inputs import make_shape
from anisomesh.embedding.direct import embed
from anisomesh.io.meshes import load
from anisomesh.learn.inference.predict import predict
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.repair.prepare import prepare

SIZES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
EMBEDDING_ITERATIONS = 10
MAX_POINTS = 200_000  # larger meshes of the data folder are skipped


def measured(surface: Surface, kind: str) -> dict[str, Any]:
    """Return seconds of metric and embedding, peak memory of the metric (kB per point), and mean stretch."""
    unit = surface.with_points(unit_frame(surface.points).to_unit(surface.points))
    small = make_shape("ring:1000")  # loads and compiles everything
    embed(small, predict(small).tensors if kind == "neural" else compute_metric(small))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.perf_counter()
    tensors = predict(unit, denoise=False).tensors if kind == "neural" else compute_metric(unit)
    middle = time.perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    embedding = embed(unit, tensors, max_iterations=EMBEDDING_ITERATIONS)
    end = time.perf_counter()
    kilobytes = (peak - before) / surface.n_points
    seconds = {"metric": middle - start, "embedding": end - middle}
    return {"points": surface.n_points, **seconds, "kB": kilobytes, "stretch": embedding.stretch.achieved_mean}


def in_new_process(surface: Surface, kind: str) -> dict[str, Any]:
    """Return what ``measured`` returns in a process without memory of earlier calls."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(measured, surface, kind).result()


def show(rows: list[dict[str, Any]], path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(9.0, 4.0), layout="constrained", dpi=150)
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2, sharey=True)
    for panel, kind in zip(panels, ("neural", "direct"), strict=True):
        some = [row for row in rows if row["kind"] == kind]
        seconds = [row["metric"] + row["embedding"] for row in some]
        marks = panel.scatter(
            [row["points"] for row in some], seconds, c=[row["stretch"] for row in some], vmin=1.0, vmax=6.0, s=14
        )
        panel.set(xscale="log", yscale="log", xlabel="points", title=f"{kind}: metric and embedding")
        panel.grid(which="both", color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
    panels[0].set_ylabel("seconds, one core")
    figure.colorbar(marks, ax=panels, label="mean stretch")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--largest", type=int, default=SIZES[-1])
    parser.add_argument("--data", type=Path, default=os.environ.get("ANISOMESH_DATA"))
    parser.add_argument("--out", type=Path, default=Path("benchmarks/out/inference.png"))
    asked = parser.parse_args()
    rows = []
    print(f"load {os.getloadavg()[0]:.2f}")
    print("| mesh | points | from | metric, s | embedding, s | metric, kB per point |\n|---|---|---|---|---|---|")
    meshes = [(f"ring:{n}", None) for n in SIZES if n <= asked.largest]
    if asked.data is not None:
        meshes += [(p.name, p) for folder in ("test", "zeroshot") for p in sorted(asked.data.glob(f"{folder}/*.ply"))]
    for name, path in meshes:
        surface = make_shape(name) if path is None else prepare(load(path)).surface
        if path is not None and surface.n_points > MAX_POINTS:
            continue
        for kind in ("neural", "direct"):
            row = {"kind": kind, **in_new_process(surface, kind)}
            rows.append(row)
            numbers = f"{row['metric']:.3f} | {row['embedding']:.3f} | {row['kB']:.1f}"
            print(f"| {name} | {row['points']:,} | {kind} | {numbers} |", flush=True)
    for kind in ("neural", "direct"):
        sizes, seconds = np.array(
            [(r["points"], r["metric"]) for r in rows if r["kind"] == kind and r["points"] > 9_000]
        ).T
        print(f"{kind}: metric ~ points^{np.polyfit(np.log(sizes), np.log(seconds), 1)[0]:.2f} above 9,000 points")
    show(rows, asked.out)


if __name__ == "__main__":
    main()

"""Times and memory: one evaluation, whole runs, growth with size, start-up.

Usage: python benchmarks/speed.py [--sizes 5000 20000 60000 200000]
Run it on a machine with nothing else to do. Meshes are made by code.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.cvt.optimise import lloyd, minimise
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.cvt.schedule import DENSITY_SHARPNESS
from anisomesh.embedding.direct import embed
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.shapes.analytic import twisted_ring
from anisomesh.voronoi.restricted import Evaluation, RestrictedVoronoi


def ring(n_points: int) -> Surface:
    """Return a closed surface with creases and anisotropy of about this many points."""
    finer = np.sqrt(n_points / 5440)
    surface = twisted_ring(n_major=round(160 * finer), n_section=(round(12 * finer), round(5 * finer)))
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


class TimedVoronoi(RestrictedVoronoi):
    """The diagram, with a clock."""

    seconds: list[float]

    def evaluate(self, sites: np.ndarray, sharpness: float = 1.0) -> Evaluation:
        """Evaluate, and note the seconds."""
        start = time.perf_counter()
        result = super().evaluate(sites, sharpness)
        self.seconds.append(time.perf_counter() - start)
        return result


def evaluation(n: int, iterations: int = 100) -> tuple[float, float, int]:
    """Return mean seconds of an evaluation, median seconds of a query of 20 neighbours, facets."""
    surface = ring(n)
    embedding = embed(surface, compute_metric(surface))
    voronoi = TimedVoronoi(embedding.points, surface.faces, threads=2)
    voronoi.seconds = []
    rng = np.random.default_rng(0)
    sites = lloyd(voronoi, sample_surface(voronoi.points, voronoi.faces, voronoi.facets.area, n, rng), 6)
    sites = lloyd(voronoi, resample_by_energy(voronoi, sites, 7.0 * DENSITY_SHARPNESS, rng), 3)
    voronoi.seconds = []
    sites = minimise(voronoi, sites, sharpness=7.0, max_iterations=iterations, tolerance=0.0).sites
    queries = []
    for _ in range(9):
        tree = cKDTree(sites)
        start = time.perf_counter()
        tree.query(sites, 20, workers=1)
        queries.append(time.perf_counter() - start)
    return float(np.mean(voronoi.seconds)), float(np.median(queries)), surface.n_faces


def embedding_time(n: int) -> float:
    """Return median seconds of the embedding without the estimate of the curvature."""
    surface = ring(n)
    tensors = compute_metric(surface)
    times = []
    for _ in range(5):
        start = time.perf_counter()
        embed(surface, tensors)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def whole_run(n: int, ratio: float) -> dict[str, float]:
    return anisomesh.remesh(ring(n), ratio=ratio).seconds


def fresh(code: str, **environment: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **environment}
    )
    return done.stdout.strip()


MEMORY = """
import sys
from pathlib import Path
sys.path.insert(0, {folder!r})
import numpy as np
from speed import ring
from anisomesh import remesh
from anisomesh.cvt.optimise import lloyd, minimise
from anisomesh.cvt.sampling import sample_surface
from anisomesh.voronoi.restricted import RestrictedVoronoi
from anisomesh.embedding.direct import embed
from anisomesh.metric.tensors import compute_metric

def status(name):
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(name))
    return 1024 * int(line.split()[1])

def peak_above(work):
    Path("/proc/self/clear_refs").write_text("5")  # the peak starts anew
    before = status("VmRSS")
    result = work()
    return (status("VmHWM") - before) / {n}, result

remesh(ring(2000), ratio=0.5)
surface = ring({n})
if {whole}:  # in a process of its own: memory that is free again hides a peak
    print(f"{{peak_above(lambda: remesh(surface, ratio=1.0, max_iterations=8))[0]:.0f}}")
    sys.exit()
stages = []
used, embedding = peak_above(lambda: embed(surface, compute_metric(surface)))
stages.append(("metric and embedding", used))
voronoi = RestrictedVoronoi(embedding.points, surface.faces)
sites = sample_surface(voronoi.points, voronoi.faces, voronoi.facets.area, {n}, np.random.default_rng(0))
used, sites = peak_above(lambda: minimise(voronoi, lloyd(voronoi, sites, 4), sharpness=7.0, max_iterations=12).sites)
stages.append(("optimisation", used))
used, _ = peak_above(lambda: voronoi.diagram(sites))
stages.append(("diagram", used))
print(", ".join(f"{{name}} {{used:.0f}}" for name, used in stages))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", default=[5_000, 20_000, 60_000, 200_000])
    options = parser.parse_args()
    anisomesh.remesh(ring(2000), ratio=0.5)  # compile
    mean, query, facets = evaluation(6_000)
    print(f"load {os.getloadavg()[0]:.2f}, {os.cpu_count()} cores")
    print(
        f"evaluation, 6,000 sites, {facets:,} facets, 8-D, mean of 100 iterations: {mean * 1e3:.1f} ms; "
        f"k-d tree query of 20 neighbours: {query * 1e3:.1f} ms; ratio {mean / query:.2f}"
    )
    for ratio in (1.0, 0.2, 0.1):
        runs = sorted((whole_run(6_000, ratio) for _ in range(3)), key=lambda seconds: seconds["total"])
        stages = ", ".join(f"{name} {value:.2f}" for name, value in runs[1].items())
        print(f"remesh, 6,000 vertices at {ratio:.0%}: {stages} s")
    print(f"embedding, 6,000 vertices: {embedding_time(6_000):.3f} s")
    times = []
    for n in options.sizes:
        mean, query, _ = evaluation(n, iterations=12)
        times.append((mean, embedding_time(n)))
        print(
            f"{n:,} sites: evaluation {mean * 1e3:.1f} ms, query {query * 1e3:.1f} ms; embedding {times[-1][1]:.2f} s",
            flush=True,
        )
    growth = np.polyfit(np.log(options.sizes), np.log(times), 1)[0]
    print(f"growth: evaluation n^{growth[0]:.2f}, embedding n^{growth[1]:.2f}")
    folder = str(Path(__file__).parent.resolve())
    memory = {"n": options.sizes[-1], "folder": folder}
    print("peak bytes a site above what was there before:", fresh(MEMORY.format(whole=False, **memory)))
    print("the same of a whole remesh, above the input:", fresh(MEMORY.format(whole=True, **memory)))
    code = "import time; t = time.perf_counter(); import anisomesh; print(time.perf_counter() - t)"
    print("import anisomesh:", fresh(code), "s")
    with tempfile.TemporaryDirectory() as cache:
        code = (
            "import time; from anisomesh import remesh, sample; from anisomesh.shapes.analytic import sphere\n"
            "s = sphere(3); t = time.perf_counter(); remesh(s, ratio=0.5); a = time.perf_counter() - t\n"
            "t = time.perf_counter(); remesh(s, ratio=0.5); print(a - (time.perf_counter() - t))"
        )
        print("first compile:", fresh(code, NUMBA_CACHE_DIR=cache), "s")


if __name__ == "__main__":
    main()

"""Times and memory: one evaluation of the energy, whole runs, growth with size, start-up.

Usage: python benchmarks/speed.py [--sizes 5000 20000 60000 200000]
Run it on an idle machine. The meshes are procedural.
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
from anisomesh.bench.inputs import make_shape
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.lbfgs import DescentOptions, minimise
from anisomesh.cvt.lloyd import lloyd
from anisomesh.cvt.sampling import resample_by_energy, sample_surface
from anisomesh.embedding.direct import embed
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import compute_metric
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi

RESAMPLING = NormalMetric(10.5)  # 1.5 times the default sharpness, as in a remesh
N_NEIGHBOURS = 20  # of a query; about as many as a cell needs
N_QUERIES, N_EMBEDDINGS, N_RUNS = 9, 5, 3  # repetitions, of which the median counts


def ring(n_points: int) -> Surface:
    """Return a closed surface with creases and anisotropy, of about this many points, at bounding-box diagonal 1."""
    surface = make_shape(f"ring:{n_points}")
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


def embedded_directly(surface: Surface) -> EmbeddedSurface:
    """Return a surface with its direct embedding."""
    embedding = embed(surface, compute_metric(surface))
    return EmbeddedSurface(surface, embedding.points, embedding.scale)


class TimedVoronoi(RestrictedVoronoi):
    """A restricted Voronoi diagram that notes the seconds of each integration."""

    def __init__(self, embedded: EmbeddedSurface) -> None:
        super().__init__(embedded, threads=2)
        self.seconds: list[float] = []

    def integrate(self, sites: np.ndarray, sharpness: float = 1.0) -> EnergyValue:
        start = time.perf_counter()
        result = super().integrate(sites, sharpness)
        self.seconds.append(time.perf_counter() - start)
        return result


def evaluation(n: int, iterations: int = 100) -> tuple[float, float, int]:
    """Return mean seconds of an evaluation, median seconds of a k-d tree query, number of facets."""
    voronoi = TimedVoronoi(embedded_directly(ring(n)))
    embedded, rng = voronoi.embedded, np.random.default_rng(0)
    sites = lloyd(voronoi, sample_surface(embedded.points, embedded.faces, embedded.face_areas, n, rng), 6)
    sites = lloyd(voronoi, resample_by_energy(voronoi, sites, RESAMPLING, rng), 3)
    voronoi.seconds.clear()
    options = DescentOptions(max_iterations=iterations, tolerance=0.0)
    sites = minimise(voronoi, sites, NormalMetric(), options=options).sites
    queries = []
    for _ in range(N_QUERIES):
        tree = cKDTree(sites)
        start = time.perf_counter()
        tree.query(sites, N_NEIGHBOURS, workers=1)
        queries.append(time.perf_counter() - start)
    return float(np.mean(voronoi.seconds)), float(np.median(queries)), embedded.surface.n_faces


def embedding_time(n: int) -> float:
    """Return median seconds of the direct embedding, given the metric."""
    surface = ring(n)
    tensors = compute_metric(surface)
    times = []
    for _ in range(N_EMBEDDINGS):
        start = time.perf_counter()
        embed(surface, tensors)
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def whole_run(n: int, ratio: float) -> dict[str, float]:
    return anisomesh.remesh(ring(n), ratio=ratio).seconds


def share_of_attributes(n: int) -> tuple[float, float]:
    """Return the seconds that a remesh to n points takes to carry over data of all kinds, and in all."""
    surface = ring(20_000)
    corners = surface.points[surface.faces]
    centres = corners.mean(axis=1)
    mesh = anisomesh.Mesh(
        surface=surface,
        point_data={"height": surface.points[:, 2], "place": surface.points},
        face_data={"pressure": centres[:, 0], "kind": np.arange(surface.n_faces) % 7},
        corner_data={"uv": corners[:, :, :2] + (centres[:, 2] > 0.0)[:, None, None]},
        regions={"part": anisomesh.Regions((centres[:, 0] > 0.0) + 2 * (centres[:, 1] > 0.0))},
    )
    seconds = anisomesh.remesh(mesh, n_vertices=n).seconds
    return seconds["attributes"], seconds["total"]


def fresh(code: str, **environment: str) -> str:
    """Run code in a new process and return its output."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **environment}
    )
    return done.stdout.strip()


MEMORY = """
import sys
from pathlib import Path
sys.path.insert(0, {folder!r})
import numpy as np
from speed import embedded_directly, ring
from anisomesh import remesh
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.lbfgs import DescentOptions, minimise
from anisomesh.cvt.lloyd import lloyd
from anisomesh.cvt.sampling import sample_surface
from anisomesh.voronoi.restricted import RestrictedVoronoi

def status(name):
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(name))
    return 1024 * int(line.split()[1])

def peak_above(work):
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    before = status("VmRSS")
    result = work()
    return (status("VmHWM") - before) / {n}, result

remesh(ring(2000), ratio=0.5)
surface = ring({n})
if {whole}:  # in a separate process: freed memory would hide a peak
    print(f"{{peak_above(lambda: remesh(surface, ratio=1.0, max_iterations=8))[0]:.0f}}")
    sys.exit()
stages = []
used, embedded = peak_above(lambda: embedded_directly(surface))
stages.append(("metric and embedding", used))
voronoi = RestrictedVoronoi(embedded)
sites = sample_surface(embedded.points, embedded.faces, embedded.face_areas, {n}, np.random.default_rng(0))
options = DescentOptions(max_iterations=12)
used, sites = peak_above(lambda: minimise(voronoi, lloyd(voronoi, sites, 4), NormalMetric(), options=options).sites)
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
        f"k-d tree query of {N_NEIGHBOURS} neighbours: {query * 1e3:.1f} ms; ratio {mean / query:.2f}"
    )
    for ratio in (1.0, 0.2, 0.1):
        runs = sorted((whole_run(6_000, ratio) for _ in range(N_RUNS)), key=lambda seconds: seconds["total"])
        stages = ", ".join(f"{name} {value:.2f}" for name, value in runs[1].items())
        print(f"remesh, 6,000 vertices at {ratio:.0%}: {stages} s")
    carried, total = share_of_attributes(6_000)
    print(f"remesh, 6,000 vertices with data and regions: {carried:.2f} of {total:.2f} s to carry them over")
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
    print("peak memory of the stages, bytes per site:", fresh(MEMORY.format(whole=False, **memory)))
    print(
        "peak memory of a whole remesh without the input, bytes per site:", fresh(MEMORY.format(whole=True, **memory))
    )
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

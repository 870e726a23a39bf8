"""Levels of detail against separate remeshes: processor time, quality G, distance and faults of each level.

Usage: python benchmarks/levels.py MESH... [--ratios 1 0.5 0.2 0.05] [--points 6000] [--seeds 0] [--stages]

MESH is a file or a shape of anisomesh.bench.inputs, such as ring:6000; without any, a ring and a part are measured.
One thread; times are of the processor, so other work on the machine hardly changes them. The cost of levels is compared
with the finest of them alone, which is the same remesh, in the same process.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import anisomesh
from anisomesh import RemeshResult, StepInfo, Surface
from anisomesh.bench.inputs import make_shape
from anisomesh.evaluation.shape import quality_in_metric, reference_metric
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.geometry import unit_frame
from anisomesh.repair.prepare import prepare

OPTIONS = {"threads": 1}
SAMPLES = 100_000
SHAPES = ["ring:6000", "part:6000"]


@dataclass
class Clock:
    """Processor seconds of each level, and of each stage of it, from the steps that a remesh reports."""

    levels: list[dict[str, float]] = field(default_factory=list)
    stage: str = "load"

    def __post_init__(self) -> None:
        self.levels.append(defaultdict(float))
        self.last = time.process_time()

    def __call__(self, step: StepInfo) -> None:
        self.stop()
        if step.stage == "level" and not step.message.startswith("0:"):
            self.levels.append(defaultdict(float))
        self.stage = step.stage

    def stop(self) -> None:
        """Count the time since the last step."""
        now = time.process_time()
        self.levels[-1][self.stage] += now - self.last
        self.last = now

    @property
    def seconds(self) -> list[float]:
        """Seconds of each level."""
        return [sum(level.values()) for level in self.levels]


def surface_of(name: str) -> Surface:
    return anisomesh.load(name) if Path(name).exists() else make_shape(name)


class Ruler:
    """What results are measured against: the prepared input at bounding-box diagonal 1, and its metric."""

    def __init__(self, given: Surface) -> None:
        prepared = prepare(given).surface
        self.frame = unit_frame(prepared.points)
        self.surface = prepared.with_points(self.frame.to_unit(prepared.points))
        self.metric = reference_metric(self.surface)

    def figures(self, result: RemeshResult) -> tuple[float, float, int]:
        """Return G, root mean squared distance, and faults."""
        mesh = Surface(self.frame.to_unit(result.surface.points), result.surface.faces)
        distance = surface_distance(self.surface, mesh, samples=SAMPLES)
        return float(quality_in_metric(*self.metric, mesh).mean()), distance.rms, result.validity.faults


def mean(values: list[float]) -> float:
    """Return the geometric mean."""
    return math.exp(float(np.mean(np.log(values))))


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", default=SHAPES)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1.0, 0.5, 0.2, 0.05])
    parser.add_argument("--points", type=int, help="ratios are of this many vertices, not of the ones of the input")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of separate remeshes, whose mean is taken")
    parser.add_argument("--embedding", default="auto")
    parser.add_argument("--stages", action="store_true", help="print the seconds of each stage of each level as well")
    return parser.parse_args()


def main() -> None:
    options = arguments()
    given = {**OPTIONS, "embedding": options.embedding}
    for shape in SHAPES:  # load or compile what is needed
        anisomesh.remesh_levels(make_shape(shape), n_vertices=[500, 200], **given)
    costs, shares = [], defaultdict(list)
    print("| mesh | vertices | s | over the finest | G, level | G, alone | RMS, level | over alone | faults | alone |")
    print("|" + "---|" * 10)
    for name in options.meshes:
        surface = surface_of(name)
        ruler, clock = Ruler(surface), Clock()
        n = options.points or surface.n_points
        counts = [max(4, round(ratio * n)) for ratio in options.ratios]
        levels = anisomesh.remesh_levels(surface, n_vertices=counts, on_step=clock, **given)
        clock.stop()
        costs.append(sum(clock.seconds) / clock.seconds[0])
        for k, level in enumerate(levels):
            g, rms, faults = ruler.figures(level)
            asked = level.vertices_asked
            alone = [
                ruler.figures(anisomesh.remesh(surface, n_vertices=asked, seed=seed, **given) if k else level)
                for seed in (options.seeds if k else options.seeds[:1])
            ]
            g_alone, rms_alone = float(np.mean([each[0] for each in alone])), mean([each[1] for each in alone])
            shares[k].append((g / g_alone, rms / rms_alone))
            print(
                f"| {Path(name).stem[:24]} | {level.surface.n_points:,} | {clock.seconds[k]:.2f} | "
                f"{clock.seconds[k] / clock.seconds[0]:.2f} | {g:.3f} | {g_alone:.3f} | {rms:.3e} | "
                f"{rms / rms_alone:.3f} | {faults} | {np.mean([each[2] for each in alone]):.1f} |",
                flush=True,
            )
            if options.stages:
                print("  ", ", ".join(f"{stage} {seconds:.2f}" for stage, seconds in clock.levels[k].items()))
    print(f"all levels over the finest alone: mean {mean(costs):.2f}, {min(costs):.2f} to {max(costs):.2f}")
    for k, each in shares.items():
        g_share, rms_share = (mean(list(column)) for column in zip(*each, strict=True))
        print(f"level {k}: G over a separate remesh {g_share:.4f}, RMS {rms_share:.3f} (geometric means)")


if __name__ == "__main__":
    main()

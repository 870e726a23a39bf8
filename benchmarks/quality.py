"""Quality, distance, creases and validity of remeshes of real meshes: smooth ones, CAD parts, badly triangulated ones.

Usage: python benchmarks/quality.py [--folders test] [--ratios 1 0.2 0.1] [--sharpness 7 1] [--metric curvature]
       [--only NAME] [--kind KIND] [--fresh] [--before FILE]

Rows are kept in benchmarks/out/quality.jsonl, and a later call measures what is missing. To compare two versions, run
one of them in another checkout, and give its file with --before.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import sys
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import anisomesh
from anisomesh import MetricField, RemeshResult, Surface
from anisomesh.bench.methods import METHODS
from anisomesh.caveats import COUNT_TOLERANCE
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.transfer import transfer_to_corners

OUT = Path(__file__).parent / "out" / "quality.jsonl"


BAD, CAD, SMOOTH = "bad triangles", "CAD", "smooth"
MIN_QUALITY = 0.7  # area-weighted mean quality of the triangles, below which a mesh is badly triangulated
FLAT_HEIGHT = 1e-6  # of the diagonal: corners this near to the plane of the closest input facet lie in it


EXACT = 1e-9  # of the diagonal: added to distances before they are compared


@dataclass(frozen=True)
class Case:
    """A mesh file and its kind."""

    path: Path
    kind: str

    @property
    def name(self) -> str:
        return f"{self.path.parent.name}/{self.path.stem}"


@dataclass(frozen=True)
class Run:
    """A mesh and the options that it is remeshed with."""

    case: Case
    ratio: float
    sharpness: float
    metric: str

    @property
    def key(self) -> tuple[str, float, float, str]:
        return self.case.name, self.ratio, self.sharpness, self.metric


def key_of(row: dict[str, Any]) -> tuple[str, float, float, str]:
    """Return the key of the run of a row."""
    return row["mesh"], row["ratio"], row["sharpness"], row.get("metric", "curvature")


def cases(data: Path, folders: list[str]) -> list[Case]:
    """Return the meshes of the folders, except ones that the manifest does not call closed and manifold."""
    with (data / "manifest.csv").open(newline="") as file:
        listed = {row["file"]: row for row in csv.DictReader(file)}
    found = []
    for path in (path for folder in folders for path in sorted((data / folder).glob("*.ply"))):
        row = listed.get(f"{path.parent.name}/{path.name}", {"closed": "1", "manifold": "1", "category": "cad"})
        if row["closed"] == row["manifold"] == "1":
            found.append(Case(path, kind_of(anisomesh.load(path), is_cad=row["category"] == "cad")))
    return found


def kind_of(mesh: Surface, *, is_cad: bool) -> str:
    """Return the kind of a mesh, by the shape of its triangles and the category of the manifest."""
    mean = np.average(euclidean_quality(mesh), weights=np.maximum(mesh.face_areas, 1e-300))
    return BAD if mean < MIN_QUALITY else CAD if is_cad else SMOOTH


def euclidean_quality(mesh: Surface) -> npt.NDArray[np.float64]:
    """Return 4 sqrt(3) area over the sum of the squared sides of the triangles (F,)."""
    return anisotropic_quality(mesh.points, mesh.faces, np.tile(np.eye(3), (mesh.n_points, 1, 1)))


def quality_in_own_metric(result: RemeshResult) -> float:
    """Return the mean quality of the triangles in the metric that was aimed at, at the working surface."""
    mesh = result.surface.with_points(result.frame.to_unit(result.surface.points))
    field = MetricField(tensors=result.tensors, corner_tensors=result.corner_tensors)
    roots = transfer_to_corners(ClosestPoints(result.working), field, mesh)
    return float(anisotropic_quality(mesh.points, mesh.faces, roots).mean())


def flat_quality(result: RemeshResult) -> float | None:
    """Return the mean Euclidean quality of the triangles in planes of the input, None if there are none."""
    reference, mesh = result.prepared, result.surface
    corners = mesh.points[mesh.faces]
    facet, _ = ClosestPoints(reference).locate(corners.mean(axis=1))
    offset = corners - reference.points[reference.faces[facet, 0]][:, None]
    height = np.abs(np.einsum("fcx,fx->fc", offset, reference.face_normals[facet])).max(axis=1)
    flat = height < FLAT_HEIGHT * reference.diagonal
    return float(euclidean_quality(mesh)[flat].mean()) if flat.any() else None


def measure(run: Run) -> dict[str, Any]:
    result = anisomesh.remesh(
        anisomesh.load(run.case.path), ratio=run.ratio, sharpness=run.sharpness, metric=run.metric, embedding="direct"
    )
    evaluation = anisomesh.evaluate(result.prepared, result.surface)
    distance = evaluation.distance
    decimated = METHODS["vtk-quadric"].run(result.prepared, result.surface.n_points, 0, {}).surface
    quadric = surface_distance(result.prepared, decimated)
    return {
        "mesh": run.case.name,
        "kind": run.case.kind,
        "ratio": run.ratio,
        "sharpness": run.sharpness,
        "metric": run.metric,
        "g_mean": evaluation.shape.g_mean,
        "g_working": quality_in_own_metric(result),
        "flat_quality": flat_quality(result),
        "mean_square": distance.mean_square_ab + distance.mean_square_ba,
        "over_quadric": (distance.rms + EXACT) / (quadric.rms / result.prepared.diagonal + EXACT),
        "hausdorff": distance.hausdorff,
        "creases": evaluation.features.crease_covered,
        **result.report(),
    }


def faults(row: dict[str, Any]) -> list[str]:
    """Return the faults of a result in words."""
    validity = row["validity"]
    found = [] if validity["oriented"] else ["not oriented"]
    names = ("nonmanifold_edges", "nonmanifold_vertices", "inverted", "new_intersections")
    found += [f"{name} {validity[name]}" for name in names if validity[name]]
    found += [
        f"{name} {validity[name]} for {validity[f'{name}_input']}"
        for name in ("euler", "components", "boundary_loops")
        if validity[name] != validity[f"{name}_input"]
    ]
    if abs(row["vertices"] - row["vertices_asked"]) > COUNT_TOLERANCE * row["vertices_asked"]:
        found.append(f"{row['vertices']} vertices for {row['vertices_asked']}")
    return found


def tables(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| metric | s | ratio | meshes | G | G, working metric | G, least | flat triangles | creases | E2 [1e-7 D²] "
        "| RMS over quadric decimation | largest | HD [1e-3 D] | time [s], mean | median | faults |",
        "|" + "---|" * 16,
    ]
    for group in grouped(rows):
        flat = [row["flat_quality"] for row in group if row["flat_quality"] is not None]
        seconds = [row["seconds"]["total"] for row in group]
        cells = [
            *headings(group),
            f"{mean(group, 'g_mean'):.3f}",
            f"{mean(group, 'g_working'):.3f}",
            f"{min(row['g_mean'] for row in group):.3f}",
            f"{np.mean(flat):.3f}" if flat else "",
            f"{mean(group, 'creases'):.1%}",
            f"{geometric_mean(group, 'mean_square') * 1e7:.2f}",
            f"{geometric_mean(group, 'over_quadric'):.2f}",
            f"{max(row['over_quadric'] for row in group):.2f}",
            f"{geometric_mean(group, 'hausdorff') * 1e3:.2f}",
            f"{np.mean(seconds):.2f}",
            f"{np.median(seconds):.2f}",
            f"{sum(bool(faults(row)) for row in group)}",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    faulty = [row for row in rows if faults(row)]
    lines += [
        "",
        *(f"{row['mesh']} {row['ratio']:.0%} s={row['sharpness']:g}: {', '.join(faults(row))}" for row in faulty),
    ]
    return "\n".join(lines)


def grouped(rows: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Return the rows of each metric, sharpness, ratio and kind of mesh."""
    groups: dict[tuple[str, float, float, str], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[key_of(row)[3], -row["sharpness"], -row["ratio"], row["kind"]].append(row)
    return [group for _, group in sorted(groups.items())]


def headings(group: list[dict[str, Any]]) -> list[str]:
    """Return metric, sharpness, ratio, and number and kind of the meshes of a group."""
    first = group[0]
    return [
        key_of(first)[3],
        f"{first['sharpness']:g}",
        f"{first['ratio']:.0%}",
        f"{len(group)} {first['kind']}",
    ]


def comparison(before: list[dict[str, Any]], after: list[dict[str, Any]]) -> str:
    """Return a table of what two versions have on the same runs."""
    earlier = {key_of(row): row for row in before}
    lines = [
        "| metric | s | ratio | meshes | G | flat triangles | creases | RMS | HD | time | faults |",
        "|" + "---|" * 11,
    ]
    for group in grouped([row for row in after if key_of(row) in earlier]):
        pairs = [(earlier[key_of(row)], row) for row in group]
        flat = [pair for pair in pairs if None not in (pair[0]["flat_quality"], pair[1]["flat_quality"])]
        cells = [
            *headings(group),
            _means(pairs, lambda row: row["g_mean"]),
            _means(flat, lambda row: row["flat_quality"]),
            _means(pairs, lambda row: row["creases"]),
            _factor(pairs, lambda row: row["mean_square"] ** 0.5),
            _factor(pairs, lambda row: row["hausdorff"]),
            _factor(pairs, lambda row: row["seconds"]["total"]),
            " -> ".join(str(sum(bool(faults(pair[k])) for pair in pairs)) for k in range(2)),
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


Pairs = list[tuple[dict[str, Any], dict[str, Any]]]


def _means(pairs: Pairs, figure: Callable[[dict[str, Any]], float]) -> str:
    """Return the means of a figure before and after."""
    return " -> ".join(f"{np.mean([figure(pair[k]) for pair in pairs]):.3f}" for k in range(2)) if pairs else ""


def _factor(pairs: Pairs, figure: Callable[[dict[str, Any]], float]) -> str:
    """Return the geometric mean of the factors that a figure has changed by."""
    logs = [np.log((figure(after) + EXACT) / (figure(before) + EXACT)) for before, after in pairs]
    return f"x {np.exp(np.mean(logs)):.2f}"


def mean(rows: list[dict[str, Any]], name: str) -> float:
    return float(np.mean([row[name] for row in rows]))


def geometric_mean(rows: list[dict[str, Any]], name: str) -> float:
    """Return the geometric mean of figures, of which exact results (0) count as 1e-16."""
    return float(np.exp(np.mean(np.log([max(row[name], 1e-16) for row in rows]))))


def read_rows(path: Path, newest: str = "over_quadric") -> list[dict[str, Any]]:
    """Return the rows of earlier calls that have the figure added last; the ones of older versions are left out."""
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return [row for row in rows if newest in row]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1.0, 0.2, 0.1])
    parser.add_argument("--sharpness", type=float, nargs="+", default=[7.0, 1.0])
    parser.add_argument("--metric", nargs="+", default=["curvature"], choices=["curvature", "approximation"])
    parser.add_argument("--folders", nargs="+", default=["test"], help="subfolders of ANISOMESH_DATA")
    parser.add_argument("--only", default="", help="run only meshes with this in their names")
    parser.add_argument("--kind", choices=[BAD, CAD, SMOOTH], help="run only meshes of this kind")
    parser.add_argument("--fresh", action="store_true", help="discard earlier rows")
    parser.add_argument("--before", type=Path, help="rows of another version to compare with")
    options = parser.parse_args()
    if "ANISOMESH_DATA" not in os.environ:
        sys.exit("set ANISOMESH_DATA to the folder of meshes")
    OUT.parent.mkdir(exist_ok=True)
    if options.fresh:
        OUT.unlink(missing_ok=True)
    rows = read_rows(OUT)
    chosen = [
        case
        for case in cases(Path(os.environ["ANISOMESH_DATA"]), options.folders)
        if options.only in case.name and options.kind in (None, case.kind)
    ]
    runs = [
        Run(case, ratio, sharpness, metric)
        for metric in options.metric
        for ratio in options.ratios
        for sharpness in options.sharpness
        for case in chosen
    ]
    done = {key_of(row) for row in rows}
    todo = [run for run in runs if run.key not in done]
    for number, run in enumerate(todo, 1):
        title = f"[{number}/{len(todo)}] {run.case.name[:34]:<34} {run.metric} {run.ratio:.0%} s={run.sharpness:g}"
        try:
            row = measure(run)
        except Exception as error:  # a crash is a result too
            print(f"{title}: {error!r}", file=sys.stderr)
            continue
        rows.append(row)
        with OUT.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(
            f"{title} G {row['g_mean']:.3f} E2 {row['mean_square'] * 1e7:.2f}e-7 x {row['over_quadric']:.2f} "
            f"HD {row['hausdorff'] * 1e3:.2f}e-3 {row['seconds']['total']:.2f} s {' '.join(faults(row))}",
            file=sys.stderr,
            flush=True,
        )
    asked = {run.key for run in runs}
    rows = [row for row in rows if key_of(row) in asked]
    print(tables(rows))
    if options.before is not None:
        print(comparison(read_rows(options.before, newest="flat_quality"), rows), sep="\n")


if __name__ == "__main__":
    main()

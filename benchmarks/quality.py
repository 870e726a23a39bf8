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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import anisomesh
from anisomesh import MetricField, RemeshResult, Surface
from anisomesh.bench.methods import METHODS
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import surface_distance
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.transfer import transfer_to_corners
from quality_tables import EXACT, comparison, faults, key_of, tables

OUT = Path(__file__).parent / "out" / "quality.jsonl"


BAD, CAD, SMOOTH = "bad triangles", "CAD", "smooth"
MIN_QUALITY = 0.7  # area-weighted mean quality of the triangles, below which a mesh is badly triangulated
FLAT_HEIGHT = 1e-6  # of the diagonal: corners this near to the plane of the closest input facet lie in it
IN_PLANE = 1e-7  # of the diagonal: about as single precision rounds coordinates
PLACES = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [18, 1, 1], [1, 18, 1], [1, 1, 18]], dtype=np.float64)
"""Barycentric coordinates, times a factor, of places of a triangle at which it is compared with the input."""


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


def vertices_at_planes(result: RemeshResult) -> tuple[int, int]:
    """Return how many vertices have a triangle over one plane of the input, and how many of these are off the plane.

    A triangle is over a plane if the input facets closest to several places of it have that plane.
    """
    reference, mesh = result.prepared, result.surface
    places = np.einsum("kc,fcx->fkx", PLACES / PLACES.sum(axis=1, keepdims=True), mesh.points[mesh.faces])
    facet = ClosestPoints(reference).locate(places.reshape(-1, 3))[0].reshape(len(mesh.faces), -1)
    normal = reference.face_normals[facet]
    height = np.einsum("fkx,fkx->fk", normal, reference.points[reference.faces[facet, 0]])
    tolerance = IN_PLANE * reference.diagonal
    over = (np.ptp(height, axis=1) < tolerance) & (np.ptp(normal, axis=1).max(axis=1) < IN_PLANE)
    off = np.abs(np.einsum("fcx,fx->fc", mesh.points[mesh.faces[over]], normal[over, 0]) - height[over, :1]) > tolerance
    return len(np.unique(mesh.faces[over])), len(np.unique(mesh.faces[over][off]))


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
        "at_planes": vertices_at_planes(result),
        "mean_square": distance.mean_square_ab + distance.mean_square_ba,
        "over_quadric": (distance.rms + EXACT) / (quadric.rms / result.prepared.diagonal + EXACT),
        "hausdorff": distance.hausdorff,
        "creases": evaluation.features.crease_covered,
        **result.report(),
    }


def read_rows(path: Path, newest: str = "at_planes") -> list[dict[str, Any]]:
    """Return the rows of earlier calls that have the figure added last; the ones of older versions are left out."""
    rows = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    return [row for row in rows if newest in row]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1.0, 0.2, 0.1])
    parser.add_argument("--sharpness", type=float, nargs="+", default=[7.0, 1.0])
    parser.add_argument("--metric", nargs="+", default=["curvature"], choices=["curvature", "approximation"])
    parser.add_argument("--folders", nargs="+", default=["test"], help="subfolders of ANISOMESH_DATA")
    parser.add_argument("--only", default="", help="run only meshes with this in their names")
    parser.add_argument("--kind", choices=[BAD, CAD, SMOOTH], help="run only meshes of this kind")
    parser.add_argument("--fresh", action="store_true", help="discard earlier rows")
    parser.add_argument("--before", type=Path, help="rows of another version to compare with")
    return parser.parse_args()


def main() -> None:
    options = arguments()
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

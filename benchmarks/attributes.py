"""What remeshes of real meshes keep of regions, data and charts: smooth ones, CAD parts, badly triangulated ones.

Usage: python benchmarks/attributes.py [--folders test] [--ratio 0.2] [--only NAME]

Regions are the parts between creases; a mesh without creases is halved across its longest axis. Coordinates are carried
as point data, and as texture coordinates with a chart for each region, so the right values are known everywhere.

Columns: kind; meshes; regions of the inputs; regions of the results; share of the area in another region than before
(median and largest of the meshes); error of the point data over the diagonal (root mean square over the vertices,
largest of the meshes); error of the texture coordinates over the diagonal (median of the meshes); lost regions without
a warning; share of the time that carrying all this takes.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import anisomesh
from anisomesh import Mesh, Regions, Surface
from anisomesh.metric.patches import smooth_patches
from quality import Case, cases

CREASE_ANGLE = 40.0
HEADER = (
    "| kind | meshes | regions | kept | area off, median | largest | points off | chart off, median | lost unsaid "
    "| time |"
)


@dataclass(frozen=True)
class Row:
    """What a remesh of a mesh keeps."""

    kind: str
    regions: int
    kept: int
    area_off: float
    points_off: float
    chart_off: float
    unsaid: int
    share_of_time: float


def labels_of(surface: Surface) -> npt.NDArray[np.int64]:
    """Return the region of each face (F,)."""
    patches = smooth_patches(surface, CREASE_ANGLE, 1).labels
    if patches.max() > 0:
        return patches.astype(np.int64) + 1
    axis = int(np.argmax(np.ptp(surface.points, axis=0)))
    along = surface.points[surface.faces, axis].mean(axis=1)
    return 1 + (along > np.median(along)).astype(np.int64)


def areas(surface: Surface, labels: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.float64]:
    """Return the share of the area in each region (count,)."""
    return np.bincount(labels, surface.face_areas, count) / surface.area


def measure(case: Case, ratio: float) -> Row:
    """Return what a remesh of a mesh keeps."""
    surface = anisomesh.load(case.path)
    labels = labels_of(surface)
    count = int(labels.max()) + 1
    corners = surface.points[surface.faces]
    given = Mesh(
        surface=surface,
        point_data={"place": surface.points},
        corner_data={"uv": corners[..., :2] + 2.0 * surface.diagonal * labels[:, None, None]},
        regions={"part": Regions(labels)},
    )
    result = anisomesh.remesh(given, ratio=ratio, embedding="direct")
    mesh, made = result.mesh, result.surface
    found = mesh.regions["part"].labels
    before, after = areas(surface, labels, count), areas(made, found, count)
    chart = mesh.corner_data["uv"] - 2.0 * surface.diagonal * found[:, None, None] - made.points[made.faces][..., :2]
    present = np.unique(found)
    lost = np.setdiff1d(np.unique(labels), present)
    return Row(
        kind=case.kind,
        regions=len(np.unique(labels)),
        kept=len(present),
        area_off=0.5 * float(np.abs(after - before).sum()),
        points_off=float(np.sqrt(((mesh.point_data["place"] - made.points) ** 2).sum(axis=1).mean())) / made.diagonal,
        chart_off=float(np.median(np.abs(chart))) / surface.diagonal,
        unsaid=len(lost) if len(lost) and not any("regions have lost area" in text for text in result.warnings) else 0,
        share_of_time=result.seconds["attributes"] / result.seconds["total"],
    )


def table(rows: list[Row]) -> str:
    """Return a row for each kind of mesh."""
    kinds = defaultdict(list)
    for row in rows:
        kinds[row.kind].append(row)
    lines = [HEADER, "|" + "---|" * 10]
    for kind, group in sorted(kinds.items()):
        off = [row.area_off for row in group]
        cells = (
            kind,
            f"{len(group)}",
            f"{sum(row.regions for row in group):,}",
            f"{sum(row.kept for row in group):,}",
            f"{np.median(off):.1e}",
            f"{max(off):.1e}",
            f"{max(row.points_off for row in group):.1e}",
            f"{np.median([row.chart_off for row in group]):.1e}",
            f"{sum(row.unsaid for row in group)}",
            f"{np.mean([row.share_of_time for row in group]):.1%}",
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folders", nargs="+", default=["test"], help="subfolders of ANISOMESH_DATA")
    parser.add_argument("--ratio", type=float, default=0.2)
    parser.add_argument("--only", default="", help="run only meshes with this in their names")
    options = parser.parse_args()
    if "ANISOMESH_DATA" not in os.environ:
        sys.exit("set ANISOMESH_DATA to the folder of meshes")
    chosen = [case for case in cases(Path(os.environ["ANISOMESH_DATA"]), options.folders) if options.only in case.name]
    rows = []
    for number, case in enumerate(chosen, 1):
        rows.append(measure(case, options.ratio))
        print(f"[{number}/{len(chosen)}] {case.name}: {rows[-1]}", file=sys.stderr, flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()

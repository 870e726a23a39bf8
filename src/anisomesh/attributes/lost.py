"""What of everything that a mesh carries is lost on another mesh of the same surface."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from anisomesh.attributes.model import Mesh

_LOST_SHARE = 0.1  # of the area of a region, or of the length of lines, that may be lost without a remark
_MAX_LOST_NAMED = 5  # regions and lines


def losses_of_attributes(before: Mesh, after: Mesh) -> Iterator[str]:
    """Yield one sentence for everything that a mesh carries in another form than the mesh it was made from, or not."""
    moved = sorted(set(after.corner_data) - set(before.corner_data))
    if moved:
        names = ", ".join(moved)
        yield f"point data with different values at coincident points are corner data of the result: {names}"
    yield from _shrunk_regions(before, after)
    yield from _lost_curves(before, after)
    yield from _shorter_lines(before, after)
    used = before.fixed_points[np.isin(before.fixed_points, before.surface.faces)]
    unused = len(np.unique(before.fixed_points)) - len(np.unique(used))
    if unused:
        yield f"fixed points that no face uses are left out: {unused:,}"
    n = len(np.unique(before.surface.points[used], axis=0))
    lost = n - len(after.fixed_points)
    if lost > 0:
        yield f"{lost:,} of {n:,} fixed points have no vertex of the result; ask for more vertices"


def _shrunk_regions(before: Mesh, after: Mesh) -> Iterator[str]:
    """Yield a sentence if regions are lost or have lost a considerable part of their area."""
    lost = []
    for division, regions in before.regions.items():
        if division not in after.regions:
            continue
        labels, own = np.unique(regions.labels, return_inverse=True)
        old = np.bincount(own, before.surface.face_areas, minlength=len(labels))
        kept = np.isin(after.regions[division].labels, labels)
        place = np.searchsorted(labels, after.regions[division].labels[kept])
        new = np.bincount(place, after.surface.face_areas[kept], minlength=len(labels))
        for k in np.flatnonzero(new < (1.0 - _LOST_SHARE) * old):
            name = regions.names.get(int(labels[k]), f"{division} {labels[k]}")
            lost.append(f"{name} ({new[k] / old[k] - 1.0:+.0%})")
    if lost:
        yield f"regions have lost area: {_listed(lost)}; ask for more vertices"


def _lost_curves(before: Mesh, after: Mesh) -> Iterator[str]:
    """Yield a sentence if no edge of the result is in a region of prescribed edges."""
    lost = []
    for division, regions in before.feature_regions.items():
        found = after.feature_regions.get(division)
        gone = np.setdiff1d(regions.labels, 0 if found is None else np.append(found.labels, 0))
        lost += [regions.names.get(label, f"{division} {label}") for label in gone.tolist()]
    if lost:
        yield f"no edges follow the lines {_listed(lost)}; ask for more vertices"


def _shorter_lines(before: Mesh, after: Mesh) -> Iterator[str]:
    """Yield a sentence if a considerable part of the prescribed edges has no edges of the result along it."""
    old, new = (_length(mesh) for mesh in (before, after))
    if new < (1.0 - _LOST_SHARE) * old:
        yield f"edges along prescribed lines are shorter in all ({new / old - 1.0:+.0%}); ask for more vertices"


def _listed(names: Sequence[str]) -> str:
    """Return some names, and the number of further ones."""
    more = f" and {len(names) - _MAX_LOST_NAMED:,} more" if len(names) > _MAX_LOST_NAMED else ""
    return ", ".join(names[:_MAX_LOST_NAMED]) + more


def _length(mesh: Mesh) -> float:
    """Return the length of the features of a mesh, each counted once."""
    ends = mesh.surface.points[np.unique(np.sort(mesh.features, axis=1), axis=0)]
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())

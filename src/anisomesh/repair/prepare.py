"""Repair of any triangle soup to an oriented manifold surface."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, Faces, Indices, PointLabels
from anisomesh.errors import MeshError, OptionError
from anisomesh.mesh import geometry, topology
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.weld import coincident
from anisomesh.repair import degenerate, duplicates, one_sided, orientation, t_junctions
from anisomesh.repair.near_points import weld_distance

logger = logging.getLogger(__name__)

_MAX_COORDINATE = 1e152  # and inverse of the least extent, so that squares neither overflow nor underflow in float64
_MAX_REPAIR_PASSES = 20  # two or three are enough in practice; heuristic
_MAX_WELD_TOLERANCE = 0.1  # of the bounding-box diagonal; heuristic

_CHANGE_DESCRIPTIONS = {
    "points_welded": "{} point(s) merged with a coincident point",
    "faces_degenerate": "{} face(s) without area removed or merged into a neighbour",
    "faces_duplicate": "{} duplicate face(s) removed",
    "points_unreferenced": "{} unused point(s) removed",
    "faces_flipped": "{} face(s) reversed to agree with their neighbours",
    "sides_split": "{} side(s) split at points of other faces that lie on them",
    "edges_nonmanifold_cut": "{} edge(s) with more than two faces cut apart",
    "edges_nonorientable_cut": "{} edge(s) cut open because the surface is not orientable",
    "points_nonmanifold_split": "{} point(s) added to split non-manifold points",
}


@dataclass(frozen=True, kw_only=True)
class PrepareReport:
    """Counts of the changes made by :func:`prepare`; all except ``components`` are zero for a clean surface.

    Attributes
    ----------
    points_welded
        Points merged into another point.
    faces_degenerate
        Faces without area, removed or flipped into a neighbour.
    faces_duplicate
        Removed faces with the same three points as another face.
    points_unreferenced
        Removed points that no face used.
    faces_flipped
        Faces whose orientation was reversed.
    sides_split
        Sides of faces that were split where points of other faces lie on them (T-junctions).
    edges_nonmanifold_cut
        Edges with more than two faces, cut apart.
    edges_nonorientable_cut
        Edges cut open because their component is not orientable, as a Moebius strip.
    points_nonmanifold_split
        Copies of points added so that the faces at each point form one fan.
    components
        Connected components of the result.
    """

    points_welded: int = 0
    faces_degenerate: int = 0
    faces_duplicate: int = 0
    points_unreferenced: int = 0
    faces_flipped: int = 0
    sides_split: int = 0
    edges_nonmanifold_cut: int = 0
    edges_nonorientable_cut: int = 0
    points_nonmanifold_split: int = 0
    components: int = 1

    @property
    def changed(self) -> bool:
        """Whether anything was changed."""
        return any(getattr(self, each.name) for each in fields(self) if each.name != "components")

    def lines(self) -> list[str]:
        """Return a line of text for each kind of change that was made."""
        counts = {name: getattr(self, name) for name in _CHANGE_DESCRIPTIONS}
        return [_CHANGE_DESCRIPTIONS[name].format(f"{count:,}") for name, count in counts.items() if count]


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """An oriented manifold surface and its relation to the input.

    Attributes
    ----------
    surface
        Every edge has at most two faces, consistently oriented, and the faces at each point form one fan.
    report
        The changes.
    point_source
        For every point (V,) an input point at the same position, up to the weld tolerance and the length below which
        sides of faces are collapsed (about 1e-14 of the longest side).
    junctions
        Which of its edges (E,) are parts of non-manifold edges that were cut apart.
    """

    surface: Surface
    report: PrepareReport
    point_source: PointLabels
    junctions: EdgeMask


def prepare(surface: Surface, *, weld_tolerance: float | Literal["auto"] = 0.0) -> Prepared:
    """Make any triangle mesh an oriented manifold, with as few changes as possible.

    Parameters
    ----------
    surface
        Any triangle mesh.
    weld_tolerance
        Points up to this distance, in model units, are merged; 0 merges equal points only, ``"auto"`` is 1e-5 of the
        bounding-box diagonal.

    Returns
    -------
    Prepared
        A surface that needs no repair is returned as the same object, even if parts of it coincide.

    Raises
    ------
    MeshError
        If no face with an area remains, or coordinates or the extent are beyond the range of float64 areas.
    OptionError
        If the tolerance is negative, not finite, or above a tenth of the bounding-box diagonal.

    Notes
    -----
    The steps of a pass are: weld points; remove degenerate and duplicate faces; split sides at T-junctions; orient each
    component by the larger part of its area, cutting edges where that is impossible; glue faces at edges with two
    faces, and at other edges the pairs that bound the same wedge of the solid, so that two cubes sharing an edge become
    two closed cubes; give each fan of faces its own point. Passes are repeated until nothing changes, so that a second
    call of this function changes nothing. A clean surface is checked in linear time but for a sort of its points; in
    repairs sorting dominates, O((V + F) log(V + F)).
    """
    _check_range(surface)
    tolerance = weld_distance(surface, weld_tolerance)
    _check_tolerance(surface, tolerance)
    passes = [_repair_once(surface, tolerance)]
    while passes[-1].changed and len(passes) < _MAX_REPAIR_PASSES:
        passes.append(_repair_once(passes[-1].surface, tolerance))
    result = passes[-1].surface
    source = passes[0].source
    for later in passes[1:]:
        source = source[later.source]
    n_used, n_sources = (int(topology.used_points(each, surface.n_points).sum()) for each in (surface.faces, source))
    report = PrepareReport(
        points_welded=max(n_used - n_sources, 0),
        faces_degenerate=sum(each.n_degenerate for each in passes),
        faces_duplicate=sum(each.n_duplicate for each in passes),
        points_unreferenced=surface.n_points - n_used,
        faces_flipped=sum(each.n_flipped for each in passes),
        sides_split=sum(each.n_split for each in passes),
        edges_nonmanifold_cut=passes[0].n_nonmanifold_edges if passes[0].changed else 0,
        edges_nonorientable_cut=passes[-1].n_conflicts if passes[0].changed else 0,
        points_nonmanifold_split=result.n_points - n_sources,
        components=topology.connected_components(result.faces, result.n_points)[0],
    )
    for line in report.lines():
        logger.info("prepare: %s", line)
    cut = np.concatenate([each.cut for each in passes])
    return Prepared(surface=result, report=report, point_source=source, junctions=_edges_at(result, cut))


@dataclass(frozen=True, kw_only=True)
class _RepairPass:
    """The result of one pass, the input point of each of its points, and where edges were cut apart (n, 2, 3)."""

    surface: Surface
    source: PointLabels
    changed: bool
    n_degenerate: int = 0
    n_duplicate: int = 0
    n_flipped: int = 0
    n_split: int = 0
    n_nonmanifold_edges: int = 0
    n_conflicts: int = 0
    cut: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 3)))


def _repair_once(surface: Surface, tolerance: float) -> _RepairPass:
    """Run all steps once; sides without a partner may find one in the next pass."""
    labels = _weld(surface, tolerance)
    if _is_clean(surface, labels, tolerance):
        return _RepairPass(surface=surface, source=np.arange(surface.n_points, dtype=np.int32), changed=False)
    n_degenerate = int(degenerate.is_degenerate(surface.points, labels[surface.faces]).sum())
    faces, labels = degenerate.remove_degenerate(surface.points, surface.faces, labels)
    n_nondegenerate = len(faces)
    faces = faces[duplicates.select_unique_faces(labels[faces])]
    if len(faces) == 0:
        raise MeshError(degenerate.why_none_is_left(surface, tolerance))
    n_unique = len(faces)
    faces, _, n_split = t_junctions.split_at_t_junctions(surface.points, faces, labels, tolerance)
    pairs, nonmanifold = orientation.pair_sides(faces, labels[faces])
    areas = 0.5 * np.linalg.norm(geometry.face_cross(surface.points, labels[faces]), axis=1)
    found = orientation.find_orientation(labels[faces], pairs, areas)
    if found.conflict.any():
        found = one_sided.with_short_cuts(surface.points, labels[faces], pairs, areas, found)
    faces[found.flip] = faces[found.flip][:, [0, 2, 1]]
    pairs = orientation.renumber_sides(pairs[~found.conflict], found.flip)
    nonmanifold = orientation.renumber_sides(nonmanifold, found.flip)
    welded = labels[faces]
    cut = surface.points[topology.half_edges(welded)[nonmanifold]]
    pairs = np.concatenate([pairs, orientation.pair_nonmanifold_sides(surface.points, welded, nonmanifold)])
    source, new_faces = _order_points(faces, *orientation.split_points(welded, pairs))
    points = surface.points[labels[source]]
    changed = not (np.array_equal(new_faces, surface.faces) and np.array_equal(points, surface.points))
    return _RepairPass(
        surface=Surface(points, new_faces) if changed else surface,
        source=source,
        changed=changed,
        n_degenerate=n_degenerate,
        n_duplicate=n_nondegenerate - n_unique,
        n_split=n_split,
        n_flipped=int(found.flip.sum()),
        n_nonmanifold_edges=len(np.unique(topology.edges_of(welded)[1].ravel()[nonmanifold])),
        n_conflicts=int(found.conflict.sum()),
        cut=cut,
    )


def _edges_at(surface: Surface, places: npt.NDArray[np.float64]) -> EdgeMask:
    """Return which edges (E,) of a surface have both their ends at the ends of one of some edges (n, 2, 3)."""
    if len(places) == 0:
        return np.zeros(len(surface.edges), dtype=bool)
    everywhere = np.concatenate([surface.points, places.reshape(-1, 3)])
    place = np.unique(everywhere, axis=0, return_inverse=True)[1].reshape(-1)
    wanted = topology.edge_keys(place[surface.n_points :].reshape(-1, 2))
    return np.isin(topology.edge_keys(place[surface.edges]), wanted)


def _check_range(surface: Surface) -> None:
    size, extent = float(np.abs(surface.points).max()), float(np.ptp(surface.points, axis=0).max())
    least = 1.0 / _MAX_COORDINATE
    if size > _MAX_COORDINATE or 0.0 < extent < least:
        raise MeshError(
            f"the mesh has extent {extent:.3g} and coordinates up to {size:.3g}; expected {least:.0e} to "
            f"{_MAX_COORDINATE:.0e}, beyond which areas overflow or vanish; scale it"
        )


def _check_tolerance(surface: Surface, tolerance: float) -> None:
    limit = _MAX_WELD_TOLERANCE * surface.diagonal
    if not (np.isfinite(tolerance) and tolerance >= 0) or (tolerance > limit and tolerance > 0):
        raise OptionError(
            f"weld_tolerance is {tolerance:g}; expected a length in model units from 0 to {limit:g}, a tenth of the "
            "bounding-box diagonal, or 'auto'"
        )


def _weld(surface: Surface, tolerance: float) -> PointLabels:
    """Return the lowest coincident point of every point (V,); unused points are ignored."""
    used = np.flatnonzero(topology.used_points(surface.faces, surface.n_points))
    labels = np.arange(surface.n_points, dtype=np.int32)
    labels[used] = used[coincident(surface.points[used], tolerance)]
    return labels


def _is_clean(surface: Surface, labels: PointLabels, tolerance: float) -> bool:
    """Return whether no repair is needed; coincident points are accepted unless welding them would close a gap."""
    faces, across = surface.faces, surface.face_neighbours
    if not topology.used_points(faces, surface.n_points).all() or surface.edge_face_count.max() > 2:
        return False
    is_twin = (across[:, 0] == across[:, 1]) & (across[:, 0] >= 0)  # of its neighbour: they have the same three points
    return bool(
        topology.is_oriented(faces)
        and topology.has_single_fans(faces, across)
        and not is_twin.any()
        and not degenerate.is_degenerate(surface.points, labels[faces]).any()
        and _leaves_open(surface, labels, tolerance)
    )


def _leaves_open(surface: Surface, labels: PointLabels, tolerance: float) -> bool:
    """Return whether welding points, and splitting sides at T-junctions, would close no gap."""
    open_sides = surface.edge_face_count[surface.face_edges.ravel()] == 1
    if not open_sides.any():
        return True
    gaps = topology.edges_of(labels[surface.faces])[1].ravel()[open_sides]
    if len(np.unique(gaps)) < len(gaps):
        return False
    return t_junctions.split_at_t_junctions(surface.points, surface.faces, labels, tolerance).n_split == 0


def _order_points(faces: Faces, n_points: int, corner_point: Indices) -> tuple[PointLabels, Faces]:
    """Sort points by the lowest input point at their corners; return this point (V,) and the faces (F, 3)."""
    source = np.full(n_points, np.iinfo(np.int32).max, dtype=np.int32)
    np.minimum.at(source, corner_point, faces.ravel())
    order = np.argsort(source, kind="stable")
    position = np.empty(n_points, dtype=np.int32)
    position[order] = np.arange(n_points)
    return source[order], position[corner_point].reshape(-1, 3)

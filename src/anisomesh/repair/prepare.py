"""Turning any triangle soup into oriented manifold orientation."""

from __future__ import annotations

import logging
from dataclasses import dataclass, fields

import numpy as np

from anisomesh._arrays import Faces, Indices, PointLabels
from anisomesh.errors import MeshError, OptionError
from anisomesh.mesh import geometry, topology
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.weld import coincident
from anisomesh.repair import degenerate, duplicates, orientation

logger = logging.getLogger(__name__)

LARGEST = 1e152  # of a coordinate, whose square is a number
MAX_STEPS = 20

WELD_LIMIT = 0.1
"""Largest weld tolerance, as a fraction of the diagonal of the bounding box."""

SENTENCES = {
    "points_welded": "{} point(s) merged with a coincident one",
    "faces_degenerate": "{} face(s) without area removed or merged into a neighbour",
    "faces_duplicate": "{} face(s) removed that repeat another one",
    "points_unreferenced": "{} point(s) removed that no face uses",
    "faces_flipped": "{} face(s) turned over to agree with their neighbours",
    "edges_nonmanifold_cut": "{} edge(s) with more than two faces separated into sheets",
    "edges_nonorientable_cut": "{} edge(s) cut open since no orientation agrees across them",
    "points_nonmanifold_split": "{} point(s) copied to separate the sheets that met there",
}


@dataclass(frozen=True, kw_only=True)
class PrepareReport:
    """What :func:`prepare` did; all counts but the number of components are zero for a clean surface.

    Parameters
    ----------
    points_welded
        Points that were merged into another one.
    faces_degenerate
        Faces without area that were removed, or exchanged for a split of their neighbour.
    faces_duplicate
        Faces with the same three points as another face.
    points_unreferenced
        Points that no face used.
    faces_flipped
        Faces whose orientation was turned.
    edges_nonmanifold_cut
        Edges that had more than two faces.
    edges_nonorientable_cut
        Edges cut open because the component is not orientable (a Moebius strip).
    points_nonmanifold_split
        Copies of points added to separate orientation.
    components
        Connected components of the result.
    """

    points_welded: int = 0
    faces_degenerate: int = 0
    faces_duplicate: int = 0
    points_unreferenced: int = 0
    faces_flipped: int = 0
    edges_nonmanifold_cut: int = 0
    edges_nonorientable_cut: int = 0
    points_nonmanifold_split: int = 0
    components: int = 1

    @property
    def changed(self) -> bool:
        """Whether anything was done."""
        return any(getattr(self, field.name) for field in fields(self) if field.name != "components")

    def lines(self) -> list[str]:
        """Return one sentence for each kind of change."""
        return [text.format(f"{getattr(self, name):,}") for name, text in SENTENCES.items() if getattr(self, name)]


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """An oriented manifold surface and where it comes from.

    Parameters
    ----------
    surface
        Every edge has at most two faces, which agree in orientation; the faces at each point form one fan.
    report
        What was done.
    point_source
        An input point for every point (V,), at the same place up to the weld tolerance and the rounding error below
        which a side of a face has no length.
    """

    surface: Surface
    report: PrepareReport
    point_source: PointLabels


def prepare(surface: Surface, *, weld_tolerance: float = 0.0) -> Prepared:
    """Make any triangle mesh an oriented manifold, with as little change as it takes.

    Parameters
    ----------
    surface
        Any triangle mesh.
    weld_tolerance
        Points up to this distance (model units) become one. Equal points always do.

    Returns
    -------
    Prepared
        A surface that needs nothing comes back as the same object, even where parts of it coincide.

    Raises
    ------
    MeshError
        If no face with an area is left, or the coordinates are too large or too small to compute with.
    OptionError
        If the tolerance is negative, not finite, or above a tenth of the diagonal of the bounding box.

    Notes
    -----
    In order: weld; remove degenerate and duplicate faces (of duplicates the first is kept, but for flaps); orient each
    component as the larger part of its area is, cutting what cannot be oriented; glue the faces again at edges
    with two faces, and at others those that bound the same wedge of material, so that two cubes sharing an edge
    become two closed cubes; give every fan of faces its own point. This is repeated until nothing changes (two or
    three times in practice), so that preparing twice does nothing more. Sorting
    dominates the cost: O((V + F) log(V + F)).
    """
    _check_range(surface)
    _check_tolerance(surface, weld_tolerance)
    steps = [_step(surface, weld_tolerance)]
    while steps[-1].changed and len(steps) < MAX_STEPS:
        steps.append(_step(steps[-1].surface, weld_tolerance))
    result = steps[-1].surface
    source = steps[0].source
    for step in steps[1:]:
        source = source[step.source]
    used, kept = len(np.unique(surface.faces)), len(np.unique(source))
    report = PrepareReport(
        points_welded=max(used - kept, 0),
        faces_degenerate=sum(step.n_degenerate for step in steps),
        faces_duplicate=sum(step.n_duplicate for step in steps),
        points_unreferenced=surface.n_points - used,
        faces_flipped=sum(step.n_flipped for step in steps),
        edges_nonmanifold_cut=steps[0].n_crowded if steps[0].changed else 0,
        edges_nonorientable_cut=steps[-1].n_conflicts if steps[0].changed else 0,
        points_nonmanifold_split=result.n_points - kept,
        components=topology.connected_components(result.faces, result.n_points)[0],
    )
    for line in report.lines():
        logger.info("prepare: %s", line)
    return Prepared(surface=result, report=report, point_source=source)


@dataclass(frozen=True, kw_only=True)
class _Step:
    surface: Surface
    source: PointLabels
    changed: bool
    n_degenerate: int = 0
    n_duplicate: int = 0
    n_flipped: int = 0
    n_crowded: int = 0
    n_conflicts: int = 0


def _step(surface: Surface, tolerance: float) -> _Step:
    """Do everything once: sides that find no partner now may find one the next time."""
    labels = _weld(surface, tolerance)
    if _is_clean(surface, labels):
        return _Step(surface=surface, source=np.arange(surface.n_points, dtype=np.int32), changed=False)
    n_degenerate = int(degenerate.is_degenerate(surface.points, labels[surface.faces]).sum())
    faces, labels = degenerate.remove_degenerate(surface.points, surface.faces, labels)
    n_nondegenerate = len(faces)
    faces = faces[duplicates.kept(labels[faces])]
    if len(faces) == 0:
        raise MeshError(f"none of the {surface.n_faces} faces has an area; nothing is left to work on")
    pairs, crowded = orientation.glue(faces, labels[faces])
    areas = 0.5 * np.linalg.norm(geometry.face_cross(surface.points, labels[faces]), axis=1)
    found = orientation.orient(labels[faces], pairs, areas)
    faces[found.flip] = faces[found.flip][:, [0, 2, 1]]
    pairs, crowded = (orientation.turn(sides, found.flip) for sides in (pairs[~found.conflict], crowded))
    welded = labels[faces]
    pairs = np.concatenate([pairs, orientation.wedge_pairs(surface.points, welded, crowded)])
    source, new_faces = _numbered(faces, *orientation.settle(welded, pairs))
    points = surface.points[labels[source]]
    changed = not (np.array_equal(new_faces, surface.faces) and np.array_equal(points, surface.points))
    return _Step(
        surface=Surface(points, new_faces) if changed else surface,
        source=source,
        changed=changed,
        n_degenerate=n_degenerate,
        n_duplicate=n_nondegenerate - len(faces),
        n_flipped=int(found.flip.sum()),
        n_crowded=len(np.unique(topology.edges_of(welded)[1].ravel()[crowded])),
        n_conflicts=int(found.conflict.sum()),
    )


def _check_range(surface: Surface) -> None:
    size, extent = float(np.abs(surface.points).max()), float(np.ptp(surface.points, axis=0).max())
    if size > LARGEST or 0.0 < extent < 1.0 / LARGEST:
        raise MeshError(
            f"the mesh is {extent:.3g} wide with coordinates up to {size:.3g}; scale it to between {1.0 / LARGEST:.0e} "
            f"and {LARGEST:.0e}, beyond which areas overflow or vanish"
        )


def _check_tolerance(surface: Surface, tolerance: float) -> None:
    limit = WELD_LIMIT * surface.diagonal
    if not (np.isfinite(tolerance) and tolerance >= 0) or (tolerance > limit and tolerance > 0):
        raise OptionError(
            f"weld_tolerance is {tolerance:g}; expected a length in model units from 0 to {limit:g}, a tenth of the "
            "diagonal of the bounding box"
        )


def _weld(surface: Surface, tolerance: float) -> PointLabels:
    """Return the lowest coincident point of every point; unused points take no part."""
    used = np.unique(surface.faces)
    labels = np.arange(surface.n_points, dtype=np.int32)
    labels[used] = used[coincident(surface.points[used], tolerance)]
    return labels


def _is_clean(surface: Surface, labels: PointLabels) -> bool:
    """Return whether nothing needs to be done; coincident points are welcome unless they could close a gap."""
    faces, used = surface.faces, np.unique(surface.faces)
    if len(used) < surface.n_points or surface.edge_face_count.max() > 2 or not topology.is_oriented(faces):
        return False
    open_sides = surface.edge_face_count[surface.face_edges.ravel()] == 1
    gaps = topology.edges_of(labels[faces])[1].ravel()[open_sides]
    return bool(
        len(np.unique(gaps)) == len(gaps)
        and topology.count_nonmanifold_points(faces) == 0
        and not degenerate.is_degenerate(surface.points, labels[faces]).any()
        and duplicates.kept(faces).all()
    )


def _numbered(faces: Faces, n_points: int, corner_point: Indices) -> tuple[PointLabels, Faces]:
    """Give points the order of the lowest input point at their corners; return that point and the faces."""
    source = np.full(n_points, np.iinfo(np.int32).max, dtype=np.int32)
    np.minimum.at(source, corner_point, faces.ravel())
    order = np.argsort(source, kind="stable")
    position = np.empty(n_points, dtype=np.int32)
    position[order] = np.arange(n_points)
    return source[order], position[corner_point].reshape(-1, 3)

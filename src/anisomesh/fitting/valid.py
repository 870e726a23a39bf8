"""Fits that add no faults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh._arrays import EdgeEnds
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.fitting.arrays import FitTask
from anisomesh.fitting.fit import FitOptions, fit_mesh
from anisomesh.fitting.target import FitTarget
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import with_neighbours
from anisomesh.mesh.validity import faulty_faces
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.held import Held, points_near_faces
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.self_intersections import remove_self_intersections

_MAX_HELD = 0.5  # share of the points of a decimation that are corners at most, to hold them
_MAX_REPAIRS = 50  # faulty triangles up to which a mesh is repaired before it is fitted again


def fit_without_faults(
    mesh: Surface, target: FitTarget, *, crease_edges: EdgeEnds, deadline: Deadline = NO_DEADLINE
) -> Surface:
    """Return a mesh fitted to a surface, with as many points and no more faults than it had before.

    Parameters
    ----------
    mesh
        A manifold mesh near the surface.
    target
        The surface.
    crease_edges
        Ends of edges of the mesh along creases (n, 2), which stay if creases are held.
    deadline
        When to end.

    Notes
    -----
    Where triangles are faulty after the fit they are repaired by local changes. If that does not help, the points of
    the mesh there and the edges between them are held, and the mesh is fitted again: once with exchange of points, then
    twice without. If faults are left, the mesh itself is returned.

    If the plan says so, a decimation of the surface is fitted in the same way, and the mesh only if faults are left
    on that. On machine parts it ends nearer, because the triangles of least error are longer on developable parts than
    an embedding reproduces.
    """
    max_faults = len(faulty_faces(mesh, target.reference))
    plan, fitted = target.plan, None
    if plan.decimation is not None and not target.holds_creases:
        start = _decimated(target, mesh.n_points)
        if start is not None:
            fitted = _fitted(start, target, plan.decimation, max_faults, deadline)
    if fitted is None:
        fitted = _fitted(target.task(mesh, crease_edges), target, plan.mesh, max_faults, deadline)
    return mesh if fitted is None else fitted


def _decimated(target: FitTarget, n_points: int) -> FitTask | None:
    """Return the task to fit the surface decimated to this many points, None if that is not possible."""
    surface = target.reference.surface
    held, anchored = target.at_corners(surface.points), target.anchors.held_in(surface.points)
    if np.count_nonzero(held & ~anchored) > _MAX_HELD * (n_points - np.count_nonzero(anchored)):
        held[:] = False
    start = decimate(surface, n_points, held=held | anchored, crease_edges=target.lines)
    return target.task(start.surface, start.crease_edges) if start.surface.n_points == n_points else None


def _fitted(
    task: FitTask, target: FitTarget, options: FitOptions, max_faults: int, deadline: Deadline
) -> Surface | None:
    """Return the mesh of a task fitted with no more than this many faults, None if that does not succeed."""
    mesh, without_exchange = task.mesh, replace(options, rounds=0)
    for how in (options, options, without_exchange, without_exchange):
        fitted = fit_mesh(task, target.samples, how, threads=target.plan.threads, deadline=deadline)
        faulty = faulty_faces(fitted, target.reference)
        if max_faults < len(faulty) <= _MAX_REPAIRS and not task.kept.any():
            fitted = _repaired(fitted, target, deadline)
            faulty = faulty_faces(fitted, target.reference)
        if len(faulty) <= max_faults:
            return fitted
        near = points_near_faces(mesh, fitted, faulty, rings=1)
        if task.held[near].all():
            near = with_neighbours(mesh.faces, near)
        task = replace(task, held=task.held | near, kept=task.kept | near[mesh.edges].all(axis=1))
    return None


def _repaired(mesh: Surface, target: FitTarget, deadline: Deadline) -> Surface:
    """Return a mesh with faults removed by local changes, itself if that takes more points."""
    reference, held = target.reference, Held(target.anchors.places)
    points, faces, _ = remove_inverted_triangles(mesh.points, mesh.faces, reference, held=held, deadline=deadline)
    points, faces, _ = remove_self_intersections(
        points, faces, reference, held=held, max_tries=_MAX_REPAIRS, deadline=deadline
    )
    return Surface(points, faces) if len(points) == mesh.n_points else mesh

"""What a mesh is fitted to, and a fit that leaves no fault behind."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import FaceLabels, PointMask, Points
from anisomesh.deadline import NO_DEADLINE, Deadline
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.features.network import FeatureNetwork
from anisomesh.fitting.fit import FitOptions, fit_mesh
from anisomesh.fitting.samples import SurfaceSamples, sample_surface
from anisomesh.fitting.state import FitTask
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import faulty_faces
from anisomesh.metric.field import MetricField

_SAME_PLACE = 1e-9  # at bounding-box diagonal 1
_SAMPLES_PER_VERTEX, _MIN_SAMPLES = 40, 10_000  # fewer than 40 are fitted better than the surface between them

EdgeEnds = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class FitTarget:
    """A surface that meshes are fitted to.

    Attributes
    ----------
    reference
        Closest points of the surface, at bounding-box diagonal 1.
    samples
        Samples of it.
    corners
        Corners of its creases, and apexes (n, 3): points of a mesh that are at one stay there.
    crease_angle
        Degrees from which on an edge is a crease.
    holds_creases
        Whether points on creases stay, since they were prescribed and the shape may not tell where they are.
    options
        How meshes are fitted.
    """

    reference: ClosestPoints
    samples: SurfaceSamples
    corners: Points
    crease_angle: float
    holds_creases: bool
    options: FitOptions = field(default_factory=FitOptions)

    @classmethod
    def of(
        cls,
        reference: ClosestPoints,
        metric: tuple[ClosestPoints, MetricField],
        features: tuple[Surface, FeatureNetwork],
        n_vertices: int,
        crease_angle: float,
        options: FitOptions | None = None,
    ) -> FitTarget:
        """Return the target for meshes of a number of vertices.

        Parameters
        ----------
        reference
            Closest points of the surface, at bounding-box diagonal 1.
        metric
            Closest points of the working surface, which may differ by a tolerance, and the metric on it.
        features
            A surface with the points of the working surface, and its creases.
        n_vertices
            Vertices of the meshes.
        crease_angle
            Degrees from which on an edge is a crease; 180 for none.
        options
            How meshes are fitted.
        """
        working, creases = features
        at_corner = corners(working, creases.sharp)
        at_corner[creases.apexes] = True
        samples = sample_surface(
            reference.surface,
            max(_SAMPLES_PER_VERTEX * n_vertices, _MIN_SAMPLES),
            creases=sharp_edges(reference.surface, crease_angle),
            metric=metric,
            rng=np.random.default_rng(0),
        )
        return cls(
            reference=reference,
            samples=samples,
            corners=working.points[at_corner],
            crease_angle=crease_angle,
            holds_creases=bool(creases.required.any()),
            options=FitOptions() if options is None else options,
        )

    def task(self, mesh: Surface, crease_edges: EdgeEnds) -> FitTask:
        """Return the task to fit a mesh with these edges (n, 2) along creases."""
        held = np.zeros(mesh.n_points, dtype=bool)
        if len(self.corners):
            held |= cKDTree(self.corners).query(mesh.points)[0] < _SAME_PLACE
        if self.holds_creases:
            held[crease_edges] = True
        kept = np.zeros(len(mesh.edges), dtype=bool)
        if self.holds_creases:
            kept = np.isin(edge_keys(mesh.edges), edge_keys(crease_edges))
        return FitTask(mesh=mesh, held=held, kept=kept, crease_angle=self.crease_angle)


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
    Where triangles are faulty after the fit, the points of the mesh and the edges between them are held, and the mesh
    is fitted again: once with exchange of points, then twice without. If faults are left, the mesh itself is returned.
    """
    task = target.task(mesh, crease_edges)
    bound = len(faulty_faces(mesh, target.reference))
    without_exchange = replace(target.options, rounds=0)
    for options in (target.options, target.options, without_exchange, without_exchange):
        fitted = fit_mesh(task, target.samples, options, deadline=deadline)
        faulty = faulty_faces(fitted, target.reference)
        if len(faulty) <= bound:
            return fitted
        near = _points_near(mesh, fitted, faulty)
        if task.held[near].all():
            near = _with_neighbours(mesh, near)
        task = replace(task, held=task.held | near, kept=task.kept | near[mesh.edges].all(axis=1))
    return mesh


def _points_near(mesh: Surface, fitted: Surface, faces: FaceLabels) -> PointMask:
    """Return which points of a mesh (V,) are nearest to these faces (n,) of the fitted mesh, and their neighbours."""
    places = fitted.points[np.unique(fitted.faces[faces])]
    near = np.zeros(mesh.n_points, dtype=bool)
    near[cKDTree(mesh.points).query(places)[1]] = True
    return _with_neighbours(mesh, near)


def _with_neighbours(mesh: Surface, chosen: PointMask) -> PointMask:
    """Return the chosen points (V,) and all points of the faces at them."""
    grown = np.array(chosen)
    grown[mesh.faces[chosen[mesh.faces].any(axis=1)]] = True
    return grown

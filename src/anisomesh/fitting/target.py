"""What a mesh is fitted to, and a fit that leaves no fault behind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from anisomesh._arrays import Points
from anisomesh.deadline import NO_DEADLINE, Deadline
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.features.network import FeatureNetwork
from anisomesh.fitting.fit import FitTask, fit_mesh
from anisomesh.fitting.samples import SurfaceSamples, sample_surface
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import faulty_faces
from anisomesh.metric.field import MetricField

_MAX_FITS = 4  # of one mesh, with more points held after each
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
    """

    reference: ClosestPoints
    samples: SurfaceSamples
    corners: Points
    crease_angle: float
    holds_creases: bool

    @classmethod
    def of(
        cls,
        reference: ClosestPoints,
        metric: tuple[ClosestPoints, MetricField],
        features: tuple[Surface, FeatureNetwork],
        n_vertices: int,
        crease_angle: float,
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
        )

    def task(self, mesh: Surface, crease_edges: EdgeEnds) -> FitTask:
        """Return the task to fit a mesh with these edges (n, 2) along creases."""
        held = np.zeros(mesh.n_points, dtype=bool)
        if len(self.corners):
            held |= cKDTree(self.corners).query(mesh.points)[0] < _SAME_PLACE
        if self.holds_creases:
            held[crease_edges] = True
        kept = np.isin(edge_keys(mesh.edges), edge_keys(crease_edges))
        return FitTask(mesh=mesh, held=held, kept=kept, crease_angle=self.crease_angle)


def fit_without_faults(
    mesh: Surface, target: FitTarget, *, crease_edges: EdgeEnds, deadline: Deadline = NO_DEADLINE
) -> Surface:
    """Return a mesh fitted to a surface, with no more faults than it had before, and its points in the same order.

    Parameters
    ----------
    mesh
        A manifold mesh near the surface.
    target
        The surface.
    crease_edges
        Ends of edges of the mesh along creases (n, 2), which are not flipped.
    deadline
        When to end.

    Notes
    -----
    Points of triangles that are faulty after the fit, and of the triangles around them, are held, and the mesh is
    fitted again. If it still has faults after four fits, the mesh itself is returned.
    """
    task = target.task(mesh, crease_edges)
    bound = len(faulty_faces(mesh, target.reference))
    for _ in range(_MAX_FITS):
        fitted = fit_mesh(task, target.samples, deadline=deadline)
        faulty = faulty_faces(fitted, target.reference)
        if len(faulty) <= bound:
            return fitted
        at_fault = np.zeros(mesh.n_points, dtype=bool)
        at_fault[fitted.faces[faulty]] = True
        around = np.array(at_fault)
        around[fitted.faces[at_fault[fitted.faces].any(axis=1)]] = True
        if task.held[around].all():  # the fault is farther away than the triangles next to it
            around[fitted.faces[around[fitted.faces].any(axis=1)]] = True
        held = task.held | around
        task = replace(task, held=held, kept=task.kept | held[mesh.edges].all(axis=1))
    return mesh

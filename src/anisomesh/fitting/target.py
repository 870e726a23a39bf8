"""What a mesh is fitted to."""

from __future__ import annotations

from dataclasses import dataclass, field

import igl
import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import EdgeEnds, PointMask, Points
from anisomesh.features.detect import sharp_edges
from anisomesh.fitting.arrays import FitTask
from anisomesh.fitting.fit import FitPlan
from anisomesh.fitting.samples import SurfaceSamples, sample_surface
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.anchors import Anchors
from anisomesh.metric.transfer import PlacedMetric

_SAME_PLACE = 1e-9  # at bounding-box diagonal 1
_MIN_SAMPLES = 10_000


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
    holds_creases
        Whether points on creases stay, since they were prescribed and the shape may not tell where they are.
    lines
        Edges of the surface, as pairs of its points (n, 2): only points on these stay, and the edges between them.
    crease_angle
        Edges that bend by more degrees are creases, along which points only slide; 180 for none.
    plan
        How meshes are fitted.
    anchors
        Where a mesh has vertices, and edges of its boundary, that stay.
    """

    reference: ClosestPoints
    samples: SurfaceSamples
    corners: Points
    holds_creases: bool = False
    lines: EdgeEnds = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    crease_angle: float = 40.0
    plan: FitPlan = field(default_factory=FitPlan)
    anchors: Anchors = field(default_factory=Anchors)

    @classmethod
    def of(
        cls,
        reference: ClosestPoints,
        metric: PlacedMetric,
        n_vertices: int,
        *,
        corners: Points,
        holds_creases: bool = False,
        crease_angle: float = 40.0,
        plan: FitPlan | None = None,
    ) -> FitTarget:
        """Return the target for meshes of a number of vertices.

        Parameters
        ----------
        reference
            Closest points of the surface, at bounding-box diagonal 1.
        metric
            The metric, which may be on a surface that differs by a tolerance.
        n_vertices
            Vertices of the meshes.
        corners, holds_creases, crease_angle, plan
            See the attributes.
        """
        plan = FitPlan() if plan is None else plan
        samples = sample_surface(
            reference.surface,
            max(plan.samples_per_vertex * n_vertices, _MIN_SAMPLES),
            creases=sharp_edges(reference.surface, crease_angle),
            metric=metric,
            rng=np.random.default_rng(0),
        )
        return cls(
            reference=reference,
            samples=samples.relative() if plan.relative else samples,
            corners=corners,
            holds_creases=holds_creases,
            crease_angle=crease_angle,
            plan=plan,
        )

    def at_corners(self, points: Points) -> PointMask:
        """Return which points (n,) are at a corner."""
        if len(self.corners) == 0:
            return np.zeros(len(points), dtype=bool)
        return np.asarray(cKDTree(self.corners).query(points)[0] < _SAME_PLACE)

    def task(self, mesh: Surface, crease_edges: EdgeEnds) -> FitTask:
        """Return the task to fit a mesh with these edges (n, 2) along creases."""
        held = self.at_corners(mesh.points) | self.anchors.held_in(mesh.points)
        stays = crease_edges if self.holds_creases else self._on_lines(mesh, crease_edges)
        held[stays] = True
        kept = np.isin(edge_keys(mesh.edges), edge_keys(stays))
        return FitTask(mesh=mesh, held=held, kept=kept, crease_angle=self.crease_angle)

    def _on_lines(self, mesh: Surface, crease_edges: EdgeEnds) -> EdgeEnds:
        """Return which edges of a mesh along creases (n, 2) are along the lines."""
        if len(self.lines) == 0 or len(crease_edges) == 0:
            return crease_edges[:0]
        points = np.unique(crease_edges)
        near = np.zeros(mesh.n_points, dtype=bool)
        squares, _, _ = igl.point_mesh_squared_distance(mesh.points[points], self.reference.surface.points, self.lines)
        near[points] = np.asarray(squares) < _SAME_PLACE**2
        return np.asarray(crease_edges[near[crease_edges].all(axis=1)])

"""Everything that is measured about a remesh, in one report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from anisomesh.evaluation.boundary import BoundaryDistance, boundary_distance
from anisomesh.evaluation.preservation import FeaturePreservation, feature_preservation
from anisomesh.evaluation.sampled import CREASE_ANGLE, DEFAULT_SAMPLES, SampledMeasures, sampled_measures
from anisomesh.evaluation.shape import ShapeStatistics, shape_statistics
from anisomesh.io.convert import as_surface
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import SurfaceDistance, surface_distance
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.metric.quality import quality_on
from anisomesh.repair.prepare import prepare


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """What is measured about a remesh; lengths at bounding-box diagonal 1 of the reference.

    Attributes
    ----------
    vertices, faces
        Size of the remesh.
    sampled, floor
        The paper's measures between samples, and the same of the reference against itself: the least that can be had.
    distance
        Exact distances to the other surface, a the reference and b the remesh, on samples, vertices and edge middles.
    vertex_rms, vertex_max
        Distance of the vertices of the remesh from the reference.
    shape
        Triangle quality in the paper's metric of the reference, angles, edge lengths.
    features
        Creases and corners of the reference that the remesh has.
    boundary
        Distances between the boundary curves, a the reference and b the remesh; None where one has none.
    validity
        Topology, inverted triangles and self-intersections.
    """

    vertices: int
    faces: int
    sampled: SampledMeasures
    floor: SampledMeasures
    distance: SurfaceDistance
    vertex_rms: float
    vertex_max: float
    shape: ShapeStatistics
    features: FeaturePreservation
    boundary: BoundaryDistance | None
    validity: Validity

    def as_dict(self) -> dict[str, Any]:
        """Return everything as nested dictionaries of numbers, for JSON."""
        return {
            "vertices": self.vertices,
            "faces": self.faces,
            "sampled": self.sampled.as_dict(),
            "floor": self.floor.as_dict(),
            "distance": {**self.distance.as_dict(), "vertex_rms": self.vertex_rms, "vertex_max": self.vertex_max},
            "shape": self.shape.as_dict(),
            "features": self.features.as_dict(),
            "boundary": self.boundary.as_dict() if self.boundary is not None else None,
            "validity": self.validity.as_dict(),
        }


def evaluate(
    reference: Any,
    result: Any,
    *,
    samples: int = DEFAULT_SAMPLES,
    crease_angle: float = CREASE_ANGLE,
    seed: int = 0,
) -> Evaluation:
    """Measure how good a remesh of a surface is.

    Parameters
    ----------
    reference
        The surface that was remeshed: a :class:`Surface`, a ``trimesh.Trimesh`` or a ``pyvista.PolyData``. It is
        repaired as before a remesh, so that it has an orientation and a topology to compare with.
    result
        The remesh, in the same units and place; it is measured as it is.
    samples
        Points drawn on each surface.
    crease_angle
        Creases of the reference are edges whose faces differ by more than this many degrees.
    seed
        Of the samples: the same seed gives the same figures.

    Raises
    ------
    MeshError
        If one of the two is no mesh, or nothing of the reference is left after the repair.
    OptionError
        If there is no sample.

    Notes
    -----
    The metric of the shape statistics is the paper's, of the reference, taken at the closest point of each vertex.

    References
    ----------
    NASM, section 4.1.
    """
    repaired = prepare(as_surface(reference)).surface
    frame = unit_frame(repaired.points)
    a = repaired.with_points(frame.to_unit(repaired.points))
    given = as_surface(result)
    b = Surface(frame.to_unit(given.points), given.faces)
    closest = ClosestPoints(a)
    squared = closest.squared_distances(b.points[np.unique(b.faces)])
    rng = np.random.default_rng(seed)
    return Evaluation(
        vertices=b.n_points,
        faces=b.n_faces,
        sampled=sampled_measures(a, b, samples=samples, crease_angle=crease_angle, seed=rng),
        floor=sampled_measures(a, a, samples=samples, crease_angle=crease_angle, seed=rng),
        distance=surface_distance(a, b, samples=samples, seed=rng),
        vertex_rms=float(np.sqrt(squared.mean())),
        vertex_max=float(np.sqrt(squared.max())),
        shape=shape_statistics(b, quality_on(closest, b)),
        features=feature_preservation(a, b, crease_angle=crease_angle),
        boundary=boundary_distance(a, b),
        validity=check_validity(b, a),
    )

"""The report of all measures of a remesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from anisomesh._values import real_number, whole_number
from anisomesh.errors import OptionError
from anisomesh.evaluation.boundary import BoundaryDistance, boundary_distance
from anisomesh.evaluation.preservation import FeaturePreservation, feature_preservation
from anisomesh.evaluation.sampled import CREASE_ANGLE, DEFAULT_SAMPLES, SampledMeasures, sampled_measures
from anisomesh.evaluation.shape import ShapeStatistics, quality_in_reference_metric, shape_statistics
from anisomesh.io.describe import soundness
from anisomesh.io.meshes import mesh_of
from anisomesh.junctions.cut import cut_at_junctions
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.distance import SurfaceDistance, surface_distance
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.html import html_table
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.repair.prepare import prepare


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Measures of a remesh; lengths in units in which the bounding-box diagonal of the reference is 1.

    Attributes
    ----------
    vertices, faces
        Size of the remesh.
    sampled, floor
        The paper's measures between point samples of reference and remesh, and between two samples of the
        reference: no remesh can be expected to have better values.
    distance
        Distances from samples, vertices and edge midpoints of each surface to the other surface; a is the reference,
        b the remesh.
    vertex_rms, vertex_max
        Root mean square and maximum of the distances of the vertices of the remesh from the reference.
    shape
        Quality in the curvature metric of the reference, angles, edge lengths of the triangles.
    features
        Creases and corners of the reference that the remesh preserves.
    boundary
        Distances between the boundaries, a of the reference and b of the remesh; None if one of them is closed.
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

    def __repr__(self) -> str:
        return f"Evaluation({', '.join(f'{name} {text}' for name, text in self._rows())})"

    def _repr_html_(self) -> str:
        return html_table("Evaluation (lengths at bounding-box diagonal 1)", self._rows())

    def _rows(self) -> list[tuple[str, str]]:
        """Return the most important measures as names and texts."""
        return [
            ("vertices", f"{self.vertices:,}"),
            ("triangles", f"{self.faces:,}"),
            ("validity", soundness(self.validity)),
            ("RMS distance", f"{self.distance.rms:.3g}"),
            ("largest distance", f"{self.distance.hausdorff:.3g}"),
            ("mean quality G", f"{self.shape.g_mean:.3f}"),
            ("creases covered", f"{self.features.crease_covered:.1%}"),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return all measures as nested dictionaries of numbers, for JSON."""
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
    """Measure a remesh against the surface that was remeshed.

    Parameters
    ----------
    reference
        The input surface: the name of a file, or what :func:`~anisomesh.io.convert.as_surface` takes. It is repaired as
        before a remesh, so that it has an orientation and a topology for comparison; non-manifold edges count as what
        they are in its topology and boundary.
    result
        The remesh, of the same types and in the same coordinates; it is measured without repair.
    samples
        Number of points drawn on each surface.
    crease_angle
        Dihedral angle in degrees, between the normals, above which edges of the reference are creases.
    seed
        Seed of the samples; equal seeds give equal results.

    Raises
    ------
    MeshFileError
        If a file cannot be read.
    MeshError
        If one of the two is not a mesh, or the repaired reference is empty.
    OptionError
        If ``samples``, ``crease_angle`` or ``seed`` is out of range.

    References
    ----------
    NASM, section 4.1.
    """
    samples, seed = whole_number("samples", samples, 1), whole_number("seed", seed, 0)
    if not 0.0 <= real_number("crease_angle", crease_angle) <= 180.0:
        raise OptionError(f"crease_angle = {crease_angle}; expected 0 to 180 degrees")
    prepared = prepare(mesh_of(reference).surface)
    repaired, junctions = prepared.surface, cut_at_junctions(prepared)
    frame = unit_frame(repaired.points)
    a = repaired.with_points(frame.to_unit(repaired.points))
    remeshed = mesh_of(result).surface
    b = Surface(frame.to_unit(remeshed.points), remeshed.faces)
    joined = repaired if junctions is None else junctions.whole
    whole = joined.with_points(frame.to_unit(joined.points))
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
        shape=shape_statistics(b, quality_in_reference_metric(a, b)),
        features=feature_preservation(a, b, crease_angle=crease_angle),
        boundary=boundary_distance(whole, b),
        validity=check_validity(b, a, whole),
    )

"""Call each stage by itself: from a mesh to a metric, an embedding, sites, and triangles.

Usage: python examples/stages.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys

import numpy as np

import anisomesh
from anisomesh.features.detect import sharp_edges
from anisomesh.fitting.target import FitTarget
from anisomesh.fitting.valid import fit_without_faults
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.validity import check_validity
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.viz import side_by_side, stretch_colouring


def main(out: str = "stages.png", n_vertices: int = 600) -> anisomesh.Surface:
    # 0. Prepare: an oriented manifold, scaled to bounding-box diagonal 1
    prepared = anisomesh.prepare(anisomesh.sample("ring"))
    frame = unit_frame(prepared.surface.points)
    surface = prepared.surface.with_points(frame.to_unit(prepared.surface.points))
    print(f"prepared: {surface.n_points:,} points, repaired: {prepared.report.changed}")

    # 1. Metric: one matrix per point
    field = anisomesh.Curvature()(surface)
    lengths = np.sqrt(np.linalg.eigvalsh(field.tensors))
    print(f"metric: stretch {np.mean(lengths[:, 2] / lengths[:, 0]):.2f} on average")

    # 2. Embedding: lengths in 8-D are lengths in the metric
    embedding = anisomesh.Direct(iterations=10)(surface, field)
    print(f"embedding: {embedding.points.shape[1]} dimensions, residual {embedding.residual:.2f}")

    # 3. Voronoi diagrams on the embedded surface, and the creases that sites are to follow
    embedded = anisomesh.EmbeddedSurface(surface, embedding.points, embedding.scale)
    voronoi = anisomesh.RestrictedVoronoi(embedded)
    sharp = sharp_edges(embedded.surface, 40.0)
    features = anisomesh.trace_features(embedded, n_vertices, sharp=sharp)
    print(f"features: {features.creases.n_polylines} creases of {sharp.sum()} edges")

    # 4. Sites: minimise the energy of the normal metric
    options = anisomesh.CVTOptions(energy=anisomesh.NormalMetric(sharpness=7.0), relocate=False, max_iterations=100)
    optimised = anisomesh.optimise_sites(voronoi, n_vertices, features, options)
    diagram = voronoi.diagram(optimised.sites)
    print(f"sites: energy {optimised.energy:.3g}, diagram of {len(diagram.site):,} polygons")

    # 5. Triangles: the dual of the diagram, made valid
    task = anisomesh.MeshingTask(
        voronoi=voronoi, features=features, surface=surface, tensors=field.tensors, n_vertices=n_vertices
    )
    mesh = anisomesh.mesh_from_sites(task, optimised.sites)
    dual = anisomesh.Surface(mesh.points, mesh.faces)
    print(f"dual: {dual.n_points:,} vertices, RMS distance {1e4 * surface_distance(surface, dual).rms:.2f}e-4")

    # 6. Fit: less distance and better triangles with the same number of vertices
    target = FitTarget.of(
        task.reference,
        PlacedMetric(task.reference, field),
        n_vertices,
        corners=task.corner_places,
    )
    fitted = fit_without_faults(dual, target, crease_edges=mesh.crease_edges)
    validity = check_validity(fitted, surface)
    print(f"fitted: RMS distance {1e4 * surface_distance(surface, fitted).rms:.2f}e-4, closed: {validity.closed}")

    # Back to model units
    result = anisomesh.Surface(frame.to_model(fitted.points), fitted.faces)
    side_by_side(prepared.surface, result, out, values=stretch_colouring(result))
    return result


if __name__ == "__main__":
    main(*sys.argv[1:])

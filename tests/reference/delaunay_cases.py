"""Duals and meshes of given sites, and what a closed manifold is, for several test files."""

import numpy as np

from anisomesh.cvt.lloyd import lloyd
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.meshing import MeshingTask, mesh_from_sites
from anisomesh.features.detect import sharp_edges
from anisomesh.features.network import trace_features
from anisomesh.mesh import topology
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.metric.tensors import uniform_metric
from anisomesh.voronoi.cells import cell_complex
from anisomesh.voronoi.restricted import RestrictedVoronoi


def dual_case(surface, sites, points=None, iterations=0):
    """Return cells and dual of sites on a surface, embedded by its own coordinates unless ``points`` are given."""
    voronoi = RestrictedVoronoi(EmbeddedSurface(surface, surface.points if points is None else points))
    cells = cell_complex(voronoi.diagram(lloyd(voronoi, sites, iterations)))
    return cells, dual_mesh(cells)


def mesh_of(voronoi, sites, crease_angle=180.0, required=False):
    """Return the valid mesh of these sites, with as many vertices asked for as there are sites."""
    embedded, n = voronoi.embedded, len(sites)
    sharp = sharp_edges(embedded.surface, crease_angle)
    features = trace_features(embedded, n, sharp=sharp, required=sharp & required)
    task = MeshingTask(
        voronoi=voronoi,
        features=features,
        surface=embedded.surface,
        tensors=uniform_metric(embedded.surface),
        n_vertices=n,
    )
    return mesh_from_sites(task, sites)


def assert_closed_manifold(faces, euler):
    edges, face_edges = topology.edges_of(faces)
    assert np.all(np.bincount(face_edges.ravel(), minlength=len(edges)) == 2)
    assert topology.is_oriented(faces)
    assert topology.count_nonmanifold_points(faces) == 0
    assert topology.euler_characteristic(faces) == euler

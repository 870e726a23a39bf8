"""Duals of given sites, and what a closed manifold is, for several test files."""

import numpy as np

from anisomesh.cvt.features import Features
from anisomesh.cvt.optimise import lloyd
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.refine import refine
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.metric.tensors import uniform_metric
from anisomesh.voronoi.cells import cells_of
from anisomesh.voronoi.restricted import RestrictedVoronoi


def dual_case(surface, sites, points=None, iterations=0):
    """Return diagram, cells and dual of sites on a surface, embedded in its own space unless ``points`` are given."""
    voronoi = RestrictedVoronoi(surface.points if points is None else points, surface.faces)
    sites = lloyd(voronoi, sites, iterations)
    diagram = voronoi.diagram(sites)
    ordered = Surface(surface.points, voronoi.faces)
    cells = cells_of(diagram, ordered.face_neighbours, voronoi.facets.area)
    return diagram, cells, dual_mesh(diagram, cells, ordered)


def mended(voronoi, sites, surface, scale=1.0, crease_angle=180.0, always=False):
    """Return what refinement makes of these sites, as many vertices asked for as there are sites."""
    sharp = sharp_edges(surface, crease_angle)
    return refine(
        voronoi,
        sites,
        surface,
        surface,
        Features(voronoi, surface, len(sites), sharp, sharp & always),
        scale,
        n_vertices=len(sites),
        tensors=uniform_metric(surface),
    )


def assert_closed_manifold(faces, euler):
    edges, face_edges = topology.edges_of(faces)
    assert np.all(np.bincount(face_edges.ravel(), minlength=len(edges)) == 2)
    assert topology.is_oriented(faces)
    assert topology.count_nonmanifold_points(faces) == 0
    assert topology.euler_characteristic(faces) == euler

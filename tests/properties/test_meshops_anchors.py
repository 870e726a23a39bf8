"""A mesh brought onto anchors has all of them, the topology it had, and few faults."""

import numpy as np
import pytest

from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import check_validity
from anisomesh.meshops.anchoring.anchored import anchored
from anisomesh.meshops.anchors import Anchors
from anisomesh.meshops.decimation import decimate
from anisomesh.shapes.analytic import sphere

NO_EDGES = np.zeros((0, 2), dtype=np.int64)


def belt(level):
    """The part of a sphere between two heights, with two boundary loops."""
    ball = sphere(level)
    heights = ball.points[ball.faces][..., 2]
    faces = ball.faces[(heights > -0.3).all(axis=1) & (heights < 0.7).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return Surface(ball.points[used], faces.reshape(-1, 3))


def anchors_of(surface, inside, edges):
    """Anchors at points of a surface (n,) and at the ends of edges (m, 2) of its boundary."""
    points = np.union1d(inside, edges).astype(np.int64)
    return Anchors(surface.points[points], np.searchsorted(points, edges))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("n_points", "share"), [(25, 1.0), (60, 0.4), (300, 0.7)])
def test_a_mesh_gets_all_anchors_and_the_outline(n_points, share, seed):
    rng = np.random.default_rng(seed)
    surface = belt(3)
    boundary = surface.edges[surface.edge_face_count == 1]
    outline = boundary[rng.random(len(boundary)) < share]
    anchors = anchors_of(surface, rng.choice(surface.n_points, 12, replace=False), outline)
    mesh = decimate(surface, n_points, moves=False).surface
    points, faces, _ = anchored(mesh.points, mesh.faces, NO_EDGES, anchors, ClosestPoints(surface))
    result = Surface(points, faces)
    assert {tuple(p) for p in anchors.places.tolist()} <= {tuple(p) for p in points.tolist()}
    number = {tuple(p): k for k, p in enumerate(points.tolist())}
    ends = np.array([[number[tuple(surface.points[end].tolist())] for end in edge] for edge in outline])
    assert np.isin(edge_keys(ends), edge_keys(result.edges[result.edge_face_count == 1])).all()
    validity = check_validity(result, surface)
    assert validity.euler == validity.euler_input
    assert validity.boundary_loops == validity.boundary_loops_input == 2
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == validity.duplicate_faces == 0
    assert validity.oriented


def test_a_mesh_that_has_its_anchors_stays_as_it_is():
    surface = belt(2)
    anchors = anchors_of(surface, np.arange(10), surface.edges[surface.edge_face_count == 1])
    points, faces, creases = anchored(surface.points, surface.faces, NO_EDGES, anchors, ClosestPoints(surface))
    assert points is surface.points
    assert faces is surface.faces
    assert creases is NO_EDGES


def test_an_edge_along_a_crease_that_an_anchor_splits_stays_along_it():
    surface = belt(3)
    mesh = decimate(surface, 60, moves=False).surface
    inner = mesh.edges[mesh.edge_face_count == 2]
    crease = inner[np.argmax(np.linalg.norm(np.diff(mesh.points[inner], axis=1)[:, 0], axis=1))][None].astype(np.int64)
    middle = mesh.points[crease[0]].mean(axis=0)
    anchors = Anchors(middle[None])
    points, faces, creases = anchored(mesh.points, mesh.faces, crease, anchors, ClosestPoints(surface))
    ends = {frozenset(map(tuple, pair)) for pair in points[creases].tolist()}
    first, last = mesh.points[crease[0]].tolist()
    assert ends == {frozenset({tuple(first), tuple(middle)}), frozenset({tuple(middle), tuple(last)})}
    assert len(faces) == mesh.n_faces + 2

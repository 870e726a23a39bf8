"""Tables of edges and neighbours agree with sorting all sides."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.mesh import topology
from anisomesh.shapes import analytic as shapes


def faces_of(n_points, n_faces, seed):
    return np.random.default_rng(seed).integers(0, n_points, (n_faces, 3)).astype(np.int32)


@given(n_points=st.integers(3, 60), n_faces=st.integers(0, 400), seed=st.integers(0, 10_000))
def test_edges_and_neighbours_of_any_triangles(n_points, n_faces, seed):
    """Few points with many faces are fans, whose sides are sorted in another way."""
    faces = faces_of(n_points, n_faces, seed)
    keys = topology.edge_keys(topology.half_edges(faces))
    unique, inverse, count = np.unique(keys, return_inverse=True, return_counts=True)
    edges, face_edges = topology.edges_of(faces)
    np.testing.assert_array_equal(topology.edge_keys(edges), unique)
    np.testing.assert_array_equal(face_edges.ravel(), inverse.ravel())
    pairs = topology.edge_faces(face_edges, len(edges))
    sides = [np.flatnonzero(inverse.ravel() == edge) // 3 for edge in range(len(unique))]
    for found, wanted, n in zip(pairs, sides, count, strict=True):
        assert found.tolist() == ([-1, -1] if n > 2 else [*wanted, -1][:2])
    across = topology.face_neighbours(face_edges, pairs)
    for face, corner in np.ndindex(*across.shape):
        both = pairs[face_edges[face, corner]]
        assert across[face, corner] == (both[1] if both[0] == face else both[0])


def test_a_point_with_two_fans_is_found():
    whole = shapes.sphere(2)
    across = whole.face_neighbours
    assert topology.has_single_fans(whole.faces, across)
    far = np.argmax(np.linalg.norm(whole.points - whole.points[0], axis=1))
    pinched = np.where(whole.faces == far, 0, whole.faces).astype(np.int32)
    assert topology.count_nonmanifold_points(pinched) == 1
    edges, face_edges = topology.edges_of(pinched)
    across = topology.face_neighbours(face_edges, topology.edge_faces(face_edges, len(edges)))
    assert not topology.has_single_fans(pinched, across)
    opened = np.delete(pinched, np.flatnonzero((pinched == 0).any(axis=1))[[0, 7]], axis=0)
    edges, face_edges = topology.edges_of(opened)
    across = topology.face_neighbours(face_edges, topology.edge_faces(face_edges, len(edges)))
    assert topology.has_single_fans(opened, across) == (topology.count_nonmanifold_points(opened) == 0)


@given(keep=st.floats(0.3, 1.0), seed=st.integers(0, 1_000))
def test_fans_with_boundaries(keep, seed):
    surface, rng = shapes.torus(n_major=12, n_minor=8), np.random.default_rng(seed)
    faces = surface.faces[rng.random(surface.n_faces) < keep]
    if len(faces) == 0:
        return
    edges, face_edges = topology.edges_of(faces)
    across = topology.face_neighbours(face_edges, topology.edge_faces(face_edges, len(edges)))
    assert topology.has_single_fans(faces, across) == (topology.count_nonmanifold_points(faces) == 0)

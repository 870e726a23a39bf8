"""Connectivity tables against plain loops over the definition."""

from collections import Counter, defaultdict
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from conftest import examples


@st.composite
def triangle_lists(draw):
    n_points = draw(st.integers(3, 9))
    triples = st.permutations(range(n_points)).map(lambda order: order[:3])
    return np.array(draw(st.lists(triples, min_size=1, max_size=20)), dtype=np.int32)


def undirected_sides(faces):
    return [tuple(sorted((face[k - 2], face[k - 1]))) for face in faces.tolist() for k in range(3)]


@examples(150)
@given(triangle_lists())
def test_counts_follow_the_definition(faces):
    sides = Counter(undirected_sides(faces))
    assert topology.count_nonmanifold_edges(faces) == sum(count > 2 for count in sides.values())
    assert topology.euler_characteristic(faces) == len(set(faces.ravel().tolist())) - len(sides) + len(faces)
    directed = Counter((face[k - 2], face[k - 1]) for face in faces.tolist() for k in range(3))
    consistent = all(directed[a, b] == directed[b, a] for (a, b), count in sides.items() if count == 2)
    assert topology.is_oriented(faces) == consistent


@examples(150)
@given(triangle_lists())
def test_points_with_one_fan_follow_the_definition(faces):
    """A point is manifold if the edges opposite it, joined where they meet, make one path or one cycle."""
    links = defaultdict(list)
    for face in faces.tolist():
        for k in range(3):
            links[face[k]].append((face[k - 2], face[k - 1]))
    bad = 0
    for link in links.values():
        degree = Counter(point for edge in link for point in edge)
        reached = {link[0][0]}
        while more := {p for edge in link for p in edge if reached & set(edge)} - reached:
            reached |= more
        bad += max(degree.values()) > 2 or len(reached) < len(degree)
    assert topology.count_nonmanifold_points(faces) == bad


@examples(150)
@given(triangle_lists())
def test_components_follow_the_definition(faces):
    count, label = topology.connected_components(faces, 12)
    groups = [set(face) for face in faces.tolist()]
    for a in range(len(groups)):
        for b in range(len(groups)):
            assert not (groups[a] & groups[b]) or label[a] == label[b]
    merged = [set().union(*(groups[k] for k in np.flatnonzero(label == part))) for part in range(count)]
    assert sum(map(len, merged)) == len(set().union(*merged))
    for part in range(count):
        members = [groups[k] for k in np.flatnonzero(label == part)]
        reached = set(members[0])
        while any(reached & group and not group <= reached for group in members):
            reached |= set().union(*(group for group in members if reached & group))
        assert reached == merged[part]


@examples(150)
@given(triangle_lists())
def test_loops_use_every_boundary_edge_once(faces):
    boundary = sorted(edge for edge, count in Counter(undirected_sides(faces)).items() if count == 1)
    walked = []
    for loop in topology.boundary_loops(faces):
        chain = loop.tolist()
        walked += [tuple(sorted(pair)) for pair in pairwise(chain)]
    assert len(walked) == len(set(walked))
    assert set(walked) <= set(boundary)
    # Each walk leaves out its last edge, back to the start or to the end of an open chain.
    assert len(walked) + len(topology.boundary_loops(faces)) == len(boundary)


@examples(60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 30))
def test_loops_of_a_holed_surface_are_closed_and_run_with_the_faces(seed, n_removed):
    rng = np.random.default_rng(seed)
    faces = np.delete(shapes.sphere(1).faces, rng.permutation(80)[:n_removed], axis=0)
    sides = {(face[k], face[(k + 1) % 3]) for face in faces.tolist() for k in range(3)}
    boundary = {(a, b) for a, b in sides if (b, a) not in sides}
    walked = [pair for loop in topology.boundary_loops(faces) for pair in zip(loop, np.roll(loop, -1), strict=True)]
    assert len(walked) == len(boundary)
    assert set(walked) == boundary


def test_known_loops():
    tube = shapes.cylinder(n_around=11, n_along=4, closed=False)
    loops = topology.boundary_loops(tube.faces)
    assert sorted(len(loop) for loop in loops) == [11, 11]
    assert {round(float(np.ptp(tube.points[loop, 2])), 12) for loop in loops} == {0.0}
    assert topology.boundary_loops(shapes.sphere(1).faces) == []
    tie = np.array([[0, 1, 2], [0, 3, 4]], dtype=np.int32)
    assert sorted(sorted(loop.tolist()) for loop in topology.boundary_loops(tie)) == [[0, 1, 2], [0, 3, 4]]


@examples(100)
@given(triangle_lists())
def test_face_tables_agree_with_the_faces(faces):
    surface = Surface(np.random.default_rng(0).normal(size=(9, 3)), faces)
    count = Counter(undirected_sides(faces))
    assert surface.edges.tolist() == sorted([list(edge) for edge in count])
    for f, face in enumerate(faces.tolist()):
        for c in range(3):
            edge = sorted((face[c - 2], face[c - 1]))
            number = surface.face_edges[f, c]
            assert surface.edges[number].tolist() == edge
            assert surface.edge_face_count[number] == count[tuple(edge)]
            others = [g for g, other in enumerate(faces.tolist()) if g != f and set(edge) <= set(other)]
            assert surface.face_neighbours[f, c] == (others[0] if len(others) == 1 else -1)
            expected = {1: sorted([f, -1]), 2: sorted([f, *others])}.get(count[tuple(edge)], [-1, -1])
            assert sorted(surface.edge_faces[number].tolist()) == expected


@pytest.mark.parametrize("n_more", [0, 7])
def test_unused_points_are_not_counted_as_components(n_more):
    faces = np.array([[0, 1, 2], [4, 5, 6]], dtype=np.int32)
    count, label = topology.connected_components(faces, 7 + n_more)
    assert count == 2
    assert label.tolist() == [0, 1]

"""Edge splits and untangling keep the topology and reach their goals."""

import numpy as np
import pytest

from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import check_validity, inverted_faces
from anisomesh.meshops.collapse import collapsible_edges
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.split import split_longest_edges
from anisomesh.shapes.analytic import cad_part, open_patch, sphere, torus

SHAPES = {"sphere": sphere(3), "torus": torus(1.0, 0.3, 48, 16), "part": cad_part(8)}


def assert_same_topology(result, reference):
    validity = check_validity(result, reference)
    assert validity.euler == validity.euler_input
    assert validity.components == check_validity(reference, reference).components
    assert validity.oriented
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == 0


def test_link_condition_against_sets():
    mesh = decimate(SHAPES["torus"], 40).surface

    def link(vertices):
        star = [face for face in mesh.faces.tolist() if set(vertices) <= set(face)]
        found = set()
        for face in star:
            rest = frozenset(face) - frozenset(vertices)
            found |= {rest} | {frozenset([v]) for v in rest}
        return found

    expected = [link([u]) & link([v]) == link([u, v]) for u, v in mesh.edges.tolist()]
    assert collapsible_edges(mesh).tolist() == expected


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("seed", range(3))
def test_inverted_triangles_are_removed(name, seed):
    surface = SHAPES[name]
    rng = np.random.default_rng(seed)
    points = np.array(surface.points)
    edges = surface.edges[rng.choice(len(surface.edges), 6, replace=False)]
    for u, v in edges.tolist():
        points[u] += 1.6 * (points[v] - points[u])  # over the neighbour and beyond
    folded = Surface(points, surface.faces)
    assert inverted_faces(folded, ClosestPoints(surface)).any()
    mended_points, faces, left = remove_inverted_triangles(folded.points, folded.faces, ClosestPoints(surface))
    mended = Surface(mended_points, faces)
    assert left == 0
    assert not inverted_faces(mended, ClosestPoints(surface)).any()
    assert_same_topology(mended, surface)


def test_a_mesh_without_inverted_triangles_is_returned_unchanged():
    surface = SHAPES["part"]
    points, faces, left = remove_inverted_triangles(surface.points, surface.faces, ClosestPoints(surface))
    assert left == 0
    assert points is surface.points
    assert faces is surface.faces


def test_an_inverted_triangle_nearest_to_another_sheet_is_removed():
    # two sheets that cross: near the line where they meet a triangle of one can be nearest to the other
    n = 12
    sheet = open_patch(lambda x, y: 0.0 * x, n=n)
    other = sheet.points * [1, 1, -1] + [0, 0, 0.013] + sheet.points[:, [0]] * [0, 0, -0.03]
    reference = Surface(
        np.concatenate([sheet.points, other]), np.concatenate([sheet.faces, sheet.faces[:, ::-1] + sheet.n_points])
    )
    coarse = open_patch(lambda x, y: 0.0 * x, n=5)
    mesh = coarse.with_points(coarse.points + [0, 0, 0.002] * np.sin(40 * coarse.points[:, [0]]))
    closest = ClosestPoints(reference)
    assert closest.inverted(mesh.points[mesh.faces]).any()
    points, faces, left = remove_inverted_triangles(mesh.points, mesh.faces, closest)
    assert left == 0
    assert not closest.inverted(points[faces]).any()
    assert_same_topology(Surface(points, faces), mesh)
    assert len(points) < 1.3 * mesh.n_points


@pytest.mark.parametrize("name", [*SHAPES, "open"])
def test_splits_reach_the_number_on_the_surface_and_keep_topology_and_side(name):
    surface = open_patch(lambda x, y: 0.3 * x * y, n=16) if name == "open" else SHAPES[name]
    reference = ClosestPoints(surface)
    coarse = decimate(surface, surface.n_points // 3).surface
    points, faces = coarse.points, coarse.faces
    roots = np.tile(np.diag([1.0, 1.0, 3.0]), (len(points), 1, 1))
    n = len(points) + 37
    grown, new_faces = split_longest_edges(points, faces, n, reference, roots)
    assert len(grown) == n
    np.testing.assert_array_equal(grown[: len(points)], points)
    result = Surface(grown, new_faces)
    assert_same_topology(result, surface)
    assert inverted_faces(result, ClosestPoints(surface)).sum() == 0
    inner = np.arange(len(points), n)[~result.on_boundary[len(points) :]]
    assert np.sqrt(reference.squared_distances(grown[inner])).max() < 1e-9
    assert split_longest_edges(points, faces, len(points), reference, roots)[0] is points


def test_splits_leave_edges_that_are_kept():
    surface = SHAPES["part"]
    longest = surface.edges[np.argsort(-surface.edge_lengths)[:50]].astype(np.int64)
    roots = np.tile(np.eye(3), (surface.n_points, 1, 1))
    grown = split_longest_edges(
        surface.points, surface.faces, surface.n_points + 30, ClosestPoints(surface), roots, kept=longest
    )
    assert len(grown[0]) == surface.n_points + 30
    assert np.isin(edge_keys(longest), edge_keys(Surface(*grown).edges)).all()

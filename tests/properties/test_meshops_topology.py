"""Edge collapses, edge splits and untangling keep the topology and reach their goals."""

import numpy as np
import pytest

from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import thickness
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity, inverted_faces
from anisomesh.meshops.collapse import collapsible_edges, decimate
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.split import split_longest_edges
from anisomesh.shapes.analytic import box, cad_part, open_patch, sphere, torus

SHAPES = {"sphere": sphere(3), "torus": torus(1.0, 0.3, 48, 16), "part": cad_part(8)}


def assert_same_topology(result, reference):
    validity = check_validity(result, reference)
    assert validity.euler == validity.euler_input
    assert validity.components == check_validity(reference, reference).components
    assert validity.oriented
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == 0


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("share", [0.9, 0.5, 0.15])
def test_decimation_reaches_the_number_and_keeps_topology_and_side(name, share):
    surface = SHAPES[name]
    n = int(share * surface.n_points)
    points, faces, _ = decimate(surface.points, surface.faces, n, ClosestPoints(surface))
    result = Surface(points, faces)
    assert result.n_points == n
    assert_same_topology(result, surface)
    assert not inverted_faces(result, ClosestPoints(surface)).any()
    known = {tuple(point) for point in surface.points.tolist()}
    assert all(tuple(point) in known for point in points.tolist())


def test_decimation_of_a_box_keeps_its_corners_until_the_end():
    surface = box(n=6)
    points, faces, _ = decimate(surface.points, surface.faces, 8, ClosestPoints(surface))
    assert len(points) == 8
    np.testing.assert_allclose(np.sort(np.abs(points - 0.5).ravel()), 0.5)
    assert Surface(points, faces).area == pytest.approx(surface.area)


def test_decimation_stops_where_nothing_can_go():
    tetrahedron = Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    points, faces, _ = decimate(tetrahedron.points, tetrahedron.faces, 1, ClosestPoints(tetrahedron))
    assert len(points) == 4
    assert len(faces) == 4


def test_decimation_keeps_the_boundary_loop():
    surface = open_patch(lambda x, y: 0.3 * x * y, n=16)
    n = surface.n_points // 3
    points, faces, _ = decimate(surface.points, surface.faces, n, ClosestPoints(surface))
    result = Surface(points, faces)
    validity = check_validity(result, surface)
    assert validity.boundary_loops == 1
    assert validity.euler == validity.euler_input == 1


def test_link_condition_against_sets():
    surface = SHAPES["torus"]
    small, faces, _ = decimate(surface.points, surface.faces, 40, ClosestPoints(surface))
    mesh = Surface(small, faces)

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


def test_decimation_of_a_square_tube_leaves_no_needle_and_no_inverted_face():
    # a thin tube with many bends: what collapses is often flat, or half way between two walls
    steps = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 0, -1]] * 4)
    path = np.cumsum(np.repeat(steps, 2, axis=0), axis=0)
    surface = cubes_boundary(np.unique(path, axis=0))
    assert_same_topology(surface, surface)
    points, faces, _ = decimate(surface.points, surface.faces, 8, ClosestPoints(surface))
    result = Surface(points, faces)
    assert_same_topology(result, surface)
    assert result.n_points < 0.9 * surface.n_points
    assert thickness(points[faces]).min() >= 1e-3
    assert not inverted_faces(result, ClosestPoints(surface)).any()


def cubes_boundary(cubes):
    """Return the boundary of a union of unit cubes, at integer corners, that share faces only."""
    quads = []
    filled = {tuple(cube) for cube in cubes.tolist()}
    for cube in filled:
        for axis in range(3):
            for side in (0, 1):
                across = list(cube)
                across[axis] += 2 * side - 1
                if tuple(across) not in filled:
                    corner = np.array(cube)
                    corner[axis] += side
                    u, v = np.roll(np.eye(3, dtype=int), axis, axis=1)[1:]
                    loop = [corner, corner + u, corner + u + v, corner + v]
                    quads.append(loop if side else loop[::-1])
    corners = np.array(quads, dtype=float).reshape(-1, 3)
    points, index = np.unique(corners, axis=0, return_inverse=True)
    index = index.reshape(-1, 4)
    return Surface(points, np.concatenate([index[:, [0, 1, 2]], index[:, [0, 2, 3]]]))


def test_a_component_of_one_triangle_is_not_collapsed():
    """Regression: the link condition alone lets a triangle without neighbours go."""
    ball = sphere(2)
    points = np.concatenate([ball.points, [[3.0, 0, 0], [4, 0, 0], [3, 1, 0]]])
    faces = np.concatenate([ball.faces, np.arange(ball.n_points, ball.n_points + 3, dtype=np.int32)[None]])
    reference = ClosestPoints(Surface(points, faces))
    _, coarse, _ = decimate(points, faces, 10, reference)
    assert topology.connected_components(coarse, coarse.max() + 1)[0] == 2
    assert topology.euler_characteristic(coarse) == 3


@pytest.mark.parametrize("name", [*SHAPES, "open"])
def test_splits_reach_the_number_on_the_surface_and_keep_topology_and_side(name):
    surface = open_patch(lambda x, y: 0.3 * x * y, n=16) if name == "open" else SHAPES[name]
    reference = ClosestPoints(surface)
    points, faces, _ = decimate(surface.points, surface.faces, surface.n_points // 3, reference)
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

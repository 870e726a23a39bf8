"""Collapses, flips, moves and placement keep the topology and do what they are for."""

import numpy as np
import pytest
from creases import wedge

from anisomesh.cvt.relocation import exchange_sites
from anisomesh.delaunay.delta_complex import simplicial_mesh
from anisomesh.delaunay.dual import dual_mesh
from anisomesh.delaunay.placement import cells_with_crease, crease_positions, on_main_planes, snap_to_missed
from anisomesh.features.detect import corners, sharp_edges
from anisomesh.mesh import topology
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import thickness
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import check_validity, flipped_faces
from anisomesh.meshops.collapse import collapsible_edges, decimate
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.split import split_longest_edges
from anisomesh.shapes.analytic import box, cad_part, open_patch, sphere, torus
from anisomesh.voronoi.cells import cells_of
from anisomesh.voronoi.restricted import RestrictedVoronoi

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
    assert not flipped_faces(result, surface).any()
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
def test_folded_triangles_are_turned_back(name, seed):
    surface = SHAPES[name]
    rng = np.random.default_rng(seed)
    points = np.array(surface.points)
    edges = surface.edges[rng.choice(len(surface.edges), 6, replace=False)]
    for u, v in edges.tolist():
        points[u] += 1.6 * (points[v] - points[u])  # over the neighbour and beyond
    folded = Surface(points, surface.faces)
    assert flipped_faces(folded, surface).any()
    mended_points, faces, left = remove_inverted_triangles(folded.points, folded.faces, ClosestPoints(surface))
    mended = Surface(mended_points, faces)
    assert left == 0
    assert not flipped_faces(mended, surface).any()
    assert_same_topology(mended, surface)


def test_a_good_mesh_is_left_alone():
    surface = SHAPES["part"]
    points, faces, left = remove_inverted_triangles(surface.points, surface.faces, ClosestPoints(surface))
    assert left == 0
    assert points is surface.points
    assert faces is surface.faces


def _box_dual(n_sites, seed=0):
    surface = box(n=12)
    voronoi = RestrictedVoronoi(surface.points, surface.faces, threads=1)
    ordered = Surface(surface.points, voronoi.faces)
    rng = np.random.default_rng(seed)
    sites = surface.points[rng.choice(surface.n_points, n_sites, replace=False)] * 0.98 + 0.01
    diagram = voronoi.diagram(sites)
    return ordered, voronoi, diagram, cells_of(diagram, ordered.face_neighbours, voronoi.facets.area)


def test_a_sliver_beyond_a_crease_does_not_lift_the_vertex_off_its_plane():
    """Regression: between two planes at 120 degrees a vertex was off the one that nearly all of its cell lies in."""
    roof = wedge(np.radians(120.0))
    left, right = (np.array([side * np.sin(np.pi / 3.0), 0.0, -0.5]) for side in (-1.0, 1.0))
    voronoi = RestrictedVoronoi(roof.points, roof.faces, threads=1)
    surface = Surface(roof.points, voronoi.faces)
    diagram = voronoi.diagram(np.stack([0.4 * left, 0.4002 * right]))
    cells = cells_of(diagram, surface.face_neighbours, voronoi.facets.area)
    chosen = cells_with_crease(diagram, cells, surface, sharp_edges(surface, 40.0))
    assert cells.site[chosen].tolist() == [0]  # the other has nothing of the crest
    lifted = crease_positions(voronoi, diagram, cells, 1.0, chosen)
    placed = on_main_planes(diagram, cells, surface, chosen, lifted)
    normal = np.cross(left, [0.0, 1.0, 0.0])
    assert abs(lifted[0] @ normal) > 1e-9
    assert abs(placed[0] @ normal) < 1e-15
    assert np.linalg.norm(placed - lifted) < 1e-4


def test_vertices_of_creased_cells_go_to_where_their_planes_meet():
    surface, voronoi, diagram, cells = _box_dual(120)
    chosen = cells_with_crease(diagram, cells, surface, sharp_edges(surface, 45.0))
    places = crease_positions(voronoi, diagram, cells, 1.0, chosen)
    normals = np.abs(voronoi.facets.normal[diagram.facet]).round().astype(bool)
    axes = np.zeros((len(cells.site), 3), dtype=bool)
    np.logical_or.at(axes, cells.of_polygon, normals)
    assert chosen.tolist() == np.flatnonzero(axes.sum(axis=1) > 1).tolist()
    assert len(chosen) < len(cells.site)
    shares = diagram.fractions * voronoi.facets.area[diagram.facet]
    for component, place in zip(chosen, places, strict=True):
        mine = cells.of_polygon == component
        for axis in np.flatnonzero(axes[component]):
            share = shares[mine & normals[:, axis]].sum() / shares[mine].sum()
            side = np.round(diagram.points[diagram.faces[diagram.facet[mine & normals[:, axis]]]][..., axis].mean())
            # one plane pulls with s^2 - 1 times its share of the cell, the centroid with 1
            assert abs(place[axis] - side) < 1.0 / (1.0 + (100.0**2 - 1.0) * share) + 1e-9


@pytest.mark.parametrize("angle", [91.0, 180.0])
def test_no_edge_of_a_box_is_sharper_than_a_right_angle(angle):
    surface, _, diagram, cells = _box_dual(30)
    sharp = sharp_edges(surface, angle)
    assert not sharp.any()
    assert len(cells_with_crease(diagram, cells, surface, sharp)) == 0


def test_corners_of_a_box_are_its_corners():
    surface = box(n=5)
    found = surface.points[corners(surface, sharp_edges(surface, 45.0))]
    assert len(found) == 8
    np.testing.assert_array_equal(np.abs(found - 0.5), 0.5)


def test_missed_corners_are_met_after_snapping():
    surface, _, diagram, cells = _box_dual(200, seed=3)
    points, faces, done = simplicial_mesh(dual_mesh(diagram, cells, surface))
    assert done
    sharp = sharp_edges(surface, 45.0)
    ends = surface.points[corners(surface, sharp)]
    before = np.sqrt(ClosestPoints(Surface(points, faces)).squared_distances(ends))
    snapped = snap_to_missed(diagram, cells, surface, points, faces, sharp, np.ones(len(cells.site), dtype=bool))
    after = np.sqrt(ClosestPoints(Surface(snapped, faces)).squared_distances(ends))
    assert before.max() > 0.01
    assert (after < 1e-9).sum() > (before < 1e-9).sum()
    unmoved = np.setdiff1d(np.arange(len(points)), cells_with_crease(diagram, cells, surface, sharp))
    np.testing.assert_array_equal(snapped[unmoved], points[unmoved])
    total = [ClosestPoints(Surface(p, faces)).squared_distances(surface.points).sum() for p in (points, snapped)]
    assert total[1] < total[0]


def test_exchange_puts_a_site_on_a_missed_corner():
    surface = box(n=12)
    voronoi = RestrictedVoronoi(surface.points, surface.faces, threads=1)
    ordered = Surface(surface.points, voronoi.faces)
    corner = np.ones(3)
    sites = surface.points[np.linalg.norm(surface.points - corner, axis=1) > 0.25][::2]
    changed = exchange_sites(voronoi, sites, ordered, 1.0, 7.0)
    assert changed.shape == sites.shape
    assert np.linalg.norm(sites - corner, axis=1).min() > 0.25
    assert np.linalg.norm(changed - corner, axis=1).min() == 0.0
    kept = (changed[:, None] == sites[None]).all(axis=2).any(axis=1)
    assert kept.mean() >= 0.95


def test_a_triangle_nearest_to_another_sheet_is_turned_back():
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
    assert closest.turned(mesh.points[mesh.faces]).any()
    points, faces, left = remove_inverted_triangles(mesh.points, mesh.faces, closest)
    assert left == 0
    assert not closest.turned(points[faces]).any()
    assert_same_topology(Surface(points, faces), mesh)
    assert len(points) < 1.3 * mesh.n_points


def test_decimation_of_a_square_tube_leaves_no_needle_and_no_turned_face():
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
    assert not flipped_faces(result, surface).any()


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
    assert flipped_faces(result, surface).sum() == 0
    inner = np.arange(len(points), n)[~result.on_boundary[len(points) :]]
    assert np.sqrt(reference.squared_distances(grown[inner])).max() < 1e-9
    assert split_longest_edges(points, faces, len(points), reference, roots)[0] is points

"""Locked regions come out as they are, and the rest is remeshed up to them."""

import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Regions, Surface
from anisomesh.errors import OptionError
from anisomesh.io.meshes import load_mesh, save
from anisomesh.mesh.geometry import thickness
from anisomesh.shapes.analytic import box, open_patch, sphere, torus

BOX, BALL = box((1.0, 0.7, 0.5), n=8), sphere(3)


def middles(surface):
    return surface.points[surface.faces].mean(axis=1)


def cap_of(surface, height):
    faces = surface.faces[(surface.points[surface.faces][..., 2] > height).all(axis=1)]
    used, faces = np.unique(faces, return_inverse=True)
    return Surface(surface.points[used], faces.reshape(-1, 3))


def tube():
    """A cylinder without ends, 48 points around and 13 along."""
    around, along = np.meshgrid(np.arange(48), np.arange(13), indexing="ij")
    angle = 2.0 * np.pi * around / 48
    points = np.stack([np.cos(angle), np.sin(angle), along / 6.0], axis=2).reshape(-1, 3)
    a, b = (number.ravel() for number in (around[:, :-1], along[:, :-1]))
    here, next_ = 13 * a + b, 13 * ((a + 1) % 48) + b
    return Surface(
        points,
        np.concatenate([np.stack([here, next_, here + 1], axis=1), np.stack([next_, next_ + 1, here + 1], axis=1)]),
    )


def triangles(surface, faces):
    """The triangles as cycles of places, each beginning at its lowest one."""
    corners = surface.points[faces].tolist()
    cycles = [[tuple(place) for place in triangle] for triangle in corners]
    return {tuple(cycle[(cycle.index(min(cycle)) + k) % 3] for k in range(3)) for cycle in cycles}


def assert_locked(result, surface, mask, n_vertices):
    """Locked triangles are there to the last digit, the count is met, and the whole has the topology of the input."""
    assert triangles(surface, surface.faces[mask]) <= triangles(result.surface, result.surface.faces)
    assert result.surface.n_points == n_vertices
    validity = result.validity
    assert validity.euler == validity.euler_input
    assert validity.boundary_loops == validity.boundary_loops_input
    assert validity.components == validity.components_input
    assert validity.nonmanifold_edges == validity.nonmanifold_vertices == validity.duplicate_faces == 0
    assert validity.oriented
    assert validity.inverted == validity.flat == validity.new_intersections == 0


CAP, TUBE = cap_of(BALL, -0.3), tube()
SQUARES = (middles(BOX)[:, 2] > 0.4999) & (
    np.floor(middles(BOX)[:, :2] @ np.diag([4.0, 4.0 / 0.7])).sum(axis=1) % 2 == 0
)
CASES = {
    "a side of a box, up to its creases": (BOX, middles(BOX)[:, 2] > 0.4999, 200, {}),
    "a corner of a box, across creases": (BOX, middles(BOX).max(axis=1) < 0.35, 200, {"metric": "approximation"}),
    "two caps of a sphere": (BALL, np.abs(middles(BALL)[:, 2]) > 0.8, 400, {"fit": False}),
    "a part up to the boundary": (CAP, middles(CAP)[:, 0] > 0.5, 320, {}),
    "a hole that is left": (CAP, middles(CAP)[:, 2] < 0.6, 420, {}),
    "a band around a tube": (TUBE, np.abs(middles(TUBE)[:, 2] - 1.0) < 0.4, 450, {}),
    "squares that touch at points": (BOX, SQUARES, 250, {}),
}


@pytest.mark.parametrize("case", CASES)
def test_locked_faces_stay_and_the_rest_joins_them(case):
    surface, mask, n_vertices, how = CASES[case]
    shifted = surface.with_points(surface.points * 17.3 + np.array([3.0, -40.0, 1.0 / 3.0]))
    result = anisomesh.remesh(shifted, n_vertices=n_vertices, lock=mask, max_iterations=10, **how)
    assert_locked(result, shifted, mask, n_vertices)
    assert result.warnings == ()


def test_single_triangles_that_are_locked_all_over_a_sphere_stay():
    mask = np.random.default_rng(0).random(BALL.n_faces) < 0.05
    result = anisomesh.remesh(BALL, n_vertices=450, lock=mask, max_iterations=10)
    assert_locked(result, BALL, mask, 450)


def test_a_locked_region_stays_where_noise_is_removed_around_it():
    ball = sphere(4)
    noise = 0.02 * np.random.default_rng(1).standard_normal((ball.n_points, 1))
    noisy, mask = ball.with_points(ball.points * (1.0 + noise)), middles(ball)[:, 2] > 0.85
    result = anisomesh.remesh(noisy, n_vertices=500, lock=mask, max_iterations=10)
    assert result.noise > 0.0
    assert_locked(result, noisy, mask, 500)


@pytest.mark.parametrize("fit", [True, False])
def test_no_triangle_is_inverted_against_the_locked_side_of_a_thin_plate(fit):
    """The mesh of the rest does not know of that side, and its edges cut the rim below it."""
    plate = box((1.0, 1.0, 0.005), n=12)
    mask = (middles(plate)[:, 2] > 0.0049) & (middles(plate)[:, 0] < 0.5)
    result = anisomesh.remesh(plate, n_vertices=220, lock=mask, fit=fit)
    assert_locked(result, plate, mask, result.surface.n_points)
    assert result.surface.n_points == pytest.approx(220, rel=0.05)


def test_a_soup_with_reversed_triangles_is_locked_too():
    faces = BALL.faces.copy()
    faces[::3] = faces[::3][:, ::-1]
    soup = Surface(BALL.points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))
    mask = middles(BALL)[:, 2] > 0.7
    result = anisomesh.remesh(soup, n_vertices=250, lock=mask, max_iterations=10)
    assert_locked(result, BALL, mask, 250)


def test_everything_can_be_locked():
    result = anisomesh.remesh(BOX, n_vertices=100, lock=np.ones(BOX.n_faces, dtype=bool))
    np.testing.assert_array_equal(result.surface.points, BOX.points)
    np.testing.assert_array_equal(result.surface.faces, BOX.faces)
    assert result.warnings == ("all faces are locked: the result is the input",)


def carrying(surface):
    """A mesh with a region "top" and another one, and data of all kinds that no formula gives."""
    rng, labels = np.random.default_rng(3), np.where(middles(surface)[:, 2] > 0.4999, 4, 9)
    return Mesh(
        surface=surface,
        point_data={"p": rng.random(surface.n_points), "k": rng.integers(0, 9, surface.n_points)},
        face_data={"f": rng.random((surface.n_faces, 2)), "word": rng.choice(["a", "bcd"], surface.n_faces)},
        corner_data={"c": rng.random((surface.n_faces, 3))},
        regions={"part": Regions(labels, {4: "top"})},
        features=surface.edges[::7],
    )


@pytest.mark.parametrize("lock", ["top", 4, "part 4", "part top", ["4"]])
def test_what_locked_faces_carry_is_the_same(lock):
    mesh = carrying(BOX)
    result = anisomesh.remesh(mesh, n_vertices=220, lock=lock, regions=False, max_iterations=5).mesh
    mask = mesh.regions["part"].labels == 4
    n = mask.sum()
    own = {tuple(place): k for k, place in enumerate(BOX.points.tolist())}
    point = np.array(
        [own[tuple(place)] for place in result.surface.points[np.unique(result.surface.faces[:n])].tolist()]
    )
    for name, values in mesh.point_data.items():
        np.testing.assert_array_equal(result.point_data[name][: len(point)], values[point])
    np.testing.assert_array_equal(point[result.surface.faces[:n]], BOX.faces[mask])
    for name, values in mesh.face_data.items():
        np.testing.assert_array_equal(result.face_data[name][:n], values[mask])
    np.testing.assert_array_equal(result.corner_data["c"][:n], mesh.corner_data["c"][mask])
    labels = result.regions["part"].labels
    assert (labels[:n] == 4).all()
    assert (labels[n:] == 9).all()
    inside = {frozenset(edge) for edge in mesh.features.tolist() if set(edge) <= set(point.tolist())}
    found = {frozenset(point[edge].tolist()) for edge in result.features if (edge < len(point)).all()}
    assert {edge for edge in inside if len(edge & set(BOX.faces[mask].ravel().tolist())) == 2} <= found


@pytest.mark.parametrize(
    ("lock", "message"),
    [
        ("bottom", r"lock = 'bottom' is not a region of the mesh; its regions are 'part top', 'part 9'"),
        (5, r"lock = 5 is not a region of the mesh; .*; groups of lines or points cannot be selected"),
        (0.5, r"lock = 0.5; expected the name or label of a region"),
        (
            np.zeros(BOX.n_faces, dtype=bool),
            r"lock is a mask that selects no face; select some, or leave it out",
        ),
        (
            np.ones(3, dtype=bool),
            r"lock is a mask of shape \(3,\); expected .* a value for each triangle after reading",
        ),
    ],
)
def test_regions_that_do_not_exist_are_refused(lock, message):
    with pytest.raises(OptionError, match=message):
        anisomesh.remesh(carrying(BOX), n_vertices=100, lock=lock)


@pytest.mark.parametrize("n_vertices", [160, 180])
def test_a_curved_border_of_locked_faces_is_not_cut_short(n_vertices):
    """Regression: the border counted as a crease with cells beside it, past which one edge from end to end was made.

    All border points hung on that edge in slivers, which filled the gap.
    """
    x, y = np.meshgrid(np.linspace(0.0, 2.0, 24), np.linspace(0.0, 1.0, 16), indexing="ij")
    points = np.stack([x, y, 0.15 * np.sin(3.0 * x) * np.cos(2.0 * y)], axis=2).reshape(-1, 3)
    a = (16 * np.arange(23)[:, None] + np.arange(15)).ravel()
    squares = np.stack([a, a + 16, a + 17, a + 1], axis=1)
    sheet = Surface(points, np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]]))
    right = middles(sheet)[:, 0] > 1.5
    mesh = Mesh(surface=sheet, regions={"side": Regions(right.astype(int), {0: "left", 1: "right"})})
    result = anisomesh.remesh(mesh, n_vertices=n_vertices, lock="right", metric="uniform")
    free = result.mesh.regions["side"].labels == 0
    surface = result.surface
    assert surface.face_areas[free].sum() == pytest.approx(sheet.face_areas[~right].sum(), rel=0.001)
    assert thickness(surface.points[surface.faces[free]]).min() > 0.03


@pytest.mark.parametrize("n_vertices", [90, 120])
def test_a_line_through_the_corner_of_a_locked_face_is_one_path(n_vertices):
    surface = open_patch(lambda x, y: 0.1 * np.sin(3.0 * x), n=12)
    row = np.flatnonzero(np.abs(surface.points[:, 1]) < 1e-9)
    row = row[np.argsort(surface.points[row, 0])]
    touching = np.flatnonzero((surface.faces == row[2]).any(axis=1) & ~np.isin(surface.faces, row[[1, 3]]).any(axis=1))
    assert len(touching) > 0
    line = np.stack([row[:-1], row[1:]], axis=1)
    result = anisomesh.remesh(Mesh(surface=surface, features=line, fixed_faces=touching[:1]), n_vertices=n_vertices)
    ends = result.surface.points[result.mesh.features]
    assert (np.abs(ends[..., 1]) < 1e-9).all()
    assert np.abs(np.diff(ends[..., 0], axis=1)).sum() == pytest.approx(np.ptp(surface.points[row, 0]), abs=1e-9)
    assert result.warnings == ()


@pytest.mark.parametrize("seed", [0, 3])
def test_a_line_that_comes_to_a_straight_side_of_locked_faces_reaches_it(seed):
    """Regression: near the corners of the side its end did not count as one, and the last edge was lost in the fit."""
    surface = open_patch(lambda x, y: 0.1 * np.sin(1.5 * x + 1.5), n=11)
    middle = middles(surface)
    block = np.flatnonzero((np.abs(middle[:, :2]) < 0.28).all(axis=1))
    row = np.flatnonzero(np.abs(surface.points[:, 1] + 1.0 / 11.0) < 1e-9)
    row = row[np.argsort(surface.points[row, 0])]
    line = np.stack([row[:-1], row[1:]], axis=1)
    mesh = Mesh(surface=surface, features=line, fixed_faces=block)
    result = anisomesh.remesh(mesh, n_vertices=60, seed=seed)
    ends = result.surface.points[result.mesh.features][..., 0]
    assert np.abs(np.diff(ends, axis=1)).sum() == pytest.approx(2.0, abs=1e-9)


def test_too_few_vertices_are_refused():
    with pytest.raises(
        OptionError, match=r"50 vertices are asked for, and the locked regions and points to keep have 81"
    ):
        anisomesh.remesh(carrying(BOX), n_vertices=50, lock="top")
    with pytest.raises(OptionError, match="it has no regions"):
        anisomesh.remesh(BOX, n_vertices=50, lock="top")


@pytest.mark.parametrize("left", [1, 2])
def test_all_but_some_faces_can_be_locked_and_the_count_is_the_one_asked_for_or_a_warning(left):
    mask = np.ones(BALL.n_faces, dtype=bool)
    first = BALL.faces[100]
    beside = np.array([np.isin(face, first).sum() == 2 for face in BALL.faces])
    mask[[100, np.flatnonzero(beside)[0]][:left]] = False
    for n in (BALL.n_points, BALL.n_points + 3):
        result = anisomesh.remesh(BALL, n_vertices=n, lock=mask, max_iterations=2)
        assert_locked(result, BALL, mask, result.surface.n_points)
        told = any(f"{result.surface.n_points} vertices instead of {n}" in each for each in result.warnings)
        assert told == (result.surface.n_points != n)
    with pytest.raises(OptionError, match=f"have {BALL.n_points};"):
        anisomesh.remesh(BALL, n_vertices=BALL.n_points - 1, lock=mask)


@pytest.mark.parametrize("surface", [torus(n_major=48, n_minor=24), open_patch(lambda x, y: 0.0 * x, 24)])
def test_beside_a_fine_locked_half_the_other_has_the_vertices_that_its_sizes_take(surface):
    """By symmetry half the vertices that the whole takes; the border counts as locked."""
    h, mask = 1.2 * surface.edge_lengths.mean(), middles(surface)[:, 0] > 0.0
    how = {"size_field": np.full(surface.n_points, h), "metric": "uniform", "max_iterations": 2, "fit": False}
    whole, half = (anisomesh.remesh(surface, **how, **more) for more in ({}, {"lock": mask}))
    more = half.surface.n_points - len(np.unique(surface.faces[mask]))
    assert more == pytest.approx(0.5 * whole.surface.n_points, rel=0.1)


@pytest.mark.slow
def test_a_search_for_a_distance_and_an_edge_length_keep_locked_faces():
    mask = middles(BALL)[:, 2] > 0.8
    result = anisomesh.remesh(BALL, max_error=0.02, lock=mask)
    assert_locked(result, BALL, mask, result.vertices_asked)
    assert result.distance <= 0.02
    result = anisomesh.remesh(BALL, edge_length=0.4, metric="uniform", lock=mask)
    assert_locked(result, BALL, mask, result.vertices_asked)


@pytest.mark.parametrize(("suffix", "division"), [("obj", "group"), ("msh", "physical")])
def test_the_command_locks_regions_and_keeps_points(run_cli, tmp_path, suffix, division):
    labels = np.where(middles(BOX)[:, 2] > 0.4999, 1, np.where(middles(BOX)[:, 2] < 1e-9, 2, 3))
    regions = {division: Regions(labels, {1: "top", 2: "bottom", 3: "sides"})}
    save(Mesh(surface=BOX, regions=regions), tmp_path / f"a.{suffix}")
    given = load_mesh(tmp_path / f"a.{suffix}")
    kept = given.surface.points[[0, 50, 99]]
    (tmp_path / "keep.txt").write_text("0\n50  # a comment\n99\n")
    options = ["-n", 250, "--lock", "top", "--lock", "bottom", "--keep-points", "keep.txt", "--embedding", "direct"]
    process = run_cli("remesh", f"a.{suffix}", "-o", f"b.{suffix}", *options, cwd=tmp_path)
    assert process.returncode == 0, process.stderr
    mesh = load_mesh(tmp_path / f"b.{suffix}")
    assert mesh.surface.n_points == 250
    assert {tuple(p) for p in kept.tolist()} <= {tuple(p) for p in mesh.surface.points.tolist()}
    for name in ("top", "bottom"):
        found, expected = (
            triangles(each.surface, each.surface.faces[named(each, division) == name]) for each in (mesh, given)
        )
        assert found == expected
    process = run_cli("remesh", f"a.{suffix}", "-o", f"c.{suffix}", "-n", 250, "--lock", "lid", cwd=tmp_path)
    assert process.returncode != 0
    assert "'lid' is not a region of the mesh; its regions are" in process.stderr


def named(mesh, division):
    regions = mesh.regions[division]
    return np.array([regions.names.get(label, "") for label in regions.labels.tolist()])


def required_side():
    """Return a box of which the triangles of the upper side are required."""
    return Mesh(surface=BOX, fixed_faces=np.flatnonzero(middles(BOX)[:, 2] > 0.4999))


def places_of(mesh):
    """Return the fixed faces of a mesh by their places, which may begin at any corner."""
    return triangles(mesh.surface, mesh.surface.faces[mesh.fixed_faces])


@pytest.mark.parametrize("suffix", [".mesh", ".meshb"])
def test_required_triangles_of_medit_stay_and_are_required_again(tmp_path, suffix):
    """Regression: a line said that the section was left out, and the triangles were remeshed."""
    given = required_side()
    save(given, tmp_path / f"a{suffix}")
    mesh = load_mesh(tmp_path / f"a{suffix}")
    np.testing.assert_array_equal(mesh.fixed_faces, given.fixed_faces)
    result = anisomesh.remesh(mesh, n_vertices=250, max_iterations=5)
    mask = np.isin(np.arange(BOX.n_faces), given.fixed_faces)
    assert_locked(result, BOX, mask, 250)
    save(result.mesh, tmp_path / f"b{suffix}")
    read = load_mesh(tmp_path / f"b{suffix}")
    assert places_of(read) == places_of(given)
    assert len(read.fixed_faces) == len(given.fixed_faces)


def test_fixed_faces_are_free_without_attributes_and_locked_beside_other_regions():
    given = required_side()
    other = middles(BOX)[:, 2] < 1e-6 + BOX.points[:, 2].min()
    both = anisomesh.remesh(given, n_vertices=400, lock=other, max_iterations=2)
    assert triangles(BOX, BOX.faces[other]) | places_of(given) <= triangles(both.surface, both.surface.faces)
    assert places_of(both.mesh) == places_of(given)
    free = anisomesh.remesh(given, n_vertices=60, attributes=False, max_iterations=2)
    assert free.surface.n_points == 60
    with pytest.raises(OptionError, match="as required triangles, are locked unless no attributes are carried over"):
        anisomesh.remesh(given, n_vertices=60, max_iterations=2)


def test_a_file_that_requires_all_triangles_fixes_none(tmp_path, caplog):
    save(Mesh(surface=BOX, fixed_faces=np.arange(BOX.n_faces)), tmp_path / "a.mesh")
    assert len(load_mesh(tmp_path / "a.mesh").fixed_faces) == 0
    assert "did not fix faces since it lists every face of its surface" in caplog.text


def test_required_quadrilaterals_are_all_their_triangles(tmp_path):
    points = "0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n2 0 0 0\n2 1 0 0\n"
    (tmp_path / "a.mesh").write_text(
        f"MeshVersionFormatted 2\nDimension 3\nVertices\n6\n{points}Quadrilaterals\n1\n1 2 3 4 0\nTriangles\n2\n"
        "2 5 3 0\n5 6 3 0\nRequiredTriangles\n1\n2\nRequiredQuadrilaterals\n1\n1\nEnd\n"
    )
    mesh = load_mesh(tmp_path / "a.mesh")
    assert {tuple(sorted(face)) for face in mesh.surface.faces[mesh.fixed_faces].tolist()} == (
        {tuple(sorted(face)) for face in mesh.surface.faces.tolist()} - {(1, 2, 4)}
    )


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".glb", ".3mf", ".vtu", ".vtp", ".msh"])
def test_formats_without_fixed_faces_name_them(tmp_path, caplog, suffix):
    save(required_side(), tmp_path / f"a{suffix}")
    assert "128 fixed face(s)" in caplog.text

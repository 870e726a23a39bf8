"""Metrics from files, and out to files: ``--metric-file`` and ``--save-metric``."""

import json

import numpy as np
import pytest

import anisomesh
from anisomesh.errors import OptionError
from anisomesh.io.fields.load import load_field
from anisomesh.io.meshes import load, save
from anisomesh.mesh.surface import Surface
from anisomesh.metric.unit_edges import tangent_sizes
from anisomesh.result import save_metric
from anisomesh.shapes.analytic import box, open_patch, sphere, torus
from conftest import torus_arrays, write_obj

FAST = ("--max-iterations", 2, "--no-fit")
SQUARE = open_patch(lambda x, y: 0.0 * x, 24)
TILTED = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
METRIC = TILTED @ np.diag(1.0 / np.array([0.3, 0.1, 0.5]) ** 2) @ TILTED.T  # edges of .3 and .1, askew to the axes


def everywhere(surface, matrix=METRIC):
    return np.broadcast_to(matrix, (surface.n_points, 3, 3)).copy()


def write_sol(path, rows):
    """Write a solution without the help of the package."""
    kind = 3 if rows.ndim == 2 else 1
    lines = [" ".join(map(repr, np.atleast_1d(row).tolist())) for row in rows]
    text = f"MeshVersionFormatted 2\nDimension 3\nSolAtVertices\n{len(rows)}\n1 {kind}\n"
    path.write_text(text + "\n".join(lines) + "\nEnd\n")
    return path


def lower_half(m):
    return np.array([m[0, 0], m[1, 0], m[1, 1], m[2, 0], m[2, 1], m[2, 2]])


def lengths(surface, matrix=METRIC):
    vectors = np.diff(surface.points[surface.edges], axis=1)[:, 0]
    return np.sqrt(np.einsum("ex,xy,ey->e", vectors, matrix, vectors))


@pytest.fixture
def run(run_cli, tmp_path):
    def run(*words):
        return run_cli(*words, "-q", cwd=tmp_path)

    return run


@pytest.fixture
def square(tmp_path):
    save(SQUARE, tmp_path / "in.mesh")
    write_sol(tmp_path / "in.sol", np.tile(lower_half(METRIC), (SQUARE.n_points, 1)))
    return tmp_path


def test_edges_have_length_one_in_the_tensors_of_a_file_and_the_count_follows(run, square):
    done = run("remesh", "in.mesh", "-o", "out.mesh", "--metric-file", "in.sol", "--json")
    assert done.returncode == 0, done.stderr
    result, facts = load(square / "out.mesh"), json.loads(done.stdout)
    found = lengths(result)
    assert np.median(found) == pytest.approx(1.0, abs=0.05)
    assert np.mean((found > 0.5**0.5) & (found < 2.0**0.5)) > 0.9
    assert facts["conformity"]["asked"] == 1.0
    assert facts["conformity"]["median"] == pytest.approx(np.median(found), rel=1e-3)
    assert facts["options"]["metric_file"] == "in.sol"
    area = SQUARE.area * np.sqrt(np.linalg.det(METRIC[:2, :2]))
    assert result.n_faces == pytest.approx(area / (0.25 * 3.0**0.5), rel=0.1)


def test_with_a_number_of_vertices_only_ratios_of_lengths_count(run, square):
    for name, factor in (("out.mesh", 1.0), ("other.mesh", 64.0)):
        write_sol(square / "in.sol", factor * np.tile(lower_half(METRIC), (SQUARE.n_points, 1)))
        assert run("remesh", "in.mesh", "-o", name, "--metric-file", "in.sol", "-n", 90, *FAST).returncode == 0
    first, second = (load(square / name) for name in ("out.mesh", "other.mesh"))
    assert first.n_points == second.n_points == 90
    assert np.median(lengths(second)) == pytest.approx(np.median(lengths(first)), rel=0.05)


def test_sizes_of_a_file_are_lengths_of_edges_where_they_are(run, tmp_path):
    surface = torus()
    save(surface, tmp_path / "in.vtu", point_data={"h": 0.1 + 0.1 * (surface.points[:, 0] > 0.0), "T": surface.points})
    done = run("remesh", "in.vtu", "-o", "out.ply", "--metric-file", "in.vtu", "--report", "r.json")
    assert done.returncode == 0, done.stderr
    result = load(tmp_path / "out.ply")
    place = result.points[result.edges].mean(axis=1)[:, 0]
    for end, size in ((place > 0.3, 0.2), (place < -0.3, 0.1)):
        assert result.edge_lengths[end].mean() == pytest.approx(size, rel=0.1)
    assert json.loads((tmp_path / "r.json").read_text())["conformity"]["share"] > 0.9


def test_the_command_line_and_python_do_the_same(run, square):
    assert run("remesh", "in.mesh", "-o", "out.mesh", "--metric-file", "in.sol", *FAST).returncode == 0
    options = {"max_iterations": 2, "fit": False}
    tensors = load_field(square / "in.sol").values
    result = anisomesh.remesh(square / "in.mesh", metric=tensors, **options)
    np.testing.assert_array_equal(result.surface.points, load(square / "out.mesh").points)
    same = anisomesh.remesh(square / "in.mesh", metric=tensors, edge_length=1.0, **options)
    np.testing.assert_array_equal(result.surface.points, same.surface.points)
    with pytest.raises(OptionError, match="density has no unit"):
        anisomesh.remesh(SQUARE, metric=tensors, density=np.ones(SQUARE.n_points))


def test_sizes_of_a_file_are_limited_as_in_python(run, tmp_path):
    sizes = np.where(SQUARE.points[:, 0] > 0.5, 0.05, 0.4)
    save(SQUARE, tmp_path / "in.vtu", point_data={"h": sizes})
    limits = ("--min-size", 0.1, "--max-size", "20%", "--gradation", 0.5)
    assert run("remesh", "in.vtu", "-o", "out.ply", "--metric-file", "in.vtu:h", *limits, *FAST).returncode == 0
    same = anisomesh.remesh(
        tmp_path / "in.vtu",
        metric="uniform",
        size_field=sizes,
        min_size=0.1,
        max_size=0.2 * SQUARE.diagonal,
        gradation=0.5,
        max_iterations=2,
        fit=False,
    )
    np.testing.assert_array_equal(same.surface.points, load(tmp_path / "out.ply").points)


@pytest.mark.parametrize("tensors", [True, False], ids=["tensors", "sizes"])
def test_rows_belong_to_the_points_of_the_file_before_its_repair(run, tmp_path, tensors):
    """Unused and repeated points of the input, which the repair removes, have rows too."""
    points, faces = torus_arrays(24, 12)
    sizes = 0.2 + 0.1 * (points[:, 0] > 0.0)
    write_obj(tmp_path / "clean.obj", points, faces)
    repeated = np.concatenate([np.full((5, 3), 0.1), points, points[:7]])
    changed = faces + 5
    for k in range(7):  # one face each around the first points has the repeated one
        face, corner = np.argwhere(changed == k + 5)[0]
        changed[face, corner] = len(points) + 5 + k
    write_obj(tmp_path / "dirty.obj", repeated, changed)
    rows = {"clean": sizes, "dirty": np.concatenate([np.full(5, 1e-3), sizes, sizes[:7]])}
    for name, values in rows.items():
        values = np.eye(3).ravel() / values[:, None] ** 2 if tensors else values
        np.save(tmp_path / f"{name}.npy", values)
        words = ("--metric-file", f"{name}.npy", "-n", 200, *FAST)
        done = run("remesh", f"{name}.obj", "-o", f"{name}.ply", *words)
        assert done.returncode == 0, done.stderr
    clean, dirty = (load(tmp_path / f"{name}.ply") for name in rows)
    np.testing.assert_allclose(dirty.points, clean.points, atol=1e-9)


def test_a_metric_of_other_points_is_refused(run, square):
    np.save(square / "few.npy", np.ones(7))
    save(SQUARE.with_points(SQUARE.points[::-1]), square / "turned.vtu", point_data={"h": np.ones(SQUARE.n_points)})
    for file, words in {
        "few.npy": "few.npy: the field 'array' has 7 values, and in.mesh has 625 points",
        "turned.vtu": "turned.vtu: the field 'h' is at other points than in.mesh has, or in another order: point 0",
    }.items():
        done = run("remesh", "in.mesh", "-o", "out.mesh", "--metric-file", file, "-n", 50)
        assert done.returncode == 1
        assert words in done.stderr


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.r_[np.ones(624), -1.0], "a.npy, field 'array': row 624 is -1"),
        (np.tile(np.diag([1.0, 1.0, -1.0]), (625, 1, 1)), "a.npy, field 'array': row 0 = [[1.0, 0.0, 0.0]"),
        (np.tile([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (625, 1, 1)), "is not symmetric"),
    ],
    ids=["negative size", "indefinite", "not symmetric"],
)
def test_values_that_are_no_metric_are_refused(run, square, values, words):
    np.save(square / "a.npy", values)
    done = run("remesh", "in.mesh", "-o", "out.mesh", "--metric-file", "a.npy", "-n", 50)
    assert done.returncode == 1
    assert words in done.stderr


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--metric", "curvature"], "--metric and --metric-file say what the metric is"),
        (["--edge-length", "2%"], "--edge-length 2%: in the metric of a file it is a number"),
        (["-n", 50, "--ratio", 0.1], "give one of -n"),
        (["--min-size", "1%", "--gradation", 0.3], "--min-size and --gradation: only sizes can be limited"),
        (["--max-size", "x"], "--max-size"),
        (["--save-metric", "none/m.sol"], "the folder none does not exist"),
        (["--save-metric", "m.stl"], "--save-metric m.stl: expected a file name ending in .sol, .solb, .npy, .vtu"),
        (["--save-metric", "in.sol"], "in.sol is an input and would be overwritten"),
        (["--save-metric", "out.mesh"], "two outputs have the same file name"),
        (["--save-metric", "-"], "--save-metric -: only the mesh goes to standard output"),
        (["-o", "in.sol"], "in.sol is an input and would be overwritten"),
    ],
)
def test_wrong_usage_is_found_before_the_work(run, square, more, words):
    done = run("remesh", "in.mesh", "-o", "out.mesh", "--metric-file", "in.sol:1", *more)
    assert done.returncode == 2
    assert words in done.stderr
    assert not (square / "out.mesh").exists()


@pytest.mark.parametrize("suffix", [".sol", pytest.param(".vtu", marks=pytest.mark.slow)])
def test_a_saved_metric_is_the_one_that_was_given_and_gives_the_mesh_again(run, square, suffix):
    saved = f"out{suffix}"
    words = ("--metric-file", "in.sol", "--save-metric", saved, *FAST)
    assert run("remesh", "in.mesh", "-o", "out.mesh", *words).returncode == 0
    first = load(square / "out.mesh")
    np.testing.assert_allclose(load_field(square / saved).values, everywhere(first), rtol=1e-12, atol=1e-9)
    assert run("remesh", "out.mesh", "-o", "again.mesh", "--metric-file", saved, *FAST).returncode == 0
    assert load(square / "again.mesh").n_points == pytest.approx(first.n_points, rel=0.03)
    assert {path.name for path in square.iterdir()} == {"in.mesh", "in.sol", "out.mesh", saved, "again.mesh"}


@pytest.mark.parametrize(
    ("make", "metric"),
    [(lambda: torus(n_major=48, n_minor=24), "curvature"), (lambda: sphere(3), METRIC), (lambda: box(n=8), "uniform")],
    ids=["curvature", "tensors", "uniform"],
)
def test_edges_of_a_result_have_length_one_in_its_saved_metric(tmp_path, make, metric):
    surface = make().with_points(50.0 * make().points + 3.0)
    metric = metric if isinstance(metric, str) else everywhere(surface, metric)
    result = anisomesh.remesh(surface, n_vertices=200, metric=metric, embedding="direct", max_iterations=10)
    save_metric(result, tmp_path / "m.sol")
    tensors = load_field(tmp_path / "m.sol").values
    at_ends = tensors[result.surface.edges]
    vectors = np.diff(result.surface.points[result.surface.edges], axis=1)[:, 0]
    found = np.sqrt(np.einsum("ex,ekxy,ey->ek", vectors, at_ends, vectors)).mean(axis=1)
    assert np.median(found) == pytest.approx(1.0, abs=0.06)
    again = anisomesh.remesh(result.surface, metric=tensors, max_iterations=2, fit=False)
    assert again.surface.n_points == pytest.approx(200, rel=0.1)


def test_a_saved_metric_has_the_density_in_it():
    density = 16.0 ** (SQUARE.points[:, 0] > 0.0)
    given = {"n_vertices": 400, "metric": "uniform", "density": density}
    result = anisomesh.remesh(SQUARE, **given, max_iterations=5)
    x = result.surface.points[:, 0]
    left, right = (np.median(result.unit_tensors[side, 0, 0]) for side in (x < -0.1, x > 0.1))
    assert right / left == pytest.approx(4.0, rel=1e-6)  # areas have the ratio of the roots of the densities


def test_sizes_along_a_surface_are_the_ones_in_its_tangent_planes():
    around_z = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for turn in (np.eye(3), np.roll(np.eye(3), 1, axis=0), around_z):
        surface = Surface(SQUARE.points @ turn.T, SQUARE.faces)
        sizes = tangent_sizes(surface, everywhere(surface, turn @ METRIC @ turn.T))
        np.testing.assert_allclose(sizes, np.tile([0.1, 0.3], (surface.n_points, 1)), rtol=1e-9)


def test_a_saved_vtu_shows_the_result_with_metric_and_sizes(run, square):
    words = ("--metric-file", "in.sol", "--save-metric", "m.vtu", *FAST)
    assert run("remesh", "in.mesh", "-o", "out.mesh", *words).returncode == 0
    mesh = anisomesh.load_mesh(square / "m.vtu")
    np.testing.assert_array_equal(mesh.surface.points, load(square / "out.mesh").points)
    assert set(mesh.point_data) == {"metric", "sizes"}
    np.testing.assert_allclose(mesh.point_data["sizes"], np.tile([0.1, 0.3], (mesh.surface.n_points, 1)), rtol=1e-6)

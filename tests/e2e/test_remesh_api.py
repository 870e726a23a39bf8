"""The Python interface: what it accepts, what it returns, what it refuses."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import anisomesh
from anisomesh import starts
from anisomesh.errors import MeshError, MeshFileError, MetricError, OptionError
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import mean_at_points
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.metric.tensors import metric_root
from anisomesh.shapes.analytic import cad_part, cylinder, open_patch, sphere, torus

FEW = {"lloyd_iterations": 4, "max_iterations": 15}


@pytest.fixture(scope="module")
def ring():
    return torus(1.0, 0.3, 64, 24)


@pytest.fixture(scope="module")
def result(ring):
    return anisomesh.remesh(ring, n_vertices=400)


def test_closed_input_gives_a_valid_mesh_of_the_asked_size(ring, result):
    assert result.surface.n_points == result.vertices_asked == 400
    validity = result.validity
    assert (validity.closed, validity.oriented) == (True, True)
    assert (validity.nonmanifold_edges, validity.nonmanifold_vertices, validity.inverted) == (0, 0, 0)
    assert validity.euler == validity.euler_input == 0
    assert result.warnings == ()
    assert surface_distance(ring, result.surface, samples=2000).hausdorff < 0.05


def test_triangles_follow_the_metric(result):
    """The quality in the closed-form metric of the torus is high, and higher than the Euclidean quality."""
    points = result.surface.points
    angle = np.arctan2(points[:, 1], points[:, 0])
    centre = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    normal = points - centre
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    across = np.cross(normal, along)
    k_across = 1 / 0.3
    k_along = np.abs((normal * centre).sum(axis=1)) / np.linalg.norm(points[:, :2], axis=1)
    diagonal = result.prepared.diagonal
    stretch = np.sqrt(np.clip(k_across * diagonal, 1, 400) / np.clip(k_along * diagonal, 1, 400))
    tensors = np.eye(3) + (stretch**2 - 1)[:, None, None] * across[:, :, None] * across[:, None, :]
    quality = anisotropic_quality(points, result.surface.faces, metric_root(tensors)).mean()
    assert quality > 0.75
    assert quality > anisotropic_quality(points, result.surface.faces, np.broadcast_to(np.eye(3), (400, 3, 3))).mean()


@pytest.mark.slow
def test_every_kind_of_input_gives_the_same(ring):
    trimesh = pytest.importorskip("trimesh")
    pyvista = pytest.importorskip("pyvista")
    inputs = [
        (ring,),
        (ring.points, ring.faces),
        (trimesh.Trimesh(ring.points, ring.faces, process=False),),
        (pyvista.PolyData.from_regular_faces(ring.points, ring.faces),),
    ]
    results = [anisomesh.remesh(*given, n_vertices=120, **FEW).surface for given in inputs]
    for other in results[1:]:
        np.testing.assert_array_equal(other.points, results[0].points)
        np.testing.assert_array_equal(other.faces, results[0].faces)


@pytest.mark.slow
def test_same_seed_same_bytes_whatever_the_threads(ring):
    runs = [anisomesh.remesh(ring, n_vertices=300, threads=threads, **FEW).surface for threads in (1, 2, 3)]
    other = anisomesh.remesh(ring, n_vertices=300, seed=1, **FEW).surface
    assert len({run.points.tobytes() + run.faces.tobytes() for run in runs}) == 1
    assert other.points.tobytes() != runs[0].points.tobytes()


@pytest.mark.slow
def test_an_open_surface_gives_the_same_bytes_whatever_the_threads():
    patch = open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=24)
    runs = [anisomesh.remesh(patch, n_vertices=120, threads=threads, **FEW).surface for threads in (1, 2, 2)]
    assert len({run.points.tobytes() + run.faces.tobytes() for run in runs}) == 1


def test_position_and_scale_of_the_model_come_back(ring):
    moved = ring.with_points(1000.0 * ring.points + [5e4, 0.0, -2e4])
    there = anisomesh.remesh(moved, n_vertices=150, **FEW).surface
    assert surface_distance(moved, there, samples=2000).hausdorff < 200.0


def test_components_are_kept():
    ball = sphere(2)
    two = Surface(
        np.concatenate([ball.points, 0.5 * ball.points + [3.0, 0, 0]]),
        np.concatenate([ball.faces, ball.faces + ball.n_points]),
    )
    result = anisomesh.remesh(two, n_vertices=120, **FEW)
    assert result.validity.components == 2
    assert result.validity.euler == 4
    assert result.validity.closed


def test_an_open_surface_keeps_its_boundary_loop_and_corners():
    patch = open_patch(lambda x, y: 0.2 * np.cos(3 * x), n=24)
    result = anisomesh.remesh(patch, n_vertices=150, **FEW)
    assert result.validity.boundary_loops == 1
    assert result.validity.nonmanifold_edges == 0
    corners = patch.points[(np.abs(patch.points[:, :2]) == 1.0).all(axis=1)]
    distance = np.linalg.norm(result.surface.points[:, None] - corners[None], axis=2).min(axis=0)
    assert distance.max() < 1e-9
    assert not result.warnings


@pytest.mark.slow
def test_own_metric_stretches_as_asked():
    """Triangles of a cylinder asked to be three times as long around as along."""
    tube = cylinder(1.0, 4.0, 72, 40, closed=False)
    tensors = np.broadcast_to(np.diag([1.0, 1.0, 9.0]), (tube.n_points, 3, 3))
    result = anisomesh.remesh(tube, n_vertices=400, metric=tensors, sharpness=1.0)
    ends = result.surface.points[result.surface.edges]
    vector = ends[:, 1] - ends[:, 0]
    along, around = np.abs(vector[:, 2]), np.linalg.norm(vector[:, :2], axis=1)
    assert 2.0 < np.sqrt((around**2).mean() / (along**2).mean()) < 4.0
    plain = anisomesh.remesh(tube, n_vertices=400, metric="uniform", sharpness=1.0)
    ends = plain.surface.points[plain.surface.edges]
    vector = ends[:, 1] - ends[:, 0]
    assert 0.7 < np.sqrt((np.linalg.norm(vector[:, :2], axis=1) ** 2).mean() / (vector[:, 2] ** 2).mean()) < 1.4


@pytest.mark.slow
def test_corners_of_a_machine_part_are_met():
    part = cad_part(10)
    result = anisomesh.remesh(part, ratio=0.3)
    corners = np.array([[0, 0, 0], [0, 1, 0], [3, 0, 0], [3, 1, 0], [0, 0, 0.8], [0, 1, 0.8]])
    edge = result.surface.edge_lengths.mean()
    distance = np.linalg.norm(result.surface.points[:, None] - corners[None], axis=2).min(axis=0)
    assert distance.max() < 0.06 * edge
    assert result.validity.inverted == 0


def test_progress_names_the_stages_and_counts_iterations(ring):
    steps = []
    anisomesh.remesh(ring, n_vertices=100, on_step=steps.append, **FEW)
    assert list(dict.fromkeys(step.stage for step in steps)) == ["prepare", "metric", "embed", "cvt", "dual", "fit"]
    counted = [step.iteration for step in steps if step.energy is not None]
    assert counted == sorted(counted)
    assert all(step.iteration <= step.total for step in steps if step.energy is not None)


def test_an_exception_in_the_callback_ends_the_work(ring):
    def stop(step):
        if step.stage == "cvt":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        anisomesh.remesh(ring, n_vertices=100, on_step=stop)


def test_tensors_at_corners_belong_to_the_faces_of_the_working_surface():
    result = anisomesh.remesh(anisomesh.sample(), n_vertices=300, embedding="direct", max_iterations=2, fit=False)
    np.testing.assert_allclose(mean_at_points(result.working, result.corner_tensors), result.tensors, rtol=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, "give one of n_vertices, ratio, max_error and edge_length"),
        (
            {"n_vertices": 9, "metric": "uniform", "size_field": 0.2},
            r"an array \(V,\), a value .* edge_length is one length",
        ),
        (
            {"n_vertices": 9, "density": np.float32(2)},
            r"density = .*; expected an array \(V,\), a value for each point",
        ),
        (
            {"n_vertices": 100, "ratio": 0.5},
            "n_vertices and ratio are given; give one of n_vertices, ratio, max_error and edge_length",
        ),
        ({"n_vertices": 3}, "at least 4"),
        ({"n_vertices": 0}, "at least 4"),
        ({"n_vertices": 10.5}, "whole number"),
        ({"n_vertices": 10.0}, "whole number"),
        ({"n_vertices": float("nan")}, "whole number"),
        ({"n_vertices": True}, "whole number"),
        ({"ratio": "0.5"}, "ratio = '0.5'; expected a number"),
        ({"max_error": "0.1%"}, "expected a number"),
        ({"n_vertices": 100, "sharpness": "7"}, "expected a number"),
        ({"n_vertices": 100, "seed": 1.5}, "whole number"),
        ({"n_vertices": 100, "denoise": "no"}, "True or False"),
        ({"n_vertices": 100, "weights": 7}, "name of a network"),
        ({"n_vertices": 100, "weld_tolerance": -1.0}, "at least 0"),
        ({"n_vertices": 100, "options": {}}, "expected RemeshOptions"),
        ({"n_vertices": 10**400}, "at most"),
        ({"n_vertices": 100, "sharpness": 10**400}, "smaller number"),
        ({"n_vertices": 100, "threads": 10**6}, "at most 1024"),
        ({"n_vertices": 100, "device": np.array(["cpu", "cpu"])}, "device"),
        ({"n_vertices": np.array([5, 6])}, "whole number"),
        ({"ratio": 1e308}, "ratio = 1e"),
        ({"n_vertices": 100, "on_step": 3}, "expected a function"),
        ({"n_vertices": 100, "features": [[0, 1], [2]]}, "rows of different lengths"),
        ({"n_vertices": 100, "features": [["a", "b"]]}, "expected whole numbers"),
        ({"n_vertices": 100, "features": [[0, float("nan")]]}, "whole numbers"),
        ({"n_vertices": 100, "features": [[0, 1j]]}, "expected whole numbers"),
        ({"n_vertices": 100, "metric": anisomesh.Curvature}, "is a class"),
        ({"ratio": 0.0}, "positive number"),
        ({"ratio": float("nan")}, "positive number"),
        ({"n_vertices": 100, "sharpness": 0.5}, "at least 1"),
        ({"n_vertices": 100, "metric": "fancy"}, "expected one of curvature"),
        ({"n_vertices": 100, "embedding": "magic"}, "expected one of auto, direct, filtered, neural, hybrid"),
        ({"n_vertices": 100, "threads": 0}, "at least 1"),
        ({"n_vertices": 100, "feature_angle": 200.0}, "0 to 180"),
        ({"n_vertices": 100, "sharpnes": 7}, "no option 'sharpnes'"),
    ],
)
def test_options_out_of_range_are_refused(ring, options, words):
    with pytest.raises(OptionError, match=words):
        anisomesh.remesh(ring, **options)


def test_a_metric_of_the_wrong_shape_or_sign_is_refused(ring):
    with pytest.raises(MetricError, match="metric has shape"):
        anisomesh.remesh(ring, n_vertices=100, metric=np.eye(3)[None])
    with pytest.raises(MetricError, match="positive definite"):
        anisomesh.remesh(ring, n_vertices=100, metric=np.broadcast_to(-np.eye(3), (ring.n_points, 3, 3)))


def test_a_wrong_tensor_is_named_by_the_point_of_the_input():
    """Its index and its values are the user's, also where points before it are unused; those may have any tensor."""
    base = torus(1.0, 0.3, 16, 8)
    surface = Surface(np.concatenate([np.full((3, 3), 7.0), base.points]), base.faces + 3)
    tensors = np.tile(np.eye(3), (surface.n_points, 1, 1))
    tensors[:3] = 0.0
    anisomesh.remesh(surface, n_vertices=40, metric=tensors, **FEW)
    tensors[10] = np.diag([1.0, 2.0, -5.0])
    words = rf"metric\[10\] = .*-5\.0.*\(eigenvalues -5, 1, 2; like this: 1 of {base.n_points}\)"
    with pytest.raises(MetricError, match=words):
        anisomesh.remesh(surface, n_vertices=40, metric=tensors)
    with pytest.raises(OptionError, match=r"density\[10\] = 0"):
        anisomesh.remesh(surface, n_vertices=40, density=np.where(np.arange(surface.n_points) == 10, 0.0, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("faults", "intersections", "used"), [([2, 0], 0, 6), ([2, 1, 1], 0, 6), ([2, 3, 1], 0, 7), ([2], 1, 5)]
)
def test_other_seeds_are_tried_while_a_mesh_has_faults_that_the_input_does_not_explain(
    ring, monkeypatch, faults, intersections, used
):
    """The best of three is the mesh of its seed, and its stages took the time of all."""
    check, left = starts.check_validity, list(faults)

    def faulty(*surfaces):
        return replace(check(*surfaces), inverted=left.pop(0), self_intersections_input=intersections)

    monkeypatch.setattr(starts, "check_validity", faulty)
    options = {"n_vertices": 60, "embedding": "direct", **FEW}
    result = anisomesh.remesh(ring, seed=5, **options)
    assert (left, result.seed, result.report()["seed"]) == ([], used, used)
    monkeypatch.undo()
    np.testing.assert_array_equal(result.surface.points, anisomesh.remesh(ring, seed=used, **options).surface.points)


def test_numbers_of_any_type_and_no_features_are_accepted(ring):
    options = {"sharpness": Fraction(7), "seed": np.int64(0), "feature_angle": np.float32(40.0), "features": []}
    result = anisomesh.remesh(ring, n_vertices=np.int32(60), embedding="direct", **options, **FEW)
    plain = anisomesh.remesh(ring, n_vertices=60, embedding="direct", **FEW)
    np.testing.assert_array_equal(result.surface.points, plain.surface.points)


def test_the_report_has_the_stretch_of_the_triangles(result):
    report = result.report()
    assert report["stretch"]["mean"] == pytest.approx(result.surface.face_stretch.mean())
    assert report["stretch"]["max"] == pytest.approx(result.surface.face_stretch.max())
    assert report["stretch_of_embedding"]["max"] == result.embedding.stretch.achieved_max


def test_values_that_are_not_meshes_are_refused():
    with pytest.raises(MeshError, match="rows of different lengths"):
        anisomesh.remesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1]], n_vertices=100)
    with pytest.raises(MeshError, match="leave out the second argument"):
        anisomesh.remesh(torus(1.0, 0.3, 8, 6), [[0, 1, 2]], n_vertices=100)
    with pytest.raises(MeshError, match="cannot read a mesh from float"):
        anisomesh.remesh(3.0, n_vertices=100)
    with pytest.raises(MeshError, match=r"the mesh is the file ring\.ply and has faces; leave out the second argument"):
        anisomesh.remesh("ring.ply", [[0, 1, 2]], n_vertices=100)
    with pytest.raises(MeshFileError, match=r"bunny\.obj: no such file"):
        anisomesh.remesh("bunny.obj", n_vertices=100)


def test_a_mesh_may_be_the_name_of_a_file(ring, tmp_path):
    anisomesh.save(ring, tmp_path / "ring.ply")
    steps = []
    result = anisomesh.remesh(tmp_path / "ring.ply", n_vertices=60, on_step=steps.append, **FEW)
    expected = anisomesh.remesh(ring, n_vertices=60, **FEW)
    np.testing.assert_array_equal(result.surface.points, expected.surface.points)
    assert steps[0].stage == "load"
    assert result.seconds["load"] > expected.seconds["load"] == 0.0
    anisomesh.save(result.surface, tmp_path / "result.ply")
    measured = anisomesh.evaluate(str(tmp_path / "ring.ply"), str(tmp_path / "result.ply"), samples=500)
    assert measured.as_dict() == anisomesh.evaluate(ring, result.surface, samples=500).as_dict()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"n": 200}, r"has no option 'n' \(did you mean 'n_vertices'\?\)$"),
        ({"n_vertexes": 200}, "did you mean 'n_vertices'"),
        ({"sharpnes": 3.0}, "did you mean 'sharpness'"),
        ({"iterations": 3}, "did you mean 'max_iterations'"),
        ({"colour": "red"}, "has no option 'colour'; expected one of n_vertices, ratio, max_error, sharpness, "),
        ({"n_vertices": "200"}, "n_vertices = '200'; expected a whole number of at least 4, written without quotes"),
        ({"ratio": "0.2"}, "ratio = '0.2'; expected a number, written without quotes"),
        ({"n_vertices": 100, "seed": "a"}, "seed = 'a'; expected a whole number of at least 0$"),
    ],
)
def test_a_wrong_keyword_or_type_is_answered_with_what_was_meant(ring, given, words):
    with pytest.raises(OptionError, match=words):
        anisomesh.remesh(ring, **given)


def test_wrong_tensors_are_counted_by_points_of_the_input():
    """Points that the repair multiplies count once."""
    ball = sphere(1)
    low = int(ball.points[:, 2].argmin())
    other = ball.faces[:, ::-1] + ball.n_points  # the ball reflected in its lowest point, which both share
    other[other == ball.n_points + low] = low
    points = np.concatenate([ball.points, 2.0 * ball.points[low] - ball.points])
    surface = Surface(points, np.concatenate([ball.faces, other]))
    tensors = np.tile(np.eye(3), (surface.n_points, 1, 1))
    tensors[low] = 0.0
    with pytest.raises(MetricError, match=rf"metric\[{low}\] .* like this: 1 of {surface.n_points - 1}\)"):
        anisomesh.remesh(surface, n_vertices=100, metric=tensors)

"""Remeshing with the pretrained networks."""

import os
import subprocess
import sys
from functools import cache

import numpy as np
import pytest

import anisomesh
from anisomesh.denoise.noise import with_noise
from anisomesh.errors import OptionError
from anisomesh.evaluation.report import evaluate
from anisomesh.learn.architecture import NetworkOptions
from anisomesh.learn.inference.predict import NOISE_FLOOR, predict
from anisomesh.learn.inference.pretrained import pretrained_networks, weights_path
from anisomesh.learn.inference.stretch import StretchInference
from anisomesh.learn.weights_file import WeightsError, read_weights
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare
from anisomesh.shapes.analytic import box, ellipsoid, sphere, torus, twisted_ring


def egg_of(subdivisions):
    surface = ellipsoid((1.0, 0.6, 0.35), subdivisions)
    return surface.with_points(surface.points / surface.diagonal)


@pytest.fixture(scope="module")
def egg():
    return egg_of(3)


@pytest.fixture(scope="module")
def remeshed_egg(egg):
    """Return a function of an embedding: the result for the egg and its evaluation, computed once."""

    @cache
    def run(embedding):
        result = anisomesh.remesh(egg, n_vertices=200, embedding=embedding)
        return result, evaluate(egg, result.surface, samples=20_000)

    return run


def unit_torus(n_major=70, n_minor=28):
    surface = torus(1.0, 0.4, n_major, n_minor)
    return surface.with_points(surface.points / surface.diagonal)


def test_the_default_network_is_there_and_says_what_it_is():
    assert "default" in pretrained_networks()
    weights = read_weights(weights_path(None))
    assert weights.options.scales >= 3
    assert {"epoch", "validation 0", "training"} <= set(weights.facts)
    assert weights_path("default") == weights_path(None)


@pytest.mark.slow
def test_a_prediction_does_not_import_torch():
    """Regression: importing torch and its compiler took 5 s of the first remesh of a process."""
    code = (
        "import sys; from anisomesh.learn.inference.predict import predict\n"
        "from anisomesh.shapes.analytic import sphere\n"
        "ball = sphere(0); predict(ball.with_points(ball.points / ball.diagonal))\n"
        "assert 'torch' not in sys.modules"
    )
    uncompiled = {**os.environ, "NUMBA_DISABLE_JIT": "1"}  # which is faster for a few points
    subprocess.run([sys.executable, "-c", code], check=True, env=uncompiled)


@pytest.mark.slow
@pytest.mark.parametrize("embedding", ["neural", "hybrid"])
def test_a_smooth_shape_is_remeshed_as_well_as_directly(remeshed_egg, embedding):
    measured = {}
    for name in ("direct", embedding):
        result, measured[name] = remeshed_egg(name)
        assert result.surface.n_points == 200
        assert result.noise == 0.0
        assert not result.validity.inverted
    assert measured[embedding].shape.g_mean > measured["direct"].shape.g_mean - 0.04
    assert measured[embedding].distance.rms < 1.15 * measured["direct"].distance.rms


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.1, 0.3, 0.5])
def test_the_size_of_noise_is_estimated(size):
    noisy = with_noise(unit_torus(), size, np.random.default_rng(0))
    assert predict(noisy).noise == pytest.approx(size, rel=0.4)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.1, 0.3])
def test_noise_is_removed(size):
    clean, measured = unit_torus(), {}
    noisy = with_noise(clean, size, np.random.default_rng(0))
    for name in ("direct", "filtered", "hybrid"):
        result = anisomesh.remesh(noisy, n_vertices=300, embedding=name, max_iterations=10)
        measured[name] = evaluate(clean, result.surface, samples=5_000)
        assert (result.noise > 0.0) == (name != "direct")
    for name in ("filtered", "hybrid"):
        assert measured[name].shape.g_mean > measured["direct"].shape.g_mean + 0.02
        assert measured[name].distance.rms < measured["direct"].distance.rms


@pytest.mark.slow
def test_noise_is_kept_on_request():
    noisy = with_noise(egg_of(4), 0.3, np.random.default_rng(0))
    result = anisomesh.remesh(noisy, n_vertices=300, embedding="neural", denoise=False, max_iterations=5)
    assert result.noise == 0.0
    np.testing.assert_allclose(result.frame.to_model(result.working.points[: noisy.n_points]), noisy.points, atol=1e-9)
    taken = anisomesh.remesh(noisy, n_vertices=300, embedding="neural", max_iterations=5)
    assert taken.noise > 2.0 * NOISE_FLOOR
    assert taken.report()["noise"] == taken.noise
    assert any("noise" in warning for warning in taken.warnings)


@pytest.mark.slow
def test_an_error_from_the_noisy_input_leaves_the_noise():
    noisy = with_noise(egg_of(4), 2.0 * NOISE_FLOOR, np.random.default_rng(0))
    error = 0.02
    result = anisomesh.remesh(noisy, max_error=error, embedding="neural", max_iterations=5)
    assert result.noise == 0.0
    assert result.distance <= error


def test_little_noise_and_creases_stay():
    for surface in (twisted_ring(), with_noise(unit_torus(), 0.01, np.random.default_rng(0))):
        found = predict(surface.with_points(surface.points / surface.diagonal))
        assert found.noise == 0.0


class FixedNetwork(StretchInference):
    """A network that finds offsets of one length along the normals, when it is asked for the first time."""

    def __init__(self, length):
        self.options, self.length = NetworkOptions(scales=2, heads=1), length

    def __call__(self, hierarchy):
        normals = hierarchy.normals[:, 0] / np.linalg.norm(hierarchy.normals[:, 0], axis=1, keepdims=True)
        offsets, self.length = self.length * normals, 0.0
        return np.zeros((len(normals), 2), dtype=np.float32), offsets.astype(np.float32)


@pytest.mark.parametrize(("height", "share"), [(0.049, 0), (0.0501, 0.004), (0.06, 0.4), (0.08, 1), (0.3, 1)])
def test_the_share_of_noise_that_is_removed_grows_evenly(egg, monkeypatch, height, share):
    """Regression: noise of 0.0500 on a clean mesh was removed in full, which inverted 204 triangles."""
    network = FixedNetwork(height * egg.edge_lengths.mean())
    monkeypatch.setattr("anisomesh.learn.inference.predict._normal_filter", lambda *given: lambda noisy, moved: moved)
    monkeypatch.setattr("anisomesh.learn.inference.predict._network", lambda *given: network)
    found = predict(egg)
    moved = np.linalg.norm(found.points - egg.points, axis=1) / egg.edge_lengths.mean()
    np.testing.assert_allclose(moved, share * height, atol=1e-6)
    assert found.noise == pytest.approx(share * height, abs=1e-6)
    assert found.remarks == ()


def test_noise_beyond_what_networks_can_judge_stays_and_is_said(egg, monkeypatch):
    """Regression: a network that had hardly been trained moved points by three mean edge lengths."""
    network = FixedNetwork(3.1 * egg.edge_lengths.mean())
    monkeypatch.setattr("anisomesh.learn.inference.predict._network", lambda *given: network)
    result = anisomesh.remesh(egg, n_vertices=100, embedding="neural", max_iterations=2)
    assert result.noise == 0.0
    assert any("too much to judge" in sentence for sentence in result.warnings)


def voxels(n=16):
    """Return the sides of the cubes of a grid that are within a ball, made of the squares between in and out."""
    inside = np.linalg.norm(np.indices((n + 2,) * 3) - (n + 1) / 2.0, axis=0) < 0.45 * n
    corners = []
    for axis in range(3):
        ahead = np.roll(inside, -1, axis)
        u, v = np.eye(3)[[(axis + 1) % 3, (axis + 2) % 3]]
        for here, turned in ((inside & ~ahead, False), (ahead & ~inside, True)):
            low = np.argwhere(here) + np.eye(3)[axis]
            square = np.stack([low, low + u, low + u + v, low + v], axis=1)
            corners.append(square[:, ::-1] if turned else square)
    squares = np.concatenate(corners)
    points, index = np.unique(squares.reshape(-1, 3), axis=0, return_inverse=True)
    faces = index.reshape(-1, 4)
    return prepare(Surface(points, np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]]))).surface


@pytest.mark.slow
def test_voxel_steps_are_not_taken_for_noise():
    ball = voxels()
    assert predict(ball.with_points(ball.points / ball.diagonal)).noise > NOISE_FLOOR  # it looks like some
    result = anisomesh.remesh(ball, n_vertices=800, max_iterations=10)
    assert result.noise == 0.0
    away = np.abs(result.surface.points - np.round(result.surface.points)).min(axis=1)
    assert np.median(away) < 1e-3


@pytest.mark.parametrize("surface", [box(n=1), sphere(0)])
def test_meshes_of_few_points_have_graphs_without_edges(surface):
    found = predict(surface.with_points(surface.points / surface.diagonal))
    assert found.tensors.shape == (surface.n_points, 3, 3)
    assert np.isfinite(found.tensors).all()
    assert np.isfinite(found.points).all()


@pytest.mark.slow
def test_the_default_embedding_is_hybrid_for_the_curvature_metric(egg):
    tensors = np.tile(np.eye(3), (egg.n_points, 1, 1))
    for metric, wanted in (("curvature", "hybrid"), ("approximation", "direct"), (tensors, "direct")):
        result = anisomesh.remesh(egg, n_vertices=100, metric=metric, max_iterations=3)
        assert result.embedding_name == wanted
        assert result.report()["embedding"] == wanted


@pytest.mark.slow
def test_the_hybrid_metric_is_between_the_two(egg):
    options = {"n_vertices": 100, "max_iterations": 0}
    means = {
        kind: anisomesh.remesh(egg, embedding=kind, **options).embedding.stretch.target_mean
        for kind in ("direct", "neural", "hybrid")
    }
    low, high = sorted([means["direct"], means["neural"]])
    assert low - 0.05 < means["hybrid"] < high + 0.05


def test_weights_of_a_network_and_of_a_filter_are_not_taken_for_each_other(egg):
    for given in ({"weights": "filter"}, {"normal_filter": "default"}):
        with pytest.raises(WeightsError, match="filter of normals"):
            predict(with_noise(egg, 0.3, np.random.default_rng(0)), **given)


def test_missing_weights_and_devices_are_refused(egg, tmp_path):
    for words, kind, message in (
        ({"embedding": "neural", "weights": tmp_path / "none"}, OptionError, "none"),
        ({"embedding": "neural", "weights": "defualt"}, OptionError, "did you mean 'default'"),
        ({"weights": "default", "metric": "uniform"}, OptionError, "and no other"),
        ({"embedding": "direct", "weights": "default"}, OptionError, "embedding 'direct' has none"),
        ({"embedding": "neural", "device": "tpu"}, OptionError, "expected one of cpu, cuda"),
        ({"embedding": "hybrid", "metric": "uniform"}, OptionError, "and no other"),
        ({"embedding": "filtered", "metric": "uniform"}, OptionError, "and no other"),
        ({"embedding": "filtered", "weights": "default"}, OptionError, "has none"),
    ):
        with pytest.raises(kind, match=message):
            anisomesh.remesh(egg, n_vertices=100, **words)


def test_a_gpu_that_is_not_there_is_refused(egg):
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("there is one")
    with pytest.raises(OptionError, match="'cuda' cannot be used here"):
        anisomesh.remesh(egg, n_vertices=100, embedding="neural", device="cuda")


@pytest.mark.slow
def test_the_command_takes_the_pretrained_network(egg, tmp_path, run_cli):
    anisomesh.save(egg, tmp_path / "in.ply")
    done = run_cli("remesh", tmp_path / "in.ply", "-o", tmp_path / "out.ply", "-n", 200, "--embedding", "hybrid")
    assert done.returncode == 0, done.stderr
    assert anisomesh.load(tmp_path / "out.ply").n_points == 200

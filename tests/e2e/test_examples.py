"""The examples run and show what their text says."""

import importlib.util
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import anisomesh
from anisomesh.shapes import analytic

FOLDER = Path(__file__).parents[2] / "examples"
COARSE = {
    "sphere": partial(analytic.sphere, 3),
    "knot": partial(analytic.trefoil_knot, n_along=150, n_around=12),
    "torus": partial(analytic.torus, n_major=48, n_minor=16),
    "ring": partial(analytic.twisted_ring, n_major=110),
}


@pytest.fixture(autouse=True)
def coarse_samples(monkeypatch):
    """Give the examples samples of fewer points, to which the time of a remesh is proportional."""
    for name, make in COARSE.items():
        monkeypatch.setitem(analytic.SAMPLES, name, make)


def example(name):
    """Return an example as a module, whose pictures have a quarter of the pixels."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for names in annotations
    spec.loader.exec_module(module)
    if hasattr(module, "PictureOptions"):
        options = module.PictureOptions
        module.PictureOptions = lambda **given: options(**given | {"scale": 1})
    return module


@pytest.fixture(scope="module")
def stretch_along_z():
    """The result of the example with a metric of one's own."""
    module = example("own_metric")
    module.cylinder = partial(module.cylinder, around=48, along=30)
    return module.main(n_vertices=200)


def test_every_example_is_tested():
    tested = {
        "remesh_a_surface",
        "own_metric",
        "gallery",
        "noisy_scan",
        "carry_data",
        "adapt_to_a_solution",
        "levels_of_detail",
        "large_input",
    }
    tutorials = {"own_metric_source", "own_energy", "own_embedder", "stages", "learn_a_metric"}
    assert {path.stem for path in FOLDER.glob("*.py")} == tested | tutorials


def test_compiled_functions_of_examples_are_not_cached():
    """Machine code cached under one module name cannot be loaded under another, as a script or in the documentation."""
    assert example("own_energy").height_spread.stats.cache_path is None


@pytest.mark.slow
def test_remesh_a_surface(tmp_path, capsys, torus_obj):
    result = example("remesh_a_surface").main(torus_obj, tmp_path, n_vertices=100)
    assert {path.name for path in tmp_path.iterdir()} == {"remeshed.ply", "remeshed.png"}
    assert f"1,152 -> {result.surface.n_points:,} vertices" in capsys.readouterr().out


@pytest.mark.slow
def test_own_metric_stretches_the_triangles_along_z(stretch_along_z):
    edges = stretch_along_z.surface.points[stretch_along_z.surface.edges]
    size = np.abs(edges[:, 1] - edges[:, 0])
    assert size[:, 2].mean() > 1.8 * np.hypot(size[:, 0], size[:, 1]).mean()


@pytest.mark.slow
def test_own_metric_keeps_the_open_cylinder(stretch_along_z):
    validity = stretch_along_z.report()["validity"]
    assert (validity["boundary_loops"], validity["components"], validity["euler"]) == (2, 1, 0)


@pytest.mark.slow
def test_gallery_draws_the_results(tmp_path, capsys):
    from PIL import Image

    module = example("gallery")
    module.trefoil_knot = lambda **sizes: analytic.trefoil_knot(**sizes | {"n_along": 120, "n_around": 12})
    module.main(str(tmp_path / "three.png"), n_vertices=150)
    with Image.open(tmp_path / "three.png") as image:
        assert image.width == 3 * 480
    assert "three.png" in capsys.readouterr().out


@pytest.mark.slow
def test_noisy_scan_is_better_with_the_network(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("anisomesh.remesh", partial(anisomesh.remesh, max_iterations=15))
    example("noisy_scan").main(str(tmp_path / "noisy.png"), n_vertices=400)
    assert (tmp_path / "noisy.png").stat().st_size > 10_000
    direct, hybrid = (
        [float(word) for word in line.replace("e-4", "").replace(",", "").split() if word.replace(".", "").isdigit()]
        for line in capsys.readouterr().out.splitlines()[:2]
    )
    assert hybrid[0] >= direct[0]  # G, to two digits: the fit makes good triangles of noise too
    assert hybrid[1] < 0.6 * direct[1]  # RMS


@pytest.mark.slow
def test_a_large_input_is_reduced_without_a_larger_error(capsys):
    reduced, whole = example("large_input").main(n_along=600, n_around=52, n_vertices=300)
    assert reduced.working.n_points < 0.8 * whole.working.n_points
    errors = [float(line.split()[-1].removesuffix("e-4")) for line in capsys.readouterr().out.splitlines()]
    assert errors[0] < 1.1 * errors[1]


@pytest.mark.slow
def test_own_metric_source_stretches_triangles_around_the_axis(tmp_path):
    plain, around, curvature = example("own_metric_source").main(str(tmp_path / "source.png"), n_vertices=200)
    assert plain.embedding.stretch.achieved_mean == pytest.approx(1.0, abs=1e-6)
    assert around.embedding.stretch.achieved_mean > 3.0
    assert curvature.embedding_name == "direct"
    middle = around.surface.points[around.surface.edges].mean(axis=1)
    edge = np.diff(around.surface.points[around.surface.edges], axis=1)[:, 0]
    along = np.abs(edge[:, 1] * middle[:, 0] - edge[:, 0] * middle[:, 1]) / np.hypot(middle[:, 0], middle[:, 1])
    assert along.mean() > 1.5 * np.sqrt((edge**2).sum(axis=1) - along**2).mean()
    assert (tmp_path / "source.png").stat().st_size > 10_000


@pytest.mark.slow
def test_own_energy_makes_flat_triangles(tmp_path):
    plain, layered = example("own_energy").main(str(tmp_path / "energy.png"), n_vertices=100)
    heights = [np.abs(np.diff(r.surface.points[r.surface.edges], axis=1)[:, 0, 2]).mean() for r in (plain, layered)]
    assert heights[1] < 0.8 * heights[0]
    assert plain.validity.closed
    assert layered.validity.closed
    assert not layered.warnings


@pytest.mark.slow
def test_own_embedder_is_worse_in_the_metric_than_the_direct_one(tmp_path, capsys):
    results = example("own_embedder").main(str(tmp_path / "embedder.png"), n_vertices=150)
    assert [result.embedding.points.shape[1] for result in results] == [6, 6, 8]
    quality = [float(line.split("G ")[1].split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert quality[2] == max(quality)


@pytest.mark.slow
def test_stages_make_a_valid_mesh_step_by_step(tmp_path, capsys):
    result = example("stages").main(str(tmp_path / "stages.png"), n_vertices=150)
    assert result.n_points == 150
    words = [line.split(":")[0] for line in capsys.readouterr().out.splitlines()]
    assert words == ["prepared", "metric", "embedding", "features", "sites", "dual", "fitted"]
    assert (tmp_path / "stages.png").stat().st_size > 10_000


@pytest.mark.slow
def test_learn_a_metric_finds_the_stretch_of_the_given_mesh(tmp_path, capsys):
    pytest.importorskip("torch")
    losses = example("learn_a_metric").main(str(tmp_path / "learned.png"), n_given=200, n_vertices=200, steps=40)
    assert losses[-1] < 1.1 < 1.25 < losses[0]
    lines = capsys.readouterr().out.splitlines()
    before, after = (float(line.split()[0]) for line in lines[1].split("factor of ")[1].split("before,"))
    assert before > 1.5 > 1.2 > after
    given, remeshed = (float(line.split("mean stretch ")[1]) for line in lines[2:4])
    assert remeshed == pytest.approx(given, rel=0.15)
    assert (tmp_path / "learned.png").stat().st_size > 10_000


@pytest.mark.slow
def test_carry_data_loses_nothing(capsys):
    result = example("carry_data").main(n_vertices=150)
    load = result.mesh.regions["group"].labels == 6
    assert abs(result.surface.face_areas[load].sum() - 1.0) < 1e-9
    assert "area 1.000000 (1 before)" in capsys.readouterr().out


@pytest.mark.slow
def test_adapting_to_a_solution_lowers_its_error_at_the_same_number_of_vertices(tmp_path, capsys):
    even, *adapted = example("adapt_to_a_solution").main(str(tmp_path / "adapted.png"), n_vertices=250)
    assert adapted[0] < even / 2.5
    assert adapted[1] < even / 4
    assert capsys.readouterr().out.count("250 vertices") == 3
    assert (tmp_path / "adapted.png").stat().st_size > 10_000


@pytest.mark.slow
def test_levels_of_detail_are_in_one_file(tmp_path, capsys):
    levels = example("levels_of_detail").main(tmp_path / "knot.glb", ratios=(0.1, 0.05))
    assert [level.surface.n_points for level in levels] == [320, 160]
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["knot.glb"]

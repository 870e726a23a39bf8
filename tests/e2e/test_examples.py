"""The examples run and show what their text says."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[2] / "examples"


def example(name):
    spec = importlib.util.spec_from_file_location(name, FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def stretch_along_z():
    """The result of the example with a metric of one's own."""
    return example("own_metric").main(n_vertices=300)


def test_every_example_is_tested():
    assert {path.stem for path in FOLDER.glob("*.py")} == {"remesh_a_surface", "own_metric", "gallery", "noisy_scan"}


def test_remesh_a_surface(tmp_path, capsys, torus_obj):
    result = example("remesh_a_surface").main(torus_obj, tmp_path, n_vertices=200)
    assert {path.name for path in tmp_path.iterdir()} == {"remeshed.ply", "remeshed.png"}
    assert f"1,152 -> {result.surface.n_points:,} vertices" in capsys.readouterr().out


def test_own_metric_stretches_the_triangles_along_z(stretch_along_z):
    edges = stretch_along_z.surface.points[stretch_along_z.surface.edges]
    size = np.abs(edges[:, 1] - edges[:, 0])
    assert size[:, 2].mean() > 1.8 * np.hypot(size[:, 0], size[:, 1]).mean()


def test_own_metric_keeps_the_open_cylinder(stretch_along_z):
    validity = stretch_along_z.report()["validity"]
    assert (validity["boundary_loops"], validity["components"], validity["euler"]) == (2, 1, 0)


@pytest.mark.slow
def test_gallery_draws_the_results(tmp_path, capsys):
    from PIL import Image

    example("gallery").main(str(tmp_path / "three.png"))
    with Image.open(tmp_path / "three.png") as image:
        assert image.width == 2 * 3 * 480
    assert "three.png" in capsys.readouterr().out


@pytest.mark.slow
def test_noisy_scan_is_better_with_the_network(tmp_path, capsys):
    pytest.importorskip("torch")
    example("noisy_scan").main(str(tmp_path / "noisy.png"))
    assert (tmp_path / "noisy.png").stat().st_size > 10_000
    direct, hybrid = (
        [float(word) for word in line.replace("e-4", "").replace(",", "").split() if word.replace(".", "").isdigit()]
        for line in capsys.readouterr().out.splitlines()[:2]
    )
    assert hybrid[0] > direct[0] + 0.05  # G
    assert hybrid[1] < 0.8 * direct[1]  # RMS

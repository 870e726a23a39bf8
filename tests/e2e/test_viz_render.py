"""Pictures as files: size, content, the same camera for both panels, errors that say what to do."""

import importlib.util

import numpy as np
import pytest
from PIL import Image

from anisomesh import AnisomeshError, OptionError, Surface
from anisomesh.viz import CellPolygons, renderer, require_renderer, side_by_side
from conftest import torus_arrays

TITLES = ("same", "same", "cells")


@pytest.fixture(scope="module")
def torus():
    return Surface(*torus_arrays(40, 20))


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def coloured(image):
    """Return the share of pixels that are far from grey."""
    return float((np.ptp(image, axis=2) > 60).mean())


def draw(path, *arguments, **options):
    side_by_side(*arguments, path, **options)
    return pixels(path)


@pytest.mark.slow
def test_both_panels_have_the_same_camera(torus, tmp_path):
    image = draw(tmp_path / "a.png", torus, torus, titles=TITLES)
    assert image.shape == (1150, 1600, 3)
    left, right = image[:, :800], image[:, 800:]
    assert (np.abs(left - right).max(axis=2) > 8).mean() < 1e-3
    assert 0.2 < (image.min(axis=2) < 245).mean() < 0.95


@pytest.mark.slow
def test_the_right_panel_shows_the_result(torus, tmp_path):
    coarse = Surface(*torus_arrays(12, 6))
    image = draw(tmp_path / "a.png", torus, coarse, titles=TITLES)
    assert (np.abs(image[:, :800] - image[:, 800:]).max(axis=2) > 30).mean() > 0.02


@pytest.mark.slow
def test_position_and_size_of_the_model_do_not_matter(torus, tmp_path):
    moved = torus.with_points(1e3 * torus.points + [5e3, -2e4, 1e3])
    first = draw(tmp_path / "a.png", torus, torus)
    second = draw(tmp_path / "b.png", moved, moved)
    assert (np.abs(first - second).max(axis=2) > 40).mean() < 0.01


@pytest.mark.slow
def test_values_colour_the_result_only(torus, tmp_path):
    plain = draw(tmp_path / "a.png", torus, torus)
    image = draw(tmp_path / "b.png", torus, torus, values=torus.face_stretch)
    assert coloured(plain) < 0.01
    assert coloured(image[:, :800]) < 0.01
    assert coloured(image[:, 800:]) > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("values", [1.0, 0.0, np.inf], ids=str)
def test_values_without_a_range_are_drawn(torus, tmp_path, values):
    image = draw(tmp_path / "a.png", torus, torus, values=np.full(torus.n_faces, values))
    assert coloured(image[:, :800]) < 0.01
    assert (image[:, 800:].min(axis=2) < 245).mean() > 0.2


@pytest.mark.slow
def test_cells_get_a_third_panel_of_many_colours(torus, tmp_path):
    cells = CellPolygons(
        points=torus.points,
        offsets=3 * np.arange(torus.n_faces + 1),
        corners=torus.faces.ravel(),
        labels=np.arange(torus.n_faces) // 8,
    )
    image = draw(tmp_path / "a.png", torus, torus, cells=cells)
    assert image.shape == (1150, 2400, 3)
    third = image[100:600, 1700:2300].reshape(-1, 3)
    assert len(np.unique(third // 32, axis=0)) > 10


def test_values_of_the_wrong_length_are_refused_without_a_file(torus, tmp_path):
    with pytest.raises(OptionError, match=r"expected \(1600,\), one per face"):
        side_by_side(torus, torus, tmp_path / "a.png", values=np.ones(3))
    assert list(tmp_path.iterdir()) == []


def test_without_pyvista_the_error_names_the_extra(monkeypatch, torus, tmp_path):
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pyvista" else find_spec(name))
    with pytest.raises(AnisomeshError, match=r'pip install "anisomesh\[picture\]"'):
        side_by_side(torus, torus, tmp_path / "a.png")


def test_without_opengl_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(renderer, "_PROBE", "import os; os.abort()")
    renderer._can_render.cache_clear()
    try:
        with pytest.raises(AnisomeshError, match="libegl1"):
            require_renderer()
    finally:
        renderer._can_render.cache_clear()

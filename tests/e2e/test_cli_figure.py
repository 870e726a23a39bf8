"""``anisomesh figure``: results, galleries and strips as PNG and PDF, and its errors."""

import importlib.util
import re
from functools import cache

import numpy as np
import pytest
from PIL import Image

from anisomesh import AnisomeshError
from anisomesh.viz import require_renderer
from conftest import torus_arrays, write_obj


@pytest.fixture(scope="module")
def drawing():
    """Skip where nothing can be drawn."""
    try:
        require_renderer()
    except AnisomeshError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """A fine, a coarse and a lengthy torus as files."""
    folder = tmp_path_factory.mktemp("meshes")
    fine, coarse = torus_arrays(24, 12), torus_arrays(12, 6)
    write_obj(folder / "fine.obj", *fine)
    write_obj(folder / "coarse.obj", *coarse)
    write_obj(folder / "long.obj", coarse[0] * [5.0, 1.0, 1.0], coarse[1])
    return folder


@pytest.fixture(scope="module")
def figure(drawing, meshes, run_cli, tmp_path_factory):
    """Run ``anisomesh figure`` quietly in the folder of the meshes, once per figure; return the path of the file."""

    @cache
    def run(*words, name="out.png", scale=1):
        out = tmp_path_factory.mktemp("figure") / name
        done = run_cli("figure", *words, "-o", out, "-q", "--scale", scale, cwd=meshes)
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
        assert list(out.parent.iterdir()) == [out]
        return out

    return run


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def coloured(image):
    """Return the share of pixels that are far from grey."""
    return float((np.ptp(image, axis=2) > 40).mean())


def different(first, second):
    return float((np.abs(first - second).max(axis=2) > 30).mean())


@pytest.mark.slow
def test_a_result_is_drawn_beside_its_input_with_the_same_camera(figure):
    image = pixels(figure("result", "fine.obj", "fine.obj"))
    assert image.shape[1] == 1600
    upper = image[60:700]
    assert different(upper[:, :800], upper[:, 800:]) < 1e-3
    assert (upper.min(axis=2) < 245).mean() > 0.2
    other = pixels(figure("result", "fine.obj", "coarse.obj"))
    assert different(other[60:700, :800], other[60:700, 800:]) > 0.02


@pytest.mark.slow
@pytest.mark.parametrize("colour", ["stretch", "quality", "distance"])
def test_colour_is_on_the_result_and_its_bar_below_it(figure, colour):
    plain = pixels(figure("result", "fine.obj", "coarse.obj"))
    image = pixels(figure("result", "fine.obj", "coarse.obj", "--colour", colour))
    height = len(plain)
    assert len(image) > height
    assert different(image[:height, :800], plain[:, :800]) < 1e-3
    assert coloured(image[60:700, 800:]) > coloured(plain[60:700, 800:]) + 0.1
    bar = image[height:]
    assert coloured(bar[:, 800:]) > 0.03
    assert coloured(bar[:, :800]) == 0.0


@pytest.mark.slow
def test_remeshing_on_the_fly_can_show_the_cells(figure):
    image = pixels(figure("result", "fine.obj", "-n", 80, "--cells", "--colour", "distance", "--threads", 1))
    assert image.shape[1] == 2400
    assert len(np.unique(image[60:600, 1700:2300].reshape(-1, 3) // 32, axis=0)) > 10


@pytest.mark.slow
def test_the_summary_names_sizes_colour_and_file(drawing, meshes, tmp_path, run_cli):
    out = tmp_path / "out.png"
    words = ["figure", "result", meshes / "fine.obj", meshes / "coarse.obj", "--color", "stretch", "-o", out]
    done = run_cli(*words, "--scale", 1)
    assert done.returncode == 0, done.stderr
    assert all(part in done.stdout for part in ("288 vertices", "72 vertices", "stretch", str(out)))


@pytest.mark.slow
def test_a_pdf_is_one_page_with_text_and_the_same_each_time(figure):
    data = figure("result", "fine.obj", "coarse.obj", "--colour", "stretch", name="out.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert data.rstrip().endswith(b"%%EOF")
    assert len(re.findall(rb"/Type /Page\b", data)) == 1
    assert b"/Type /Font" in data
    assert data == figure("result", "fine.obj", "coarse.obj", "--colour", "stretch", name="again.pdf").read_bytes()


@pytest.mark.slow
def test_scale_gives_more_pixels_of_the_same_picture(figure):
    small = Image.open(figure("gallery", "coarse.obj"))
    large = Image.open(figure("gallery", "coarse.obj", scale=2))
    assert large.size == (2 * small.width, 2 * small.height)
    shrunk = np.asarray(large.convert("RGB").resize(small.size, Image.Resampling.BOX)).astype(int)
    assert np.abs(shrunk - np.asarray(small.convert("RGB")).astype(int)).mean() < 6.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "words", "grid"), [(1, [], (1, 1)), (5, [], (3, 2)), (5, ["--columns", 2], (2, 3)), (3, [], (3, 1))]
)
def test_a_gallery_is_a_grid_with_a_caption_under_each_mesh(figure, count, words, grid):
    image = pixels(figure("gallery", *["fine.obj"] * count, *words))
    columns, rows = grid
    assert image.shape[1] == 480 * columns
    height = len(image) / rows
    assert height == int(height)
    tiles = [
        image[
            int(height) * (k // columns) : int(height) * (k // columns + 1),
            480 * (k % columns) : 480 * (k % columns + 1),
        ]
        for k in range(columns * rows)
    ]
    for number, tile in enumerate(tiles):
        assert ((tile.min(axis=2) < 245).mean() > 0.2) == (number < count)
        assert (tile[-50:].min(axis=2) < 150).any() == (number < count)
        assert number >= count or different(tile, tiles[0]) < 1e-3


@pytest.mark.slow
def test_meshes_fill_their_panels_unless_the_camera_is_the_same(figure):
    own = pixels(figure("gallery", "fine.obj", "long.obj"))
    same = pixels(figure("gallery", "fine.obj", "long.obj", "--same-view"))

    def breadth(image):
        columns = np.flatnonzero((image[:-72].min(axis=2) < 245).any(axis=0))
        return columns.max() - columns.min()

    assert breadth(own[:, :480]) > 0.7 * 480
    assert breadth(same[:, :480]) < 0.5 * breadth(same[:, 480:])


@pytest.mark.slow
def test_a_strip_shows_fewer_and_fewer_triangles_from_the_same_side(figure):
    image = pixels(figure("strip", "fine.obj", "--ratios", 1, 0.5, 0.15, "--threads", 1))
    assert image.shape[1] == 3 * 480
    first, second, last = (image[:-72, 480 * k : 480 * (k + 1)].min(axis=2) < 245 for k in range(3))
    assert (first != second).mean() < 0.05
    assert 0.0 < (first != last).mean() < 0.1


@pytest.mark.slow
def test_ratios_may_be_one_word_and_stand_before_the_mesh(figure):
    first = figure("strip", "--ratios", "0.9,0.7", "coarse.obj", "--threads", 1, name="a.png")
    second = figure("strip", "--ratios", 0.9, 0.7, "coarse.obj", "--threads", 1, name="b.png")
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.slow
def test_from_and_up_turn_the_camera(figure):
    front = pixels(figure("gallery", "long.obj", "--from", 0, -1, 0, "--up", "z"))
    side = pixels(figure("gallery", "long.obj", "--from", 0, -1, 0, "--up", "x"))
    assert len(side) > 1.5 * len(front)


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        (["result", "fine.obj"], 2, "RESULT"),
        (["result", "fine.obj", "-n", "90", "--ratio", "0.5"], 2, "only one"),
        (["result", "fine.obj", "coarse.obj", "--ratio", "0.5"], 2, "RESULT is given"),
        (["result", "fine.obj", "coarse.obj", "--cells"], 2, "--cells"),
        (["result", "fine.obj", "coarse.obj", "--colour", "pink"], 2, "--colour"),
        (["result", "fine.obj", "coarse.obj", "-o", "out.jpg"], 2, ".png or .pdf"),
        (["result", "fine.obj", "coarse.obj", "-o", "missing/out.png"], 2, "the folder missing does not exist"),
        (["result", "fine.obj", "coarse.obj", "--from", "0", "0", "0"], 2, "--from"),
        (["result", "missing.obj", "coarse.obj"], 1, "missing.obj"),
        (["result", "fine.obj", "missing.obj"], 1, "missing.obj"),
        (["gallery"], 2, "MESH"),
        (["gallery", "fine.obj", "missing.obj"], 1, "missing.obj"),
        (["gallery", "fine.obj", "-o", "out"], 2, ".png or .pdf"),
        (["strip", "fine.obj", "--ratios", "0.5", "0"], 2, "0 is not a positive"),
        (["strip", "fine.obj", "--ratios", "1,half"], 2, "'half' is not a share"),
        (["strip", "missing.obj"], 1, "missing.obj"),
        (["heap", "fine.obj"], 2, "heap"),
    ],
)
def test_an_error_is_one_line_and_leaves_no_file(drawing, meshes, run_cli, tmp_path, words, code, expected):
    for name in ("fine.obj", "coarse.obj"):
        (tmp_path / name).write_bytes((meshes / name).read_bytes())
    words = words if "-o" in words or words[0] == "heap" else [*words, "-o", "out.png"]
    done = run_cli("figure", *words, *(["-q"] if words[0] != "heap" else []), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, "")
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("anisomesh: error: ")
    assert expected in done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"fine.obj", "coarse.obj"}


def test_a_figure_without_a_kind_shows_the_kinds(run_cli):
    done = run_cli("figure")
    assert done.returncode == 2
    assert all(kind in done.stdout for kind in ("result", "gallery", "strip"))


@pytest.mark.slow
def test_the_picture_of_a_remesh_may_be_a_pdf(drawing, meshes, run_cli, tmp_path):
    words = ["remesh", meshes / "coarse.obj", "-o", tmp_path / "out.ply", "-n", 60, "--picture", tmp_path / "both.pdf"]
    assert run_cli(*words, "-q").returncode == 0
    assert (tmp_path / "both.pdf").read_bytes().startswith(b"%PDF-")


@pytest.mark.parametrize("missing", ["pyvista", "matplotlib"])
def test_without_a_library_the_error_names_it_and_the_extra(missing, meshes, monkeypatch, tmp_path, run_cli):
    find_spec = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == missing else find_spec(name))
    done = run_cli("figure", "gallery", meshes / "fine.obj", "-o", tmp_path / "out.png", "-q")
    assert done.returncode == 1
    assert f"need {missing}" in done.stderr
    assert "anisomesh[picture]" in done.stderr
    assert list(tmp_path.iterdir()) == []

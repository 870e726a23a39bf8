"""``anisomesh remesh --adapt-to``: meshes that follow a field of a file."""

import json

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import open_patch

SHEET = open_patch(lambda x, y: 0.0 * x, n=24)
LAYER = np.tanh(8.0 * SHEET.points[:, 0])
DATA = {"u": LAYER, "v": np.stack([LAYER, LAYER], axis=1)}


@pytest.fixture
def folder(tmp_path):
    save(Mesh(surface=SHEET, point_data=DATA), tmp_path / "solved.vtu")
    save(Mesh(surface=SHEET), tmp_path / "plain.stl")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(("source", "field"), [("solved.vtu", "u"), ("plain.stl", "solved.vtu:u")])
def test_triangles_are_narrow_in_the_layer(run_cli, folder, source, field):
    process = run_cli(
        "remesh", source, "-n", 200, "--adapt-to", field, "--norm", "2", "-o", "a.vtu", "--report", "a.json", cwd=folder
    )
    assert process.returncode == 0, process.stderr
    assert f"metric of the field {field}" in process.stdout
    options = json.loads((folder / "a.json").read_text(encoding="utf-8"))["options"]
    assert (options["adapt_to"], options["norm"]) == (field, "2")
    mesh = load_mesh(folder / "a.vtu").surface
    assert mesh.n_points == 200
    ends = mesh.points[mesh.edges]
    inside = np.abs(ends.mean(axis=1)[:, 0]) < 0.2
    across, along = np.abs(ends[:, 1] - ends[:, 0])[:, :2].T
    assert inside.mean() > 0.33  # of the edges, in a fifth of the area
    assert along[inside].mean() > 2.0 * across[inside].mean()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-n", 99, "--adapt-to", "w"), "no field 'w' at its points; it has u, v"),
        (("-n", 99, "--adapt-to", "v"), "2 numbers at each point"),
        (("-n", 99, "--adapt-to", "plain.stl:u"), "it has none"),
        (("-n", 99, "--adapt-to", "missing.vtu:u"), "no such file"),
        (("-n", 99, "--adapt-to", "solved.vtu"), "FILE:FIELD"),
        (("-n", 99, "--adapt-to", "u", "--norm", "0.5"), "at least 1"),
        (("-n", 99, "--adapt-to", "u", "--norm", "max"), "at least 1"),
        (("-n", 99, "--adapt-to", "u", "--metric", "uniform"), "--metric and --adapt-to say what the metric is"),
        (("-n", 99, "--norm", "inf"), "--adapt-to"),
        (("--max-error", "1%", "--adapt-to", "u"), "give -n, --ratio or --ratios"),
        (("--edge-length", "1", "--adapt-to", "u"), "give -n, --ratio or --ratios"),
    ],
)
def test_wrong_requests_are_explained(run_cli, folder, arguments, message):
    process = run_cli("remesh", "solved.vtu", "-o", "a.vtu", *arguments, cwd=folder)
    assert process.returncode != 0
    assert message in " ".join(process.stderr.replace("│", " ").split())

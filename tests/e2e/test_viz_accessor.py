"""``mesh.anisomesh`` on meshes of PyVista."""

import importlib
import tomllib
from pathlib import Path

import numpy as np
import pytest

import anisomesh

pyvista = pytest.importorskip("pyvista")
if not hasattr(pyvista, "register_dataset_accessor"):
    pytest.skip("needs PyVista 0.48", allow_module_level=True)

FEW = {"metric": "uniform", "max_iterations": 3}


@pytest.fixture(scope="module")
def ball():
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    importlib.import_module(project["entry-points"]["pyvista.accessors"]["anisomesh"])
    return pyvista.Sphere(theta_resolution=16, phi_resolution=16)


def test_a_mesh_has_the_methods_and_is_not_changed(ball):
    before = ball.copy()
    remeshed = ball.anisomesh.remesh(60, **FEW)
    expected = anisomesh.remesh(ball, n_vertices=60, **FEW).surface
    assert isinstance(remeshed, pyvista.PolyData)
    np.testing.assert_array_equal(remeshed.points, expected.points)
    np.testing.assert_array_equal(remeshed.regular_faces, expected.faces)
    assert ball == before
    evaluation = ball.anisomesh.evaluate(remeshed, samples=500, seed=1)
    assert evaluation.as_dict() == anisomesh.evaluate(ball, expected, samples=500, seed=1).as_dict()


def test_the_result_has_the_data_of_the_mesh(ball):
    given = ball.copy()
    given.point_data["height"] = given.points[:, 2]
    given.cell_data["side"] = (given.cell_centers().points[:, 2] > 0).astype(int)
    given.field_data["title"] = ["a ball"]
    remeshed = given.anisomesh.remesh(60, **FEW)
    np.testing.assert_allclose(remeshed.point_data["height"], remeshed.points[:, 2], atol=0.05)
    assert set(np.unique(remeshed.cell_data["side"])) == {0, 1}
    assert remeshed.field_data["title"].tolist() == ["a ball"]
    assert remeshed.active_normals is not None


def test_other_targets_and_grids(ball):
    assert ball.anisomesh.remesh(ratio=0.2, **FEW).n_points == round(0.2 * ball.n_points)
    assert ball.cast_to_unstructured_grid().anisomesh.remesh(50, **FEW).n_points == 50
    image = pyvista.ImageData(dimensions=(5, 5, 1))
    assert image.anisomesh.remesh(20, **FEW).n_points == 20
    blocks = pyvista.MultiBlock({"image": image, "ball": ball})
    assert set(blocks.anisomesh.remesh(70, **FEW).cell_data["block"]) == {0, 1}
    assert repr(image.anisomesh) == "ImageData.anisomesh: remesh(n_vertices, ...), evaluate(result, ...)"


@pytest.mark.slow
def test_errors_and_warnings_are_those_of_a_remesh(ball, caplog):
    with pytest.raises(anisomesh.OptionError, match="give one of n_vertices, ratio, max_error and edge_length"):
        ball.anisomesh.remesh()
    tube = pyvista.ParametricTorus(u_res=24, v_res=12, w_res=12).triangulate()
    expected = anisomesh.remesh(tube, n_vertices=4, **FEW).warnings
    caplog.clear()
    tube.anisomesh.remesh(4, **FEW)
    assert expected
    assert [record.message for record in caplog.records if record.name.endswith("accessor")] == list(expected)

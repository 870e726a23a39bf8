"""Units of length: 3MF files say them, GLB means metres, and coordinates stay as they are."""

import io
import logging
import zipfile

import numpy as np
import pytest
import trimesh

import anisomesh
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.convert import from_object
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.io.objects.write import to_pyvista
from anisomesh.levels.files import save_meshes
from anisomesh.shapes.analytic import box

BOX = box(n=1)


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING)
    return caplog


def model(path):
    with zipfile.ZipFile(path) as archive:
        return archive.read("3D/3dmodel.model").decode()


def test_3mf_of_a_glb_mesh_is_in_metres(tmp_path, log):
    """Regression: it said millimetres, a thousandth of the size."""
    save(Mesh(surface=BOX), tmp_path / "a.glb")
    save(load_mesh(tmp_path / "a.glb"), tmp_path / "b.3mf")
    assert '<model unit="meter"' in model(tmp_path / "b.3mf")
    read = load_mesh(tmp_path / "b.3mf")
    assert read.materials["unit"] == "meter"
    np.testing.assert_array_equal(read.surface.points, BOX.points)
    save(read, tmp_path / "c.glb")
    assert log.text == ""


@pytest.mark.parametrize("write", [save, lambda mesh, path: save_meshes([mesh, mesh], path)])
@pytest.mark.parametrize("unit", ["millimeter", "inch"])
def test_glb_of_a_mesh_in_another_unit_says_that_glb_means_metres(tmp_path, log, unit, write):
    """Regression: nothing was said of millimetres, and of others only that the unit was left out."""
    save(Mesh(surface=BOX, materials={"unit": unit}), tmp_path / "a.3mf")
    write(load_mesh(tmp_path / "a.3mf"), tmp_path / "b.glb")
    assert log.text.count(f"the unit {unit}: coordinates stay as they are, and GLB means metre") == 1
    assert len(log.records) == 1
    np.testing.assert_array_equal(load_mesh(tmp_path / "b.glb").surface.points, BOX.points)


@pytest.mark.parametrize("source", [".glb", ".3mf"])
def test_other_formats_say_nothing_of_a_unit_that_a_format_means(tmp_path, log, source):
    save(Mesh(surface=BOX), tmp_path / f"a{source}")
    mesh = load_mesh(tmp_path / f"a{source}")
    for suffix in MESH_FORMATS:
        if suffix not in (".glb", ".3mf"):
            save(mesh, tmp_path / f"b{suffix}")
    to_pyvista(mesh)
    assert log.text == ""
    save(Mesh(surface=BOX, materials={"unit": "inch"}), tmp_path / "b.ply")
    assert "materials 'unit'" in log.text


@pytest.mark.parametrize(("units", "unit"), [("meters", "meter"), ("m", "meter"), ("mm", "millimeter"), (None, None)])
def test_units_of_trimesh(log, units, unit):
    given = trimesh.Trimesh(BOX.points, BOX.faces, process=False)
    if units:
        given.units = units
    mesh = from_object(given)
    assert mesh.materials.get("unit") == unit
    save(mesh, io.BytesIO(), file_format="glb")
    assert ("GLB means metre" in log.text) == (unit == "millimeter")


@pytest.mark.parametrize("attributes", [True, False])
def test_a_remesh_keeps_the_unit(tmp_path, attributes):
    """Also where nothing else is carried: a result in other numbers would have another size."""
    regions = {"node": Regions(np.arange(BOX.n_faces) % 2)}
    save(Mesh(surface=BOX, regions=regions if not attributes else {}), tmp_path / "a.glb")
    options = {"n_vertices": 8, "max_iterations": 1, "fit": False, "attributes": attributes}
    result = anisomesh.remesh(tmp_path / "a.glb", **options)
    assert result.mesh.is_bare
    assert result.mesh.materials == {"unit": "meter"}
    save(result.mesh, tmp_path / "b.3mf")
    assert '<model unit="meter"' in model(tmp_path / "b.3mf")

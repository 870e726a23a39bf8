"""Values that some points or corners lack: no file says that they are zero, and a warning says why data are lost."""

import logging

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (2, 2, 2)])
SURFACE = Surface(POINTS, [[0, 1, 2], [1, 3, 2]])  # no face uses the last point
UP = np.array([0.0, 0.0, 1.0])
SOME = np.array([UP, UP, UP, [np.nan] * 3, [np.nan] * 3])
MEDIT = (
    "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n"
    + "".join("{} {} {} 0\n".format(*row) for row in POINTS.tolist())
    + "Triangles\n2\n1 2 3 0\n2 4 3 0\nNormals\n2\n0 0 1\n0 0 2\nNormalAtVertices\n3\n1 1\n3 1\n2 2\nEnd\n"
)
HOLDS_NAN = (".ply", ".vtu", ".vtp", ".msh", ".mesh", ".meshb")


def by_place(mesh):
    """Return the normals by the places of the corners of faces."""
    if "normal" in mesh.corner_data:
        normals = mesh.corner_data["normal"]
    else:
        normals = mesh.point_data["normal"][mesh.surface.faces]
    places = mesh.surface.points[mesh.surface.faces]
    return {(*places[f].mean(axis=0), *places[f, c]): normals[f, c] for f in range(len(places)) for c in range(3)}


def test_vertices_of_medit_without_a_normal_have_none(tmp_path, caplog):
    """Regression: their normals were zero, and so they were in files that were written."""
    (tmp_path / "a.mesh").write_text(MEDIT)
    mesh = load_mesh(tmp_path / "a.mesh")
    expected = SOME.copy()
    expected[1] = 2.0 * UP
    np.testing.assert_array_equal(mesh.point_data["normal"], expected)
    assert "2 of 5 vertices have no normal and get NaN" in caplog.text
    save(mesh, tmp_path / "b.mesh")
    assert "NormalAtVertices\n3\n1 1\n2 2\n3 3\n" in (tmp_path / "b.mesh").read_text()


@pytest.mark.parametrize("at", ["points", "corners"])
@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_no_file_has_normals_of_length_zero(tmp_path, caplog, suffix, at):
    """Regression: normals that were missing, or at points that no face uses, were written as zeros."""
    caplog.set_level(logging.WARNING)
    normals = SOME[SURFACE.faces] if at == "corners" else SOME
    given = Mesh(surface=SURFACE, **{f"{at[:-1]}_data": {"normal": normals}})
    save(given, tmp_path / f"a{suffix}")
    said = caplog.text
    read = load_mesh(tmp_path / f"a{suffix}")
    if "normal" not in read.point_data.keys() | read.corner_data.keys():
        assert "normal" in said
        assert suffix in (".stl", ".3mf")
        return
    stored = [data["normal"] for data in (read.point_data, read.corner_data) if "normal" in data]
    assert all((np.linalg.norm(rows, axis=-1) != 0.0).all() for rows in stored)
    before, after = by_place(given), by_place(read)
    kept = [key for key in before if np.array_equal(before[key], after[key], equal_nan=True)]
    if suffix in HOLDS_NAN:
        assert len(kept) == 6
    elif suffix in (".glb", ".off"):  # one normal for each point
        np.testing.assert_array_equal(list(after.values()), [UP] * 6)
        assert ("1 of 4 points" if at == "points" or suffix == ".off" else "1 of 6 corners") in said
        assert "missing normals at 1 of " in said
    else:
        assert suffix == ".obj"
        assert "vn 0" not in (tmp_path / "a.obj").read_text().replace("vn 0.0 0.0 1.0", "")
        assert sorted(before[key][2] for key in kept if np.isfinite(before[key]).all()) == [1.0] * 3
        assert "the normal at 1 face(s), some corners of which have none" in said


def test_faces_of_obj_with_texture_coordinates_and_normals_at_some_corners(tmp_path):
    rng = np.random.default_rng(0)
    surface = Surface(rng.normal(size=(30, 3)), rng.permuted(np.tile(np.arange(30), (40, 1)), axis=1)[:, :3])
    normals, uv = np.tile(UP, (40, 3, 1)), rng.random((40, 3, 2))
    normals[::3], uv[::4] = np.nan, np.nan
    save(Mesh(surface=surface, corner_data={"normal": normals, "uv": uv}), tmp_path / "a.obj")
    read = load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(read.surface.faces, surface.faces)
    np.testing.assert_array_equal(read.corner_data["normal"], normals)
    np.testing.assert_array_equal(read.corner_data["uv"], uv)


FIELDS = {
    "holes": (np.array([1.0, np.nan, 2.0, 3.0, np.nan]), "point data 'holes', which are NaN at 2 of 5 points"),
    "poles": (np.array([1.0, np.inf, 2.0, 3.0, 4.0]), "point data 'poles', which are infinite at 1 of 5 points"),
    "five": (np.zeros((5, 5)), "point data 'five', which have 5 components"),
    "large": (np.full(5, 2**40), "point data 'large', whose integers are too large for float32"),
    "huge": (np.full(5, 1e300), "point data 'huge', whose numbers are too large for float32"),
}


def test_glb_says_why_it_does_not_hold_data(tmp_path, caplog):
    """Regression: a field with NaN was named without the reason."""
    data = {name: values for name, (values, _) in FIELDS.items()}
    corners = np.ones((2, 3))
    corners[0, 1] = np.nan
    save(Mesh(surface=SURFACE, point_data=data, corner_data={"gap": corners}), tmp_path / "a.glb")
    for said in (*(said for _, said in FIELDS.values()), "corner data 'gap', which are NaN at 1 of 6 corners"):
        assert said in caplog.text


@pytest.mark.parametrize("suffix", [".ply", ".msh"])
def test_integers_that_float64_does_not_hold_are_named_with_the_reason(tmp_path, caplog, suffix):
    save(Mesh(surface=SURFACE, point_data={"id": np.full(5, 2**60 + 1)}), tmp_path / f"a{suffix}")
    assert "point data 'id', whose integers are too large for float64" in caplog.text


def test_colours_of_3mf_with_nan_are_named_with_the_reason(tmp_path, caplog):
    colours = np.ones((5, 3))
    colours[:2] = np.nan
    save(Mesh(surface=SURFACE, point_data={"uv": np.zeros((5, 2)), "color": colours}), tmp_path / "a.3mf")
    assert "point data 'uv'; point data 'color'" in caplog.text
    assert "point data 'color', which are NaN at 2 of 5 points" in caplog.text


TRIANGLES = box(n=1)
HAS_UV = np.arange(TRIANGLES.n_faces) < 5


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".vtp"])
def test_texture_coordinates_that_are_missing_stay_missing(tmp_path, suffix):
    """Regression: they were read as 0, and GLB left out all of them if some were NaN."""
    uv = np.random.default_rng(0).random((TRIANGLES.n_faces, 3, 2)).astype(np.float32).astype(np.float64)
    uv = np.where(HAS_UV[:, None, None], uv, np.nan)
    regions = {"material": Regions(HAS_UV.astype(int), {0: "plain", 1: "textured"})}
    save(Mesh(surface=TRIANGLES, corner_data={"uv": uv}, regions=regions), tmp_path / f"a{suffix}")
    read = load_mesh(tmp_path / f"a{suffix}")
    rows = read.corner_data["uv"] if "uv" in read.corner_data else read.point_data["uv"][read.surface.faces]
    middles = [surface.points[surface.faces].mean(axis=1).round(3) for surface in (read.surface, TRIANGLES)]
    order = [np.lexsort(rows.T) for rows in middles]
    found, given = rows[order[0]], uv[order[1]]
    np.testing.assert_allclose(np.sort(found, axis=1), np.sort(given, axis=1), atol=1e-6)


def test_glb_and_off_have_zero_where_some_texture_coordinates_are_missing(tmp_path, caplog):
    """In one primitive of GLB all vertices have them, and so they do in OFF."""
    uv = np.array([[0.25, 0.5], [0.5, 0.5], [np.nan, np.nan], [1.0, 1.0], [np.nan, np.nan]])
    for suffix, count in ((".glb", "2 vertices"), (".off", "2 points")):
        caplog.clear()
        save(Mesh(surface=SURFACE, point_data={"uv": uv}), tmp_path / f"a{suffix}")
        assert f"that {count} have no uv: they get 0" in caplog.text
        np.testing.assert_allclose(load_mesh(tmp_path / f"a{suffix}").point_data["uv"], np.nan_to_num(uv))

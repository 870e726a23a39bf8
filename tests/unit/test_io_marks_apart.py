"""Lines and vertices in pieces of their own are at the points of the surface with the same coordinates."""

import numpy as np
import pytest

from anisomesh.io.meshes import load_mesh, mesh_of
from anisomesh.shapes.analytic import box

SURFACE = box((1.0, 1.0, 1.0), n=2)
POINTS = SURFACE.points
LINE = SURFACE.edges[:2].astype(np.int64)
FIXED = np.array([3, 5])


def ends(mesh):
    """Return the coordinates of the ends of each feature."""
    return {frozenset(map(tuple, mesh.surface.points[edge].tolist())) for edge in mesh.features}


@pytest.fixture(scope="module")
def blocks():
    """Return a surface with data, lines, and vertices, as data sets of PyVista."""
    pyvista = pytest.importorskip("pyvista")
    faces = pyvista.PolyData.from_regular_faces(POINTS, SURFACE.faces)
    faces.point_data["height"] = POINTS[:, 2]
    faces.point_data["color"] = np.full((len(POINTS), 3), 7, dtype=np.uint8)
    faces.cell_data["weight"] = np.arange(SURFACE.n_faces)
    lines = pyvista.PolyData(POINTS[LINE.ravel()], lines=[2, 0, 1, 2, 2, 3])
    lines.cell_data["physical"] = [4, 9]
    return {"skin": faces, "rim": lines, "tips": pyvista.PolyData(POINTS[FIXED])}


@pytest.mark.parametrize("order", [("skin", "rim", "tips"), ("rim", "tips", "skin")])
def test_blocks_of_lines_and_vertices_are_features_and_fixed_points(blocks, caplog, order):
    """Regression: they were left out, and took the data of the surface with them."""
    pyvista = pytest.importorskip("pyvista")
    mesh = mesh_of(pyvista.MultiBlock({name: blocks[name] for name in order}))
    np.testing.assert_array_equal(mesh.surface.points, POINTS)
    assert ends(mesh) == {frozenset(map(tuple, POINTS[edge].tolist())) for edge in LINE}
    np.testing.assert_array_equal(mesh.fixed_points, FIXED)
    np.testing.assert_array_equal(mesh.point_data["height"], POINTS[:, 2])
    assert mesh.point_data["color"].dtype == np.uint8
    np.testing.assert_array_equal(mesh.face_data["weight"], np.arange(SURFACE.n_faces))
    assert sorted(mesh.feature_regions["physical"].labels) == [4, 9]
    assert "physical" not in {**mesh.regions, **mesh.face_data}
    for regions, name in (
        (mesh.regions, "skin"),
        (mesh.feature_regions, "rim"),
        (mesh.fixed_point_regions, "tips"),
    ):
        assert set(regions["block"].names.values()) == {name}
    assert caplog.text == ""


def test_a_line_is_on_one_block_and_what_is_on_none_is_named(blocks, caplog):
    pyvista = pytest.importorskip("pyvista")
    moved = blocks["skin"].translate((1.0, 0.0, 0.0))
    places = np.array(
        [POINTS[LINE[0, 0]], POINTS[LINE[0, 1]], (9, 9, 9), moved.points[LINE[1, 0]], moved.points[LINE[1, 1]]]
    )
    lines = pyvista.PolyData(places, lines=[3, 0, 1, 2, 2, 3, 4])
    lines.point_data["tension"] = np.arange(5.0)
    lines.cell_data["stress"] = [0.5, 1.5]
    several = pyvista.MultiBlock([blocks["skin"], moved, lines, pyvista.PolyData(places[2:3])])
    mesh = mesh_of(several)
    assert ends(mesh) == {frozenset(map(tuple, places[[k, k + 1]].tolist())) for k in (0, 3)}
    assert len(mesh.fixed_points) == 0
    assert "height" in mesh.point_data
    for said in (
        "left out 1 line(s) whose ends are not points of its surface",
        "left out 1 vertex cell(s) whose points are not points of its surface",
        "left out PointData 'tension' of lines and vertices",
        "left out cell data 'stress' of lines and vertices",
    ):
        assert said in caplog.text


def test_pieces_of_files_with_lines_only_keep_the_data_of_others(tmp_path, caplog):
    piece = (
        '<Piece NumberOfPoints="{n}" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" '
        'format="ascii">{points}</DataArray></Points><Cells>'
        '<DataArray type="Int64" Name="connectivity" format="ascii">{corners}</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">{n}</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">{kind}</DataArray></Cells>'
        "<PointData>{data}</PointData></Piece>"
    )
    height = '<DataArray type="Float64" Name="height" format="ascii">5 6 7</DataArray>'
    text = (
        '<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">'
        "<UnstructuredGrid>"
        + piece.format(n=2, points="0 1 0 -0 0 0", corners="1 0", kind=3, data="")
        + piece.format(n=3, points="0 0 0 1 0 0 0 1 0", corners="0 1 2", kind=5, data=height)
        + "</UnstructuredGrid></VTKFile>"
    )
    (tmp_path / "a.vtu").write_text(text)
    mesh = load_mesh(tmp_path / "a.vtu")
    assert mesh.features.tolist() == [[0, 2]]
    assert mesh.point_data["height"].tolist() == [5, 6, 7]
    assert caplog.text == ""

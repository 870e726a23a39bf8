"""Mesh objects of other libraries are read by the same rules as files."""

import meshio
import numpy as np
import pytest
import trimesh

from anisomesh.errors import MeshError
from anisomesh.io.convert import as_surface
from anisomesh.io.meshes import load, save
from anisomesh.shapes import analytic as shapes

CUBE = shapes.box((1.0, 1.0, 1.0), n=1)
U = np.array([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)], dtype=float)
U3 = np.pad(U, ((0, 0), (0, 1)))
MIDDLES = np.array([[0, 0], [2, 0], [2, 2], [1, 0], [2, 1], [1, 1]], dtype=float)


def volume(surface):
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", np.cross(a, b), c) / 6


def test_trimesh_scene_with_its_transformations(caplog):
    box = trimesh.creation.box((1, 2, 3))
    scene = trimesh.Scene([trimesh.PointCloud(np.eye(3))])
    turn = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (4, 5, 6))
    scene.add_geometry(box, transform=turn)
    scene.add_geometry(box, transform=np.diag([-2.0, 1.0, 1.0, 1.0]))
    surface = as_surface(scene)
    assert (surface.n_faces, volume(surface)) == (24, pytest.approx(18))
    assert "of type PointCloud, which is not a surface" in caplog.text
    np.testing.assert_allclose(surface.points[:8], trimesh.transform_points(box.vertices, turn))


def test_meshio_meshes(tmp_path):
    cells = [("line", [[0, 1]]), ("polygon", [list(range(8))]), ("tetra", [[0, 1, 2, 3]])]
    mesh = meshio.Mesh(U, cells)
    assert as_surface(mesh).area == pytest.approx(7)
    save(mesh, tmp_path / "a.ply")
    assert load(tmp_path / "a.ply").area == pytest.approx(7)
    split = as_surface(meshio.Mesh(MIDDLES, [("triangle6", [[0, 1, 2, 3, 4, 5]])]))
    assert (split.n_faces, split.area) == (4, pytest.approx(2))
    corners = as_surface(meshio.Mesh(MIDDLES, [("triangle6", [[0, 1, 2, 3, 4, 5]]), ("triangle", [[0, 1, 2]])]))
    assert corners.faces.tolist() == [[0, 1, 2]] * 2


def test_meshio_meshes_that_are_refused():
    volume_cells = meshio.Mesh(U3, [("tetra", [[0, 1, 2, 3]]), ("line", [[0, 1]])])
    with pytest.raises(MeshError, match="only cells of type line, tetra and no surface"):
        as_surface(volume_cells)
    triangle = meshio.Mesh(U3, [("triangle", [[0, 1, 9]])])
    with pytest.raises(MeshError, match="refers to point 9"):
        as_surface(triangle)
    triangle.cells[0].type = "VTK_BEZIER_TRIANGLE"
    with pytest.raises(MeshError, match="type 'VTK_BEZIER_TRIANGLE', which is not known"):
        as_surface(triangle)


def test_pyvista_data_sets(caplog):
    pyvista = pytest.importorskip("pyvista")
    flat = pyvista.PolyData(U3, faces=[8, *range(8)])
    assert as_surface(flat).area == pytest.approx(7)
    strip = pyvista.PolyData(U3[[0, 1, 7, 2]], strips=[4, 0, 1, 2, 3])
    assert as_surface(strip).area == pytest.approx(9)
    grid = pyvista.UnstructuredGrid([8, *range(8), 4, 0, 1, 2, 7], [7, 10], U3)
    assert as_surface(grid).area == pytest.approx(7)
    plane = pyvista.StructuredGrid(*np.meshgrid([0.0, 1, 2], [0.0, 1, 3], [0.0]))
    assert as_surface(plane).area == pytest.approx(6)
    blocks = pyvista.MultiBlock(
        [flat, None, pyvista.MultiBlock([grid.translate((9, 0, 0)), pyvista.Table({"a": np.ones(1)})])]
    )
    both = as_surface(blocks)
    assert both.area == pytest.approx(14)
    assert both.points[:, 0].max() == 12
    assert "left out a block of type Table" in caplog.text
    with pytest.raises(MeshError, match="only cells of type hexahedron and no surface"):
        as_surface(pyvista.ImageData(dimensions=(2, 2, 2)))
    with pytest.raises(MeshError, match="it has no face"):
        as_surface(pyvista.MultiBlock())


def test_objects_of_triangles_keep_points_and_faces():
    pyvista = pytest.importorskip("pyvista")
    for mesh in (
        trimesh.Trimesh(CUBE.points, CUBE.faces, process=False),
        pyvista.PolyData.from_regular_faces(CUBE.points, CUBE.faces),
        meshio.Mesh(CUBE.points, [("triangle", CUBE.faces)]),
        trimesh.Scene(trimesh.Trimesh(CUBE.points, CUBE.faces, process=False)),
    ):
        np.testing.assert_array_equal(as_surface(mesh).points, CUBE.points)
        np.testing.assert_array_equal(as_surface(mesh).faces, CUBE.faces)


def test_other_objects_are_refused():
    for mesh in (3, "a", None, object()):
        with pytest.raises(MeshError, match="cannot read a mesh from"):
            as_surface(mesh)
    with pytest.raises(MeshError, match=r"from tuple; expected a Surface, as Surface\(points, faces\) of two arrays"):
        as_surface((np.eye(3), np.array([[0, 1, 2]])))

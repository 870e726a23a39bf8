"""Cell data of lines and vertices, which a mesh has no place for: a line names them where they hold something."""

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, mesh_of, save
from anisomesh.io.objects.write import to_meshio, to_pyvista
from anisomesh.shapes.analytic import box

BOX = box(n=1)
N = BOX.n_faces
EDGE = BOX.edges[:1].astype(np.int64)
DATA = {  # by name, of faces, of a line and of a vertex
    "id": (np.arange(N), 5, 6),
    "flag": (np.ones(N, dtype=np.uint8), 0, 1),
    "of the line": (np.zeros(N), 0.5, np.nan),
    "filled": (np.arange(N) + 0.5, np.nan, 0.0),
    "zeros": (np.arange(N), 0, 0),
    "material_ids": (np.zeros(N, dtype=int), 3, 4),  # regions, of the line and of the vertex too
}
NAMES = "'flag', 'id', 'of the line'"  # the ones that hold something there


def lines_of(caplog):
    return [record.getMessage().partition(": ")[2] for record in caplog.records]


def named(text):
    """Return the names in a line in order."""
    before, _, after = text.partition("left out cell data ")
    assert before == ""
    assert after.endswith(" of lines and vertices")
    return ", ".join(sorted(after.removesuffix(" of lines and vertices").split(", ")))


def of_meshio():
    meshio = pytest.importorskip("meshio")
    data = {name: [faces, np.array([a]), np.array([b])] for name, (faces, a, b) in DATA.items()}
    return meshio.Mesh(BOX.points, [("triangle", BOX.faces), ("line", EDGE), ("vertex", [[0]])], cell_data=data)


def of_pyvista():
    pyvista = pytest.importorskip("pyvista")
    cells = np.concatenate([np.insert(BOX.faces, 0, 3, axis=1).ravel(), [2, *EDGE[0]], [1, 0]])
    grid = pyvista.UnstructuredGrid(cells, np.array([5] * N + [3, 1], dtype=np.uint8), BOX.points)
    for name, (faces, a, b) in DATA.items():
        grid.cell_data[name] = np.concatenate([faces, [a, b]])
    return grid


@pytest.mark.parametrize("make", [of_meshio, of_pyvista])
def test_objects_with_data_at_lines_and_vertices(caplog, make):
    """Regression: the values of lines and vertices vanished."""
    mesh = mesh_of(make())
    said = lines_of(caplog)
    assert len(said) == 1
    assert named(said[0]) == NAMES
    np.testing.assert_array_equal(mesh.face_data["id"], np.arange(N))
    assert mesh.feature_regions["material_ids"].labels.tolist() == [3]
    assert mesh.fixed_point_regions["material_ids"].labels.tolist() == [4]


@pytest.mark.parametrize("suffix", ["vtu", "vtp"])
def test_vtk_files_with_data_at_lines_and_vertices(tmp_path, caplog, suffix):
    """Regression: the values of lines and vertices vanished, when read and when written again."""
    pyvista = pytest.importorskip("pyvista")
    grid = of_pyvista()
    if suffix == "vtp":
        faces = np.insert(BOX.faces, 0, 3, axis=1).ravel()
        grid = pyvista.PolyData(BOX.points, faces=faces, lines=[2, *EDGE[0]], verts=[1, 0])
        for name, (of_faces, a, b) in DATA.items():
            grid.cell_data[name] = np.concatenate([[b, a], of_faces])
    grid.save(tmp_path / f"a.{suffix}")
    mesh = load_mesh(tmp_path / f"a.{suffix}")
    said = lines_of(caplog)
    assert len(said) == 1
    assert named(said[0]) == NAMES
    caplog.clear()
    save(mesh, tmp_path / f"b.{suffix}")
    load_mesh(tmp_path / f"b.{suffix}")
    assert lines_of(caplog) == []


def test_msh_files_with_data_at_lines(tmp_path, caplog):
    """Regression: $ElementData of lines vanished."""
    text = (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
        "$Elements\n2\n1 1 2 4 1 1 2\n2 2 2 5 1 1 2 3\n$EndElements\n"
    )
    for name, of_line in (("stress", 0.5), ("zeros", 0)):
        text += f'$ElementData\n1\n"{name}"\n1\n0\n3\n0\n1\n2\n1 {of_line}\n2 7\n$EndElementData\n'
    (tmp_path / "a.msh").write_text(text)
    mesh = load_mesh(tmp_path / "a.msh")
    assert mesh.face_data["stress"].tolist() == [7]
    assert lines_of(caplog) == ["left out cell data 'stress' of lines and vertices"]


@pytest.mark.parametrize("suffix", ["vtu", "vtp", "msh", "meshio", "pyvista"])
def test_what_is_written_is_read_without_a_line(tmp_path, caplog, suffix):
    """What stands for no value at lines and vertices is nothing."""
    mesh = Mesh(
        surface=BOX,
        face_data={"id": np.arange(1, N + 1), "stress": np.arange(N) + 0.5, "flag": np.ones(N, dtype=bool)},
        regions={"physical": Regions(np.arange(N) % 2 + 1)},
        features=EDGE,
        fixed_points=[0, 1],
        feature_regions={"physical": Regions(np.array([3]))},
        fixed_point_regions={"physical": Regions(np.array([4, 5]))},
    )
    if suffix in ("meshio", "pyvista"):
        pytest.importorskip(suffix)
        read = mesh_of({"meshio": to_meshio, "pyvista": to_pyvista}[suffix](mesh))
    else:
        save(mesh, tmp_path / f"a.{suffix}")
        read = load_mesh(tmp_path / f"a.{suffix}")
    assert read.face_data.keys() == mesh.face_data.keys()
    assert lines_of(caplog) == []

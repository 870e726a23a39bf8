"""Fields at points, read from files of other programs and written so that others read the same."""

import meshio
import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.fields.load import load_field, split_spec
from anisomesh.io.fields.save import TENSOR_FORMATS, save_tensors
from anisomesh.io.formats.medit.solution import read_sol
from anisomesh.io.meshes import save
from anisomesh.shapes.analytic import sphere

SURFACE = sphere(1)
N = SURFACE.n_points
HEAD = "MeshVersionFormatted 2\n\nDimension\n3\n\n"
ROWS = np.random.default_rng(1).normal(size=(N, 6))


def random_tensors(n=N, seed=0):
    roots = np.random.default_rng(seed).normal(size=(n, 3, 3))
    return roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(3)


def symmetric(xx, yy, zz, xy, yz, xz):
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def written(path, **point_data):
    """Write a file by meshio, as an independent program."""
    meshio.Mesh(SURFACE.points, [("triangle", SURFACE.faces)], point_data=point_data).write(
        path, "gmsh" if path.suffix == ".msh" else None
    )
    return path


@pytest.mark.parametrize("suffix", TENSOR_FORMATS)
def test_tensors_are_the_same_after_writing_and_reading(tmp_path, suffix):
    tensors, path = random_tensors(), tmp_path / f"metric{suffix}"
    save_tensors(SURFACE, tensors, path, {"sizes": np.ones((N, 2))})
    field = load_field(path)
    assert field.kind == "tensor"
    np.testing.assert_array_equal(field.values, tensors)
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_the_order_of_a_tensor_in_a_solution_is_the_lower_half_row_by_row(tmp_path):
    path = tmp_path / "a.sol"
    path.write_text(HEAD + "SolAtVertices\n2\n1 3\n11 12 22 13 23 33\n1 0 2 0.5 0 3 # a comment\n\nEnd\n")
    expected = [[[11, 12, 13], [12, 22, 23], [13, 23, 33]], [[1, 0, 0.5], [0, 2, 0], [0.5, 0, 3]]]
    np.testing.assert_array_equal(load_field(path).values, expected)


def test_a_solution_with_several_fields_is_read_field_by_field(tmp_path):
    path = tmp_path / "a.sol"
    path.write_text(HEAD + "SolAtTriangles 1 1 1 7\nSolAtVertices\n2\n3 1 2 1\n1 2 3 4 5\n6 7 8 9 10\nEnd\n")
    np.testing.assert_array_equal(load_field(f"{path}:1").values, [1, 6])
    np.testing.assert_array_equal(load_field(path, kinds=["vector"]).values, [[2, 3, 4], [7, 8, 9]])
    with pytest.raises(MeshFileError, match=r"name one, as in a.sol:NAME; .* it has '1' \(float64 of shape"):
        load_field(path)


def test_a_tensor_of_the_plane_acts_on_the_plane_as_it_is():
    (tensors,) = read_sol(b"MeshVersionFormatted 2 Dimension 2 SolAtVertices 1 1 3 4 1 9 End")
    np.testing.assert_array_equal(tensors[0, :2, :2], [[4, 1], [1, 9]])
    assert (np.linalg.eigvalsh(tensors) > 0).all()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\x01\x00\x00\x00\x02\x00\x00\x00", "no section SolAtVertices"),
        (b"\x01\x00\x00\x00\x02\x00", "truncated: a section should begin at byte 4 of 6"),
        (b"hello", "does not begin with MeshVersionFormatted"),
        (HEAD.encode(), "no section SolAtVertices"),
        (b"MeshVersionFormatted 2 Dimension 4 SolAtVertices 1 1 1 1", "its dimension is 4"),
        (HEAD.encode() + b"SolAtVertices 2 1 3 1 2 3 4 5 6 End", "truncated: SolAtVertices declares 2 rows of 6 but 6"),
        (HEAD.encode() + b"SolAtVertices 1 1 7 1", "fields are of types .7."),
        (HEAD.encode() + b"SolAtVertices 1 2 1", "truncated: the section SolAtVertices has 1 numbers where 2"),
        (HEAD.encode() + b"SolAtVertices 1 1 1 1.x", "the section SolAtVertices should give numbers"),
        (HEAD.encode() + b"SolAtVertices 1 1 1 1 2", "malformed: more than the 1 rows of 1 numbers"),
        (HEAD.encode() + b"SolAtVertices", "truncated: the section SolAtVertices has no count"),
    ],
)
def test_a_broken_solution_is_refused(tmp_path, content, words):
    path = tmp_path / "a.sol"
    path.write_bytes(content)
    with pytest.raises(MeshFileError, match=f"a.sol: cannot be read as SOL: .*{words}"):
        load_field(path)


def test_six_components_in_vtk_files_have_the_order_of_vtk(tmp_path):
    path = written(tmp_path / "a.vtu", M=ROWS)
    np.testing.assert_array_equal(load_field(path).values, [symmetric(*row) for row in ROWS])
    assert load_field(path).layout == "XX YY ZZ XY YZ XZ"


@pytest.mark.parametrize("suffix", [".vtu", ".msh"])
def test_nine_components_are_read_row_by_row(tmp_path, suffix):
    values = np.random.default_rng(2).normal(size=(N, 3, 3))
    path = written(tmp_path / f"a{suffix}", M=values.reshape(N, 9))
    np.testing.assert_array_equal(load_field(path).values, values)
    np.testing.assert_allclose(load_field(path).points, SURFACE.points, rtol=1e-15)


def test_an_array_of_integers_is_read_and_what_cannot_be_used_is_said_in_plain_words(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.arange(1, 8))
    np.testing.assert_array_equal(load_field(path).values, np.arange(1.0, 8.0))
    for content, words in {
        b"xxxx": "it was not written by numpy.save",
        path.read_bytes()[:-5]: "or is truncated",
    }.items():
        path.write_bytes(content)
        with pytest.raises(MeshFileError, match=f"a.npy: cannot be read as NPY: .*{words}"):
            load_field(path)
    np.save(path, np.array([{}, 1], dtype=object))
    with pytest.raises(MeshFileError, match="it holds Python objects"):
        load_field(path)
    np.save(path, np.ones((7, 4)))
    with pytest.raises(MeshFileError, match=r"a.npy: it cannot be used; expected a number .* of shape \(7, 4\)"):
        load_field(path)


def test_the_layout_of_tensors_of_the_plane_is_the_one_that_was_read(tmp_path):
    (tmp_path / "a.sol").write_text("MeshVersionFormatted 2 Dimension 2 SolAtVertices 1 1 3 4 1 9 End")
    assert load_field(tmp_path / "a.sol").layout.startswith("m11 m12 m22, ")
    (tmp_path / "a.sol").write_text(HEAD + "SolAtVertices\n1\n1 3\n11 12 22 13 23 33\nEnd\n")
    assert load_field(tmp_path / "a.sol").layout == "m11 m12 m22 m13 m23 m33"


def test_six_components_elsewhere_are_refused_since_their_order_is_unknown(tmp_path):
    save(SURFACE, tmp_path / "a.ply", point_data={"M": ROWS})
    np.save(tmp_path / "a.npy", ROWS)
    for spec in ("a.ply:M", "a.npy:array"):
        with pytest.raises(MeshFileError, match="6 components have a known order in VTU and VTP files only"):
            load_field(tmp_path / spec)


@pytest.mark.parametrize("suffix", [".vtu", ".ply", ".msh"])
def test_a_field_is_chosen_by_name_and_others_are_listed(tmp_path, suffix):
    path, h = written(tmp_path / f"a{suffix}", h=SURFACE.points[:, 0], T=SURFACE.points[:, 1]), SURFACE.points[:, 0]
    np.testing.assert_array_equal(load_field(f"{path}:h").values, h)
    with pytest.raises(MeshFileError, match=r"it has no field 'x' at points; it has 'h' \(float64.*'T' \(float64"):
        load_field(f"{path}:x")
    with pytest.raises(MeshFileError, match=r"name one, .* it has 'h'"):
        load_field(path)


def test_the_only_field_of_real_numbers_needs_no_name(tmp_path):
    path = tmp_path / "a.vtu"
    save(SURFACE, path, point_data={"h": np.ones(N), "node": np.arange(N), "v": np.ones((N, 3))})
    assert load_field(path).name == "h"
    np.testing.assert_array_equal(load_field(f"{path}:node").values, np.arange(N))
    with pytest.raises(MeshFileError, match=r"'v' is float64 of shape .*; expected a number or a 3x3 tensor"):
        load_field(f"{path}:v")


@pytest.mark.parametrize("shape", [(N,), (N, 1), (N, 9), (N, 3, 3)])
def test_arrays_of_numpy_may_have_any_clear_shape(tmp_path, shape):
    values = np.random.default_rng(3).normal(size=shape)
    np.save(tmp_path / "a.npy", values)
    found = load_field(tmp_path / "a.npy").values
    np.testing.assert_array_equal(found, values.reshape(found.shape))
    assert found.ndim == (3 if len(values[0:1].ravel()) == 9 else 1)


def test_files_that_hold_no_field_are_refused(tmp_path):
    save(SURFACE, tmp_path / "a.mesh")
    np.save(tmp_path / "a.npy", np.array(["a", "b"]))
    (tmp_path / "b.npy").write_bytes(b"no array")
    (tmp_path / "c.npy").write_bytes(b"")
    with (tmp_path / "d.npy").open("wb") as file:
        np.savez(file, h=np.ones(N))
    for name, words in {
        "a.mesh": "it has no field at points",
        "a.npy": "it cannot be used",
        "b.npy": "cannot be read as NPY",
        "c.npy": "cannot be read as NPY",
        "d.npy": "cannot be read as NPY",
        "d.sol": "cannot be read: No such file",
        "a.txt": "unknown format .txt; expected one of .sol, .solb, .npy",
    }.items():
        with pytest.raises(MeshFileError, match=words):
            load_field(tmp_path / name)


@pytest.mark.parametrize(
    ("spec", "path", "name"),
    [
        ("a.sol", "a.sol", None),
        ("a.sol:2", "a.sol", "2"),
        ("b/a.VTU:stress: yy", "b/a.VTU", "stress: yy"),
        ("C:\\a.mesh.vtp:h", "C:\\a.mesh.vtp", "h"),
        ("x:y/a.ply:h.sol:1", "x:y/a.ply", "h.sol:1"),
        ("a.txt:h", "a.txt:h", None),
    ],
)
def test_file_and_name_are_told_apart(spec, path, name):
    assert (str(split_spec(spec)[0]), split_spec(spec)[1]) == (path, name)


def test_a_file_whose_name_has_a_colon_is_found(tmp_path):
    path = tmp_path / "a.sol:1.npy"
    np.save(path, np.ones(3))
    assert split_spec(path) == (path, None)
    assert load_field(path).values.tolist() == [1, 1, 1]


def test_tensors_are_not_written_to_formats_that_cannot_hold_them(tmp_path):
    with pytest.raises(MeshFileError, match=r"expected a file name ending in one of \.sol"):
        save_tensors(SURFACE, random_tensors(), tmp_path / "a.stl")

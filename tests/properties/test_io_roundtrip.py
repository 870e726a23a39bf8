"""Written meshes are read back exactly, or rounded to float32 where the format does so."""

import io
import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from anisomesh.errors import MeshFileError
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load, save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from conftest import examples

EXACT = [".obj", ".off", ".ply", ".3mf", ".vtu", ".vtp", ".msh", ".mesh", ".meshb"]
any_float = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def surfaces(draw):
    n_points = draw(st.integers(1, 6))
    points = draw(st.lists(st.tuples(any_float, any_float, any_float), min_size=n_points, max_size=n_points))
    index = st.integers(0, n_points - 1)
    return Surface(np.array(points), np.array(draw(st.lists(st.tuples(index, index, index), min_size=1, max_size=8))))


@pytest.mark.parametrize("suffix", EXACT)
@settings(examples(25), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(surface=surfaces())
def test_every_bit_comes_back(tmp_path, suffix, surface):
    path = tmp_path / f"mesh{suffix}"
    save(surface, path)
    again = load(path)
    assert again.points.tobytes() == surface.points.tobytes()
    np.testing.assert_array_equal(again.faces, surface.faces)


@pytest.mark.parametrize("suffix", [".stl", ".glb"])
def test_float32_formats_keep_the_triangles(tmp_path, suffix):
    surface = shapes.torus(n_major=12, n_minor=8)
    save(surface, tmp_path / f"mesh{suffix}")
    again = load(tmp_path / f"mesh{suffix}")
    assert again.n_points == surface.n_points
    rounded = surface.points.astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(again.points[again.faces], rounded[surface.faces])


def mutations(rng, data):
    for _ in range(40):
        yield data[: rng.integers(len(data))]
        changed = bytearray(data)
        for _ in range(rng.integers(1, 4)):
            changed[rng.integers(len(data))] = rng.choice([rng.integers(256), *b"0123456789- \n"])
        yield bytes(changed)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
@pytest.mark.parametrize("seed", range(3))
def test_damaged_files_give_one_clear_error_or_a_mesh(tmp_path, capfd, suffix, seed):
    rng = np.random.default_rng(seed)
    path = tmp_path / f"mesh{suffix}"
    save(Surface(rng.normal(size=(8, 3)), np.array([[0, 1, 2], [3, 4, 5], [5, 6, 7]])), path)
    n_errors = 0
    for data in mutations(rng, path.read_bytes()):
        path.write_bytes(data)
        try:
            surface = load(path)
        except MeshFileError as error:
            n_errors += 1
            assert str(error).startswith(f"{path}: ")
            assert len(str(error).splitlines()) == 1
        else:
            assert surface.n_faces >= 1
    assert n_errors > 0
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_truncation_is_noticed(tmp_path, suffix):
    """Whatever is cut off, the file is refused, unless all numbers are still there (a text's last line ends)."""
    path = tmp_path / f"mesh{suffix}"
    surface = Surface(np.arange(12.0).reshape(4, 3) ** 2, np.array([[0, 1, 2], [1, 2, 3], [0, 3, 2]]))
    save(surface, path)
    whole = load(path)
    data = path.read_bytes()
    for length in range(0, len(data), 1 if len(data) < 600 else 7):
        path.write_bytes(data[:length])
        try:
            again = load(path)
        except MeshFileError:
            continue
        # OBJ announces no counts: a prefix of whole lines is a file of its own.
        count = again.n_faces if suffix == ".obj" else whole.n_faces
        np.testing.assert_array_equal(again.points, whole.points)
        np.testing.assert_array_equal(again.faces, whole.faces[:count])


PLY_TYPES = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
}


@settings(examples(100), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_ply_layout_is_understood(tmp_path, data):
    """Points and polygons among arbitrary extra properties and elements, in all three encodings."""
    draw = data.draw
    order = draw(st.sampled_from(["ascii", "binary_little_endian", "binary_big_endian"]))
    names = [f"extra{k}" for k in range(draw(st.integers(0, 3)))]
    columns = draw(st.permutations(["x", "y", "z", *names]))
    types = [
        draw(st.sampled_from(["float", "double"])) if c in "xyz" else draw(st.sampled_from([*PLY_TYPES]))
        for c in columns
    ]
    n_points = draw(st.integers(4, 7))
    points = np.array(
        draw(st.lists(st.tuples(*[st.integers(0, 100)] * 3), min_size=n_points, max_size=n_points)), dtype=float
    )
    polygons = draw(st.lists(st.permutations(range(n_points)), min_size=1, max_size=5))
    sizes = draw(st.lists(st.integers(3, 4), min_size=len(polygons), max_size=len(polygons)))
    polygons = [p[:size] for p, size in zip(polygons, sizes, strict=True)]
    count_type, index_type = draw(st.sampled_from(["uchar", "int"])), draw(st.sampled_from(["int", "uint", "ushort"]))
    extra_list, flag_first = draw(st.booleans()), draw(st.booleans())

    body = io.BytesIO()

    def put(kind, value):
        if order == "ascii":
            body.write(f"{value} ".encode())
        else:
            body.write(struct.pack(("<" if "little" in order else ">") + PLY_TYPES[kind], value))

    for edge in range(2):
        put("int", edge)
    for point in points:
        for name, kind in zip(columns, types, strict=True):
            value = point["xyz".index(name)] if name in "xyz" else 7
            put(kind, value if kind in ("float", "double") else int(value))
    for polygon in polygons:
        if flag_first:
            put("short", -3)
        put(count_type, len(polygon))
        for index in polygon:
            put(index_type, index)
        if extra_list:
            put("uchar", 2)
            put("float", 0.5)
            put("float", 1.5)
    header = ["ply", f"format {order} 1.0", "comment made here", "element edge 2", "property int number"]
    header += [f"element vertex {n_points}", *(f"property {k} {c}" for c, k in zip(columns, types, strict=True))]
    header += [f"element face {len(polygons)}"] + ["property short flag"] * flag_first
    header += [f"property list {count_type} {index_type} vertex_indices"]
    header += ["property list uchar float texcoord"] * extra_list + ["end_header", ""]
    path = tmp_path / "mesh.ply"
    path.write_bytes("\n".join(header).encode() + body.getvalue())
    surface = load(path)
    np.testing.assert_array_equal(surface.points, points)
    # Each polygon becomes triangles of its own corners in its own direction.
    owner = np.repeat(np.arange(len(polygons)), [len(p) - 2 for p in polygons])
    for face, k in zip(surface.faces.tolist(), owner, strict=True):
        places = [list(polygons[k]).index(corner) for corner in face]
        turns = sum((b - a) % len(polygons[k]) for a, b in zip(places, places[1:] + places[:1], strict=True))
        assert turns == len(polygons[k])

"""What a mesh carries is checked once, when the mesh is made."""

import pickle

import numpy as np
import pytest

from anisomesh import Mesh, MeshError, Regions
from anisomesh.shapes.analytic import box

BOX = box((1.0, 1.0, 1.0), n=2)


@pytest.mark.parametrize(
    ("carried", "message"),
    [
        ({"point_data": {"t": np.zeros(3)}}, r"point_data\['t'\] has shape \(3,\); expected \(26, ...\)"),
        ({"face_data": {"t": np.zeros((3, 2))}}, r"face_data\['t'\] has shape \(3, 2\); expected \(48, ...\)"),
        (
            {"corner_data": {"uv": np.zeros((48, 2))}},
            r"corner_data\['uv'\] has shape \(48, 2\); expected \(48, 3, ...\)",
        ),
        ({"point_data": {"t": [None] * 26}}, r"point_data\['t'\] has dtype object; expected bools, numbers or strings"),
        ({"point_data": {"t": [[1], [1, 2]]}}, r"point_data\['t'\] has rows of different lengths"),
        ({"regions": {"r": Regions(np.zeros(3, dtype=int))}}, r"regions\['r'\].labels has shape \(3,\)"),
        ({"regions": {"r": np.zeros(48, dtype=int)}}, r"regions\['r'\] is of type ndarray; expected Regions"),
        ({"features": [[0, 1, 2]]}, r"features has shape \(1, 3\); expected \(n, 2\)"),
        ({"features": [[0, 99]]}, r"features has the point 99; expected 0 to 25"),
        ({"feature_regions": {"r": Regions(np.ones(1, dtype=int))}}, r"labels has shape \(1,\); expected \(0,\)"),
        ({"fixed_point_regions": {"r": [1]}}, r"fixed_point_regions\['r'\] is of type list; expected Regions"),
        ({"fixed_points": [-1]}, r"fixed_points has the point -1"),
        ({"fixed_points": [0.5]}, r"fixed_points have dtype float64; expected integers"),
        (
            {"point_data": {"n": np.zeros(26)}, "corner_data": {"n": np.zeros((48, 3))}},
            r"'n' is in point_data and in corner_data",
        ),
    ],
)
def test_what_does_not_fit_the_surface_is_an_error(carried, message):
    with pytest.raises(MeshError, match=message):
        Mesh(surface=BOX, **carried)


def test_labels_are_whole_numbers():
    with pytest.raises(MeshError, match="region labels have dtype float64"):
        Regions(np.zeros(48))


def test_the_surface_is_a_surface():
    with pytest.raises(MeshError, match="surface is of type list; expected a Surface"):
        Mesh(surface=[1])


def test_arrays_are_copies_that_cannot_be_written():
    values = np.zeros(26)
    mesh = Mesh(surface=BOX, point_data={"t": values})
    values[0] = 1.0
    assert mesh.point_data["t"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.point_data["t"][0] = 1.0


def test_parts_are_what_no_division_divides():
    first, second = np.arange(48) % 2, np.arange(48) % 3
    mesh = Mesh(surface=BOX, regions={"a": Regions(first + 10), "b": Regions(-second)})
    assert len(np.unique(mesh.parts)) == 6
    for part in range(6):
        chosen = mesh.parts == part
        assert set(first[chosen] + 10) == {mesh.part_labels["a"][part]}
        assert set(-second[chosen]) == {mesh.part_labels["b"][part]}


def test_a_mesh_says_what_it_carries_and_can_be_pickled():
    mesh = Mesh(surface=BOX, point_data={"t": np.zeros(26)}, fixed_points=[1, 2])
    assert repr(mesh) == "Mesh(Surface(26 points, 48 faces), 1 point_data, 2 fixed_points)"
    assert Mesh(surface=BOX).is_bare
    assert Mesh(surface=BOX, materials={"unit": "meter"}).is_bare
    assert not Mesh(surface=BOX, materials={"steel": 7.85}).is_bare
    assert not mesh.is_bare
    assert repr(pickle.loads(pickle.dumps(mesh))) == repr(mesh)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("point_data", None, "expected a dictionary"),
        ("regions", None, "expected a dictionary"),
        ("point_data", {1: np.zeros(8)}, "expected a string"),
        ("point_data", {"a": np.zeros((8, 0))}, "its rows are empty"),
    ],
)
def test_what_is_not_data_by_name_is_refused(field, value, words):
    with pytest.raises(MeshError, match=words):
        Mesh(surface=box(n=1), **{field: value})


def test_labels_beyond_64_bits_are_refused():
    with pytest.raises(MeshError, match="int64"):
        Regions(np.array([1, 2**64 - 1], dtype=np.uint64))


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ({"x": "a"}, r"the label 'x', which is not an integer; expected a dictionary of names by label"),
        ({1.5: "a"}, r"the label 1.5, which is not an integer"),
        ({None: "a"}, r"the label None, which is not an integer"),
        ({float("inf"): "a"}, r"the label inf, which is not an integer"),
        (["inlet"], r"names of regions are of type list; expected a dictionary"),
        (None, r"names of regions are of type NoneType; expected a dictionary"),
    ],
)
def test_names_of_regions_are_by_integers(names, words):
    """Regression: the error was the one of Python's int."""
    with pytest.raises(MeshError, match=words):
        Regions(np.array([1, 2]), names)
    assert Regions(np.array([1, 2]), {np.int32(1): "inlet", 2.0: 5}).names == {1: "inlet", 2: "5"}

"""Regions of lines in PLY and OBJ files."""

import io

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import box

BOX = box(n=2)


def read(text, suffix):
    return load_mesh(io.BytesIO(text.encode()), file_format=suffix)


def written(mesh, suffix):
    stream = io.BytesIO()
    save(mesh, stream, file_format=suffix)
    return stream.getvalue()


def round_trip(mesh, suffix):
    return load_mesh(io.BytesIO(written(mesh, suffix)), file_format=suffix)


def by_edge(mesh, name):
    """Return label and name of each feature in a region, by its points."""
    division = mesh.feature_regions[name]
    rows = zip(np.sort(mesh.features).tolist(), division.labels.tolist(), strict=True)
    return {tuple(edge): division.names.get(label, label) for edge, label in rows if label}


OBJ = """v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
l 1 2
o plate
g part
f 1 2 3
f 2 4 3
g inlet side
l 2 4 3
g
l 1 3
o
g region_7
l 2 3
"""


def test_groups_and_objects_of_lines_in_obj():
    """A line is in the objects and groups in front of it, if any; a word without a name ends a region."""
    mesh = read(OBJ, "obj")
    assert by_edge(mesh, "group") == {(1, 3): "inlet side", (2, 3): "inlet side", (1, 2): 7}
    assert by_edge(mesh, "object") == {(1, 3): "plate", (2, 3): "plate", (0, 2): "plate"}
    assert len(mesh.features) == 5
    assert mesh.regions["group"].names == {1: "part"}


def test_lines_without_groups_have_no_regions():
    assert read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\n", "obj").feature_regions == {}


@pytest.mark.parametrize("faces", [{}, {"group": "g"}, {"object": "o"}, {"group": "g", "object": "o", "material": "m"}])
@pytest.mark.parametrize("lines", [{}, {"group": 3}, {"object": 0}, {"physical": 2}, {"group": 3, "own": 2}])
def test_regions_of_lines_and_of_faces_are_kept_apart_in_obj(faces, lines):
    """Regression: lines behind the faces were in the last group of faces."""
    labels = np.arange(BOX.n_faces) % 2 + 1
    features = BOX.edges[::3]
    divisions = {
        name: Regions((np.arange(len(features)) + shift) % 3, {1: "inlet", 2: f"of {name}"})
        for name, shift in lines.items()
    }
    mesh = Mesh(
        surface=BOX,
        regions={name: Regions(labels, {1: f"{text} 1", 2: f"{text} 2"}) for name, text in faces.items()},
        features=features,
        feature_regions=divisions,
    )
    found = round_trip(mesh, "obj")
    assert found.regions.keys() == mesh.regions.keys()
    given = [by_edge(mesh, name) for name in mesh.feature_regions]
    assert len(found.feature_regions) == len(given)
    assert all(by_edge(found, name) in given for name in found.feature_regions)
    assert {tuple(edge) for edge in np.sort(found.features).tolist()} == {tuple(e) for e in np.sort(features).tolist()}


def test_a_third_division_of_lines_is_named_in_the_warning(caplog):
    division = Regions(np.ones(2, dtype=int))
    three = dict.fromkeys(("group", "object", "own"), division)
    written(Mesh(surface=BOX, features=BOX.edges[:2], feature_regions=three), "obj")
    assert "regions of feature edges 'own'" in caplog.text


PLY = """ply
format ascii 1.0
comment edge_regions curve 3 the "inlet"
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
element edge 3
property int vertex1
property int vertex2
property int curve
property uchar region
property float crease
property int other
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
0 1 3 0 .5 1
1 2 0 4 .5 1
0 2 9 4 .5 1
"""


def test_properties_of_edges_in_ply(caplog):
    """Integers are regions if a comment or their name says so; other properties are named as left out."""
    mesh = read(PLY, "ply")
    assert by_edge(mesh, "curve") == {(0, 1): 'the "inlet"', (0, 2): 9}
    assert by_edge(mesh, "region") == {(1, 2): 4, (0, 2): 4}
    assert "left out the properties crease, other of edges" in caplog.text


def test_broken_names_of_regions_of_edges_are_left_out(caplog):
    mesh = read(PLY.replace("curve 3", "curve three"), "ply")
    assert len(mesh.features) == 3
    assert "left out the regions 'curve' of edges" in caplog.text


def test_odd_names_come_back_in_ply():
    """Names of divisions that are not one word, names of regions with quotes, and labels beyond 32 bits."""
    names = {5: ' two  blanks "and quotes"', 2**40: "large"}
    mesh = Mesh(
        surface=BOX,
        features=BOX.edges[:3],
        feature_regions={"my curves": Regions([5, 0, 2**40], names), "vertex1": Regions([1, 2, 3])},
    )
    found = round_trip(mesh, "ply")
    assert list(found.feature_regions) == ["my curves"]  # the other one's name is taken
    assert found.feature_regions["my curves"].names == names
    assert found.feature_regions["my curves"].labels.tolist() == [5, 0, 2**40]

"""Regions of lines and points, such as physical curves, are kept with their ends, lengths, numbers and names."""

import io

import meshio
import numpy as np
import pytest

import anisomesh
from anisomesh import Mesh, Regions
from anisomesh.attributes.lost import losses_of_attributes
from anisomesh.io.meshes import load_mesh, save
from anisomesh.setup.fixed import curve_ends
from anisomesh.shapes.analytic import box, open_patch

INLET, OUTLET, SLIT = 3, 5, 8
NAMES = {INLET: "inlet", OUTLET: "outlet"}


def plate():
    """The square [-1, 1] x [-1, 1] with curves, of which the inlet ends in the middle of a straight side."""
    surface = open_patch(lambda x, y: 0.0 * x, n=12)
    middles = surface.points[surface.edges].mean(axis=1)
    along_x = np.ptp(surface.points[surface.edges][..., 1], axis=1) < 1e-12
    label = np.zeros(len(surface.edges), dtype=np.int64)
    label[(np.abs(middles[:, 0] + 1.0) < 1e-9) & (middles[:, 1] < 0.3)] = INLET
    label[np.abs(middles[:, 0] - 1.0) < 1e-9] = OUTLET
    label[along_x & (np.abs(middles[:, 1]) < 1e-9) & (np.abs(middles[:, 0]) < 0.5)] = SLIT
    fixed = np.argsort(np.linalg.norm(surface.points - [0.3, 0.6, 0.0], axis=1))[:2]
    return Mesh(
        surface=surface,
        features=surface.edges[label > 0],
        fixed_points=np.sort(fixed),
        feature_regions={"physical": Regions(label[label > 0], NAMES)},
        fixed_point_regions={"physical": Regions(np.array([7, 0]), {7: "probe"})},
    )


def curves(mesh, division="physical"):
    """Length, name, and places of the two ends of each curve by label."""
    regions, found = mesh.feature_regions[division], {}
    for label in np.unique(regions.labels[regions.labels != 0]).tolist():
        edges = mesh.features[regions.labels == label]
        lengths = np.linalg.norm(np.diff(mesh.surface.points[edges], axis=1), axis=2)
        points, count = np.unique(edges, return_counts=True)
        ends = mesh.surface.points[points[count == 1]]
        found[label] = float(lengths.sum()), regions.names.get(label), sorted(map(tuple, ends.tolist()))
    return found


def assert_same_curves(found, expected):
    assert found.keys() == expected.keys()
    for label, (length, name, ends) in expected.items():
        assert found[label][0] == pytest.approx(length, abs=1e-9)
        assert found[label][1:] == (name, ends)


@pytest.fixture(scope="module")
def remeshed():
    """The result for a plate that was read from a file of Gmsh."""
    stream = io.BytesIO()
    save(plate(), stream, file_format="msh")
    mesh = load_mesh(io.BytesIO(stream.getvalue()), file_format="msh")
    return anisomesh.remesh(mesh, n_vertices=120)


def test_curves_keep_ends_lengths_numbers_and_names(remeshed):
    assert_same_curves(curves(remeshed.mesh), curves(plate()))
    assert curves(plate()).keys() == {INLET, OUTLET, SLIT}
    assert remeshed.surface.n_points == 120
    assert remeshed.warnings == ()


def test_points_keep_their_places_numbers_and_names(remeshed):
    labels = []
    for mesh in (plate(), remeshed.mesh):
        regions = mesh.fixed_point_regions["physical"]
        places = mesh.surface.points[mesh.fixed_points].tolist()
        labels.append(dict(zip(map(tuple, places), regions.labels.tolist(), strict=True)))
        assert regions.names == {7: "probe"}
    assert labels[0] == labels[1]
    assert sorted(labels[0].values()) == [0, 7]


def test_meshio_reads_the_physical_groups_of_the_result(remeshed, tmp_path):
    save(remeshed.mesh, tmp_path / "out.msh")
    read = meshio.read(tmp_path / "out.msh")
    assert {name: value.tolist() for name, value in read.field_data.items()} == {
        "inlet": [INLET, 1],
        "outlet": [OUTLET, 1],
        "probe": [7, 0],
    }
    lengths = {}
    for block, labels in zip(read.cells, read.cell_data["gmsh:physical"], strict=True):
        if block.type == "line":
            for ends, label in zip(read.points[block.data], labels.tolist(), strict=True):
                lengths[label] = lengths.get(label, 0.0) + float(np.linalg.norm(ends[1] - ends[0]))
    assert lengths == pytest.approx({label: length for label, (length, _, _) in curves(plate()).items()}, abs=1e-9)


@pytest.mark.parametrize("suffix", ["msh", "mesh", "vtu", "vtp"])
def test_curves_of_the_result_are_in_files(remeshed, suffix):
    stream = io.BytesIO()
    save(remeshed.mesh, stream, file_format=suffix)
    mesh = load_mesh(io.BytesIO(stream.getvalue()), file_format=suffix)
    division = "reference" if suffix == "mesh" else "physical"
    expected = curves(remeshed.mesh)
    if suffix == "mesh":
        expected = {label: (length, None, ends) for label, (length, _, ends) in expected.items()}
    assert_same_curves(curves(mesh, division), expected)


def test_curves_on_a_solid_keep_their_labels_beside_locked_faces():
    surface = box((1.0, 0.7, 0.5), n=6)
    is_top = surface.face_normals[:, 2] > 0.5
    side = np.flatnonzero(np.bincount(surface.face_edges[is_top].ravel(), minlength=len(surface.edges)) == 1)
    middles = surface.points[surface.edges[side]].mean(axis=1)
    labels = np.where(middles[:, 0] == surface.points[:, 0].max(), 2, 1)
    mesh = Mesh(surface=surface, features=surface.edges[side], feature_regions={"rim": Regions(labels, {2: "front"})})
    for how in ({}, {"lock": is_top}):
        result = anisomesh.remesh(mesh, n_vertices=150, **how)
        assert_same_curves(curves(result.mesh, "rim"), curves(mesh, "rim"))


def test_curves_end_where_one_of_their_edges_does():
    mesh = plate()
    for label, (_, _, ends) in curves(mesh).items():
        chosen = mesh.feature_regions["physical"].labels == label
        alone = Mesh(
            surface=mesh.surface,
            features=mesh.features[chosen],
            feature_regions={"physical": Regions(np.full(chosen.sum(), label))},
        )
        found = mesh.surface.points[curve_ends(alone)].tolist()
        assert sorted(map(tuple, found)) == ends


def test_numbers_of_single_edges_are_no_curves():
    edges = plate().surface.edges
    numbers = {"number": Regions(np.arange(1, len(edges) + 1))}
    assert len(curve_ends(Mesh(surface=plate().surface, features=edges, feature_regions=numbers))) == 0


def test_a_curve_that_no_edge_follows_is_named():
    mesh = plate()
    warnings = list(losses_of_attributes(mesh, Mesh(surface=mesh.surface)))
    assert "no edges follow the lines inlet, outlet, physical 8; ask for more vertices" in warnings


@pytest.mark.parametrize(("lost", "is_said"), [(1, False), (6, True)])
def test_lines_of_which_a_part_is_lost_are_said_to_be_shorter(lost, is_said):
    mesh = plate()
    assert len(mesh.features) > 20
    after = Mesh(surface=mesh.surface, features=mesh.features[lost:])
    told = [warning for warning in losses_of_attributes(mesh, after) if "shorter" in warning]
    assert bool(told) == is_said
    assert all("edges along prescribed lines are shorter in all (-" in warning for warning in told)

"""Labels of 64 bits come back exactly or are named with the reason, and so are data and divisions without a name."""

import logging
import re

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.levels.files import save_meshes
from anisomesh.mesh.surface import Surface

LARGE = [-(2**63), -(2**53) - 1, -(2**31) - 1, 2**31, 2**53, 2**62 + 1, 2**63 - 1]
POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)])
SURFACE = Surface(POINTS, [(0, 1, 2), (0, 2, 3), (1, 4, 2)])
WITHOUT_REGIONS = (".off",)
BY_NAME = (".ply", ".vtu", ".vtp")  # formats whose divisions have names
XML = (
    '<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
    '<FieldData><DataArray type="Int32" format="ascii">1</DataArray></FieldData>'
    '<Piece NumberOfPoints="3" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" '
    'format="ascii">0 0 0 1 0 0 0 1 0</DataArray></Points><Cells>'
    '<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>'
    '<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>'
    '<DataArray type="UInt8" Name="types" format="ascii">5</DataArray></Cells>'
    '<PointData><DataArray type="Int32" format="ascii">1 2 3</DataArray></PointData>'
    '<CellData><DataArray type="Int32" Name="" format="ascii">7</DataArray></CellData>'
    "</Piece></UnstructuredGrid></VTKFile>"
)


@pytest.mark.parametrize("label", LARGE)
@pytest.mark.parametrize("suffix", [suffix for suffix in MESH_FORMATS if suffix not in WITHOUT_REGIONS])
def test_a_large_label_comes_back_or_is_named_with_the_reason(tmp_path, caplog, suffix, label):
    """Regression: MEDIT files lost all references with it, VTK files the names, MSH files did not say why."""
    labels = np.array([label, 3, label])
    mesh = Mesh(surface=SURFACE, regions={"part": Regions(labels, {3: "inlet"})})
    with caplog.at_level(logging.WARNING):
        save(mesh, tmp_path / f"a{suffix}")
        regions = list(load_mesh(tmp_path / f"a{suffix}").regions.values())
    if not regions:
        assert suffix in (".ply", ".msh")
        assert "regions 'part', whose integers are too large for float64" in caplog.text
        assert abs(label) >= 2**53
    else:
        assert np.count_nonzero(regions[0].labels == label) == 2  # some formats sort faces by regions
        assert "inlet" in regions[0].names.values() or suffix in (".mesh", ".meshb")
        assert "left out" not in caplog.text or suffix in (".mesh", ".meshb")


@pytest.mark.parametrize("suffix", [".mesh", ".meshb"])
def test_references_of_medit_files_are_exact(tmp_path, caplog, suffix):
    labels = np.array([2**53 + 1, -(2**63), 2**63 - 1])
    mesh = Mesh(
        surface=SURFACE,
        regions={"reference": Regions(labels)},
        features=[(0, 1), (1, 2)],
        feature_regions={"reference": Regions(labels[:2])},
        fixed_points=[1, 3],
        fixed_point_regions={"reference": Regions(labels[1:])},
    )
    path = tmp_path / f"a{suffix}"
    save(mesh, path)
    read = load_mesh(path)
    np.testing.assert_array_equal(read.regions["reference"].labels, labels)
    np.testing.assert_array_equal(read.feature_regions["reference"].labels, labels[:2])
    np.testing.assert_array_equal(read.fixed_point_regions["reference"].labels, labels[1:])
    assert caplog.text == ""
    version = path.read_bytes().split()[1] if suffix == ".mesh" else path.read_bytes()[4:5]
    assert version in (b"4", b"\x04")  # whose integers have 64 bits


def test_references_of_vertices_beyond_int64_are_named(tmp_path, caplog):
    """Regression: 2^64 - 1 became -1."""
    references = np.array([1, 2, 3, 4, 2**64 - 1], dtype=np.uint64)
    save(Mesh(surface=SURFACE, point_data={"reference": references}), tmp_path / "a.mesh")
    assert "point data 'reference', whose integers are too large for int64" in caplog.text
    assert "reference" not in load_mesh(tmp_path / "a.mesh").point_data


@pytest.mark.parametrize("name", ["physical", "geometrical"])
def test_tags_of_gmsh_beyond_32_bits_are_named_with_the_reason(tmp_path, caplog, name):
    large = Regions(np.array([2**40, 1, 1]))
    mesh = Mesh(
        surface=SURFACE,
        regions={name: large},
        features=[(0, 1)],
        feature_regions={"lines": Regions([2**40])},
        fixed_points=[2],
        fixed_point_regions={"tips": Regions([2**40])},
    )
    save(mesh, tmp_path / "a.msh")
    why = "whose integers are too large for tags, which have 32 bits"
    for what in (f"regions {name!r}", "regions of feature edges 'lines'", "regions of fixed points 'tips'"):
        assert f"{what}, {why}" in caplog.text


def test_a_reference_beyond_64_bits_leaves_the_faces(tmp_path, caplog):
    save(Mesh(surface=SURFACE, regions={"reference": Regions([5, 6, 7])}), tmp_path / "a.mesh")
    text = (tmp_path / "a.mesh").read_text()
    (tmp_path / "a.mesh").write_text(re.sub(r" 6$", f" {2**70}", text, flags=re.MULTILINE))
    read = load_mesh(tmp_path / "a.mesh")
    np.testing.assert_array_equal(read.surface.faces, SURFACE.faces)
    assert read.regions == {}
    assert "left out the references of faces" in caplog.text


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_data_without_a_name_are_said_to_be_left_out_once(tmp_path, caplog, suffix):
    """Regression: they vanished from VTU and VTP files, and were named after reading only in PLY, MSH and GLB files."""
    mesh = Mesh(
        surface=SURFACE,
        point_data={"": np.arange(5.0)},
        face_data={"": np.arange(3.0)},
        regions={"physical": Regions([1, 2, 2]), "": Regions([1, 1, 2])},
        features=[(0, 1)],
        feature_regions={"": Regions([4])},
    )
    corners = Mesh(surface=SURFACE, corner_data={"": np.arange(9.0).reshape(3, 3)})
    with caplog.at_level(logging.WARNING):
        save(mesh, tmp_path / f"a{suffix}")
        save_meshes([corners], tmp_path / f"b{suffix}")
        written = caplog.text
        read = load_mesh(tmp_path / f"a{suffix}")
    for what in ("point data", "face data", "corner data"):
        assert written.count(f"{what} without a name") == 1
    assert not read.point_data
    assert not read.face_data
    if suffix in (*BY_NAME, ".msh"):
        assert "; regions without a name" in written
        assert caplog.text == written
    if suffix in BY_NAME:
        assert "regions of feature edges without a name" in written
        assert list(read.regions) == ["physical"]


def test_arrays_of_vtk_without_a_name_are_said_to_be_left_out(tmp_path, caplog):
    (tmp_path / "a.vtu").write_text(XML)
    read = load_mesh(tmp_path / "a.vtu")
    assert (read.point_data, read.face_data, read.materials) == ({}, {}, {})
    for section in ("PointData", "CellData", "FieldData"):
        assert f"left out {section} without a name" in caplog.text

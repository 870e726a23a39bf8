"""Textures of 3MF: texture coordinates at corners, and images in the archive."""

import io
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import anisomesh
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import box

BOX = box(n=2)
N = BOX.n_faces
UV = np.random.default_rng(0).random((N, 3, 2))
LABELS = np.arange(N) % 3
HELD = np.where((LABELS > 0)[:, None, None], UV, np.nan)  # of faces with a texture


def image(colour, kind="PNG"):
    content = io.BytesIO()
    Image.new("RGB", (2, 2), colour).save(content, kind)
    return content.getvalue()


WOOD, STONE = image("brown"), image("grey", "JPEG")
TEXTURES = {1: {"data": WOOD, "tilestyleu": "mirror", "filter": "nearest"}, 2: {"data": STONE}}


def textured(names=None, textures=None, **more):
    names = {1: "wood.png", 2: "stone.jpg"} if names is None else names
    regions = {"texture": Regions(LABELS, names), **more.pop("regions", {})}
    materials = {"textures": TEXTURES if textures is None else textures}
    return Mesh(
        surface=BOX, corner_data={"uv": HELD, **more.pop("corner_data", {})}, regions=regions, materials=materials
    )


def round_trip(mesh, tmp_path):
    save(mesh, tmp_path / "a.3mf")
    return load_mesh(tmp_path / "a.3mf")


def test_textures_come_back_with_their_images(tmp_path, caplog):
    """Faces in no region of the division have no texture and no texture coordinates."""
    read = round_trip(textured(), tmp_path)
    assert read.regions["texture"].names == {1: "wood.png", 2: "stone.jpg"}
    np.testing.assert_array_equal(read.regions["texture"].labels, LABELS)
    np.testing.assert_array_equal(read.corner_data["uv"], HELD)
    assert read.materials["textures"] == {
        1: {"contenttype": "image/png", "tilestyleu": "mirror", "filter": "nearest", "data": WOOD},
        2: {"contenttype": "image/jpeg", "data": STONE},
    }
    again = round_trip(read, tmp_path)
    assert again.materials == read.materials
    assert caplog.text == ""


def test_textures_stand_beside_colours_and_materials_of_other_faces(tmp_path, caplog):
    colours = np.full((N, 3, 4), 255, dtype=np.uint8)
    colours[LABELS == 0] = [1, 2, 3, 255]
    read = round_trip(textured(corner_data={"color": colours}), tmp_path)
    np.testing.assert_array_equal(read.corner_data["color"], colours)
    oak = Regions(np.where(LABELS == 0, 1, 0), {1: "oak"})
    read = round_trip(textured(regions={"material": oak}), tmp_path)
    np.testing.assert_array_equal(read.regions["material"].labels, oak.labels)
    assert [record.message.partition(": ")[2] for record in caplog.records] == [
        "left out what 3MF cannot hold: unknown colours of 1 of 1 material(s): they are grey"
    ]


@pytest.mark.parametrize(
    ("mesh", "said"),
    [
        (textured(regions={"material": Regions(LABELS + 1)}), f"the materials of {2 * N // 3} face(s) that have a tex"),
        (textured(corner_data={"color": np.zeros((N, 3, 3), np.uint8)}), f"the colours of {2 * N // 3} face(s)"),
        (textured(textures={1: TEXTURES[1]}), "the texture 'stone.jpg', whose image is missing"),
        (textured(textures={1: {"data": b"GIF89a"}, 2: 3}), "corner data 'uv'; materials 'textures'"),
        (textured({1: "wood.png", 2: "my / stone"}), "some characters of 1 name(s) such as 'my / stone'"),
        (Mesh(surface=BOX, corner_data={"uv": UV}, materials={"textures": TEXTURES}), "corner data 'uv'; materials"),
    ],
)
def test_what_is_not_held_is_named(mesh, said, tmp_path, caplog):
    save(mesh, tmp_path / "a.3mf")
    assert said in caplog.text
    load_mesh(tmp_path / "a.3mf")


def test_names_that_are_equal_in_the_archive_stay_apart(tmp_path):
    read = round_trip(textured({1: "a b", 2: "a_b"}), tmp_path)
    np.testing.assert_array_equal(read.regions["texture"].labels, LABELS)
    assert [table["data"] for table in read.materials["textures"].values()] == [WOOD, STONE]
    read = round_trip(textured({}), tmp_path)
    assert not read.regions["texture"].names
    np.testing.assert_array_equal(read.regions["texture"].labels, LABELS)


def test_the_archive_is_as_published(tmp_path):
    """The model refers to the image, and the relationships and kinds of parts name it."""
    save(textured(), tmp_path / "a.3mf")
    with zipfile.ZipFile(tmp_path / "a.3mf") as archive:
        assert archive.read("3D/Textures/wood.png") == WOOD
        model, kinds, related = (
            archive.read(name).decode()
            for name in ("3D/3dmodel.model", "[Content_Types].xml", "3D/_rels/3dmodel.model.rels")
        )
    assert 'path="/3D/Textures/wood.png" contenttype="image/png" tilestyleu="mirror" filter="nearest"' in model
    assert '<Override PartName="/3D/Textures/stone.jpg" ContentType="image/jpeg"/>' in kinds
    assert 'Target="/3D/Textures/wood.png" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing' in related


MODEL = (
    '<model unit="inch" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02"><resources>'
    '<m:texture2d id="4" path="/3D/Textures/a.png" contenttype="image/png" tilestylev="clamp"/>'
    '<m:texture2dgroup id="5" texid="4"><m:tex2coord u="0" v=".25"/><m:tex2coord u="1" v="2"/></m:texture2dgroup>'
    '<m:texture2dgroup id="6" texid="4"><m:tex2coord u=".5" v=".5"/></m:texture2dgroup>'
    '<m:texture2dgroup id="8" texid="9"><m:tex2coord u=".5" v=".5"/></m:texture2dgroup>'
    '<object id="1" pid="6" pindex="0"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>'
    '<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2" pid="5" p1="1" p2="0" p3="7"/>'
    '<triangle v1="0" v2="1" v3="2"/><triangle v1="0" v2="1" v3="2" pid="8" p1="0"/></triangles></mesh></object>'
    '</resources><build><item objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></build></model>'
)


def test_coordinates_of_files_of_others(tmp_path, caplog):
    """Groups of the same texture are one region; corners turn with a reflection; an image that is missing is named."""
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("3D/3dmodel.model", MODEL)
        archive.writestr("3D/Textures/a.png", WOOD)
    mesh = load_mesh(tmp_path / "a.3mf")
    assert mesh.surface.faces.tolist() == [[2, 1, 0]] * 3
    expected = [[[np.nan, np.nan], [0, 0.25], [1, 2]], [[0.5, 0.5]] * 3, [[0.5, 0.5]] * 3]
    np.testing.assert_array_equal(mesh.corner_data["uv"], expected)
    assert mesh.regions["texture"].labels.tolist() == [1, 1, 2]
    assert mesh.regions["texture"].names == {1: "a.png"}
    assert mesh.materials["textures"][1] == {"contenttype": "image/png", "tilestylev": "clamp", "data": WOOD}
    assert "left out the image of the texture ''" in caplog.text


@pytest.mark.slow
def test_a_remesh_keeps_textures(tmp_path):
    mesh = Mesh(
        surface=BOX,
        point_data={"uv": BOX.points[:, :2]},
        regions={"texture": Regions(np.ones(N, int), {1: "wood.png"})},
        materials={"textures": {1: TEXTURES[1]}},
    )
    read = round_trip(anisomesh.remesh(mesh, n_vertices=60, max_iterations=5).mesh, tmp_path)
    assert read.materials["textures"][1]["data"] == WOOD
    np.testing.assert_allclose(read.corner_data["uv"], read.surface.points[read.surface.faces][..., :2], atol=1e-9)


def test_texture_coordinates_of_faces_without_a_texture_are_named(tmp_path, caplog):
    """Regression: they were 0 in the file, and nothing was said."""
    given = replace(textured(), corner_data={"uv": UV})
    read = round_trip(given, tmp_path)
    assert f"the uv of {np.count_nonzero(LABELS == 0)} face(s) without a texture" in caplog.text
    np.testing.assert_array_equal(read.corner_data["uv"], HELD)
    caplog.clear()
    round_trip(replace(given, corner_data={"uv": np.nan_to_num(HELD)}), tmp_path)
    assert caplog.text == ""


def test_a_texture_without_texture_coordinates_is_named(tmp_path, caplog):
    gaps = UV.copy()
    gaps[LABELS == 2], gaps[1, 1] = np.nan, np.nan
    read = round_trip(replace(textured(), corner_data={"uv": gaps}), tmp_path)
    n_stone = np.count_nonzero(LABELS == 2)
    assert f"the texture 'stone.jpg' at {n_stone} face(s), some corners of which have no uv" in caplog.text
    assert "the texture 'wood.png' at 1 face(s), some corners of which have no uv" in caplog.text
    held = (LABELS == 1) & (np.arange(N) != 1)
    np.testing.assert_array_equal(read.regions["texture"].labels == 1, held)
    np.testing.assert_array_equal(read.corner_data["uv"], np.where(held[:, None, None], UV, np.nan))

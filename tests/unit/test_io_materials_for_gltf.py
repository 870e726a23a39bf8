"""Materials of OBJ and 3MF in GLB files, as trimesh reads them."""

import io
import logging

import numpy as np
import pytest
import trimesh
from PIL import Image

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.meshes import load_mesh, save
from anisomesh.levels.files import save_meshes
from anisomesh.shapes.analytic import box

BOX = box(n=2)
UV = np.round(np.random.default_rng(0).random((BOX.n_faces, 3, 2)), 3)
LABELS = np.arange(BOX.n_faces) % 3  # 0 for none
PIXELS = np.random.default_rng(1).integers(0, 255, (4, 4, 3), dtype=np.uint8)


def image(pixels, kind="PNG"):
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, kind)
    return content.getvalue()


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING)
    return caplog


def obj(folder, materials, names=("", "wood", "red")):
    """Return a mesh that is read from an OBJ file with a material file beside it."""
    folder.mkdir(exist_ok=True)
    regions = Regions(np.sort(LABELS), {k: name for k, name in enumerate(names) if name})
    save(Mesh(surface=BOX, corner_data={"uv": UV}, regions={"material": regions}), folder / "a.obj")
    (folder / "a.mtl").write_text(materials)
    (folder / "a.obj").write_text("mtllib a.mtl\n" + (folder / "a.obj").read_text().replace("usemtl region_0\n", ""))
    return load_mesh(folder / "a.obj")


def parts_of(path):
    """Return the parts of a file by the names of their materials, as trimesh reads them."""
    scene = trimesh.load(path, process=False)
    return {getattr(getattr(part.visual, "material", None), "name", None): part for part in scene.geometry.values()}


def test_textures_and_colours_of_obj_are_in_glb(tmp_path, log):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "my wood.png").write_bytes(image(PIXELS))
    mesh = obj(
        tmp_path / "in", "newmtl wood\nKd .5 .5 .5\nmap_Kd -s 1 1 1 my wood.png\nnewmtl red\nKd 1 0.25 0\nd 0.5\n"
    )
    save(mesh, tmp_path / "a.glb")
    parts = parts_of(tmp_path / "a.glb")
    np.testing.assert_array_equal(parts["wood"].visual.material.baseColorTexture, PIXELS)
    assert (parts["wood"].visual.material.baseColorFactor == 255).all()
    np.testing.assert_allclose(parts["red"].visual.material.baseColorFactor, [255, 64, 0, 128], atol=1)
    assert parts["red"].visual.material.alphaMode == "BLEND"
    corners = {tuple(row) for row in UV[np.sort(LABELS) == 1].reshape(-1, 2).astype(np.float32)}
    found = {tuple(row) for row in np.asarray(parts["wood"].visual.uv, dtype=np.float32)}
    assert max(np.abs(np.array(sorted(corners)) - np.array(sorted(found))).max(axis=1)) < 1e-6
    read = load_mesh(tmp_path / "a.glb")
    for label, name in ((1, "wood"), (2, "red")):
        number = next(key for key, text in read.regions["material"].names.items() if text == name)
        assert (read.regions["material"].labels == number).sum() == (label == LABELS).sum()
    assert (read.regions["material"].labels == -1).sum() == (LABELS == 0).sum()
    assert log.text == ""


def test_what_glb_has_no_place_for_is_named_in_one_line(tmp_path, log):
    mesh = obj(tmp_path / "in", "newmtl wood\nKs 1 1 1\nmap_Kd gone.png\nnewmtl red\nKd 2 a 0\nbump a.png\n")
    save(mesh, tmp_path / "a.glb")
    assert len(log.records) == 1
    for words in ("image of 'wood', which is missing", "statements bump, ks of materials"):
        assert words in log.text
    assert "obj" not in log.text.split(":")[-1]


def test_textures_and_display_colours_of_3mf_are_in_glb(tmp_path, log):
    stone = PIXELS[::-1].copy()
    textures = {1: {"data": image(PIXELS), "tilestyleu": "mirror", "filter": "nearest"}, 2: {"data": image(stone)}}
    oak = Regions(np.where(LABELS == 0, 5, 0), {5: "oak"})
    given = Mesh(
        surface=BOX,
        corner_data={"uv": np.where((LABELS > 0)[:, None, None], UV, np.nan)},
        regions={"texture": Regions(LABELS, {1: "wood.png", 2: "stone.png"}), "material": oak},
        materials={"textures": textures, "display_colours": {5: "#BC8040"}, "unit": "meter"},
    )
    save(given, tmp_path / "a.3mf")
    save(load_mesh(tmp_path / "a.3mf"), tmp_path / "a.glb")
    parts = parts_of(tmp_path / "a.glb")
    assert parts.keys() == {"wood.png", "stone.png", "oak"}
    for name, pixels in (("wood.png", PIXELS), ("stone.png", stone)):
        np.testing.assert_array_equal(parts[name].visual.material.baseColorTexture, pixels)
    linear = np.array([0xBC, 0x80, 0x40]) / 255.0  # within the power of the curve
    factor = parts["oak"].visual.material.baseColorFactor[:3] / 255.0
    np.testing.assert_allclose(factor, linear**2.2, atol=0.01)
    assert log.text == ""
    gltf = load_mesh(tmp_path / "a.glb").materials["gltf"]
    assert gltf["samplers"] == [{"wrapS": 33648, "magFilter": 9728, "minFilter": 9728}]


def test_levels_of_detail_share_the_materials(tmp_path):
    """Also where a coarser level has lost a material."""
    regions = Regions(LABELS, {1: "wood.png", 2: "stone.png"})
    textures = {1: {"data": image(PIXELS)}, 2: {"data": image(PIXELS[::-1].copy())}}
    fine = Mesh(surface=BOX, corner_data={"uv": UV}, regions={"texture": regions}, materials={"textures": textures})
    coarse = Mesh(
        surface=BOX,
        corner_data={"uv": UV},
        regions={"texture": Regions(np.full(BOX.n_faces, 2), regions.names)},
        materials=fine.materials,
    )
    save_meshes([fine, coarse], tmp_path / "a.glb")
    coarser = trimesh.load(tmp_path / "a.glb", process=False)
    materials = [part.visual.material for part in coarser.geometry.values() if len(part.faces) == BOX.n_faces]
    assert [material.name for material in materials] == ["stone.png"]
    np.testing.assert_array_equal(materials[0].baseColorTexture, PIXELS[::-1])


def test_a_broken_colour_or_texture_is_no_error(tmp_path, log):
    regions = {"material": Regions(LABELS, {1: "a", 2: "b"}), "texture": Regions(LABELS, {2: "c"})}
    materials = {"display_colours": {1: "#12", 2: "#zz"}, "textures": {2: {"data": b"GIF89a"}, 1: 3}}
    save(Mesh(surface=BOX, corner_data={"uv": UV}, regions=regions, materials=materials), tmp_path / "a.glb")
    assert "left out" in log.text
    assert load_mesh(tmp_path / "a.glb").surface.n_faces == BOX.n_faces


@pytest.mark.parametrize("suffix", [".glb", ".3mf"])
def test_options_of_textures_are_named(tmp_path, log, suffix):
    """Regression: a texture was written without its scale and offset, and nothing was said."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "oak.png").write_bytes(image(PIXELS))
    plain = "newmtl wood\nmap_Kd -s 1 1 1.0 -o 0 -clamp OFF -blendu on oak.png\nnewmtl red\nKd 1 0 0\n"
    mesh = obj(tmp_path / "in", plain)
    save(mesh, tmp_path / f"a{suffix}")
    assert "the options" not in log.text
    mesh = obj(tmp_path / "in", plain.replace("-s 1 1 1.0", "-s 2 2 -texres 64").replace("OFF", "on"))
    save(mesh, tmp_path / f"a{suffix}")
    assert "the options -clamp, -s, -texres of map_Kd of materials" in log.text


@pytest.mark.parametrize(("suffix", "in_file"), [(".glb", True), (".glb", False), (".3mf", True)])
def test_colours_are_unknown_without_a_material_file(tmp_path, log, suffix, in_file):
    """Regression: materials 'obj' were said to be left out, and 3MF was grey without a line."""
    given = obj(tmp_path / "in", "")
    if not in_file:
        given = load_mesh(io.BytesIO((tmp_path / "in" / "a.obj").read_bytes()), file_format="obj")
    (tmp_path / "in" / "a.mtl").unlink()
    mesh = load_mesh(tmp_path / "in" / "a.obj") if in_file else given
    log.clear()
    save(mesh, tmp_path / f"b{suffix}")
    assert len(log.records) == 1
    assert "the colours of materials, which are unknown since their .mtl files were not read" in log.text
    assert "'obj'" not in log.text
    assert ("unknown colours of 2 of 2 material(s): they are grey" in log.text) == (suffix == ".3mf")


def test_materials_that_no_material_file_describes_are_named(tmp_path, log):
    save(obj(tmp_path / "in", "newmtl wood\nKd 1 0 0\n"), tmp_path / "a.3mf")
    assert "the colours of 'red', which its .mtl files do not describe" in log.text

"""Materials of GLB in OBJ and 3MF files, and back: colours, opacity, textures with their images."""

import io
import logging
import re

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
LABELS = np.sort(np.arange(BOX.n_faces) % 4 - 1)  # -1 for none
NAMES = {0: "wood", 1: "red glass", 2: "grey"}


def image(seed):
    content = io.BytesIO()
    Image.fromarray(np.random.default_rng(seed).integers(0, 255, (4, 4, 3), dtype=np.uint8)).save(content, "PNG")
    return content.getvalue()


def physical(**properties):
    return {"pbrMetallicRoughness": {"metallicFactor": 0.0, **properties}}


GLTF = {
    "materials": [
        {"name": "wood", **physical(baseColorTexture={"index": 0}, baseColorFactor=[1.0, 1.0, 1.0, 1.0])},
        {"name": "red glass", "alphaMode": "BLEND", **physical(baseColorFactor=[0.8, 0.1, 0.0, 0.3])},
        {"name": "grey", **physical(baseColorFactor=[0.25, 0.25, 0.25, 1.0])},
    ],
    "textures": [{"source": 0}],
    "images": [{"mimeType": "image/png", "name": "oak.png"}],
    "data": {0: image(1)},
}


def mesh_with(gltf=GLTF, labels=LABELS, names=NAMES):
    regions = {"material": Regions(labels, names)}
    return Mesh(surface=BOX, corner_data={"uv": UV}, regions=regions, materials={"gltf": gltf, "unit": "meter"})


@pytest.fixture(autouse=True)
def log(caplog):
    caplog.set_level(logging.WARNING)
    return caplog


def others(log):
    """Return what was said but of texture coordinates of faces without a texture, which 3MF does not hold."""
    return [
        record.message for record in log.records if not re.search(r"the uv of 36 face|no uv|without uv", record.message)
    ]


def looks(mesh):
    """Return colour and image of the materials of a mesh that is read from a GLB file, by the places of faces."""
    gltf, labels = mesh.materials["gltf"], mesh.regions["material"].labels
    found = {}
    for middle, label in zip(mesh.surface.points[mesh.surface.faces].mean(axis=1), labels.tolist(), strict=True):
        surface = gltf["materials"][label].get("pbrMetallicRoughness", {}) if label >= 0 else {}
        index = surface.get("baseColorTexture", {}).get("index")
        picture = None if index is None else gltf["data"][gltf["textures"][index]["source"]]
        found[tuple(np.round(middle, 5))] = surface.get("baseColorFactor"), picture
    return found


def test_materials_of_glb_are_in_obj_and_come_back(tmp_path, log):
    """Regression: they were named and left out."""
    save(mesh_with(), tmp_path / "a.glb")
    given = load_mesh(tmp_path / "a.glb")
    save(given, tmp_path / "b.obj")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.glb", "b.mtl", "b.obj", "oak.png"]
    assert (tmp_path / "oak.png").read_bytes() == GLTF["data"][0]
    materials = {
        part.visual.material.name: part.visual.material
        for part in trimesh.load(tmp_path / "b.obj", process=False).geometry.values()
        if hasattr(part.visual, "material")
    }
    assert materials["red glass"].diffuse.tolist()[:3] == [204, 26, 0]  # trimesh reads no opacity
    np.testing.assert_array_equal(np.asarray(materials["wood"].image), np.asarray(Image.open(tmp_path / "oak.png")))
    save(load_mesh(tmp_path / "b.obj"), tmp_path / "c.glb")
    again = load_mesh(tmp_path / "c.glb")
    before, after = looks(given), looks(again)
    unset = [key for key, look in before.items() if look == (None, None)]
    assert len(unset) == (LABELS == -1).sum()
    assert {key: look for key, look in after.items() if key not in unset} == (
        {key: look for key, look in before.items() if key not in unset}
    )
    assert log.text == ""


def test_materials_of_obj_come_back_through_glb(tmp_path, log):
    """Colours, opacity and textures are the same to the last digit."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "oak.png").write_bytes(image(1))
    regions = {"material": Regions(LABELS + 2, {1: "none", 2: "wood", 3: "red glass", 4: "grey"})}
    save(Mesh(surface=BOX, corner_data={"uv": UV}, regions=regions), tmp_path / "in" / "a.obj")
    text = (
        "newmtl none\nKd 1.0 1.0 1.0\nd 1.0\nnewmtl wood\nKd 1.0 1.0 1.0\nd 1.0\nmap_Kd oak.png\nnewmtl red glass\n"
        "Kd 0.8 0.1 0.012345678901234\nd 0.3\nnewmtl grey\nKd 0.2 0.2 0.2\nd 1.0\n"
    )
    (tmp_path / "in" / "a.mtl").write_text(text)
    obj = tmp_path / "in" / "a.obj"
    obj.write_text("mtllib a.mtl\n" + obj.read_text())
    save(load_mesh(obj), tmp_path / "b.glb")
    save(load_mesh(tmp_path / "b.glb"), tmp_path / "c.obj")
    assert (tmp_path / "c.mtl").read_text().partition("\n")[2] == text.replace("map_Kd oak", "map_Kd wood")
    assert (tmp_path / "wood.png").read_bytes() == image(1)
    again, first = load_mesh(tmp_path / "c.obj"), load_mesh(obj)
    assert sorted(again.regions["material"].names.values()) == ["grey", "none", "red glass", "wood"]
    assert len(again.corner_data["uv"]) == len(first.corner_data["uv"])
    assert log.text == ""


def test_images_replace_no_file_of_another_content(tmp_path):
    (tmp_path / "oak.png").write_bytes(b"mine")
    for name in ("a.obj", "b.obj"):
        save(mesh_with(), tmp_path / name)
        assert "map_Kd oak_1.png\n" in (tmp_path / name).with_suffix(".mtl").read_text()
    assert (tmp_path / "oak.png").read_bytes() == b"mine"
    assert not (tmp_path / "oak_2.png").exists()


def test_levels_in_obj_share_materials_and_images(tmp_path, log):
    coarse = mesh_with(labels=np.full(BOX.n_faces, 2), names={2: "grey"})
    save_meshes([mesh_with(), coarse], tmp_path / "a.obj")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.lod0.obj", "a.lod1.obj", "a.mtl", "oak.png"]
    assert (tmp_path / "a.mtl").read_text().count("newmtl") == 3
    assert log.text == ""


def test_materials_of_glb_are_in_3mf(tmp_path, log):
    """Regression: base materials were grey, and textures were left out."""
    save(mesh_with(), tmp_path / "a.3mf")
    read = load_mesh(tmp_path / "a.3mf")
    displayed = {name: read.materials["display_colours"][k] for k, name in read.regions["material"].names.items()}
    # sRGB of 0.8, 0.1, 0 and 0.25: 0.906, 0.349, 0 and 0.537 by the tables of IEC 61966-2-1
    assert displayed == {"red glass": "#E759004C", "grey": "#898989FF"}
    assert list(read.materials["textures"].values()) == [{"contenttype": "image/png", "data": GLTF["data"][0]}]
    np.testing.assert_array_equal(read.regions["texture"].labels != 0, LABELS == 0)
    np.testing.assert_array_equal(read.corner_data["uv"][LABELS == 0], UV[LABELS == 0])
    save(read, tmp_path / "b.glb")
    before, after = looks(mesh_with()), looks(load_mesh(tmp_path / "b.glb"))
    for key, (colour, picture) in before.items():
        assert after[key][1] == picture
        if colour and not picture:
            np.testing.assert_allclose(after[key][0], colour, atol=1 / 255)
    assert others(log) == []


def test_samplers_come_back_through_3mf_and_obj_names_them(tmp_path, log):
    sampled = {"samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]}
    gltf = {**GLTF, **sampled, "textures": [{"source": 0, "sampler": 0}]}
    save(mesh_with(gltf), tmp_path / "a.3mf")
    table = next(iter(load_mesh(tmp_path / "a.3mf").materials["textures"].values()))
    assert (table["tilestyleu"], table["tilestylev"], table["filter"]) == ("clamp", "mirror", "nearest")
    assert others(log) == []
    save(mesh_with(gltf), tmp_path / "a.obj")
    assert "how textures end at their borders" in log.text


def test_materials_of_3mf_and_obj_become_each_other(tmp_path, log):
    save(mesh_with(), tmp_path / "a.3mf")
    save(load_mesh(tmp_path / "a.3mf"), tmp_path / "b.obj")
    assert "newmtl red glass\nKd 0.7991" in (tmp_path / "b.mtl").read_text()
    save(load_mesh(tmp_path / "b.obj"), tmp_path / "c.3mf")
    read = load_mesh(tmp_path / "c.3mf")
    displayed = {read.materials["display_colours"][k] for k in read.regions["material"].names}
    assert displayed == {"#E759004C", "#898989FF"}
    assert [table["data"] for table in read.materials["textures"].values()] == [GLTF["data"][0]]
    assert others(log) == []


def test_what_obj_has_no_place_for_is_named(tmp_path, log):
    glossy = {**physical(baseColorFactor=[1, 0, 0, 1], roughnessFactor=0.2), "normalTexture": {"index": 0}}
    gone = physical(baseColorTexture={"index": 7})
    second = physical(baseColorTexture={"index": 0, "texCoord": 1})
    save(mesh_with({**GLTF, "materials": [glossy, gone, second]}, names={1: "a", 2: "b"}), tmp_path / "a.obj")
    assert len(log.records) == 1
    for said in (
        "the properties normalTexture, roughnessFactor of materials",
        "the texture of 'a': it is missing",
        "the texture of 'b': it has texture coordinates of its own",
    ):
        assert said in log.text
    assert "map_Kd" not in (tmp_path / "a.mtl").read_text()


def test_a_stream_has_no_folder_for_materials(log):
    save(mesh_with(), io.BytesIO(), file_format="obj")
    assert "materials 'gltf'" in log.text


@pytest.mark.parametrize("suffix", [".obj", ".3mf"])
@pytest.mark.parametrize("colour", ["x", [1, 2], [float("nan")] * 4, None, {}])
def test_a_broken_colour_of_gltf_is_white(tmp_path, suffix, colour):
    materials = [physical(baseColorFactor=colour), 7, {"pbrMetallicRoughness": 3}]
    save(mesh_with({"materials": materials}), tmp_path / f"a{suffix}")
    read = load_mesh(tmp_path / f"a{suffix}")
    assert read.surface.n_faces == BOX.n_faces
    if suffix == ".obj":
        assert (tmp_path / "a.mtl").read_text().count("Kd 1.0 1.0 1.0\n") == 3
    else:
        assert set(read.materials["display_colours"].values()) == {"#FFFFFFFF"}


NAMED = {"materials": [{"name": "wood"}, {"name": "red glass"}, {"name": "grey"}, {"name": "unused"}]}


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".vtu", ".3mf"])
def test_nothing_is_lost_of_materials_that_have_names_only(tmp_path, log, suffix):
    """Regression: materials 'gltf' were said to be left out."""
    given = mesh_with(NAMED, names={0: "wood", 2: "grey"})
    save(given, tmp_path / f"a{suffix}")
    assert "gltf" not in log.text
    assert "names of regions with nothing in them, 'unused'" in log.text
    assert set(load_mesh(tmp_path / f"a{suffix}").regions["material"].names.values()) >= set(NAMES.values())


@pytest.mark.parametrize("suffix", [".obj", ".3mf"])
@pytest.mark.parametrize("colour", [{}, physical(baseColorFactor=[1, 0, 0, 1])])
def test_other_properties_of_gltf_are_named(tmp_path, log, suffix, colour):
    """Regression: sides and extras of materials were lost without a line."""
    usual = {**colour, "doubleSided": False, "extras": {}, "alphaMode": "OPAQUE"}
    save(mesh_with({"materials": [usual]}), tmp_path / f"a{suffix}")
    assert "the properties" not in log.text
    others = {**colour, "doubleSided": True, "extras": {"kind": "oak"}, "alphaMode": "MASK"}
    save(mesh_with({"materials": [others]}), tmp_path / f"a{suffix}")
    assert "the properties alphaMode, doubleSided, extras of materials" in log.text


@pytest.mark.parametrize(
    ("extension", "said"), [("KHR_texture_transform", "a texture transform"), ("EXT_other", "EXT_other")]
)
def test_extensions_of_textures_are_named(tmp_path, log, extension, said):
    """Regression: a transform was called texture coordinates of its own."""
    texture = physical(baseColorTexture={"index": 0, "extensions": {extension: {"offset": [1, 0]}}})
    save(mesh_with({**GLTF, "materials": [texture]}, names={0: "a"}), tmp_path / "a.obj")
    assert f"the texture of 'a': it has {said}" in log.text
    assert "map_Kd" not in (tmp_path / "a.mtl").read_text()


def test_equal_names_of_materials_are_said_to_be_changed(tmp_path, log):
    """Regression: some characters of a name were said to be left out, or nothing."""
    save(mesh_with(names={0: "wood", 1: "grey", 2: "grey"}), tmp_path / "a.obj")
    assert "equal names of 1 region(s) such as 'grey', which is 'grey_2' there" in log.text
    assert "usemtl grey_2\n" in (tmp_path / "a.obj").read_text()
    log.clear()
    regions = {"group": Regions(LABELS, {1: "a", 2: "a"})}
    save(Mesh(surface=BOX, regions=regions), tmp_path / "b.obj")
    assert "equal names of 1 region(s) such as 'a', which is 'a_2' there" in log.text
    assert "characters" not in log.text

"""Textures in files that are missing: their names are from the folder of the output, and a line says it."""

import logging
from urllib.parse import unquote

import numpy as np
import pytest

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.materials.textures import texture_line
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import box

BOX = box(n=1)
LOOK = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
KEPT = ("http://example.org/a.png", "C:\\tex\\a.png")  # names from no folder here


@pytest.fixture
def folders(tmp_path, caplog):
    caplog.set_level(logging.WARNING)
    for name in ("in put", "out"):
        (tmp_path / name).mkdir()
    return tmp_path / "in put", tmp_path / "out"


def test_a_missing_texture_of_ply_is_named_from_the_output(folders, caplog):
    """Regression: the name stayed as it was in the folder of the input."""
    source, target = folders
    names = ("sub/gone.png", *KEPT)
    save(Mesh(surface=BOX, materials={"texture_files": names}), source / "a.ply")
    mesh = load_mesh(source / "a.ply")
    save(mesh, target / "b.ply")
    save(mesh, target / "c.stl")
    content = (target / "b.ply").read_bytes().decode(errors="replace")
    for name in ("../in put/sub/gone.png", *KEPT):
        assert f"comment TextureFile {name}\n" in content
    assert len([record for record in caplog.records if "b.ply" in record.message]) == 1
    assert caplog.text.count("the content of missing texture files: 'gone.png'") == 1
    save(mesh, source / "c.ply")
    assert b"comment TextureFile sub/gone.png\n" in (source / "c.ply").read_bytes()


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_a_missing_texture_of_glb_is_named_from_the_output(folders, caplog, suffix):
    source, target = folders
    gltf = {"materials": [LOOK], "textures": [{"source": 0}], "images": [{"uri": "go%20ne.png"}]}
    regions = {"material": Regions(np.zeros(BOX.n_faces, int), {0: "wood"})}
    uv = np.zeros((BOX.n_faces, 3, 2))
    save(Mesh(surface=BOX, corner_data={"uv": uv}, regions=regions, materials={"gltf": gltf}), source / "a.glb")
    save(load_mesh(source / "a.glb"), target / f"b{suffix}")
    text = (target / f"b{'.mtl' if suffix == '.obj' else suffix}").read_bytes().decode(errors="replace")
    assert "../in put/go ne.png" in unquote(text)
    assert "the content of missing texture files: 'go ne.png'" in caplog.text


def test_missing_textures_of_mtl_are_named_from_the_output(folders, caplog):
    source, target = folders
    (source / "here.png").write_bytes(b"pixels")
    lines = ["newmtl wood", "map_Kd -s 1 2 -clamp on sub\\my gone.png", "bump -bm 0.5 gone.png", "map_d here.png"]
    (source / "a.mtl").write_text("\n".join([*lines, f"map_Ks {KEPT[0]}", f"map_Ka {KEPT[1]}", ""]))
    save(Mesh(surface=BOX, regions={"material": Regions(np.ones(BOX.n_faces, int), {1: "wood"})}), source / "a.obj")
    (source / "a.obj").write_text("mtllib a.mtl\n" + (source / "a.obj").read_text())
    save(load_mesh(source / "a.obj"), target / "b.obj")
    written = (target / "b.mtl").read_text().splitlines()[1:]
    assert written == [
        "newmtl wood",
        "map_Kd -s 1 2 -clamp on ../in put/sub/my gone.png",
        "bump -bm 0.5 ../in put/gone.png",
        "map_d ../in put/here.png",
        f"map_Ks {KEPT[0]}",
        f"map_Ka {KEPT[1]}",
    ]
    assert len(caplog.records) == 1
    for name in ("../in put/sub/my gone.png", "../in put/gone.png"):
        assert repr(name) in caplog.text
    assert "here.png" not in caplog.text


@pytest.mark.parametrize(
    ("line", "name", "options"),
    [
        ("map_Kd a.png", "a.png", []),
        ("  map_Kd -s 2 1 1 my a.png", "my a.png", ["-s"]),
        ("map_Kd -o 0.5 7.png", "7.png", ["-o"]),
        ("norm -mm 0 1 -imfchan r -bm -2.5 a.png", "a.png", ["-imfchan", "-bm"]),
        ("map_Kd -s 1 1 1", "1", []),
        ("map_Kd ", None, None),
        ("Kd 1 1 1", None, None),
    ],
)
def test_lines_of_textures(tmp_path, line, name, options):
    found = texture_line(line, tmp_path)
    assert (None if found is None else found.name) == name
    assert (None if found is None else found.options) == options

"""What a mesh carries comes back from a file, or a warning names it."""

import importlib.util
import io
import logging
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load, load_mesh, save
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import analytic as shapes
from conftest import examples

ROOT = Path(__file__).parents[2]
spec = importlib.util.spec_from_file_location("formats", ROOT / "benchmarks/formats.py")
formats = importlib.util.module_from_spec(spec)
spec.loader.exec_module(formats)

METRES = "left out what GLB cannot hold: the unit millimeter: coordinates stay as they are"
GREY = "they are grey"  # colours of materials in 3MF files that are not known
WORDS = {  # what a warning says of a kind
    "point": "point data",
    "corner": "corner data",
    "face": "face data",
    "region": "regions",
    "feature": "feature edge",
    "fixed": "fixed ",
}


@pytest.mark.parametrize("kind", formats.MESHES)
@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_what_is_not_kept_is_named_in_one_line(suffix, kind):
    mesh = formats.MESHES[kind]
    read, warnings = formats.round_trip(mesh, suffix)
    found = formats.kept(mesh, read)
    np.testing.assert_array_equal(formats.by_corner(read)[0], formats.by_corner(mesh)[0])
    if found == formats.LOST or found == "numbers":
        assert len(warnings) == 1
        assert "left out what" in warnings[0]
        assert any(word in warnings[0] for key, word in WORDS.items() if key in kind)
    else:
        assert warnings == []


def test_the_page_of_formats_has_the_table():
    page = formats.PAGE.read_text(encoding="utf-8")
    assert page.split(formats.BEGIN)[1].split(formats.END)[0].strip() == formats.table()


@pytest.mark.parametrize("kind", formats.MESHES)
def test_binary_medit_files_hold_what_text_holds(kind):
    mesh = formats.MESHES[kind]
    (text, warnings), (binary, same_warnings) = (formats.round_trip(mesh, suffix) for suffix in MEDIT)
    assert same_warnings == warnings
    assert formats.kept(mesh, binary) == formats.kept(mesh, text)
    np.testing.assert_array_equal(binary.surface.points, text.surface.points)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_a_bare_mesh_stays_bare(suffix):
    read, warnings = formats.round_trip(Mesh(surface=formats.SURFACE), suffix)
    assert read.is_bare
    assert warnings == []


MEDIT = (".mesh", ".meshb")
FULL = {
    ".obj": ("point_data", "corner_data", "features", "fixed_points"),
    ".ply": ("point_data", "corner_data", "face_data", "regions", "features"),
    ".vtu": ("point_data", "face_data", "regions", "features", "fixed_points"),
    ".vtp": ("point_data", "face_data", "regions", "features", "fixed_points"),
    ".msh": ("point_data", "face_data", "regions", "features", "fixed_points"),
    ".mesh": ("regions", "features", "fixed_points"),
    ".meshb": ("regions", "features", "fixed_points"),
    ".stl": (),
    ".glb": (),
    ".3mf": (),
    ".off": (),
}
NAME = st.text(st.characters(min_codepoint=33, max_codepoint=0x24F, exclude_characters='"\x7f'), min_size=1).filter(
    lambda text: text.strip() == text and text.isprintable()
)


@st.composite
def meshes(draw):
    """Return a mesh with random data of all kinds at some of the faces of a grid."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    whole = shapes.box(n=2)
    faces = whole.faces[np.sort(rng.permutation(whole.n_faces)[: draw(st.integers(1, whole.n_faces))])]
    surface = Surface(rng.normal(size=whole.points.shape), faces)
    kinds = [np.float64, np.float32, np.int32, np.uint8, np.int16, bool]

    def arrays(*shape):
        data = {}
        for k in range(draw(st.integers(0, 3))):
            width = draw(st.sampled_from([(), (2,), (3,), (4,)]))
            values = rng.integers(0, 2**31 - 1, (*shape, *width)).astype(draw(st.sampled_from(kinds)))
            data[f"data {k} of {len(shape)} {shape[0]}"] = values
        return data

    labels = rng.integers(0, draw(st.integers(1, 5)), surface.n_faces) + draw(st.sampled_from([-3, 0, 1, 2**31 - 6]))
    names = draw(st.dictionaries(st.sampled_from(np.unique(labels).tolist()), NAME))
    used = np.unique(surface.faces)
    features, fixed_points = surface.edges[rng.random(len(surface.edges)) < 0.3], used[rng.random(len(used)) < 0.5][:-1]

    def marked(count):
        own = rng.integers(0, draw(st.integers(1, 5)), count) * draw(st.sampled_from([1, 7, 2**29 - 1]))
        present = np.unique(own[own != 0]).tolist()
        given_names = draw(st.dictionaries(st.sampled_from(present), NAME)) if present else {}
        return {"physical": Regions(own, given_names)} if present and draw(st.booleans()) else {}

    return Mesh(
        surface=surface,
        point_data=arrays(surface.n_points),
        face_data=arrays(surface.n_faces),
        corner_data={**arrays(surface.n_faces, 3), "uv": rng.uniform(size=(surface.n_faces, 3, 2))},
        regions={"physical": Regions(labels, names)} if draw(st.booleans()) else {},
        features=features,
        fixed_points=fixed_points,
        feature_regions=marked(len(features)),
        fixed_point_regions=marked(len(fixed_points)),
    )


@pytest.mark.parametrize("suffix", MESH_FORMATS)
@settings(examples(30))
@given(mesh=meshes())
def test_random_meshes(suffix, mesh):
    """Kinds of data that a format holds come back exactly, and nothing keeps a mesh from being written and read."""
    stream = io.BytesIO()
    save(mesh, stream, file_format=suffix)
    read = load_mesh(io.BytesIO(stream.getvalue()), file_format=suffix)
    kinds = FULL[suffix]
    if not kinds:
        assert read.surface.n_faces == mesh.surface.n_faces
        return
    if suffix != ".obj" or not mesh.regions:
        np.testing.assert_array_equal(read.surface.faces, mesh.surface.faces)
    for kind in set(kinds) & {"point_data", "face_data", "corner_data"}:
        for name, values in getattr(mesh, kind).items():
            if suffix == ".obj" and (name != "uv" or mesh.regions):
                continue
            found = getattr(read, kind)[name]
            np.testing.assert_array_equal(found, values.reshape(len(values), *found.shape[1:]))
    if "regions" in kinds and mesh.regions and (mesh.regions["physical"].labels.any() or suffix not in MEDIT):
        found, given_ = read.regions["reference" if suffix in MEDIT else "physical"], mesh.regions["physical"]
        np.testing.assert_array_equal(found.labels, given_.labels)
        assert suffix in MEDIT or found.names == given_.names
    if "features" in kinds:
        assert {tuple(row) for row in np.sort(read.features).tolist()} == {
            tuple(row) for row in np.sort(mesh.features).tolist()
        }
    if "fixed_points" in kinds:
        assert read.fixed_points.tolist() == mesh.fixed_points.tolist()
    if suffix in (".ply", ".msh", *MEDIT, ".vtu", ".vtp"):
        division = "reference" if suffix in MEDIT else "physical"
        for of in ("feature_regions",) if suffix == ".ply" else ("feature_regions", "fixed_point_regions"):
            assert getattr(read, of).keys() == ({division} if getattr(mesh, of) else set())
            for given_ in getattr(mesh, of).values():
                np.testing.assert_array_equal(getattr(read, of)[division].labels, given_.labels)
                assert suffix in MEDIT or getattr(read, of)[division].names == given_.names


NAMES_ONLY = (".obj", ".stl", ".glb", ".3mf")


@pytest.mark.parametrize("suffix", sorted(set(MESH_FORMATS) - {".off"}))
@pytest.mark.parametrize("division", ["region", "material"])
@pytest.mark.parametrize("labels", [(1, 5, 9), (0, 1), (0,), (-3, 0), (-1, 2), (7,), (-1,)])
def test_regions_without_names_keep_their_numbers(suffix, division, labels):
    mesh = Mesh(surface=formats.SURFACE, regions={division: Regions(np.resize(labels, formats.N_FACES))})
    read, warnings = formats.round_trip(mesh, suffix)
    warnings = [text for text in warnings if suffix != ".3mf" or GREY not in text]
    if suffix in MEDIT and labels == (0,):  # no faces have references
        assert warnings == [f"stream: left out what MEDIT cannot hold: regions '{division}'"]
    else:
        assert warnings == []
        assert formats.regions_kept(mesh, read) == formats.EXACT
        assert not any(regions.names for regions in read.regions.values())


@pytest.mark.parametrize("suffix", NAMES_ONLY)
def test_names_and_numbers_in_one_division(suffix):
    labels = np.resize([1, 4, 7], formats.N_FACES)
    mesh = Mesh(surface=formats.SURFACE, regions={"part": Regions(labels, {4: "inlet", 7: "region_9"})})
    read, warnings = formats.round_trip(mesh, suffix)
    assert warnings == []
    (regions,) = read.regions.values()
    assert list(regions.names.values()) == ["inlet"]
    assert {1, 9} < set(regions.labels.tolist())  # a name such as ours stands for a number
    again, _ = formats.round_trip(read, suffix)
    assert formats.regions_kept(read, again) in (formats.EXACT, formats.NAMES)


ODD_NAMES = {1: ' two  blanks "and quotes"', 2: "it's\nin two lines", 3: '"', 4: "$EndComments", 5: "Wand 3 \u2028"}


@pytest.mark.parametrize("suffix", sorted(set(MESH_FORMATS) - {".off", *MEDIT}))
def test_odd_names_of_regions_are_kept_or_named(suffix):
    labels = np.resize(list(ODD_NAMES), formats.N_FACES)
    mesh = Mesh(surface=formats.SURFACE, regions={"my part": Regions(labels, ODD_NAMES)})
    read, warnings = formats.round_trip(mesh, suffix)
    (regions,) = read.regions.values()
    _, faces, _ = formats.by_corner(mesh)
    _, faces_read, _ = formats.by_corner(read)
    found = [regions.names.get(label) for label in regions.labels[faces_read]]
    expected = [ODD_NAMES[label] for label in labels[faces]]
    if found == expected:
        assert warnings == []
    else:
        assert len(warnings) == 1
        assert "some characters of" in warnings[0]
        assert suffix in (".obj", ".stl", ".vtu", ".vtp")
    if suffix in (".ply", ".vtu", ".vtp"):
        assert list(read.regions) == ["my part"]


@pytest.mark.parametrize("suffix", [".ply", ".vtu", ".vtp", ".msh"])
def test_regions_with_label_0_stay_regions_beside_others_and_edges(suffix):
    labels = np.arange(formats.N_FACES) % 2
    regions = {name: Regions(labels, {0: "none", 1: "all"}) for name in ("physical", "geometrical", "zone", "foo")}
    mesh = Mesh(surface=formats.SURFACE, regions=regions, features=formats.SURFACE.edges[:5])
    read, warnings = formats.round_trip(mesh, suffix)
    assert warnings == []
    assert set(read.regions) == set(regions)
    assert not read.face_data
    for each in read.regions.values():
        np.testing.assert_array_equal(each.labels, labels)
        assert each.names == {0: "none", 1: "all"}


@pytest.mark.parametrize("suffix", [".ply", ".vtu", ".vtp", ".msh", ".glb"])
def test_names_of_data_are_kept_or_named(suffix):
    names = ['of "one" point', "wall  shear", " in front"]
    values = np.arange(formats.N_POINTS, dtype=np.float32)
    read, warnings = formats.round_trip(Mesh(surface=formats.SURFACE, point_data=dict.fromkeys(names, values)), suffix)
    if suffix == ".msh":
        assert warnings == [
            "stream: left out what MSH cannot hold: some characters of 1 name(s) such as 'of \"one\" point'"
        ]
    else:
        assert warnings == []
        assert set(read.point_data) == set(names)


@pytest.mark.parametrize(
    ("kind", "way"),
    [
        ("numbers at points", ".ply .vtu .msh .vtp .ply"),
        ("vectors at faces", ".vtu .ply .msh .vtp"),
        ("texture coordinates at corners", ".obj .ply .glb .obj"),
        ("colours at points", ".ply .glb .vtu .ply .obj"),
        ("normals at points", ".ply .mesh .vtu .obj .glb .vtp"),
        ("regions with names", ".msh .vtu .ply .obj .stl .3mf .glb .vtp .msh"),
        ("feature edges", ".vtu .mesh .msh .ply .obj .vtp"),
        ("fixed points", ".vtu .mesh .msh .obj .vtp"),
    ],
)
def test_data_survive_a_way_through_formats(kind, way):
    mesh = formats.MESHES[kind]
    for suffix in way.split():
        mesh, warnings = formats.round_trip(mesh, suffix)
        assert [text for text in warnings if GREY not in text and METRES not in text] == []
    found = formats.kept(formats.MESHES[kind], mesh)
    assert found in (formats.EXACT, formats.ROUNDED, formats.NAMES)
    assert found != formats.NAMES or "regions" in kind


def test_values_survive_a_change_of_corner_order(tmp_path):
    """Polygons give their triangles the data of the face, and each corner its own."""
    rng = np.random.default_rng(0)
    sizes = rng.integers(3, 9, 40)
    points, lines, expected = [], [], []
    for k, size in enumerate(sizes.tolist()):
        angle = np.sort(rng.uniform(0, 2 * np.pi, size))
        radius = 1.0 if k % 2 else rng.uniform(0.2, 1.0, size)  # concave ones too
        points.append(np.column_stack([radius * np.cos(angle) + 3 * k, radius * np.sin(angle), 0 * angle]))
    points = np.concatenate(points)
    texture = rng.uniform(size=(len(points), 2))
    lines += ["v {!r} {!r} {!r}\n".format(*row) for row in points.tolist()]
    lines += ["vt {!r} {!r}\n".format(*row) for row in texture.tolist()]
    ends = [0, *np.cumsum(sizes).tolist()]
    for k, (first, end) in enumerate(pairwise(ends)):
        lines.append(f"g part{k}\nf " + " ".join(f"{n + 1}/{n + 1}" for n in range(first, end)) + "\n")
        expected += [f"part{k}"] * (end - first - 2)
    (tmp_path / "a.obj").write_text("".join(lines))
    mesh = load_mesh(tmp_path / "a.obj")
    np.testing.assert_array_equal(mesh.corner_data["uv"], texture[mesh.surface.faces])
    regions = mesh.regions["group"]
    assert [regions.names[label] for label in regions.labels] == expected


def test_reading_the_surface_alone_says_nothing_of_attributes(tmp_path, caplog):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/9 2/9 3/9\n"
    (tmp_path / "a.obj").write_text(text)
    assert load(tmp_path / "a.obj").n_faces == 1
    assert caplog.text == ""
    caplog.set_level(logging.WARNING)
    assert load_mesh(tmp_path / "a.obj").is_bare
    assert re.search("left out texture coordinates: a face refers to vt 9 of 1", caplog.text)


@pytest.mark.parametrize("suffix", [".vtu", ".vtp"])
def test_faces_in_one_region_0_keep_it_beside_regions_of_points_of_the_same_name(suffix):
    mesh = Mesh(
        surface=formats.SURFACE,
        regions={"physical": Regions(np.zeros(formats.N_FACES, dtype=np.int64))},
        fixed_points=np.array([0, 1, 3]),
        fixed_point_regions={"physical": Regions(np.array([1, 1, 0]))},
    )
    read, _ = formats.round_trip(mesh, suffix)
    assert not read.regions["physical"].labels.any()
    assert read.fixed_point_regions["physical"].labels.tolist() == [1, 1, 0]

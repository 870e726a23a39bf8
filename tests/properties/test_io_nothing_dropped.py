"""Each thing that a mesh can carry, in each format: it comes back from the file, or a warning names it."""

import numpy as np
import pytest
from test_io_attributes import formats

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS

SURFACE = formats.SURFACE
RNG = np.random.default_rng(0)
V, F = (SURFACE.n_points,), (SURFACE.n_faces,)
C = (SURFACE.n_faces, 3)


def values_of_all_kinds(shape):
    """Return arrays of every type, width and meaning, by name."""
    shares = RNG.random((*shape, 4))
    weights = np.round(shares / shares.sum(axis=-1, keepdims=True), 3)
    holes = RNG.normal(size=shape)
    holes[::5] = np.nan
    return {
        "real64": RNG.normal(size=shape) * 1e-30,
        "real32": RNG.normal(size=shape).astype(np.float32),
        "real16": RNG.normal(size=shape).astype(np.float16),
        "holes": holes,
        "infinite": np.where(holes > 0, np.inf, -np.inf),
        "huge": RNG.normal(size=shape) * 1e300,
        "int8": RNG.integers(-128, 127, shape, dtype=np.int8),
        "uint16": RNG.integers(0, 2**16 - 1, shape, dtype=np.uint16),
        "uint32": RNG.integers(2**31, 2**32 - 1, shape, dtype=np.uint32),
        "int64": RNG.integers(2**60, 2**62, shape),
        "uint64": RNG.integers(2**63, 2**64 - 1, shape, dtype=np.uint64),
        "bools": RNG.random(shape) > 0.5,
        "complex": RNG.normal(size=shape) + 1j,
        "text": np.array([f"Größe {k % 9}" for k in range(int(np.prod(shape)))]).reshape(shape),
        "empty": np.full(shape, ""),
        "bytes": np.full(shape, b"ab"),
        "pair": RNG.normal(size=(*shape, 2)),
        "five": RNG.normal(size=(*shape, 5)),
        "matrix": RNG.normal(size=(*shape, 3, 3)),
        "one": RNG.normal(size=(*shape, 1)),
        "color": RNG.random((*shape, 3)),
        "color1": RNG.integers(0, 255, (*shape, 4), dtype=np.uint8),
        "normal": formats.unit_vectors(*shape),
        "tangent": RNG.normal(size=(*shape, 4)),
        "uv": RNG.random((*shape, 3)),
        "uv1": RNG.random((*shape, 2)),
        "JOINTS_0": RNG.integers(0, 9, (*shape, 4)),
        "WEIGHTS_0": weights,
        "reference": RNG.integers(-5, 5, shape),
        "region": RNG.integers(0, 5, shape),
        "smoothing_group": RNG.integers(0, 5, shape),
        "attribute": RNG.integers(0, 5, shape, dtype=np.uint16),
        "Höhe²": RNG.normal(size=shape),
        'a"b<c>&d': RNG.normal(size=shape),
    }


def divisions():
    """Return divisions with labels and names of every kind, by name."""
    labels = np.sort(RNG.integers(0, 4, F))
    for name in ("physical", "geometrical", "material", "group", "object", "solid", "node", "reference", "own"):
        yield name, Regions(labels + 1, {1: "inlet", 3: "Wände"})
    yield "negative", Regions(labels - 2, {})
    yield "large", Regions(labels + 2**40, {})
    yield "odd", Regions(labels, {0: 'a "b" <c> & d', 1: "a\nb", 2: "#5", 3: "a"})
    yield "same", Regions(labels, {0: "a", 1: "a"})


EDGES, FIXED = SURFACE.edges[::4], np.arange(0, V[0], 3)


def marked_divisions():
    """Return meshes with divisions of features and of fixed points, some of which are in no region."""
    for name, regions in divisions():
        names = {label + (label >= 0): text for label, text in regions.names.items()}
        for field, rows in (("features", EDGES), ("fixed_points", FIXED)):
            labels = np.resize(np.unique(regions.labels), len(rows))
            labels = labels + (labels >= 0)
            labels[::5] = 0
            what = "features" if field == "features" else "fixed points"
            given = {field: rows, f"{field.removesuffix('s')}_regions": {name: Regions(labels, names)}}
            yield f"regions of {what} {name!r}", Mesh(surface=SURFACE, **given)


MATERIALS = {
    "own": object(),
    "trimesh": "not a table of materials",
    "unit": "inch",
    "field_data": {"time": np.array([0.5])},
    "gltf": {"materials": [{"name": "red", "emissiveFactor": [1, 0, 0]}, {"name": "blue"}]},
    "obj": {"mtllib": ("a.mtl",)},
    "texture_files": ("a.png",),
    "display_colours": {1: "#FF0000FF"},
}
SAID = {"gltf": "the properties emissiveFactor of materials", "obj": "their .mtl files were not read"}
TWO = {"material": Regions(np.arange(F[0]) % 2, {0: "red", 1: "blue"})}

CASES = [
    *((f"point data {n!r}", Mesh(surface=SURFACE, point_data={n: v})) for n, v in values_of_all_kinds(V).items()),
    *((f"face data {n!r}", Mesh(surface=SURFACE, face_data={n: v})) for n, v in values_of_all_kinds(F).items()),
    *((f"corner data {n!r}", Mesh(surface=SURFACE, corner_data={n: v})) for n, v in values_of_all_kinds(C).items()),
    *((f"regions {n!r}", Mesh(surface=SURFACE, regions={n: r})) for n, r in divisions()),
    *((f"materials {n!r}", Mesh(surface=SURFACE, regions=TWO, materials={n: v})) for n, v in MATERIALS.items()),
    ("feature edge", Mesh(surface=SURFACE, features=SURFACE.edges[::7])),
    ("fixed point", Mesh(surface=SURFACE, fixed_points=np.arange(0, V[0], 5))),
    *marked_divisions(),
]


def is_kept(mesh, read):
    """Return whether everything is in a mesh that was read: equal, or rounded to float32, colours to 8 bits."""
    names = {*mesh.point_data, *mesh.face_data, *mesh.corner_data}
    if not all(same(formats.values_at_corners(mesh, name), found_at_corners(read, name), name) for name in names):
        return False
    missing = mesh.materials.keys() - read.materials.keys()
    if missing and not (missing == {"display_colours"} and [1.0, 0.0, 0.0, 1.0] in colours_of_gltf(read)):
        return False
    for field in ("features", "fixed_points"):
        kind = f"{field.removesuffix('s')}_regions"
        given = [labelled(mesh, getattr(mesh, field), regions) for regions in getattr(mesh, kind).values()]
        found = [labelled(read, getattr(read, field), regions) for regions in getattr(read, kind).values()]
        if not all(any(same_labels(one, other) for other in found) for one in given):
            return False
    divisions = read.regions.values()
    return all(any(same_regions(mesh, given, read, found) for found in divisions) for given in mesh.regions.values())


def colours_of_gltf(read):
    """Return the colours of materials of glTF, into which the ones of 3MF are converted."""
    given = read.materials.get("gltf", {}).get("materials", [])
    return [one["pbrMetallicRoughness"].get("baseColorFactor") for one in given if "pbrMetallicRoughness" in one]


def found_at_corners(read, name):
    """Return the data with a name at all corners: integers may be regions, and quotes are not in names of Gmsh."""
    for key in (name, plain(name)):
        if key in read.regions:
            return read.regions[key].labels[formats.by_corner(read)[1]]
        found = formats.values_at_corners(read, key)
        if found is not None:
            return found
    return None


def same(values, found, name):
    """Return whether values are equal, in whatever type and shape, or rounded."""
    if found is None:
        return False
    if name == "color" and found.dtype == np.uint8:
        return np.abs(255 * values - found[:, :3]).max() <= 0.5
    if values.size != found.size:
        return False
    found = found.reshape(values.shape)
    if values.dtype.kind in "SUc":
        return bool(np.array_equal(values.astype(found.dtype), found))
    exact = values.dtype.kind in "iu" and found.dtype.kind in "iu"
    absolute = 1e-6 if name.startswith("uv") else 1e-36
    return bool((values == found).all()) if exact else np.allclose(values, found, 1e-6, absolute, equal_nan=True)


def same_regions(mesh, given, read, found):
    """Return whether the faces are divided alike, and regions that have names still have them, in one line."""
    labels = given.labels[formats.by_corner(mesh)[1]], found.labels[formats.by_corner(read)[1]]
    pairs = np.unique(np.stack(labels), axis=1).T.tolist()
    texts = [(plain(given.names.get(a, "")), plain(found.names.get(b, ""))) for a, b in pairs]
    one_to_one = len(pairs) == len(np.unique(labels[0])) == len(np.unique(labels[1]))
    return one_to_one and all(text in (name, name.rpartition("_")[0]) for text, name in texts if text)


def labelled(mesh, rows, regions):
    """Return label and name by place of features or fixed points that are in a region."""
    found = {}
    for row, label in zip(rows, regions.labels.tolist(), strict=True):
        if label:
            found[formats.place(mesh, row)] = label, plain(regions.names.get(label, ""))
    return found


def same_labels(given, found):
    """Return whether the same places are in the same regions, and these still have their names, if any, in one line."""
    if given.keys() != found.keys():
        return False
    pairs = {(*given[key], *found[key]) for key in given}
    one_to_one = len(pairs) == len({label for label, *_ in pairs}) == len({label for _, _, label, _ in pairs})
    return one_to_one and all(text in ("", name, name.rpartition("_")[0]) for _, text, _, name in pairs)


def plain(text):
    return " ".join(text.replace('"', "'").split())


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_each_thing_comes_back_or_is_named(suffix):
    silent = []
    for what, mesh in CASES:
        read, warnings = formats.round_trip(mesh, suffix)
        if read.surface.n_faces != SURFACE.n_faces or not np.array_equal(
            formats.by_corner(read)[0], formats.by_corner(mesh)[0]
        ):
            silent.append(f"{what}: other triangles")
        elif what in ("feature edge", "fixed point"):
            if formats.kept(mesh, read) == formats.LOST and not any(what in text for text in warnings):
                silent.append(what)
        elif not is_kept(mesh, read) and not any(named(what, text) for text in warnings):
            silent.append(f"{what}: {warnings}")
    assert silent == []


def named(what, warning):
    """Return whether a warning names something by its name, or the names of its regions."""
    name = what.partition("'")[2].rstrip("'")
    return name in warning or (what.startswith("materials") and SAID.get(name, name) in warning)

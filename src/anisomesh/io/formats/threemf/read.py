"""3MF: a zip archive of XML models of triangles.

Format: https://github.com/3MFConsortium/spec_core/blob/master/3MF%20Core%20Specification.md.
"""

from __future__ import annotations

import io
import re
import zipfile
from array import array
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import UNIT
from anisomesh.io.carried import Carried, listed
from anisomesh.io.cells import SurfaceCells
from anisomesh.io.formats.region_names import also_named
from anisomesh.io.formats.threemf.extensions import check_required, check_resolution
from anisomesh.io.formats.threemf.properties import MATERIAL, OBJECT, TEXTURES, Properties
from anisomesh.io.formats.threemf.resources import CORE, NONE, Resources, integer_attributes, number, real_attributes
from anisomesh.io.formats.threemf.triangle_sets import TRIANGLE_SETS, SetsOfObjects, TriangleSet, take
from anisomesh.io.formats.units import OF_3MF
from anisomesh.io.formats.words import text_of
from anisomesh.io.polygons import Integers, PolygonSoup

ROOT = "3D/3dmodel.model"
MODEL_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
_SHAPES = {"beamlattice", "booleanshape", "levelset", "slicestack"}
_ENTRIES = tuple(f"m{row}{column}" for row in range(4) for column in range(3))  # of a transformation
_DEEPEST_COMPONENTS = 100
_MAX_OBJECTS = 100_000
_LARGEST_SHARE = 1_100  # uncompressed bytes per byte of an entry; zlib reaches 1,032


@dataclass
class _Object:
    """An object of a model: a mesh, or copies of other objects."""

    name: str = ""
    points: array[float] = field(default_factory=lambda: array("d"))
    faces: array[int] = field(default_factory=lambda: array("q"))
    properties: array[int] = field(default_factory=lambda: array("q"))  # group and three members, of each triangle
    default: tuple[int, int] = (NONE, NONE)  # group and member of triangles without
    components: list[tuple[tuple[str, str], str]] = field(default_factory=list)
    sets: list[TriangleSet] = field(default_factory=list)


@dataclass
class _Model:
    """A part of the archive with objects by number, and what is built of them."""

    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[tuple[str, str], str]] = field(default_factory=list)
    ignored: set[str] = field(default_factory=set)
    resources: Resources = field(default_factory=Resources)
    unit: str = OF_3MF


def read_3mf(data: bytes) -> PolygonSoup:
    """Read the objects that a 3MF archive builds, in their places, in its unit; all objects if it builds none."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except zipfile.BadZipFile as error:
        raise ValueError(f"truncated or malformed: it is not a zip archive as a 3MF file is ({error})") from None
    with archive:
        build = _Build(archive)
        root = build.model(_root_name(archive))
        items = root.items or [(("", other), "") for other in root.objects]
        for (path, other), transform in items:
            build.add((path or build.root, other), _matrix(transform), 0)
        remarks = [f"left out its {name}, which are not triangles" for name in sorted(build.ignored & _SHAPES)]
        hidden = build.not_built()
        if hidden:
            remarks.append(f"left out {len(hidden)} object(s) that it does not build: {listed(hidden)}")
        return build.cells.soup(np.concatenate(build.points), tuple(remarks), build.carry())


class _Build:
    """The objects that are built, collected from the parts of an archive."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self._models: dict[str, _Model] = {}
        self.root = ""
        self.cells = SurfaceCells()
        self.points: list[npt.NDArray[np.float64]] = [np.zeros((0, 3))]
        self.ignored: set[str] = set()
        self._built: set[tuple[str, str]] = set()
        self._empty: list[str] = []  # names of objects without triangles
        self._n_points = self._n_instances = 0
        self._properties, self._sets = Properties(), SetsOfObjects()

    def model(self, name: str) -> _Model:
        """Return a part of the archive; ValueError if it is missing or malformed."""
        name = name.lstrip("/")
        if name not in self._models:
            self._models[name] = _parse_model(_entry(self._archive, name), name)
            self.ignored |= self._models[name].ignored | self._models[name].resources.ignored
        self.root = self.root or name
        return self._models[name]

    def add(self, key: tuple[str, str], matrix: npt.NDArray[np.float64], depth: int) -> None:
        """Add an object, given by its part and number, moved by a matrix (4, 3) that is multiplied from the right."""
        self._n_instances += 1
        if depth > _DEEPEST_COMPONENTS or self._n_instances > _MAX_OBJECTS:
            raise ValueError("malformed: its objects contain each other")
        found = self.model(key[0]).objects.get(key[1])
        if found is None:
            raise ValueError(f"truncated or malformed: it has no object {key[1]!r} in {key[0]}")
        self._built.add((key[0].lstrip("/"), key[1]))
        for (path, other), transform in found.components:
            self.add((path or key[0], other), _product(_matrix(transform), matrix), depth + 1)
        if not found.faces and not found.components:
            self._empty.append(found.name)
        if found.faces:
            points = np.array(found.points, dtype=np.float64).reshape(-1, 3)
            faces: Integers = np.array(found.faces, dtype=np.int64).reshape(-1, 3)
            if faces.min() < 0 or faces.max() >= len(points):
                raise ValueError(f"a triangle of object {key[1]} refers to a point beyond its {len(points)} points")
            given = np.array(found.properties, dtype=np.int64).reshape(-1, 4)
            is_reflected = bool(np.linalg.det(matrix[:3]) < 0.0)
            resources = self.model(key[0]).resources
            self._properties.add(found.name, given, found.default, resources, inverted=is_reflected)
            self._sets.add(found.sets, len(faces))
            if is_reflected:
                faces = faces[:, ::-1]  # a reflection turns triangles inside out
            self.cells.add("triangle", faces + self._n_points)
            moved = points if (matrix == np.eye(4, 3)).all() else points @ matrix[:3] + matrix[3]
            self.points.append(moved)
            self._n_points += len(points)

    def not_built(self) -> list[str]:
        """Return the names, or numbers, of objects with triangles that are not built."""
        objects = [((part, key), found) for part, model in self._models.items() for key, found in model.objects.items()]
        return [
            repr(each.name) if each.name else key[1] for key, each in objects if each.faces and key not in self._built
        ]

    def carry(self) -> Carried:
        """Return everything besides triangles."""
        carried = Carried()
        also_named(carried, OBJECT, self._empty)
        groups = [group for model in self._models.values() for group in model.resources.materials.values()]
        also_named(carried, MATERIAL, (name for group in groups for name, _ in group))
        for path, label in self._properties.carry(carried).items():
            with carried.optional(f"the image of the texture {path!r}"):
                carried.materials[TEXTURES][label]["data"] = _entry(self._archive, path)
        self._sets.carry(carried)
        carried.materials[UNIT] = self.model(self.root).unit
        others = sorted(self.ignored - _SHAPES)
        if others:
            carried.remarks.append(f"left out its {', '.join(others)}")
        return carried


def _root_name(archive: zipfile.ZipFile) -> str:
    """Return the name of the part where the model begins."""
    if "_rels/.rels" in archive.namelist():
        for element in re.findall(rb"<[\w:]*Relationship\s[^>]*>", _entry(archive, "_rels/.rels")):
            target = re.search(rb"Target\s*=\s*[\"']([^\"']+)", element)
            if target and MODEL_TYPE.encode() in element:
                return text_of(target[1]).lstrip("/")
    return ROOT


def _entry(archive: zipfile.ZipFile, name: str) -> bytes:
    try:
        info = archive.getinfo(name)
        if info.file_size > _LARGEST_SHARE * (info.compress_size + 1):
            raise ValueError(f"malformed: {name} declares {info.file_size} bytes in {info.compress_size}")
        return archive.read(info)
    except KeyError:
        raise ValueError(f"truncated or malformed: the archive has no {name}") from None


def _parse_model(text: bytes, name: str) -> _Model:
    model, current, namespaces = _Model(), _Object(), dict[str, str]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal current
        namespace, _, local = tag.rpartition(" ")
        if namespace == TRIANGLE_SETS:
            take(current.sets, local, attributes)
        elif namespace != CORE:
            model.resources.take(namespace, local, attributes)
            if local in _SHAPES:
                model.ignored.add(local)
        elif local == "vertex":
            current.points.extend(real_attributes(attributes, "x", "y", "z"))
        elif local == "triangle":
            current.faces.extend(integer_attributes(attributes, "v1", "v2", "v3"))
            current.properties.extend(number(attributes.get(key, "")) for key in ("pid", "p1", "p2", "p3"))
        elif local == "object":
            check_resolution(attributes)
            current = model.objects.setdefault(attributes["id"], _Object())
            current.name = attributes.get("name", "")
            current.default = (number(attributes.get("pid", "")), number(attributes.get("pindex", "")))
        elif local == "model":
            check_required(attributes.get("requiredextensions", ""), namespaces)
            model.unit = attributes.get("unit", model.unit)
        elif local in ("component", "item"):
            path = next((value for key, value in attributes.items() if key.endswith(" path")), "")
            placed = (path, attributes["objectid"]), attributes.get("transform", "")
            (current.components if local == "component" else model.items).append(placed)
        else:
            model.resources.take(namespace, local, attributes)

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = start
    parser.StartNamespaceDeclHandler = lambda prefix, uri: namespaces.setdefault(prefix or "", uri or "")
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"truncated or malformed: {name}: {error}") from None
    except KeyError as error:
        raise ValueError(f"malformed: {name}: line {parser.CurrentLineNumber} lacks the attribute {error}") from None
    except ValueError as error:
        raise ValueError(f"{name}: line {parser.CurrentLineNumber}: {error}") from None
    return model


def _matrix(text: str) -> npt.NDArray[np.float64]:
    """Return a transformation (4, 3) that is multiplied from the right."""
    if not text:
        return np.eye(4, 3)
    words = text.split()
    if len(words) != 12:
        raise ValueError(f"malformed: a transformation has {len(words)} numbers; expected 12")
    numbers = real_attributes(dict(zip(_ENTRIES, words, strict=True)), *_ENTRIES)
    return np.array(numbers, dtype=np.float64).reshape(4, 3)


def _product(first: npt.NDArray[np.float64], then: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    product: npt.NDArray[np.float64] = first @ then[:3]
    product[3] += then[3]
    return product

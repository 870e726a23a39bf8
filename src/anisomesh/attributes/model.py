"""A surface with everything that is given at its points, faces and corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeEnds
from anisomesh.errors import MeshError
from anisomesh.mesh.html import html_table
from anisomesh.mesh.surface import Surface

UNIT = "unit"
"""Key of the unit of length among the materials of a mesh."""

_KINDS = "biufcSU"  # of dtypes: bools, integers, real and complex numbers, strings

Array = npt.NDArray[Any]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Regions:
    """A division of the faces of a surface into regions, or of prescribed edges or fixed points.

    Attributes
    ----------
    labels
        Label of the region of each face (F,), any integers; of edges or points (n,), with 0 for none.
    names
        Names of labels, for the ones that have one.

    Raises
    ------
    MeshError
        If labels are not integers, or names are not a dictionary of names by label.
    """

    labels: Ints
    names: Mapping[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "labels", _whole_numbers("region labels", self.labels))
        object.__setattr__(self, "names", _names_of_labels(self.names))


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh:
    """A surface with everything that a file can say of it.

    Attributes
    ----------
    surface
        Points and faces.
    point_data, face_data
        Arrays by name, with one row for each point (V, ...) or face (F, ...): bools, numbers or strings.
    corner_data
        Arrays by name with a row for each corner of each face (F, 3, ...), such as texture coordinates and normals,
        which may differ between the faces at a point. No name is in ``point_data`` too.
    regions
        Divisions of the faces by name: the physical groups of Gmsh, the groups and materials of an OBJ file, the solids
        of STL.
    features
        Edges that stay edges, as pairs of points (n, 2).
    fixed_points
        Points at which there stays a point (n,).
    fixed_faces
        Faces that stay as they are (n,), such as required triangles of MEDIT.
    feature_regions, fixed_point_regions
        Divisions of the features, and of the fixed points, by name: the physical curves and points of Gmsh, the
        references of edges in MEDIT. The label of edges and points in no region is 0.
    materials
        Anything that belongs to the mesh as a whole or to regions, by name. It is handed on as it is.

    Raises
    ------
    MeshError
        If an array has the wrong length or a type that cannot be carried, or points of features are out of range.

    Notes
    -----
    Arrays are copied and read-only.
    """

    surface: Surface
    point_data: Mapping[str, Array] = field(default_factory=dict)
    face_data: Mapping[str, Array] = field(default_factory=dict)
    corner_data: Mapping[str, Array] = field(default_factory=dict)
    regions: Mapping[str, Regions] = field(default_factory=dict)
    features: EdgeEnds = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    fixed_points: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    fixed_faces: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    feature_regions: Mapping[str, Regions] = field(default_factory=dict)
    fixed_point_regions: Mapping[str, Regions] = field(default_factory=dict)
    materials: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.surface, Surface):
            raise MeshError(f"surface is of type {type(self.surface).__name__}; expected a Surface")
        n_points, n_faces = self.surface.n_points, self.surface.n_faces
        shapes = {"point_data": (n_points,), "face_data": (n_faces,), "corner_data": (n_faces, 3)}
        for data, shape in shapes.items():
            given = self._mapping(data)
            object.__setattr__(self, data, {name: _checked(f"{data}[{name!r}]", given[name], shape) for name in given})
        both = sorted(set(self.point_data) & set(self.corner_data))
        if both:
            raise MeshError(f"{both[0]!r} is in point_data and in corner_data; give them different names")
        object.__setattr__(self, "materials", self._mapping("materials"))
        object.__setattr__(self, "features", _points_of("features", self.features, n_points, 2))
        object.__setattr__(self, "fixed_points", _points_of("fixed_points", self.fixed_points, n_points, 1))
        object.__setattr__(self, "fixed_faces", _points_of("fixed_faces", self.fixed_faces, n_faces, 1, "face"))
        counts = {
            "regions": n_faces,
            "feature_regions": len(self.features),
            "fixed_point_regions": len(self.fixed_points),
        }
        for what, count in counts.items():
            object.__setattr__(self, what, self._divisions(what, count))

    def _mapping(self, what: str) -> dict[str, Any]:
        """Return a field by name, or an error unless it is a mapping with names for keys."""
        given = getattr(self, what)
        if not isinstance(given, Mapping):
            raise MeshError(f"{what} is of type {type(given).__name__}; expected a dictionary of names")
        wrong = [name for name in given if not isinstance(name, str)]
        if wrong:
            raise MeshError(f"{what} has the name {wrong[0]!r} of type {type(wrong[0]).__name__}; expected a string")
        return dict(given)

    def _divisions(self, what: str, count: int) -> dict[str, Regions]:
        """Return divisions by name, or an error unless they are divisions of a number of faces, edges or points."""
        given = self._mapping(what)
        for name, regions in given.items():
            if not isinstance(regions, Regions):
                kind = type(regions).__name__
                raise MeshError(f"{what}[{name!r}] is of type {kind}; expected Regions(labels, names)")
            if regions.labels.shape != (count,):
                row = {"regions": "face of the surface", "feature_regions": "feature"}.get(what, "fixed point")
                raise MeshError(
                    f"{what}[{name!r}].labels has shape {regions.labels.shape}; expected ({count},), a label for each "
                    f"{row}"
                )
        return given

    def __repr__(self) -> str:
        names = {f.name: len(getattr(self, f.name)) for f in fields(self) if f.name != "surface"}
        carried = ", ".join(f"{count:,} {name}" for name, count in names.items() if count)
        return f"Mesh({self.surface!r}{', ' * bool(carried)}{carried})"

    def _repr_html_(self) -> str:
        rows = [("points", f"{self.surface.n_points:,}"), ("faces", f"{self.surface.n_faces:,}")]
        for f in fields(self):
            given = getattr(self, f.name)
            if f.name != "surface" and len(given):
                text = ", ".join(given) if isinstance(given, Mapping) else f"{len(given):,}"
                rows.append((f.name.replace("_", " "), text))
        return html_table("Mesh", rows)

    @property
    def is_bare(self) -> bool:
        """Whether the mesh carries nothing besides its surface and a unit of length."""
        carried = (f.name for f in fields(self) if f.name not in ("surface", "materials"))
        return not self.materials.keys() - {UNIT} and not any(len(getattr(self, name)) for name in carried)

    def in_unit_of(self, other: Mesh) -> Mesh:
        """Return the mesh with the unit of length of another one, if that has any."""
        unit = {name: one for name, one in other.materials.items() if name == UNIT}
        return replace(self, materials={**self.materials, **unit}) if unit else self

    @cached_property
    def parts(self) -> Ints:
        """Number of the part of each face (F,): faces are in one part if they are in the same region of each division.

        Parts are numbered from 0 in the order of their labels.
        """
        if not self.regions:
            return np.zeros(self.surface.n_faces, dtype=np.int64)
        labels = np.stack([self.regions[name].labels for name in sorted(self.regions)], axis=1)
        return np.unique(labels, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)

    @cached_property
    def part_labels(self) -> dict[str, Ints]:
        """Label of each part, (P,), in each division."""
        first = np.unique(self.parts, return_index=True)[1]
        return {name: regions.labels[first] for name, regions in self.regions.items()}


def _checked(name: str, values: Any, shape: tuple[int, ...]) -> Array:
    """Return values as a read-only array, or an error unless they can be carried and begin with a shape."""
    try:
        array = np.array(values)
    except ValueError as error:
        raise MeshError(f"{name} has rows of different lengths ({error})") from error
    if array.dtype.kind not in _KINDS:
        raise MeshError(f"{name} has dtype {array.dtype}; expected bools, numbers or strings")
    if array.shape[: len(shape)] != shape:
        expected = ", ".join(map(str, shape))
        of_what = {1: "a row for each point or face", 2: "a row for each corner of each face"}[len(shape)]
        raise MeshError(f"{name} has shape {array.shape}; expected ({expected}, ...), {of_what} of the surface")
    if 0 in array.shape[len(shape) :]:
        raise MeshError(f"{name} has shape {array.shape}, so its rows are empty; leave it out")
    array.flags.writeable = False
    return array


def _whole_numbers(name: str, values: Any) -> Ints:
    """Return values as read-only integers, or an error unless they are."""
    array = np.asarray(values)
    if array.size == 0:
        array = array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise MeshError(f"{name} have dtype {array.dtype}; expected integers")
    if array.dtype.kind == "u" and array.size and array.max() > np.iinfo(np.int64).max:
        raise MeshError(f"{name} has {array.max()}; expected at most {np.iinfo(np.int64).max}, which is int64")
    array = array.astype(np.int64)
    array.flags.writeable = False
    return array


def _names_of_labels(names: Any) -> dict[int, str]:
    """Return names by label, or an error unless they are given by integers."""
    expected = "expected a dictionary of names by label, such as {1: 'inlet'}"
    try:
        given = dict(names)
    except (TypeError, ValueError) as error:
        raise MeshError(f"names of regions are of type {type(names).__name__}; {expected}") from error
    found = {}
    for label, name in given.items():
        try:
            number = int(label)
        except (TypeError, ValueError, OverflowError):
            number = None
        if number is None or number != label:
            raise MeshError(f"names of regions have the label {label!r}, which is not an integer; {expected}")
        found[number] = str(name)
    return found


def _points_of(name: str, values: Any, count: int, width: int, what: str = "point") -> Ints:
    """Return points or faces as (n,) or (n, 2) read-only integers, or an error unless the surface has them."""
    array = _whole_numbers(name, values)
    if array.size == 0:
        array = np.zeros((0, 2) if width == 2 else (0,), dtype=np.int64)
    if array.shape[1:] != ((2,) if width == 2 else ()) or array.ndim == 0:
        expected = "(n, 2), two points for each edge" if width == 2 else f"(n,), a {what} each"
        raise MeshError(f"{name} has shape {array.shape}; expected {expected}")
    wrong = np.flatnonzero((array < 0) | (array >= count))
    if len(wrong):
        raise MeshError(
            f"{name} has the {what} {array.ravel()[wrong[0]]}; expected 0 to {count - 1} since there are {count} "
            f"{what}s"
        )
    array.flags.writeable = False
    return array

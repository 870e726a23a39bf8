"""What a format can hold of a mesh, and what is left out of a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import NORMAL, Array, Integers
from anisomesh.mesh.surface import Surface

_PREFERRED = ("physical", "material", "group", "object", "solid", "node", "reference")  # divisions, if one is kept


OF_FEATURES, OF_FIXED_POINTS = "regions of feature edges", "regions of fixed points"
"""What a warning calls divisions of features and of fixed points."""

EMPTY_REGIONS = "names of regions with nothing in them,"
"""What a warning calls names of labels that no face, edge or point has."""

TOO_LARGE = "whose integers are too large for float64"
"""Why integers of 64 bits are left out."""

_LARGEST_EXACT = 2**53 - 1  # up to it every integer has a float64 of its own


class Losses:
    """Collects what a format cannot hold, for one warning."""

    def __init__(self) -> None:
        self._names: dict[str, list[str]] = {}
        self._reasons: dict[tuple[str, str], str] = {}
        self._others: list[str] = []
        self._changed: list[str] = []
        self._renamed: list[tuple[str, str]] = []

    def add(self, what: str, *names: str) -> None:
        """Add data of a kind, such as point data, with these names."""
        if names:
            self._names.setdefault(what, []).extend(name for name in names if name not in self._names.get(what, []))

    def because(self, what: str, name: str, reason: str) -> None:
        """Add data of a kind with the reason why these values are not held."""
        self.add(what, name)
        self._reasons[what, name] = reason

    def say(self, what: str) -> None:
        """Add something else."""
        self._others.append(what)

    def changed(self, name: str) -> None:
        """Add a name that is written with other characters."""
        self._changed.append(name)

    def renamed(self, name: str, text: str) -> None:
        """Add a name that another region has too, and the text that is written for it."""
        self._renamed.append((name, text))

    def features(self, mesh: Mesh) -> None:
        """Add the features and fixed points of a mesh, and their divisions."""
        if len(mesh.features):
            self.say(f"{len(mesh.features)} feature edge(s)")
        if len(mesh.fixed_points):
            self.say(f"{len(mesh.fixed_points)} fixed point(s)")
        self.fixed_faces(mesh)
        self.divisions_of_features(mesh)

    def fixed_faces(self, mesh: Mesh) -> None:
        """Add the fixed faces of a mesh."""
        if len(mesh.fixed_faces):
            self.say(f"{len(mesh.fixed_faces)} fixed face(s)")

    def divisions_of_features(self, mesh: Mesh) -> None:
        """Add the divisions of the features and fixed points of a mesh."""
        self.add(OF_FEATURES, *mesh.feature_regions)
        self.add(OF_FIXED_POINTS, *mesh.fixed_point_regions)

    def names_of_regions(self, mesh: Mesh, *divisions: str) -> None:
        """Add the names of the regions of divisions that have names."""
        self.add("names of regions", *(name for name in divisions if mesh.regions[name].names))

    def text(self) -> str:
        """Return everything in one line, empty if nothing is left out."""
        parts = []
        for what, names in self._names.items():
            parts += [f"{what} without a name"] if "" in names and not what.startswith("names of ") else []
            plain = [repr(name) for name in names if name and (what, name) not in self._reasons]
            parts += [f"{what} {', '.join(plain)}"] if plain else []
            parts += [f"{what} {name!r}, {why}" for name in names if name and (why := self._reasons.get((what, name)))]
        if self._changed:
            parts.append(f"some characters of {len(self._changed)} name(s) such as {self._changed[0]!r}")
        if self._renamed:
            name, text = self._renamed[0]
            parts.append(f"equal names of {len(self._renamed)} region(s) such as {name!r}, which is {text!r} there")
        return "; ".join([*parts, *self._others])


def without_unnamed(mesh: Mesh, losses: Losses, *, divisions: bool = False) -> Mesh:
    """Return a mesh without data that have no name, which no format holds; without such divisions too if asked for."""
    kinds = {"point_data": "point data", "face_data": "face data", "corner_data": "corner data"}
    if divisions:
        kinds |= {"regions": "regions", "feature_regions": OF_FEATURES, "fixed_point_regions": OF_FIXED_POINTS}
    for kind, what in kinds.items():
        given = getattr(mesh, kind)
        if "" in given:
            losses.add(what, "")
            changes: dict[str, Any] = {kind: {name: values for name, values in given.items() if name}}
            mesh = replace(mesh, **changes)
    return mesh


def numeric(data: Mapping[str, Array], what: str, losses: Losses) -> dict[str, Array]:
    """Return the arrays of real numbers, of types that files have: bools as bytes, odd floats as float32 or float64."""
    kept = {}
    for name, values in data.items():
        kind, size = values.dtype.kind, values.dtype.itemsize
        if kind not in "biuf" or values.size == 0:
            losses.add(what, name)
        elif kind == "b":
            kept[name] = values.astype(np.uint8)
        elif kind == "f" and size not in (4, 8):
            kept[name] = values.astype(np.float32 if size == 2 else np.float64)
        else:
            kept[name] = values
    return kept


def is_exact_in_float64(values: Array) -> bool:
    """Return whether float64 holds numbers exactly: all but large integers of 64 bits."""
    if values.dtype.kind not in "iu" or values.dtype.itemsize < 8:
        return True
    return max(-int(values.min()), int(values.max())) <= _LARGEST_EXACT


def flat_rows(values: Array) -> Array:
    """Return an array as (n,) or (n, k)."""
    return values if values.ndim == 1 else values.reshape(len(values), -1)


def main_division(regions: Mapping[str, Regions], *preferred: str) -> tuple[str, Regions] | None:
    """Return the division for a format that holds one: one of these names, else the most telling one."""
    wanted = (*preferred, *_PREFERRED, *sorted(regions))
    return next(((name, regions[name]) for name in wanted if name in regions), None)


def held_division(
    regions: Mapping[str, Regions], what: str, losses: Losses, *preferred: str, with_names: bool = False
) -> Regions | None:
    """Return the one division of features or fixed points that a format holds, if any has a label; others are lost.

    Parameters
    ----------
    regions
        All divisions.
    what
        :data:`OF_FEATURES` or :data:`OF_FIXED_POINTS`.
    losses
        What is lost is added here.
    preferred
        Names of divisions as for :func:`main_division`.
    with_names
        Whether the format holds names.
    """
    given = {name: division for name, division in regions.items() if division.labels.any()}
    found = main_division(given, *preferred)
    losses.add(what, *(name for name in given if found is None or name != found[0]))
    if found is not None and found[1].names and not with_names:
        losses.add(f"names of {what}", found[0])
    return None if found is None else found[1]


def by_label(*labels: Integers) -> list[tuple[tuple[int, ...], Integers]]:
    """Return the faces (n,) with each combination of labels (F,), in the order of the labels."""
    order = np.lexsort(labels[::-1])
    table = np.stack(labels, axis=1)[order]
    begin = np.flatnonzero((np.diff(table, axis=0, prepend=table[:1] - 1) != 0).any(axis=1))
    keys = [tuple(row) for row in table[begin].tolist()]
    return list(zip(keys, np.split(order.astype(np.int64), begin[1:]), strict=True))


def has_direction(normals: Array) -> npt.NDArray[np.bool_]:
    """Return which vectors (..., k) are finite and have a length; normals that are missing are NaN or zero."""
    return np.asarray(np.isfinite(normals).all(axis=-1) & normals.any(axis=-1))


def share_not_finite(rows: Array, where: str) -> str:
    """Return why data (n, k) are left out that are not finite at some points or corners, empty if they are finite."""
    lacking = ~np.isfinite(rows).all(axis=1)
    if not lacking.any():
        return ""
    what = "NaN" if np.isnan(rows[lacking]).any() else "infinite"
    return f"which are {what} at {np.count_nonzero(lacking):,} of {len(rows):,} {where}"


def with_all_normals(mesh: Mesh, losses: Losses) -> Mesh:
    """Return a mesh with a normal wherever some are given, for formats that have one everywhere or none.

    The ones that are missing are the ones of the faces; how many points or corners of faces lack one is added to the
    losses.
    """
    surface = mesh.surface
    for where, data in (("points", mesh.point_data), ("corners", mesh.corner_data)):
        given = data.get(NORMAL)
        if given is None or given.dtype.kind != "f" or given.shape[-1] != 3 or given.ndim != 2 + (where == "corners"):
            continue
        has = has_direction(given)
        if has.all() or not has.any():
            continue
        at_points = where == "points"
        computed = surface.point_normals if at_points else np.repeat(surface.face_normals[:, None], 3, axis=1)
        computed = np.where(has_direction(computed)[..., None], computed, np.array([0.0, 0.0, 1.0]))
        used = np.isin(np.arange(surface.n_points), surface.faces) if at_points else np.ones_like(has)
        if (count := np.count_nonzero(used & ~has)) > 0:
            n_used = np.count_nonzero(used)
            losses.say(f"missing normals at {count:,} of {n_used:,} {where}, which get the ones of faces")
        filled = {**data, NORMAL: np.where(has[..., None], given, computed.astype(given.dtype))}
        mesh = replace(mesh, point_data=filled) if at_points else replace(mesh, corner_data=filled)
    return mesh


def continuous_corner_data(mesh: Mesh, losses: Losses) -> dict[str, Array]:
    """Return the corner data that are the same in all faces at each point as point data; the others are lost."""
    kept = {}
    points = mesh.surface.faces.ravel()
    for name, values in mesh.corner_data.items():
        rows = values.reshape(len(points), *values.shape[2:])
        at_points = _blank(name, mesh.surface.n_points, values)
        at_points[points] = rows
        same = at_points[points] == rows
        if values.dtype.kind in "fc":
            same |= np.isnan(at_points[points]) & np.isnan(rows)
        if same.all():
            kept[name] = at_points
        else:
            losses.add("corner data", name)
    return kept


def _blank(name: str, count: int, values: Array) -> Array:
    """Return rows (count, ...) for corner data (F, 3, ...) at points that no face uses: 0, of normals NaN."""
    rows = np.zeros((count, *values.shape[2:]), dtype=values.dtype)
    if name == NORMAL and values.dtype.kind == "f":
        rows[:] = np.nan
    return rows


def distinct_corners(mesh: Mesh, chosen: Integers) -> tuple[Integers, Integers]:
    """Return the first corner ``3 f + c`` (n,) of each combination of a point and corner data in some faces.

    The second array is the number of the combination at each corner of these faces (m, 3). Combinations are in the
    order of their points.
    """
    corners = (3 * chosen[:, None] + np.arange(3)).ravel()
    columns = [mesh.surface.faces.astype(np.int64).ravel()[corners]]
    for values in mesh.corner_data.values():
        rows = values.reshape(mesh.surface.faces.size, -1)[corners]
        columns.append(np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1))
    _, first, number = np.unique(np.stack(columns, axis=1), axis=0, return_index=True, return_inverse=True)
    return corners[first], number.reshape(-1, 3).astype(np.int64)


def with_points_repeated(mesh: Mesh) -> tuple[Mesh, Integers]:
    """Return a mesh whose corner data are point data, since points are repeated where these differ.

    The second array is the point of the given mesh that each point is (V',). The points that there were come first, in
    their order, and features refer to them.
    """
    joined = continuous_corner_data(mesh, Losses())
    apart = {name: values for name, values in mesh.corner_data.items() if name not in joined}
    mesh = replace(mesh, point_data={**mesh.point_data, **joined}, corner_data=apart)
    own, faces = mesh.surface, mesh.surface.faces.astype(np.int64)
    if not apart:
        return mesh, np.arange(own.n_points)
    corners, numbers = distinct_corners(mesh, np.arange(own.n_faces))
    points = faces.ravel()[corners]
    is_first = np.diff(points, prepend=-1) > 0
    place = np.where(is_first, points, own.n_points - 1 + np.cumsum(~is_first))
    source = np.concatenate([np.arange(own.n_points), points[~is_first]])
    point_data = {name: values[source] for name, values in mesh.point_data.items()}
    for name, values in apart.items():
        rows = values.reshape(faces.size, *values.shape[2:])
        point_data[name] = _blank(name, len(source), values)
        point_data[name][place] = rows[corners]
    surface = Surface(own.points[source], place[numbers])
    return replace(mesh, surface=surface, point_data=point_data, corner_data={}), source


def regions_as_integers(mesh: Mesh, divisions: Sequence[str]) -> dict[str, Integers]:
    """Return the labels of divisions in the smallest of int32 and int64 that holds them."""
    return {name: narrowed(mesh.regions[name].labels) for name in divisions}


def narrowed(labels: Integers) -> Integers:
    """Return labels (n,) in the smallest of int32 and int64 that holds them."""
    return labels.astype(np.int32) if fits_int32(labels) else labels


def fits_int32(labels: Integers) -> bool:
    """Return whether int32 holds all labels (n,)."""
    limits = np.iinfo(np.int32)
    return len(labels) == 0 or bool(labels.min() >= limits.min and labels.max() <= limits.max)

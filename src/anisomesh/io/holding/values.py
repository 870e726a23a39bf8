"""Values that formats have: with names, of real numbers, finite."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import Array
from anisomesh.io.holding.losses import OF_FEATURES, OF_FIXED_POINTS, Losses

_LARGEST_EXACT = 2**53 - 1  # up to it every integer has a float64 of its own


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


def share_not_finite(rows: Array, where: str) -> str:
    """Return why data (n, k) are left out that are not finite at some points or corners, empty if they are finite."""
    lacking = ~np.isfinite(rows).all(axis=1)
    if not lacking.any():
        return ""
    what = "NaN" if np.isnan(rows[lacking]).any() else "infinite"
    return f"which are {what} at {np.count_nonzero(lacking):,} of {len(rows):,} {where}"

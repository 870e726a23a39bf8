"""Normals for formats that have one everywhere or none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.model import Mesh
from anisomesh.io.carried import NORMAL, Array
from anisomesh.io.holding.losses import Losses


def has_direction(normals: Array) -> npt.NDArray[np.bool_]:
    """Return which vectors (..., k) are finite and have a length; normals that are missing are NaN or zero."""
    return np.asarray(np.isfinite(normals).all(axis=-1) & normals.any(axis=-1))


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

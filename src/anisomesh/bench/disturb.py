"""Meshes with added noise or badly shaped triangles, as inputs of methods."""

from __future__ import annotations

import zlib

import numpy as np

from anisomesh.denoise.noise import with_noise
from anisomesh.errors import OptionError
from anisomesh.learn.data.retriangulate import with_random_triangles
from anisomesh.mesh.surface import Surface
from anisomesh.pipeline import remesh

CLEAN, STRETCHED, _NOISE_PREFIX = "clean", "stretched", "noise "


def check_disturbance(where: str, name: str) -> None:
    """Raise OptionError unless a name is ``clean``, ``stretched``, or ``noise`` and a size."""
    if name in (CLEAN, STRETCHED) or (name.startswith(_NOISE_PREFIX) and _noise_size(name) > 0.0):
        return
    raise OptionError(
        f"{where}: {name!r} is unknown; expected 'clean', 'stretched', or 'noise' and a size: 'noise 0.1'"
    )


def disturbed(surface: Surface, name: str, mesh: str) -> Surface:
    """Return a surface with added noise or with stretched triangles, reproducible for a name of the mesh.

    Parameters
    ----------
    surface
        The clean surface.
    name
        ``"clean"``, ``"stretched"``, or ``"noise SIZE"`` with a size in mean edge lengths.
    mesh
        Name of the mesh, the seed of the random numbers.
    """
    if name == CLEAN:
        return surface
    rng = np.random.default_rng(zlib.crc32(f"{mesh}, {name}".encode()))
    if name == STRETCHED:
        return with_random_triangles(surface, surface.n_points, rng, remesh)
    return with_noise(surface, _noise_size(name), rng)


def _noise_size(name: str) -> float:
    try:
        size = float(name.removeprefix(_NOISE_PREFIX))
    except ValueError:
        return 0.0
    return size if np.isfinite(size) else 0.0

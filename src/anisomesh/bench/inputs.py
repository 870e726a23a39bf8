"""The meshes of a suite: files of the data folder and procedural shapes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from anisomesh.bench.suite import Suite
from anisomesh.errors import OptionError
from anisomesh.io.meshes import load
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import sphere, torus, twisted_ring
from anisomesh.shapes.cad_part import cad_part

_RING_POINTS = 5_440  # of the twisted ring with 160 sections of 34 points
_PART_POINTS = 8_396  # of the machine part at resolution 24
_TORUS_POINTS = 6_000  # heuristic


@dataclass(frozen=True)
class Input:
    """A mesh by name, loaded from a file, or the procedural shape of this name if there is none."""

    name: str
    path: Path | None = None

    def make(self) -> Surface:
        """Return the mesh."""
        return make_shape(self.name) if self.path is None else load(self.path)


def inputs_of(suite: Suite, data: Path | None) -> list[Input]:
    """Return the meshes of a suite: files in the order of their names, then shapes.

    Parameters
    ----------
    suite
        The suite.
    data
        The folder of the mesh files; None if the suite has shapes only.

    Raises
    ------
    OptionError
        If the suite has patterns but there is no data folder, or a pattern matches no file.
    """
    found = []
    for pattern in suite.meshes:
        if data is None:
            raise OptionError(
                f"suite {suite.name} needs the meshes {pattern}; name their folder with --data or ANISOMESH_DATA"
            )
        paths = sorted(data.glob(pattern))
        if not paths:
            raise OptionError(f"suite {suite.name} needs the meshes {pattern}, and {data} has none of them")
        found += [Input(str(path.relative_to(data)), path) for path in paths]
    found += [Input(spec) for spec in suite.shapes]
    return list({entry.name: entry for entry in found}.values())


def make_shape(spec: str) -> Surface:
    """Return a procedural shape.

    Parameters
    ----------
    spec
        ``sphere:N``, ``ring:N`` or ``part:N`` with about N points, or ``torus:R`` whose curvature metric stretches
        triangles R times on the outer equator, as in the paper's synthetic test.

    Raises
    ------
    OptionError
        If the name is unknown or the number is out of range.
    """
    name, _, number = spec.partition(":")
    makers: dict[str, Callable[[float], Surface]] = {
        "sphere": lambda n: sphere(max(0, round(np.log(n / 10.0) / np.log(4.0)))),
        "ring": _ring,
        "part": lambda n: cad_part(max(2, round(24 * np.sqrt(n / _PART_POINTS)))),
        "torus": _stretched_torus,
    }
    try:
        value = float(number)
    except ValueError:
        value = np.nan
    if name not in makers or not value > 1.0:
        raise OptionError(f"shape {spec!r}; expected one of {', '.join(makers)}, a colon and a number above 1")
    return makers[name](value)


def _ring(n: float) -> Surface:
    finer = np.sqrt(n / _RING_POINTS)
    return twisted_ring(n_major=round(160 * finer), n_section=(round(12 * finer), round(5 * finer)))


def _stretched_torus(ratio: float) -> Surface:
    """Return a torus with (major + minor) / minor = ratio^2 and about square faces."""
    minor = 1.0 / (ratio**2 - 1.0)
    n_minor = max(12, round(np.sqrt(_TORUS_POINTS * minor)))
    return torus(1.0, minor, max(24, round(_TORUS_POINTS / n_minor)), n_minor)

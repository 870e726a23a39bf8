"""Write an energy term: keep cells thin in height, so that the mesh has nearly horizontal layers.

Usage: python examples/own_energy.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

import anisomesh
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring


@numba.njit
def height_spread(vertices: Any, site: Any, normal: Any, vertex_gradient: Any, site_gradient: Any) -> float:
    """Return the integral of (z - z of the site)^2 over a polygon, and add its derivatives to the gradients.

    The polygon is a fan of triangles (0, k, k + 1). On a triangle of area A, with heights a, b, c above the site and
    their sum s, the integral is A (a^2 + b^2 + c^2 + s^2) / 12.
    """
    total = 0.0
    for k in range(1, len(vertices) - 1):
        u, v = vertices[k] - vertices[0], vertices[k + 1] - vertices[0]
        uu, uv, vv = (u * u).sum(), (u * v).sum(), (v * v).sum()
        area = 0.5 * np.sqrt(max(uu * vv - uv * uv, 0.0))
        if area < 1e-30:
            continue
        a, b, c = vertices[0, 2] - site[2], vertices[k, 2] - site[2], vertices[k + 1, 2] - site[2]
        s = a + b + c
        mean = (a * a + b * b + c * c + s * s) / 12.0
        total += area * mean
        # the area changes with the corners ...
        for x in range(len(site)):
            by_u = mean * (vv * u[x] - uv * v[x]) / (4.0 * area)
            by_v = mean * (uu * v[x] - uv * u[x]) / (4.0 * area)
            vertex_gradient[k, x] += by_u
            vertex_gradient[k + 1, x] += by_v
            vertex_gradient[0, x] -= by_u + by_v
        # ... and the mean with their heights
        vertex_gradient[0, 2] += area * (a + s) / 6.0
        vertex_gradient[k, 2] += area * (b + s) / 6.0
        vertex_gradient[k + 1, 2] += area * (c + s) / 6.0
        site_gradient[2] -= area * 4.0 * s / 6.0
    return total


@dataclass(frozen=True)
class Layered:
    """The energy of the paper plus a multiple of the height spread of the cells.

    Attributes
    ----------
    weight
        Factor of the height spread: the larger, the flatter the triangles.
    """

    weight: float

    def evaluate(self, voronoi: anisomesh.RestrictedVoronoi, sites: np.ndarray) -> anisomesh.EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        base = anisomesh.NormalMetric(7.0).evaluate(voronoi, sites)
        term = anisomesh.energy_from_kernel(height_spread).evaluate(voronoi, sites)
        return anisomesh.EnergyValue(
            value=base.value + self.weight * term.value,
            gradient=base.gradient + self.weight * term.gradient,
            mass=base.mass,
            per_cell=base.per_cell + self.weight * term.per_cell,
        )


def main(out: str = "own_energy.png", n_vertices: int = 800) -> list[anisomesh.RemeshResult]:
    surface = anisomesh.sample("sphere")
    panels, results = [], []
    for energy in (Layered(0.0), Layered(15.0)):
        error = anisomesh.check_energy_gradient(energy)
        result = anisomesh.remesh(surface, n_vertices=n_vertices, metric="uniform", energy=energy, max_iterations=80)
        edges = np.abs(np.diff(result.surface.points[result.surface.edges], axis=1)[:, 0])
        note = f"mean edge: {edges[:, 2].mean():.3f} high, {np.hypot(*edges[:, :2].T).mean():.3f} wide"
        print(f"{energy}: gradient off by {error:.0e}; {note}")
        colouring = stretch_colouring(result.surface, high=4.0)
        panels.append(Panel(surface=result.surface, name=str(energy), note=note, colouring=colouring))
        results.append(result)
    gallery(panels, out, columns=2, options=PictureOptions(direction=(1.0, -0.6, 0.4), up=2, scale=2))
    return results


if __name__ == "__main__":
    main(*sys.argv[1:])

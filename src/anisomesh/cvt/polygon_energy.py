"""Energies from a user's function of a polygon."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba.core.errors import NumbaError

from anisomesh._arrays import Sites
from anisomesh._kernels.polygon_energy import integrate_polygons, is_compiled
from anisomesh.errors import OptionError
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi
from anisomesh.voronoi.shape_derivative import pull_back

PolygonFunction = Callable[[Any, Any, Any, Any, Any], float]
"""``function(vertices, site, normal, vertex_gradient, site_gradient) -> value``, see :func:`energy_from_kernel`."""


def energy_from_kernel(polygon_function: PolygonFunction) -> PolygonEnergy:
    """Return the energy that is the sum of a function over all polygons of the restricted Voronoi diagram.

    Parameters
    ----------
    polygon_function
        Compiled with ``numba.njit``; called as ``function(vertices, site, normal, vertex_gradient, site_gradient)``
        with

        - ``vertices`` (n, d): corners of a polygon, the part of a cell in one facet, counter-clockwise,
        - ``site`` (d,): the site of the cell,
        - ``normal`` (3,): unit normal of the facet in space,

        returns the value and adds its derivatives by vertices and site to ``vertex_gradient`` (n, d) and
        ``site_gradient`` (d,), which hold zeros. Embedding units; the first three coordinates are space.

    Raises
    ------
    OptionError
        If the function is not compiled.

    Notes
    -----
    The motion of the vertices with the sites is added here, so the gradient is exact also where the integrand jumps
    between cells. A density of the embedded surface multiplies the value on each facet. An evaluation writes the
    diagram and costs two to three times as much as the built-in energy.

    References
    ----------
    Compare ``IntegrationSimplex`` in geogram (Levy, Liu, TOG 2010).
    """
    if not is_compiled(polygon_function):
        raise OptionError("the polygon function is not compiled; decorate it with numba.njit")
    return PolygonEnergy(polygon_function)


@dataclass(frozen=True)
class PolygonEnergy:
    """The sum of a compiled function over the polygons of a diagram, see :func:`energy_from_kernel`."""

    function: PolygonFunction

    def evaluate(self, voronoi: RestrictedVoronoi, sites: Sites, /) -> EnergyValue:
        """Return the energy of sites (S, d), its gradient, and mass and energy of each cell."""
        diagram, embedded = voronoi.diagram(sites), voronoi.embedded
        n_polygons, dimension = len(diagram.site), embedded.dimension
        value, site_gradient = np.zeros(n_polygons), np.zeros((n_polygons, dimension))
        vertex_gradient = np.zeros((len(diagram.label), dimension))
        try:
            integrate_polygons(
                self.function,
                diagram.positions,
                diagram.offset,
                diagram.site,
                diagram.sites,
                embedded.facets.normal[diagram.facet],
                value,
                vertex_gradient,
                site_gradient,
            )
        except NumbaError as error:
            reason = " ".join(str(error).split())[:200]
            raise OptionError(f"the polygon function cannot be compiled for its five arguments: {reason}") from error
        if embedded.density is not None:
            weight = embedded.density[embedded.faces].mean(axis=1)[diagram.facet]
            value, site_gradient = weight * value, weight[:, None] * site_gradient
            vertex_gradient *= weight[diagram.polygon_of, None]
        gradient = pull_back(diagram, vertex_gradient)
        np.add.at(gradient, diagram.site, site_gradient)
        mass = diagram.fractions * embedded.weighted_facets.area[diagram.facet]
        n = len(diagram.sites)
        return EnergyValue(
            value=float(value.sum()),
            gradient=gradient,
            mass=np.bincount(diagram.site, mass, minlength=n).astype(np.float64),
            per_cell=np.bincount(diagram.site, value, minlength=n).astype(np.float64),
        )

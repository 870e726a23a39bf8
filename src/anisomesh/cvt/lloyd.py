"""Lloyd's algorithm on the embedded surface."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Sites
from anisomesh.voronoi.restricted import RestrictedVoronoi

OnIteration = Callable[[int, float], None]
"""Called with the number of iterations done and the energy."""


def lloyd(
    voronoi: RestrictedVoronoi,
    sites: Sites,
    iterations: int,
    on_iteration: OnIteration | None = None,
    *,
    fixed: npt.NDArray[np.bool_] | None = None,
) -> Sites:
    """Move every site to the centroid of its cell, a number of times; return the sites (S, d).

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Start positions (S, d).
    iterations
        Number of steps.
    on_iteration
        Called after every step.
    fixed
        Sites that stay where they are (S,).

    Notes
    -----
    A site with an empty cell, hidden by another at the same place, stays.

    References
    ----------
    Lloyd 1982; Du, Faber, Gunzburger, "Centroidal Voronoi tessellations", SIAM Review 1999.
    """
    for iteration in range(iterations):
        value = voronoi.integrate(sites)
        if fixed is not None:
            value.gradient[fixed] = 0.0
        sites = sites - divide_rows(value.gradient, 2.0 * value.mass)
        if on_iteration is not None:
            on_iteration(iteration + 1, value.value)
    return sites


def divide_rows(values: Sites, weights: npt.NDArray[np.float64]) -> Sites:
    """Divide rows (S, d) by weights (S,); rows of weight 0 become 0."""
    return np.asarray(np.divide(values, weights[:, None], out=np.zeros_like(values), where=weights[:, None] > 0.0))

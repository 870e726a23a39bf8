"""Integration of a user's function over the polygons of a diagram."""

import numba


@numba.njit(nogil=True)
def integrate_polygons(function, positions, offset, site, sites, normal, value, vertex_gradient, site_gradient):
    """Call a function for every polygon and write what it returns.

    ``positions`` (Q, d) are the vertices of the polygons, ``offset`` (P + 1,) the first of each, ``site`` (P,) and
    ``normal`` (P, 3) their site and the unit normal of their facet in space, ``sites`` (S, d) the positions of all
    sites. Writes ``value`` (P,), ``vertex_gradient`` (Q, d) and ``site_gradient`` (P, d), which hold zeros before.
    """
    for p in range(len(site)):
        first, last = offset[p], offset[p + 1]
        value[p] = function(
            positions[first:last], sites[site[p]], normal[p], vertex_gradient[first:last], site_gradient[p]
        )


def is_compiled(function: object) -> bool:
    """Return whether a function has been compiled with ``numba.njit``."""
    return isinstance(function, numba.core.registry.CPUDispatcher)

"""Functions of a polygon with their derivatives, whose sum over a diagram is known from elsewhere.

They write component by component: assignments of arrays take seconds to compile, for the text of their errors.
"""

import numba
import numpy as np


@numba.njit
def plain(vertices, site, normal, vertex_gradient, site_gradient):
    """Squared distance to the site, integrated exactly: the plain CVT energy."""
    total = 0.0
    for k in range(1, len(vertices) - 1):
        p, q, r = vertices[0] - site, vertices[k] - site, vertices[k + 1] - site
        u, v = q - p, r - p
        uu, uv, vv = (u * u).sum(), (u * v).sum(), (v * v).sum()
        area2 = uu * vv - uv * uv
        if area2 <= 0.0:
            continue
        area = 0.5 * np.sqrt(area2)
        s = p + q + r
        mean = ((p * p).sum() + (q * q).sum() + (r * r).sum() + (s * s).sum()) / 12.0
        total += area * mean
        for x in range(len(site)):
            du = mean * (vv * u[x] - uv * v[x]) / (4.0 * area)
            dv = mean * (uu * v[x] - uv * u[x]) / (4.0 * area)
            dp, dq, dr = area * (p[x] + s[x]) / 6.0, area * (q[x] + s[x]) / 6.0, area * (r[x] + s[x]) / 6.0
            vertex_gradient[0, x] += dp - du - dv
            vertex_gradient[k, x] += dq + du
            vertex_gradient[k + 1, x] += dr + dv
            site_gradient[x] -= dp + dq + dr
    return total


@numba.njit
def height(vertices, site, normal, vertex_gradient, site_gradient):
    """Area times squared height of the site over the plane in space: the normal part of the energy; it jumps."""
    h = ((vertices[0, :3] - site[:3]) * normal).sum()
    area = 0.0
    for k in range(1, len(vertices) - 1):
        u, v = vertices[k] - vertices[0], vertices[k + 1] - vertices[0]
        uu, uv, vv = (u * u).sum(), (u * v).sum(), (v * v).sum()
        area2 = uu * vv - uv * uv
        if area2 <= 0.0:
            continue
        part = 0.5 * np.sqrt(area2)
        area += part
        for x in range(len(site)):
            du = h * h * (vv * u[x] - uv * v[x]) / (4.0 * part)
            dv = h * h * (uu * v[x] - uv * u[x]) / (4.0 * part)
            vertex_gradient[0, x] -= du + dv
            vertex_gradient[k, x] += du
            vertex_gradient[k + 1, x] += dv
    for x in range(3):
        vertex_gradient[0, x] += 2.0 * area * h * normal[x]
        site_gradient[x] -= 2.0 * area * h * normal[x]
    return area * h * h


@numba.njit
def without_site_gradient(vertices, site, normal, vertex_gradient, site_gradient):
    """The plain energy with a derivative that is missing on purpose."""
    value = plain(vertices, site, normal, vertex_gradient, site_gradient)
    site_gradient[:] = 0.0
    return value

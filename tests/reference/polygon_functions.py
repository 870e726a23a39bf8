"""Functions of a polygon with their derivatives, whose sum over a diagram is known from elsewhere."""

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
        du, dv = mean * (vv * u - uv * v) / (4.0 * area), mean * (uu * v - uv * u) / (4.0 * area)
        dp, dq, dr = area * (p + s) / 6.0, area * (q + s) / 6.0, area * (r + s) / 6.0
        vertex_gradient[0] += dp - du - dv
        vertex_gradient[k] += dq + du
        vertex_gradient[k + 1] += dr + dv
        site_gradient -= dp + dq + dr
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
        du, dv = h * h * (vv * u - uv * v) / (4.0 * part), h * h * (uu * v - uv * u) / (4.0 * part)
        vertex_gradient[0] -= du + dv
        vertex_gradient[k] += du
        vertex_gradient[k + 1] += dv
    vertex_gradient[0, :3] += 2.0 * area * h * normal
    site_gradient[:3] -= 2.0 * area * h * normal
    return area * h * h


@numba.njit
def without_site_gradient(vertices, site, normal, vertex_gradient, site_gradient):
    """The plain energy with a derivative that is missing on purpose."""
    value = plain(vertices, site, normal, vertex_gradient, site_gradient)
    site_gradient[:] = 0.0
    return value

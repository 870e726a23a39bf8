"""Energy and gradient of the normal-metric CVT (NASM, section 3.3), accumulated over the cells on a chunk of facets.

Per polygon P of site i on a facet (area A, barycentric moments M1, M2, normal N, h_i = N . (v_a - x_i)):

    E      = area_f (W_i . M1 - sum |side|^2 M2) + (s^2 - 1) A h_i^2
    dE/dx_i = 2 A x_i - 2 sum_c M1_c v_c - 2 (s^2 - 1) A h_i [N; 0]
              + sum over bisector edges (i, j), length L, midpoint m:
                (s^2 - 1) (h_i^2 - h_j^2) L / |P_T (x_j - x_i)| (m - x_i)

The last sum is the motion of the cell boundaries: the normal part of the energy is discontinuous across a bisector,
because the diagram is Euclidean. |P_T (x_j - x_i)| is half the gradient, in the facet, of the linear form
l . (W_j - W_i). All vectors are combinations of x_i, the corners and N, so the dimension of the embedding occurs once
per polygon.
"""

import numpy as np

from .clip import BUFFER_TOO_SMALL, START_TOO_FAR, clip_facet
from .compiled import inlined, kernel


@inlined
def moments(vertex, start, end):
    """Return the area as a fraction of the facet, M1 (a, b, c) and M2 (bc, ca, ab) of a polygon."""
    area = 0.0
    ma = mb = mc = 0.0
    mbc = mca = mab = 0.0
    pa, pb, pc = vertex[start, 0], vertex[start, 1], vertex[start, 2]
    for k in range(start + 1, end - 1):
        qa, qb, qc = vertex[k, 0], vertex[k, 1], vertex[k, 2]
        ra, rb, rc = vertex[k + 1, 0], vertex[k + 1, 1], vertex[k + 1, 2]
        t = (qa - pa) * (rb - pb) - (qb - pb) * (ra - pa)
        sa, sb, sc = pa + qa + ra, pb + qb + rb, pc + qc + rc
        area += t
        ma += t * sa
        mb += t * sb
        mc += t * sc
        mbc += t * (pb * pc + qb * qc + rb * rc + sb * sc)
        mca += t * (pc * pa + qc * qa + rc * ra + sc * sa)
        mab += t * (pa * pb + qa * qb + ra * rb + sa * sb)
    return area, ma / 3.0, mb / 3.0, mc / 3.0, mbc / 12.0, mca / 12.0, mab / 12.0


@inlined
def height(facets, facet, positions, site):
    """Return h = N . (v_a - x), the signed distance of a site x from the plane of a facet."""
    corner = facets.faces[facet, 0]
    h = 0.0
    for k in range(3):
        h += facets.normal[facet, k] * (facets.points[corner, k] - positions[site, k])
    return h


@inlined
def boundary_rate(vertex, k, following, p, q, side2):
    """Return L / (2 A g) for the edge k to following of a polygon on a bisector: L its length, A the facet's area.

    g is the gradient in the facet of the linear form of the bisector, whose values at the corners b and c exceed the
    value at a by p and q.
    """
    da = vertex[following, 0] - vertex[k, 0]
    db = vertex[following, 1] - vertex[k, 1]
    dc = vertex[following, 2] - vertex[k, 2]
    length2 = -(db * dc * side2[0] + dc * da * side2[1] + da * db * side2[2])
    # 4 area^2 |gradient|^2 from the differences p and q along the sides ab (side2[2]) and ac (side2[1])
    slope2 = p * p * side2[1] - p * q * (side2[1] + side2[2] - side2[0]) + q * q * side2[2]
    if length2 <= 0.0 or slope2 <= 0.0:
        return 0.0
    return np.sqrt(length2 / slope2)


@inlined
def _boundary_motion(ws, k, following, i, j, jump, side2, area):
    """Return the coefficient of (m - x_i) for the bisector edge k to following between slots i and j."""
    p = (ws.table[j, 1] - ws.table[i, 1]) - (ws.table[j, 0] - ws.table[i, 0])
    q = (ws.table[j, 2] - ws.table[i, 2]) - (ws.table[j, 0] - ws.table[i, 0])
    return jump * 4.0 * area * boundary_rate(ws.vertex, k, following, p, q, side2)


@kernel
def integrate_chunk(chunk, owners, facets, sites, ws, sharpness, row_of, touched, accumulated, problems):
    """Integrate over a chunk of facets, given by index.

    For each site with a polygon, writes its index to ``touched``, and its gradient (d), mass and energy to a row of
    ``accumulated`` (at most one row per polygon). ``row_of`` (S,) is -1 between calls; ``owners`` (F,) are the start
    sites and are updated. A facet that cannot be clipped is skipped and written to ``problems`` as (facet, status).
    Returns the number of sites with a polygon and the number of problems.
    """
    dimension = sites.positions.shape[1]
    extra = sharpness * sharpness - 1.0
    n_touched = 0
    n_problems = 0
    for facet in chunk:
        n_polygons = clip_facet(facet, owners[facet], facets, sites, ws)
        if n_polygons < 0 or n_touched + n_polygons > touched.shape[0]:
            problems[n_problems, 0] = facet
            problems[n_problems, 1] = n_polygons if n_polygons < 0 else BUFFER_TOO_SMALL
            n_problems += 1
            if n_polygons == START_TOO_FAR:
                owners[facet] = ws.candidate[ws.polygon_slot[0]]
            continue
        owners[facet] = ws.candidate[ws.polygon_slot[0]]
        area = facets.area[facet]
        side2 = facets.side2[facet]
        for p in range(n_polygons):
            i = ws.polygon_slot[p]
            site = ws.candidate[i]
            start = ws.polygon_start[p]
            stop = ws.polygon_start[p + 1]
            row = row_of[site]
            if row < 0:
                row = n_touched
                row_of[site] = row
                touched[row] = site
                for k in range(dimension + 2):
                    accumulated[row, k] = 0.0
                n_touched += 1
            fraction, ma, mb, mc, mbc, mca, mab = moments(ws.vertex, start, stop)
            mass = area * fraction
            energy = area * (
                (ws.table[i, 0] * ma + ws.table[i, 1] * mb + ws.table[i, 2] * mc)
                - (side2[0] * mbc + side2[1] * mca + side2[2] * mab)
            )
            own_weight = 2.0 * mass
            weight_a, weight_b, weight_c = -2.0 * area * ma, -2.0 * area * mb, -2.0 * area * mc
            if extra > 0.0:
                h = height(facets, facet, sites.positions, site)
                energy += extra * mass * h * h
                for k in range(3):
                    accumulated[row, k] -= 2.0 * extra * mass * h * facets.normal[facet, k]
                for k in range(start, stop):
                    j = ws.label[k]
                    if j < 0:
                        continue
                    h_j = height(facets, facet, sites.positions, ws.candidate[j])
                    following = k + 1 if k + 1 < stop else start
                    weight = _boundary_motion(ws, k, following, i, j, extra * (h * h - h_j * h_j), side2, area)
                    own_weight -= weight
                    weight_a += 0.5 * weight * (ws.vertex[k, 0] + ws.vertex[following, 0])
                    weight_b += 0.5 * weight * (ws.vertex[k, 1] + ws.vertex[following, 1])
                    weight_c += 0.5 * weight * (ws.vertex[k, 2] + ws.vertex[following, 2])
            a = facets.faces[facet, 0]
            b = facets.faces[facet, 1]
            c = facets.faces[facet, 2]
            for k in range(dimension):
                accumulated[row, k] += (
                    own_weight * sites.positions[site, k]
                    + weight_a * facets.points[a, k]
                    + weight_b * facets.points[b, k]
                    + weight_c * facets.points[c, k]
                )
            accumulated[row, dimension] += mass
            accumulated[row, dimension + 1] += energy
    for k in range(n_touched):
        row_of[touched[k]] = -1
    return n_touched, n_problems


@kernel
def gather(touched, accumulated, gradient, mass, energy):
    """Add the rows of one chunk to the gradient (S, d), the mass (S,) and the energy (S,) of each cell."""
    dimension = gradient.shape[1]
    for row in range(len(touched)):
        site = touched[row]
        for k in range(dimension):
            gradient[site, k] += accumulated[row, k]
        mass[site] += accumulated[row, dimension]
        energy[site] += accumulated[row, dimension + 1]

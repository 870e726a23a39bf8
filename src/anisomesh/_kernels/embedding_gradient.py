"""Derivative of the energy of the normal-metric CVT by the points of the embedded surface.

On a facet f of area A the energy of polygon P of site i (module integrate) is A e with

    e = W_i . M1 - sum |side|^2 M2 + (s^2 - 1) |P| h_i^2

where |P| is the share of the facet, and M1 and M2 depend on P in barycentric coordinates only. The points occur in

    W_i = |v_c - x_i|^2     whose derivative is A M1, and moves the bisectors: the edge between P and the polygon of j,
                            length L, midpoint l, moves outwards by l . d(W_j - W_i) / g, and the integrand jumps there
                            by (s^2 - 1) (h_i^2 - h_j^2); g is the gradient of l . (W_j - W_i) in the facet
    |side|^2                by - A M2, and through the area: dA / d|side_c|^2 = (the other two squares - this) / (16 A)
    h_i                     2 (s^2 - 1) A |P| h_i, where dh_i / dv_c = b_c N with the barycentric coordinates b of the
                            projection of x_i to the plane of f in space, since N turns with the corners
"""

from .compiled import inlined, kernel
from .integrate import boundary_rate, height, moments
from .vectors import coordinates, cross, dot, subtract


@inlined
def _squares(points, corners, positions, site):
    """Return the squared distances of a site to the corners of a facet."""
    wa = wb = wc = 0.0
    for k in range(points.shape[1]):
        x = positions[site, k]
        wa += (points[corners[0], k] - x) ** 2
        wb += (points[corners[1], k] - x) ** 2
        wc += (points[corners[2], k] - x) ** 2
    return wa, wb, wc


@inlined
def _projected(points, corners, positions, site):
    """Return barycentric coordinates of the projection of a site to the plane of a facet in space, 0 without one."""
    a = coordinates(points, corners[0])
    u, v = subtract(coordinates(points, corners[1]), a), subtract(coordinates(points, corners[2]), a)
    x = subtract(coordinates(positions, site), a)
    normal = cross(u, v)
    square = dot(normal, normal)
    if square <= 0.0:
        return 0.0, 0.0, 0.0
    b, c = dot(cross(x, v), normal) / square, dot(cross(u, x), normal) / square
    return 1.0 - b - c, b, c


@inlined
def _boundary_motion(polygon, vertex, label, facet, facets, positions):
    """Return the derivative by W_i, over s^2 - 1 and the area, through the motion of the bisectors around a polygon.

    ``polygon`` is (first vertex, last vertex + 1, site).
    """
    start, stop, site = polygon
    corners = facets.faces[facet]
    wa, wb, wc = _squares(facets.points, corners, positions, site)
    h = height(facets, facet, positions, site)
    ga = gb = gc = 0.0
    for k in range(start, stop):
        other = label[k]
        if other < 0:
            continue
        following = k + 1 if k + 1 < stop else start
        va, vb, vc = _squares(facets.points, corners, positions, other)
        p, q = (vb - wb) - (va - wa), (vc - wc) - (va - wa)
        h_other = height(facets, facet, positions, other)
        motion = (h * h - h_other * h_other) * boundary_rate(vertex, k, following, p, q, facets.side2[facet])
        ga -= motion * (vertex[k, 0] + vertex[following, 0])
        gb -= motion * (vertex[k, 1] + vertex[following, 1])
        gc -= motion * (vertex[k, 2] + vertex[following, 2])
    return ga, gb, gc


@inlined
def _add_by_squares(by_squares, corners, site, points, positions, gradient):
    """Add what the squared distances of a site to the corners of a facet contribute."""
    for c in range(3):
        for k in range(points.shape[1]):
            gradient[corners[c], k] += 2.0 * by_squares[c] * (points[corners[c], k] - positions[site, k])


@inlined
def _add_by_sides(by_sides, corners, points, gradient):
    """Add what the squared sides of a facet contribute."""
    for c in range(3):
        one, two = corners[(c + 1) % 3], corners[(c + 2) % 3]
        for k in range(points.shape[1]):
            pull = 2.0 * by_sides[c] * (points[one, k] - points[two, k])
            gradient[one, k] += pull
            gradient[two, k] -= pull


@inlined
def _add_by_height(by_height, corners, site, facet, facets, positions, gradient):
    """Add what the height of a site above the plane of a facet contributes."""
    shares = _projected(facets.points, corners, positions, site)
    for c in range(3):
        for k in range(3):
            gradient[corners[c], k] += by_height * shares[c] * facets.normal[facet, k]


@kernel
def add_embedding_gradient(offset, facet_of, site_of, label, vertex, facets, positions, sharpness, gradient):
    """Add the derivative of the energy by the points of the embedded surface to ``gradient`` (V, d).

    ``offset`` (P + 1,), ``facet_of`` and ``site_of`` (P,), ``label`` (Q,) and ``vertex`` (Q, 3) are the polygons of a
    diagram of sites at ``positions`` (S, d). Facets without area are left out: the energy has a kink there.
    """
    extra = sharpness * sharpness - 1.0
    for p in range(len(site_of)):
        facet, site, start, stop = facet_of[p], site_of[p], offset[p], offset[p + 1]
        area, corners = facets.area[facet], facets.faces[facet]
        if area <= 0.0:
            continue
        sa, sb, sc = facets.side2[facet, 0], facets.side2[facet, 1], facets.side2[facet, 2]
        wa, wb, wc = _squares(facets.points, corners, positions, site)
        fraction, ma, mb, mc, mbc, mca, mab = moments(vertex, start, stop)
        mean = (wa * ma + wb * mb + wc * mc) - (sa * mbc + sb * mca + sc * mab)
        if extra > 0.0:
            h = height(facets, facet, positions, site)
            mean += extra * fraction * h * h
            _add_by_height(2.0 * extra * area * fraction * h, corners, site, facet, facets, positions, gradient)
            ga, gb, gc = _boundary_motion((start, stop, site), vertex, label, facet, facets, positions)
            ma, mb, mc = ma + extra * ga, mb + extra * gb, mc + extra * gc
        _add_by_squares((area * ma, area * mb, area * mc), corners, site, facets.points, positions, gradient)
        growth = mean / (16.0 * area)
        by_a, by_b, by_c = growth * (sb + sc - sa), growth * (sc + sa - sb), growth * (sa + sb - sc)
        _add_by_sides((by_a - area * mbc, by_b - area * mca, by_c - area * mab), corners, facets.points, gradient)

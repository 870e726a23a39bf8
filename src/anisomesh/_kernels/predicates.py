"""Exact predicates for the lower envelope of planes over a triangle, with symbolic perturbation.

On a facet with corners a, b, c the squared distance to site i differs from a common quadratic by the linear function
``l . W_i``, with barycentric coordinates ``l`` and the squared distances ``W_i`` from the site to the corners. Point l
belongs to site j rather than i where ``l . (W_j - W_i) < 0``. Every decision of the clipping is the sign of such a form
at a vertex that is the intersection of two lines, so the sign of a determinant of 1, 2 or 3 rows ``W_m - W_i``. The
table W is rounded once; everything else is exact: products are expanded into sums of doubles without error (Dekker, "A
floating-point technique for extending the available precision", 1971) and summed as expansions (Shewchuk 1997).

Ties are broken by an infinitesimal added to the three entries of ``W_m``, which decreases with the index m
(Edelsbrunner and Muecke, "Simulation of simplicity", 1990). The same amount at all corners perturbs the power weight of
the site, so it is the same on every facet: the diagram is consistent over the whole surface.
"""

import numpy as np

from .compiled import allocating, inlined

UNIT_ROUNDOFF = 1.1102230246251565e-16  # 2**-53

_SPLITTER = 134217729.0  # 2**27 + 1, halves the bits of a double (Dekker)
_MAX_TERMS = 128  # of a sum; interior_side has 4 determinants of 6 triple products of 4 terms, 96


@inlined
def _two_product(a, b):
    """Return the rounded product p and its error e, so that p + e = a * b exactly."""
    p = a * b
    t = _SPLITTER * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = _SPLITTER * b
    b_high = t - (t - b)
    b_low = b - b_high
    return p, a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low)


@allocating
def sign_of_sum(terms, n):
    """Return the exact sign (-1, 0, 1) of the sum of the first n terms, by growing an expansion (Shewchuk)."""
    expansion = np.empty(_MAX_TERMS + 1)
    length = 0
    for k in range(n):
        q = terms[k]
        kept = 0
        for m in range(length):
            e = expansion[m]
            s = q + e
            b = s - q
            error = (q - (s - b)) + (e - b)
            if error != 0.0:
                expansion[kept] = error
                kept += 1
            q = s
        if q != 0.0:
            expansion[kept] = q
            kept += 1
        length = kept
    if length == 0:
        return 0
    return 1 if expansion[length - 1] > 0.0 else -1


@allocating
def add_product(terms, n, a, b, sign):
    """Append the two terms of sign * a * b; return the number of terms."""
    p, e = _two_product(a, b)
    terms[n] = sign * p
    terms[n + 1] = sign * e
    return n + 2


@allocating
def _add_triple_product(terms, n, a, b, c, sign):
    """Append the four terms of sign * a * b * c; return the number of terms."""
    p, e = _two_product(a, b)
    n = add_product(terms, n, p, c, sign)
    return add_product(terms, n, e, c, sign)


@allocating
def add_determinant(terms, n, p, q, r, sign):
    """Append the 24 terms of sign * det(p, q, r); return the number of terms."""
    n = _add_triple_product(terms, n, p[0], q[1], r[2], sign)
    n = _add_triple_product(terms, n, p[0], q[2], r[1], -sign)
    n = _add_triple_product(terms, n, p[1], q[2], r[0], sign)
    n = _add_triple_product(terms, n, p[1], q[0], r[2], -sign)
    n = _add_triple_product(terms, n, p[2], q[0], r[1], sign)
    return _add_triple_product(terms, n, p[2], q[1], r[0], -sign)


@allocating
def _add_cross_sum(terms, n, p, q):
    """Append the 12 terms of (1, 1, 1) . (p x q); return the number of terms."""
    for k in range(3):
        m = (k + 1) % 3
        n = add_product(terms, n, p[k], q[m], 1.0)
        n = add_product(terms, n, p[m], q[k], -1.0)
    return n


@allocating
def cross_sum_sign(p, q, r):
    """Return the exact sign of (1, 1, 1) . ((p - r) x (q - r))."""
    terms = np.empty(_MAX_TERMS)
    n = _add_cross_sum(terms, 0, p, q)
    n = _add_cross_sum(terms, n, q, r)
    n = _add_cross_sum(terms, n, r, p)
    return sign_of_sum(terms, n)


@allocating
def _slope_sign(p, q, a, b):
    """Return the exact sign of (p[b] - p[a]) - (q[b] - q[a])."""
    terms = np.empty(4)
    terms[0] = p[b]
    terms[1] = -p[a]
    terms[2] = -q[b]
    terms[3] = q[a]
    return sign_of_sum(terms, 4)


@allocating
def corner_side(w_i, w_j, index_i, index_j, corner):
    """Return 1 if the corner belongs to site i, -1 if to site j."""
    if w_i[corner] != w_j[corner]:
        return 1 if w_i[corner] < w_j[corner] else -1
    return 1 if index_i > index_j else -1


@allocating
def edge_side(w_i, w_k, w_j, index_i, index_k, index_j, a, b):
    """Return 1 if the intersection of side (a, b) with the bisector of i and k belongs to i, -1 if to j.

    The intersection must exist: the bisector separates the two corners.
    """
    terms = np.empty(12)
    n = add_product(terms, 0, w_j[a], w_k[b], 1.0)
    n = add_product(terms, n, w_j[a], w_i[b], -1.0)
    n = add_product(terms, n, w_i[a], w_k[b], -1.0)
    n = add_product(terms, n, w_j[b], w_k[a], -1.0)
    n = add_product(terms, n, w_j[b], w_i[a], 1.0)
    n = add_product(terms, n, w_i[b], w_k[a], 1.0)
    slope_k = _slope_sign(w_k, w_i, a, b)
    sign = sign_of_sum(terms, n)
    if sign == 0:
        sign = _first_by_index(
            index_i, _slope_sign(w_j, w_k, a, b), index_j, slope_k, index_k, -_slope_sign(w_j, w_i, a, b), -1, 0
        )
    return sign * slope_k


@allocating
def interior_side(w_i, w_k, w_l, w_j, index_i, index_k, index_l, index_j):
    """Return 1 if the common point of the cells of i, k and l belongs to i, -1 if to j."""
    terms = np.empty(_MAX_TERMS)
    n = add_determinant(terms, 0, w_k, w_l, w_j, 1.0)
    n = add_determinant(terms, n, w_i, w_l, w_j, -1.0)
    n = add_determinant(terms, n, w_k, w_i, w_j, -1.0)
    n = add_determinant(terms, n, w_k, w_l, w_i, -1.0)
    orientation = cross_sum_sign(w_k, w_l, w_i)
    sign = sign_of_sum(terms, n)
    if sign == 0:
        sign = _first_by_index(
            index_i,
            -cross_sum_sign(w_k, w_l, w_j),
            index_j,
            orientation,
            index_k,
            cross_sum_sign(w_l, w_j, w_i),
            index_l,
            cross_sum_sign(w_j, w_k, w_i),
        )
    return sign * orientation


@allocating
def _first_by_index(i, sign_i, j, sign_j, k, sign_k, m, sign_m):
    """Return the first non-zero sign in increasing order of the indices; an index of -1 is skipped."""
    last = -1
    while True:
        best = -1
        sign = 0
        if i > last and (best < 0 or i < best):
            best, sign = i, sign_i
        if j > last and (best < 0 or j < best):
            best, sign = j, sign_j
        if k > last and (best < 0 or k < best):
            best, sign = k, sign_k
        if m > last and (best < 0 or m < best):
            best, sign = m, sign_m
        if best < 0:
            return 0
        if sign != 0:
            return sign
        last = best

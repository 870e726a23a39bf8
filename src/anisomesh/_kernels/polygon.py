"""Clipping of a convex polygon on a facet by the bisector of two sites, with error bounds (see module clip)."""

from .compiled import inlined, kernel
from .predicates import UNIT_ROUNDOFF, corner_side, edge_side, interior_side

# columns of Workspace.work after the three barycentric coordinates
ERROR = 3  # bound on the error of the coordinates
SQUARE = 4  # upper bound of the squared distance to the site
LABEL = 5  # label of the edge that starts at the vertex
VALUE = 6  # linear form l . (W_j - W_i) of the clipping bisector


@kernel
def _exact_side(table, candidate, i, before, after, j):
    """Return the owner, 1 for site i and -1 for site j, of the vertex between two labelled edges of cell i, exactly."""
    site = candidate
    w = table
    if before < 0 and after < 0:
        return corner_side(w[i], w[j], site[i], site[j], 5 + before + after)
    if before < 0 or after < 0:
        side = -1 - min(before, after)
        k = max(before, after)
        return edge_side(w[i], w[k], w[j], site[i], site[k], site[j], (side + 1) % 3, (side + 2) % 3)
    return interior_side(w[i], w[before], w[after], w[j], site[i], site[before], site[after], site[j])


@inlined
def _intersect(work, source, p, q, m, size):
    """Write the zero of the linear form on the edge p q, and a bound on its error, as vertex m.

    With t the true and t' the computed parameter, both in [0, 1], and beta the error of the two values,
    |t - t'| <= 3 beta / (|value_p - value_q| - 2 beta). The error of the new point is at most the error of its parents
    plus this fraction, at most 1, of their distance.
    """
    parents = max(work[source, p, ERROR], work[source, q, ERROR])
    beta = (parents + 8.0 * UNIT_ROUNDOFF) * size
    gap = work[source, p, VALUE] - work[source, q, VALUE]
    t = min(max(work[source, p, VALUE] / gap, 0.0), 1.0) if gap != 0.0 else 0.5
    spread = abs(gap) - 2.0 * beta
    fraction = min(1.0, 3.0 * beta / spread) if spread > 0.0 else 1.0
    length = 0.0
    for c in range(3):
        step = work[source, q, c] - work[source, p, c]
        work[1 - source, m, c] = work[source, p, c] + t * step
        length = max(length, abs(step))
    work[1 - source, m, ERROR] = parents + fraction * (length + 2.0 * parents) + 4.0 * UNIT_ROUNDOFF


@inlined
def classify(work, table, candidate, source, n, i, j, fa, fb, fc):
    """Determine which vertices belong to site j; return their number and the first of them in cyclic order."""
    size = abs(fa) + abs(fb) + abs(fc)
    first = 0
    n_lost = 0
    before = False
    zero = False
    for k in range(n):
        v = work[source, k, 0] * fa + work[source, k, 1] * fb + work[source, k, 2] * fc
        work[source, k, VALUE] = v
        if abs(v) > (work[source, k, ERROR] + 8.0 * UNIT_ROUNDOFF) * size:
            lost = v < 0.0
        else:
            label_before = int(work[source, k - 1 if k > 0 else n - 1, LABEL])
            lost = _exact_side(table, candidate, i, label_before, int(work[source, k, LABEL]), j) < 0
        if k == 0:
            zero = lost
        elif lost and not before:
            first = k
        if lost:
            n_lost += 1
        before = lost
    if zero and not before:
        first = 0
    return n_lost, first


@inlined
def cut(work, source, n, n_lost, first, j, size):
    """Write the polygon without the vertices of site j to the other buffer; return its vertex count."""
    target = 1 - source
    entry = first - 1 if first > 0 else n - 1
    last = first + n_lost - 1
    if last >= n:
        last -= n
    leave = last + 1 if last + 1 < n else 0
    k = leave
    kept = n - n_lost
    for m in range(kept):
        for c in range(VALUE):
            work[target, m, c] = work[source, k, c]
        k = k + 1 if k + 1 < n else 0
    _intersect(work, source, entry, first, kept, size)
    work[target, kept, LABEL] = j
    _intersect(work, source, leave, last, kept + 1, size)
    work[target, kept + 1, LABEL] = work[source, last, LABEL]
    return kept + 2


@inlined
def bound_squares(work, source, first, n, wa, wb, wc, sa, sb, sc, slack, spread):
    """Write bounds of the squared distances of the vertices from ``first`` on; return the largest of all bounds.

    ``slack`` bounds the rounding of the squares, ``spread`` times the error of a vertex the effect of its position.
    """
    for m in range(first, n):
        la = work[source, m, 0]
        lb = work[source, m, 1]
        lc = work[source, m, 2]
        square = la * wa + lb * wb + lc * wc - (lb * lc * sa + lc * la * sb + la * lb * sc)
        work[source, m, SQUARE] = square + slack + spread * work[source, m, ERROR]
    largest = 0.0
    for m in range(n):
        largest = max(largest, work[source, m, SQUARE])
    return largest


@inlined
def start_with_facet(work, wa, wb, wc, slack):
    """Initialise the polygon with the whole facet."""
    for k in range(3):
        for c in range(4):
            work[0, k, c] = 1.0 if c == k else 0.0
        work[0, k, LABEL] = -1 - (k + 2) % 3
    work[0, 0, SQUARE] = wa + slack
    work[0, 1, SQUARE] = wb + slack
    work[0, 2, SQUARE] = wc + slack

"""The predicates against exact rational arithmetic with an explicit perturbation of every table entry."""

import itertools
from fractions import Fraction

import naive_rvd as naive
import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from anisomesh._kernels import predicates
from conftest import examples

ties = st.integers(0, 3).map(float)
near_ties = st.tuples(st.integers(0, 2), st.integers(-2, 2)).map(lambda parts: parts[0] + 1.0 + parts[1] * 2.0**-52)
generic = st.floats(1e-6, 8.0)


def tables(n):
    """Tables (n, 3) of one of three kinds: with many ties, tied but for the last digit, and in general position."""
    return st.one_of(
        *(st.lists(st.tuples(entry, entry, entry), min_size=n, max_size=n) for entry in (ties, near_ties, generic))
    ).map(np.array)


def indices(n):
    return st.lists(st.integers(0, 50), min_size=n, max_size=n, unique=True)


def difference(row, other):
    return [a - b for a, b in zip(row, other, strict=True)]


def edge_truth(rows, side):
    """Whether i owns, against j, the point of the bisector of i and k opposite corner ``side`` (rows i, k, j)."""
    i, k, j = rows
    corner = [1 if c == side else 0 for c in range(3)]
    return naive.exact_owner([[*difference(k, i), 0], [*corner, 0], [1, 1, 1, 1]], i, j)


def interior_truth(rows):
    i, k, m, j = rows
    return naive.exact_owner([[*difference(k, i), 0], [*difference(m, i), 0], [1, 1, 1, 1]], i, j)


@given(tables(2), indices(2), st.integers(0, 2))
def test_corner_side_is_exact_and_one_site_owns(w, index, corner):
    i, j = naive.perturbed(w, index)
    side = predicates.corner_side(w[0], w[1], *index, corner)
    assert side == (1 if i[corner] < j[corner] else -1)
    assert predicates.corner_side(w[1], w[0], *index[::-1], corner) == -side


@examples(400)
@given(tables(3), indices(3), st.integers(0, 2))
def test_edge_side_is_exact(w, index, side):
    truth = edge_truth(naive.perturbed(w, index), side)
    assume(truth is not None)
    a, b = (side + 1) % 3, (side + 2) % 3
    assert predicates.edge_side(*w, *index, a, b) == truth
    # the same from the facet across the edge, and from the polygon of the other site
    assert predicates.edge_side(*w, *index, b, a) == truth
    assert predicates.edge_side(w[1], w[0], w[2], index[1], index[0], index[2], a, b) == truth


@examples(400)
@given(tables(4), indices(4))
def test_interior_side_is_exact(w, index):
    truth = interior_truth(naive.perturbed(w, index))
    assume(truth is not None)
    for order in itertools.permutations(range(3)):
        rows = [*order, 3]
        assert predicates.interior_side(*w[rows], *[index[r] for r in rows]) == truth


def test_fully_tied_tables_are_decided_for_every_order_of_the_sites():
    w = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.0]]) + 2.0
    for index in itertools.permutations(range(4)):
        truth = interior_truth(naive.perturbed(w, index))
        assert predicates.interior_side(*w, *index) == truth


@given(st.lists(st.floats(-1e9, 1e9).filter(lambda x: x == 0.0 or abs(x) > 1e-200), max_size=40), st.data())
def test_sign_of_sum_is_exact(values, data):
    # the negatives of some of the values, with the last digit changed, make the sum cancel
    copies = data.draw(st.lists(st.sampled_from(values), max_size=40)) if values else []
    nudges = data.draw(st.lists(st.integers(-1, 1), min_size=len(copies), max_size=len(copies)))
    values = values + [-float(np.nextafter(x, x + n)) if n else -x for x, n in zip(copies, nudges, strict=True)]
    total = sum(map(Fraction, values), Fraction(0))
    sign = predicates.sign_of_sum(np.array([*values, 1.0]), len(values))
    assert sign == (total > 0) - (total < 0)


def test_sign_of_sum_sees_what_rounding_loses():
    assert predicates.sign_of_sum(np.array([1.0, 1e-30, -1.0]), 3) == 1
    assert predicates.sign_of_sum(np.array([1e16, 1.0, -1e16, -1.0, -1e-40]), 5) == -1
    assert predicates.sign_of_sum(np.array([0.1, 0.2, -0.3, -(0.1 + 0.2 - 0.3)]), 4) == int(
        np.sign(float(Fraction(0.1) + Fraction(0.2) - Fraction(0.3) - Fraction(0.1 + 0.2 - 0.3)))
    )

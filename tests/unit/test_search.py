"""The search for the smallest count, with errors from formulas, with and without noise."""

import numpy as np
import pytest

from anisomesh.counts.search import COUNT_PRECISION, Counts, smallest_count
from conftest import pairwise


def counted(function):
    tried = []

    def error_at(n):
        tried.append(n)
        return function(n)

    return error_at, tried


@pytest.mark.parametrize(
    ("power", "answer", "first"), pairwise([0.5, 1.0, 2.0], [4, 5, 37, 1_000, 99_000], [4, 300, 100_000])
)
def test_the_smallest_count_is_found_to_three_per_cent(power, answer, first):
    error_at, tried = counted(lambda n: (answer / n) ** power)
    n, error = smallest_count(error_at, 1.0, Counts(first=first, least=4, most=100_000))
    assert error == error_at(n) <= 1.0
    assert answer <= n <= max(answer + 1, COUNT_PRECISION * answer)
    assert len(tried) <= 17


@pytest.mark.parametrize("seed", range(20))
def test_a_noisy_error_still_gives_a_sufficient_count(seed):
    rng = np.random.default_rng(seed)
    noise = rng.uniform(0.8, 1.25, 10_001)
    error_at, tried = counted(lambda n: 500 / n * noise[n])
    n, error = smallest_count(error_at, 1.0, Counts(first=100, least=4, most=10_000))
    assert error == 500 / n * noise[n] <= 1.0
    assert 400 <= n <= 640
    assert len(set(tried)) == len(tried) <= 17


def test_an_error_out_of_reach_returns_the_largest_count():
    error_at, tried = counted(lambda n: 2.0)
    assert smallest_count(error_at, 1.0, Counts(first=100, least=4, most=5_000)) == (5_000, 2.0)
    assert max(tried) == 5_000


def test_the_smallest_allowed_count_is_returned_if_sufficient():
    error_at, tried = counted(lambda n: 0.0)
    assert smallest_count(error_at, 1.0, Counts(first=100, least=4, most=5_000)) == (4, 0.0)
    assert len(tried) < 10


def test_the_search_stops_early_only_with_a_sufficient_count():
    error_at, tried = counted(lambda n: 1000 / n)
    n, error = smallest_count(error_at, 1.0, Counts(first=100, least=4, most=5_000), stop=lambda: True)
    assert error <= 1.0
    assert n == tried[-1]
    assert tried[:-1] == [n for n in tried if n < 1000]


def test_a_milestone_is_tried_before_any_larger_count():
    """The error is low at the milestone only, as for a decimation that ends at the input itself."""
    tried = []

    def error_at(n):
        tried.append(n)
        return 0.0 if n == 100 else 5.0 / n if n > 100 else 1.0

    n, error = smallest_count(error_at, 0.01, Counts(first=10, least=4, most=10_000, milestone=100))
    assert (n, error) == (100, 0.0)
    assert max(tried) == 100

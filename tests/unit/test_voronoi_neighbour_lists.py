"""Neighbour lists of moving sites: sorted, and complete within the radius they promise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anisomesh.execution.threads import Workers
from anisomesh.voronoi.neighbour_lists import NeighbourLists
from conftest import examples


def assert_lists_hold(table, sites):
    """Lists are sorted, without duplicates, with true distances up to a bound, complete within their radius."""
    distance = np.sqrt(((sites[:, None] - sites[None]) ** 2).sum(axis=2))
    for site in range(len(sites)):
        listed = table.neighbours[table.start[site] : table.start[site] + table.length[site]]
        promised = table.distance[table.start[site] : table.start[site] + table.length[site]]
        true = distance[site, listed]
        assert np.all(np.abs(promised - true) <= table.stale[site] + 1e-12 * np.maximum(promised, true))
        assert np.all(np.diff(promised) >= 0)
        assert len(set(listed.tolist())) == len(listed)
        assert site not in listed
        near = np.flatnonzero(distance[site] < max(table.complete[site], 0.0) * (1 - 1e-12))
        assert set(near.tolist()) - {site} <= set(listed.tolist())


@examples(25)
@given(
    st.integers(1, 120),
    st.sampled_from([1, 2, 3, 8]),
    st.lists(st.tuples(st.floats(-5, 0.5), st.sampled_from([0.03, 0.3, 1.0])), max_size=6),
    st.integers(0, 2**32),
    st.booleans(),
)
def test_lists_stay_complete_while_the_sites_move(n, dimension, moves, seed, duplicates):
    rng = np.random.default_rng(seed)
    sites = rng.random((n, dimension))
    if duplicates:
        sites = sites[rng.integers(max(1, n // 3), size=n)]
    lists = NeighbourLists(Workers(1))
    assert_lists_hold(lists.table(sites), sites)
    for size, share in moves:
        chosen = rng.random(n) < share
        sites = sites + 10.0**size * chosen[:, None] * rng.normal(size=sites.shape)
        assert_lists_hold(lists.table(sites), sites)
        needed = np.where(rng.random(n) < 0.2, 2.0 * rng.random(n), 0.0)
        table = lists.grow(sites, needed)
        assert np.all(table.complete[needed > 0] >= needed[needed > 0])
        assert_lists_hold(table, sites)


def test_exact_lists_have_true_distances_whatever_came_before():
    rng = np.random.default_rng(5)
    lists = NeighbourLists(Workers(1))
    sites = rng.random((300, 3))
    for _ in range(4):
        assert_lists_hold(lists.table(sites), sites)
        sites = sites + 1e-4 * rng.normal(size=sites.shape)
    assert lists.table(sites).stale.any()
    assert not lists.table(sites, exact=True).stale.any()
    assert_lists_hold(lists.table(sites, exact=True), sites)


def test_number_of_sites_may_change():
    rng = np.random.default_rng(0)
    lists = NeighbourLists(Workers(1))
    for n in (50, 3, 1, 200):
        sites = rng.random((n, 3))
        assert_lists_hold(lists.table(sites), sites)


def test_tied_neighbours_are_sorted_by_index():
    sites = np.stack(np.meshgrid(*3 * [np.arange(4.0)]), axis=-1).reshape(-1, 3)
    table = NeighbourLists(Workers(1)).table(sites)
    for site in range(len(sites)):
        part = slice(table.start[site], table.start[site] + table.length[site])
        keys = list(zip(table.distance[part].tolist(), table.neighbours[part].tolist(), strict=True))
        assert keys == sorted(keys)


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_lists_of_many_sites_do_not_depend_on_threads(threads):
    rng = np.random.default_rng(1)
    sites = rng.random((3500, 3))
    tables = [NeighbourLists(Workers(count)).table(sites) for count in (1, threads)]
    np.testing.assert_array_equal(tables[0].neighbours, tables[1].neighbours)
    np.testing.assert_array_equal(tables[0].distance, tables[1].distance)


def test_nearest_is_the_nearest_site():
    rng = np.random.default_rng(2)
    lists = NeighbourLists(Workers(1))
    for _ in range(2):
        sites, queries = rng.random((40, 5)), rng.random((30, 5))
        lists.table(sites)
        wanted = ((queries[:, None] - sites[None]) ** 2).sum(axis=2).argmin(axis=1)
        np.testing.assert_array_equal(lists.nearest(queries, sites), wanted)


def test_near_is_not_beaten_by_a_listed_neighbour():
    rng = np.random.default_rng(3)
    lists = NeighbourLists(Workers(1))
    sites, queries = rng.random((400, 4)), rng.random((50, 4))
    lists.table(sites)
    sites = sites + 0.02 * rng.normal(size=sites.shape)
    table = lists.table(sites)
    found = lists.near(queries, sites)
    for query, site in zip(queries, found, strict=True):
        listed = table.neighbours[table.start[site] : table.start[site] + table.length[site]]
        best = ((sites[listed] - query) ** 2).sum(axis=1).min()
        assert ((sites[site] - query) ** 2).sum() <= best
    exact = ((queries[:, None] - sites[None]) ** 2).sum(axis=2).argmin(axis=1)
    assert (found == exact).mean() > 0.9

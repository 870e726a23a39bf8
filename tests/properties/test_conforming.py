"""Chains of boundaries that are given the same vertices."""

import numpy as np
import pytest
from junction_shapes import square

from anisomesh.conforming.chains import Bundle, Chain, conform
from anisomesh.mesh.boundary_places import boundary_places
from anisomesh.mesh.closed_polyline import placed_on
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, euler_characteristic

CURVE = np.stack([0.3 * np.sin(np.linspace(0, 2, 41)), np.linspace(0, 2, 41), np.zeros(41)], axis=1)
START = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(CURVE, axis=0), axis=1))])


def on_curve(places):
    return np.stack([np.interp(places, START, CURVE[:, axis]) for axis in range(3)], axis=1)


def strips(counts, rng):
    """Return strips beside the curve with a number of vertices on it at random places, and their chains."""
    points, faces, chains, first = [], [], [], 0
    for number, count in enumerate(counts):
        places = np.concatenate([[0.0], np.sort(rng.uniform(0.0, START[-1], count - 2)), START[-1:]])
        angle = 2.0 * np.pi * number / len(counts)
        away = 0.5 * np.array([np.cos(angle), 0.0, np.sin(angle)])
        row = first + np.arange(count)
        points += [on_curve(places), on_curve(places) + away]
        a, b, c, d = row[:-1], row[1:], row[1:] + count, row[:-1] + count
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
        chains.append(Chain(row, places))
        first += 2 * count
    return np.concatenate(points), np.concatenate(faces).astype(np.int32), chains


@pytest.mark.parametrize("seed", range(10))
def test_chains_get_the_same_vertices_in_order(seed):
    rng = np.random.default_rng(seed)
    counts = rng.integers(2, 30, size=rng.integers(2, 6))
    points, faces, chains = strips(counts, rng)
    made = conform(points, faces, [Bundle(CURVE, chains)])
    (table,) = made.chains
    assert max(counts) <= table.shape[1] <= counts.sum()
    assert (made.points[table] == made.points[table[:1]]).all()
    assert np.allclose(points[table[np.argmax(counts)][table[np.argmax(counts)] < len(points)]][0], on_curve([0.0])[0])
    height = made.points[table[0], 1]
    assert (np.diff(height) > 0.0).all()  # no vertex has passed another one
    surface = Surface(made.points, made.faces)
    boundary = {tuple(edge) for edge in np.sort(surface.edges[surface.edge_face_count == 1], axis=1).tolist()}
    for chain in table:
        assert {tuple(sorted(pair)) for pair in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True)} <= boundary
    assert euler_characteristic(made.faces) == euler_characteristic(faces)
    assert made.faces[: len(faces)].shape == faces.shape


@pytest.mark.parametrize("least", [1, 2, 5])
def test_a_curve_gets_at_least_so_many_vertices(least):
    points, faces, chains = strips([2, 2, 2], np.random.default_rng(0))
    (table,) = conform(points, faces, [Bundle(CURVE, chains, least)]).chains
    assert table.shape == (3, 2 + least)


def test_loops_at_the_same_place_are_told_apart():
    """Two sheets that have their whole boundary in common, one above the other."""
    reference, mesh = (
        [square(n, n, lambda u, v, s=s: (u, v, s * u * v * (1 - u) * (1 - v) * 4)) for s in (1, -1)] for n in (21, 7)
    )
    joint = [
        Surface(np.concatenate([one[0], two[0]]), np.concatenate([one[1], two[1] + len(one[0])]))
        for one, two in (reference, mesh[::-1])
    ]
    placed = boundary_places(joint[1], joint[0], [loop.astype(np.int64) for loop in boundary_loops(joint[0].faces)])
    assert placed is not None
    first = [int(loop[0]) < 441 for loop in boundary_loops(joint[0].faces)]
    for upper, found in zip(first, placed, strict=True):
        assert (found.points >= 49).all() == upper  # the sheets of the mesh are in the other order
        assert (np.diff(found.places) > 0.0).all()
        assert len(found.points) == 24


def test_many_loops_in_pairs_are_told_apart():
    """Pairs of plates, each with its boundary in common, on a grid: each loop belongs to the plate it is nearest to."""

    def plates(n, order):
        parts = [
            square(n, n, lambda u, v, k=k: (u + 2 * (k // 2), v, (1 - 2 * (k % 2)) * u * v * (1 - u) * (1 - v) * 4))
            for k in order
        ]
        faces = np.concatenate([faces + n * n * k for k, (_, faces) in enumerate(parts)])
        return Surface(np.concatenate([points for points, _ in parts]), faces)

    order = np.random.default_rng(0).permutation(60)
    reference, mesh = plates(7, range(60)), plates(4, order)
    loops = [loop.astype(np.int64) for loop in boundary_loops(reference.faces)]
    placed = boundary_places(mesh, reference, loops)
    assert placed is not None
    for loop, found in zip(loops, placed, strict=True):
        assert order[found.points[0] // 16] == loop[0] // 49


def comb(n):
    """A sheet with three tabs whose ends are at one place, in one direction, and where its points are on a flat comb.

    There are n edges along each side of a square of the comb, which is 5 squares wide and 2 high.
    """
    flat, faces = square(5 * n + 1, 2 * n + 1, lambda u, v: (5 * u, 2 * v, 0 * u))
    middle = flat[faces].mean(axis=1)
    used, faces = np.unique(faces[(middle[:, 1] > 1) | (np.floor(middle[:, 0]) % 2 == 0)], return_inverse=True)
    flat, faces = flat[used], faces.reshape(-1, 3)
    u, v = flat[:, 0], flat[:, 1]
    tab = 2 * np.clip(np.round((u - 0.5) / 2), 0, 2)
    down = np.clip(1 - v, 0, 1)
    bend = down**2 * (3 - 2 * down)  # level at both ends
    bent = np.stack([u + bend * (2 - tab), v, 0.5 * (tab - 2) * (down * (1 - down)) ** 2], axis=1)
    return flat, Surface(bent, faces)


@pytest.mark.parametrize("seed", range(4))
def test_a_loop_that_passes_three_times_through_one_place_is_placed_in_order(seed):
    """Uneven faces of the mesh are like now one tab of the surface, now another."""
    (flat, reference), (coarse, mesh) = comb(12), comb(4)
    uneven = np.where(mesh.on_boundary[:, None], 0.0, np.random.default_rng(seed).normal(0.0, 0.06, mesh.points.shape))
    mesh = mesh.with_points(mesh.points + uneven)
    (loop,) = (each.astype(np.int64) for each in boundary_loops(reference.faces))
    (found,) = boundary_places(mesh, reference, [loop])
    corners = np.append(loop, loop[0])
    start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(reference.points[corners], axis=0), axis=1))])
    there = np.stack([np.interp(found.places, start, flat[corners, axis]) for axis in range(2)], axis=1)
    assert np.abs(there - coarse[found.points, :2]).max() < 0.15  # an edge is .25 long


def test_a_small_loop_of_a_face_that_is_turned_is_placed_in_order():
    reference = Surface(*square(9, 9, lambda u, v: (u, v, 0 * u)))
    (loop,) = (each.astype(np.int64) for each in boundary_loops(reference.faces))
    turned = Surface(np.array([[0.0, 0.0, 0.0], [0.5, 1.0, 0.0], [1.0, 0.0, 0.0]]), np.array([[0, 1, 2]]))
    (found,) = boundary_places(turned, reference, [loop])
    assert sorted(found.points.tolist()) == [0, 1, 2]
    assert (np.diff(found.places) > 0.0).all()
    assert 0.0 <= found.places[0] < found.places[-1] < 4.0


def test_points_at_one_place_before_and_after_a_turn_are_placed_in_order():
    """Regression: the places of the ones before the turn were rounded, some to above the others."""
    rng = np.random.default_rng(3)
    for _ in range(60):
        corners = rng.random((7, 3))
        corners = np.concatenate([corners, corners[:1]])
        start = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
        total = start[-1]
        places = np.sort(rng.random(8)) * total
        places = np.concatenate([places[:1], places, places[:1] + total])  # the first place three times
        points = np.stack([np.interp(places, start, axis, period=total) for axis in corners.T], axis=1)
        sides = np.mod(0.5 * (places + np.append(places[1:], places[0] + total)), total)
        found = placed_on(points, sides, corners)
        assert found is not None
        assert (np.diff(found[1]) >= 0.0).all()


def test_vertices_at_one_place_are_spaced_evenly():
    points, faces, chains = strips([6, 2], np.random.default_rng(0))
    points[1:5] = on_curve([0.7])
    chains[0] = Chain(chains[0].points, np.array([0.0, 0.7, 0.7, 0.7, 0.7, START[-1]]))
    made = conform(points, faces, [Bundle(CURVE, chains)])
    height = made.points[made.chains[0][0], 1]
    assert np.diff(height).min() > 0.1 * np.diff(height).mean()

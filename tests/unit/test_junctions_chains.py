"""Nodes of junctions on the boundary loops of a mesh."""

from types import SimpleNamespace

import numpy as np
import pytest
from junction_shapes import square

from anisomesh.junctions.chains import _Chained
from anisomesh.mesh.boundary_places import LoopPlaces
from anisomesh.mesh.surface import Surface


@pytest.mark.parametrize(
    ("places", "wanted"),
    [
        ([0.0, 1.0, 1.0, 2.0], [0.0, 1.4]),  # two points at one place, and a node behind them
        ([0.0, 1.0, 1.0, 2.0], [0.0, 0.6]),  # and before them
        ([0.1, 1.0, 2.0, 2.9], [0.0, 0.9, 1.1, 2.8]),  # two nodes nearest to one point
        ([0.2, 1.0, 1.5, 2.9], [0.0, 2.5, 2.6, 2.7]),
    ],
)
def test_points_keep_their_order_around_a_loop_when_some_become_nodes(places, wanted):
    mesh = Surface(*square(2, 2, lambda u, v: (u, v, 0 * u)))
    chained = _Chained(mesh, mesh, SimpleNamespace(graph=SimpleNamespace(curves=())))
    loop = LoopPlaces(np.arange(4), np.array(places))
    points, found, at = chained._with_nodes(loop, np.array(wanted), 3.0)
    assert np.allclose(found[at], wanted)
    assert (np.diff(found) >= 0.0).all()
    assert (np.diff(at) > 0).all()
    assert at[0] == 0
    old = points[:-1][points[:-1] < 4].tolist()
    first = old.index(0)
    assert old[first:] + old[:first] == [0, 1, 2, 3]

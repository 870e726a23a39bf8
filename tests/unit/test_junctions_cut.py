"""The cut of surfaces at junctions, and the graph of these."""

import numpy as np
import pytest
from junction_shapes import SHAPES, lengths_by_count, square

from anisomesh.junctions.cut import cut_at_junctions
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare

FACES_AND_CURVES = {  # faces at each curve, sorted, and distinct places of nodes
    "wavy_fin": ([3], 2),
    "tee": ([3], 2),
    "book": ([5], 2),
    "sphere_with_fin": ([3], 2),
    "two_boxes": ([3] * 4, 4),
    "cubes_at_an_edge": ([4], 2),
    "disc_in_tube": ([3], 1),
    "soap_films": ([3], 1),
}


@pytest.mark.parametrize("name", SHAPES)
def test_sheets_are_manifold_and_joined_again_they_are_the_input(name):
    surface = Surface(*SHAPES[name]())
    junctions = cut_at_junctions(prepare(surface))
    sheets = junctions.sheets
    assert topology.count_nonmanifold_edges(sheets.faces) == topology.count_nonmanifold_points(sheets.faces) == 0
    assert topology.is_oriented(sheets.faces)
    whole = junctions.whole
    assert whole.n_points == surface.n_points + (name == "cubes_at_an_edge")  # a point in the middle of its edge
    assert lengths_by_count(whole.points, whole.faces) == pytest.approx(lengths_by_count(surface.points, surface.faces))
    assert topology.euler_characteristic(whole.faces) == topology.euler_characteristic(surface.faces)


@pytest.mark.parametrize("name", FACES_AND_CURVES)
def test_curves_end_at_nodes_and_have_as_many_copies_as_faces(name):
    junctions = cut_at_junctions(prepare(Surface(*SHAPES[name]())))
    graph, (copies, nodes) = junctions.graph, FACES_AND_CURVES[name]
    assert sorted(graph.copies) == copies
    assert len(np.unique(junctions.joined[graph.nodes])) == nodes
    for loop in graph.loops:
        for arc in loop.arcs:
            if arc.curve >= 0:
                points = np.append(loop.points, loop.points[0])[arc.first : arc.last + 1]
                curve = graph.curves[arc.curve]
                assert (junctions.joined[points] == (curve[::-1] if arc.backward else curve)).all()


def test_manifold_surfaces_are_not_cut():
    assert cut_at_junctions(prepare(Surface(*square(4, 4, lambda u, v: (u, v, 0 * u))))) is None

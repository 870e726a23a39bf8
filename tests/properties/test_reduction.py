"""A reduction keeps topology, lines and held points, is near, and changes little of a remesh."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import anisomesh
from anisomesh.features.detect import sharp_edges
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import boundary_loops, euler_characteristic
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.reduction import reduce_points
from anisomesh.options import RemeshOptions
from anisomesh.setup.inputs import prepared_input
from anisomesh.setup.reduction import reduced
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.cad_part import cad_part

SHAPES = {
    "sphere": lambda: shapes.sphere(4),
    "torus": lambda: shapes.torus(n_major=60, n_minor=24),
    "part": lambda: cad_part(8),
    "open patch": lambda: shapes.open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=30),
}


def plain(surface):
    """Return arguments for a reduction in which nothing is held."""
    return {"held": np.zeros(surface.n_points, bool), "labels": np.zeros(len(surface.edges), np.int32)}


def edge_labels(reduction):
    """Return the label of each labelled edge, by its ends in the surface before."""
    pairs = np.sort(reduction.kept[reduction.surface.edges], axis=1)
    return {tuple(pair): label for pair, label in zip(pairs.tolist(), reduction.labels.tolist(), strict=True) if label}


@given(
    name=st.sampled_from(sorted(SHAPES)),
    share=st.floats(0.1, 0.9),
    shake=st.floats(0.0, 0.3),
    seed=st.integers(0, 1_000),
)
def test_topology_count_and_held_points_are_kept(name, share, shake, seed):
    surface, rng = SHAPES[name](), np.random.default_rng(seed)
    away = rng.normal(size=surface.points.shape) * shake * surface.edge_lengths.mean()
    surface = Surface(surface.points + away, surface.faces)
    given_labels = plain(surface)
    given_labels["held"] = rng.random(surface.n_points) < 0.2 * share
    result = reduce_points(surface, int(share * surface.n_points), **given_labels)
    assert euler_characteristic(result.surface.faces) == euler_characteristic(surface.faces)
    assert len(boundary_loops(result.surface.faces)) == len(boundary_loops(surface.faces))
    assert np.isin(np.flatnonzero(given_labels["held"]), result.kept).all()
    wanted = int(share * surface.n_points)
    assert result.surface.n_points >= wanted
    if shake == 0.0:
        assert result.surface.n_points <= wanted + given_labels["held"].sum() + 12


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_points_are_at_the_points_that_they_are_said_to_be(name):
    """Once an edge was collapsed into one end, and the surface made with the other."""
    surface = SHAPES[name]()
    result = reduce_points(surface, surface.n_points // 4, **plain(surface))
    np.testing.assert_array_equal(result.surface.points, surface.points[result.kept])
    assert len(np.unique(result.kept)) == result.surface.n_points


def test_it_is_nearly_as_near_as_a_decimation_in_the_order_of_costs():
    surface = shapes.torus(n_major=200, n_minor=80)
    result = reduce_points(surface, 2_000, **plain(surface)).surface
    ordered = decimate(surface, result.n_points, moves=False).surface
    assert surface_distance(result, surface).rms < 1.3 * surface_distance(ordered, surface).rms


def test_lines_keep_their_place_and_their_labels():
    surface = cad_part(16)
    creases = sharp_edges(surface, 40.0)
    middle = surface.points[surface.edges].mean(axis=1)
    labels = np.where(creases, np.where(middle[:, 0] > middle[:, 0].mean(), 1, 2), 0).astype(np.int32)
    result = reduce_points(surface, surface.n_points // 6, held=plain(surface)["held"], labels=labels)
    length = result.surface.edge_lengths
    for label in (1, 2):  # straight lines keep their length; holes lose the height of their arcs
        assert length[result.labels == label].sum() == pytest.approx(
            surface.edge_lengths[labels == label].sum(), rel=5e-3
        )
    before = {tuple(sorted(ends)) for ends in surface.edges[labels != 0].tolist()}
    on_lines = {point for pair in before for point in pair}
    assert all(a in on_lines and b in on_lines for a, b in edge_labels(result))


def test_an_input_is_reduced_only_if_it_is_dense_and_nothing_is_prescribed():
    dense = shapes.torus(n_major=300, n_minor=110)
    tensors = np.broadcast_to(np.eye(3), (dense.n_points, 3, 3))
    for options, is_reduced in (
        (RemeshOptions(), True),
        (RemeshOptions(reduce=False), False),
        (RemeshOptions(metric=tensors), False),
        (RemeshOptions(density=np.ones(dense.n_points)), False),
    ):
        source = prepared_input(anisomesh.Mesh(surface=dense), options)
        assert (reduced(source, 300, options) is not source) == is_reduced
        assert reduced(source, dense.n_points // 20, options) is source


def test_points_to_keep_and_borders_of_regions_are_kept():
    dense = shapes.torus(n_major=300, n_minor=110)
    middle = dense.points[dense.faces].mean(axis=1)
    regions = anisomesh.Regions((middle[:, 0] > 0.0).astype(np.int64))
    mesh = anisomesh.Mesh(surface=dense, regions={"half": regions})
    options = RemeshOptions(keep_points=[5, 77, 20_000])
    source = prepared_input(mesh, options)
    result = reduced(source, 300, options)
    surface = result.prepared.surface
    np.testing.assert_array_equal(surface.points[result.fixed], dense.points[[5, 77, 20_000]])
    np.testing.assert_array_equal(surface.points, dense.points[result.prepared.point_source])
    ends = surface.points[surface.edges[result.borders]]
    assert np.abs(ends[:, :, 0]).max() < 0.05
    assert surface.edge_lengths[result.borders].sum() == pytest.approx(
        source.prepared.surface.edge_lengths[source.borders].sum(), rel=0.05
    )


@pytest.mark.slow
def test_the_error_of_a_remesh_is_about_the_one_without_a_reduction():
    dense = shapes.torus(n_major=300, n_minor=110)
    height = 0.02 * np.sin(5 * dense.points[:, 0]) * np.sin(6 * dense.points[:, 1] + 1) * np.sin(7 * dense.points[:, 2])
    dense = Surface(dense.points + height[:, None] * dense.point_normals, dense.faces)
    with_it, without = (anisomesh.remesh(dense, n_vertices=400, reduce=reduce) for reduce in (True, False))
    assert with_it.surface.n_points == 400 and with_it.validity.faults == 0
    assert with_it.working.n_points < 0.8 * dense.n_points
    assert with_it.prepared is without.prepared
    errors = [surface_distance(each.surface, dense).rms for each in (with_it, without)]
    assert errors[0] < 1.1 * errors[1]

"""Metrics with thin layers: the surface that is embedded resolves them, and its embedding does not fold."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

import anisomesh
from anisomesh.embedding.direct import Start, embed
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import open_patch
from anisomesh.working.subdivision import split_long_edges

SMALLEST, LARGEST = 0.002, 0.2


def layer(points):
    """A metric (n, 3, 3): edges .2 long in y, and in x from .2 down to .002 at x = 0."""
    across = SMALLEST + (LARGEST - SMALLEST) * np.abs(points[:, 0])
    metric = np.tile(np.eye(3) / LARGEST**2, (len(points), 1, 1))
    metric[:, 0, 0] = across**-2
    return metric


def along_x(x):
    """The length in the metric from the layer to x, the integral of 1 / size."""
    slope = LARGEST - SMALLEST
    return np.sign(x) * np.log1p(slope * np.abs(x) / SMALLEST) / slope


def sheet(n=40):
    return open_patch(lambda x, y: 0.0 * x, n=n)


def test_subdivision_by_lengths_of_another_kind():
    """Edges are halved across the layer only, until they are short in the metric; the area stays."""

    def lengths(surface):
        start, end = surface.points[surface.edges].transpose(1, 0, 2)
        return np.hypot(along_x(end[:, 0]) - along_x(start[:, 0]), (end - start)[:, 1] / LARGEST)

    parent = sheet(10)
    fine = split_long_edges(parent, 1.2, max_faces=100_000, lengths=lengths)
    assert fine.complete
    assert lengths(fine.surface).max() <= 1.2
    assert fine.surface.area == pytest.approx(parent.area)
    np.testing.assert_allclose(fine.interpolate(parent.points), fine.surface.points, atol=1e-14)


def test_lengths_that_never_get_short_end_at_the_limit_on_faces():
    fine = split_long_edges(sheet(2), 1.0, max_faces=500, lengths=lambda surface: np.full(len(surface.edges), 2.0))
    assert not fine.complete
    assert fine.surface.n_faces <= 500


def test_embedding_does_not_fold_at_a_layer():
    """Regression: the two sides of the layer lay on each other, and cells reached across."""
    grid = sheet(60)
    x = np.sign(grid.points[:, 0]) * SMALLEST * np.expm1(np.abs(grid.points[:, 0]) * np.log(LARGEST / SMALLEST))
    x /= np.abs(x).max()
    surface = Surface(np.stack([x, grid.points[:, 1], 0.0 * x], axis=1) / np.sqrt(8.0), grid.faces)
    model = surface.points * np.sqrt(8.0)
    embedding = embed(surface, layer(model) * 8.0, start=Start(unfolded=True))
    assert embedding.residual < 0.15
    exact = np.stack([along_x(model[:, 0]), model[:, 1] / LARGEST], axis=1)
    distance, neighbour = cKDTree(embedding.points).query(embedding.points, 7)
    apart = np.linalg.norm(exact[:, None] - exact[neighbour], axis=2)[:, 1:] / distance[:, 1:]
    assert np.quantile(apart, 0.99) < 1.5


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["source", "tensors"])
def test_edges_get_unit_length_in_a_layer_that_is_a_hundred_times_finer(kind):
    """The number of vertices is the area in the metric over the one of a cell, up to the boundary."""
    surface = sheet()
    frame_scale = np.sqrt(8.0)

    def source(working):
        return anisomesh.MetricField(tensors=layer(working.points * frame_scale))

    metric = source if kind == "source" else layer(surface.points)
    mesh = anisomesh.remesh(surface, metric=metric, edge_length=1.0).surface
    if kind == "tensors":  # linear between the vertices of the input, so not yet exact
        mesh = anisomesh.remesh(mesh, metric=layer(mesh.points), edge_length=1.0).surface
    start, end = mesh.points[mesh.edges].transpose(1, 0, 2)
    lengths = np.hypot(along_x(end[:, 0]) - along_x(start[:, 0]), (end - start)[:, 1] / LARGEST)
    assert np.mean((lengths > 0.5**0.5) & (lengths < 2.0**0.5)) > 0.93
    width, height = 2.0 * along_x(1.0), 2.0 / LARGEST
    assert mesh.n_points == pytest.approx(width * height / np.sqrt(0.75) + (width + height) / 2 + 1, rel=0.08)

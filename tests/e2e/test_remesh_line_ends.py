"""Prescribed lines that run along a boundary or a crease, and end in the middle of it, are followed from end to end."""

import numpy as np
import pytest

import anisomesh
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.shapes.analytic import box, open_patch

SHEET = open_patch(lambda x, y: 0.0 * x, n=20)
BOX = box(n=12)


def along(surface, on_line):
    """Return the edges of a surface that have both ends where ``on_line`` is true of points (n, 3)."""
    return surface.edges[on_line(surface.points)[surface.edges].all(axis=1)]


def length_of_features(result):
    ends = result.mesh.surface.points[result.mesh.features]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()


def on_boundary(points):
    return (points[:, 1] == points[:, 1].min()) & (points[:, 0] <= 0.0)


def on_crease(points):
    return (points[:, 1] == 0.0) & (points[:, 2] == 0.0) & (points[:, 0] < 0.51)


@pytest.mark.parametrize("how", [{"n_vertices": 60}, {"n_vertices": 200}, {"max_error": 0.01}])
@pytest.mark.parametrize(("surface", "on_line"), [(SHEET, on_boundary), (BOX, on_crease)], ids=["boundary", "crease"])
def test_a_line_that_ends_in_the_middle_of_another_is_kept_whole(surface, on_line, how):
    edges = along(surface, on_line)
    wanted = np.linalg.norm(np.ptp(surface.points[edges].reshape(-1, 3), axis=0))
    result = anisomesh.remesh(Mesh(surface=surface, features=edges), embedding="direct", **how)
    assert result.warnings == ()
    assert result.feature_distance < 1e-12
    assert length_of_features(result) == pytest.approx(wanted, rel=1e-12)


def test_a_single_edge_is_kept():
    edge = along(BOX, on_crease)[2:3]
    result = anisomesh.remesh(Mesh(surface=BOX, features=edge), n_vertices=100, embedding="direct")
    kept = result.mesh.surface.points[result.mesh.features].reshape(-1, 3)
    np.testing.assert_array_equal(np.sort(kept, axis=0), np.sort(BOX.points[edge[0]], axis=0))


def test_the_border_of_a_locked_region_is_not_reported_as_lost():
    centre = SHEET.points[SHEET.faces].mean(axis=1)
    regions = Regions((centre[:, 0] < 0.3).astype(np.int64), {1: "inlet"})
    mesh = Mesh(surface=SHEET, regions={"part": regions})
    for how in ({"n_vertices": 400}, {"max_error": 0.01}):
        result = anisomesh.remesh(mesh, lock="inlet", embedding="direct", **how)
        assert result.warnings == ()
        assert result.feature_distance < 1e-12

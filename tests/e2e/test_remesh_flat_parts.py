"""Parts with flat faces and straight creases: corners exactly kept, flat faces exactly flat, and creases covered."""

import igl
import numpy as np
import pytest
from sliver_shapes import thick_comb

import anisomesh
from anisomesh.evaluation.preservation import feature_preservation
from anisomesh.features.detect import corners, points_along, sharp_edges
from anisomesh.metric.quality import anisotropic_quality
from anisomesh.shapes.analytic import box
from anisomesh.shapes.parts import loft, sparse_parts

pytestmark = pytest.mark.slow


def star_prism(tips, subdivisions, inner=0.45, height=0.5):
    """Return a prism over a star with divided sides."""
    angle = np.pi * np.arange(2 * tips) / tips
    radius = np.where(np.arange(2 * tips) % 2 == 0, 1.0, inner)
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    share = np.arange(subdivisions)[:, None] / subdivisions
    sides = [a + share * (b - a) for a, b in zip(star, np.roll(star, -1, axis=0), strict=True)]
    return loft(np.concatenate(sides), [(0.0, 0.0), (1.0, 0.0), (1.0, height), (0.0, height)])


PARTS = {
    "cube of twelve triangles": (lambda: box(n=1), 200),
    "cube at a fifth": (lambda: box(n=4), 20),
    "slab of a grid": (lambda: box((3.0, 2.0, 0.2), n=3), 200),
    "star in which a chord across a crease is flipped by the fit": (lambda: star_prism(9, 6), 250),
    "rod of a grid": (lambda: box((0.3, 0.3, 4.0), n=2), 120),
    **{name: (lambda part=part: part, 200) for name, part in sparse_parts().items() if part.n_points <= 24},
}


@pytest.mark.parametrize(("name", "seed"), [(name, k % 3) for k, name in enumerate(PARTS)])
def test_corners_and_planes_are_exact_and_creases_covered(name, seed):
    make, n = PARTS[name]
    part = make()
    result = anisomesh.remesh(part, n_vertices=n, seed=seed, max_iterations=20)
    new, size = result.surface, part.diagonal
    sharp = sharp_edges(part, 40.0)
    at_corner = part.points[corners(part, sharp)]
    nearest = np.linalg.norm(new.points[:, None] - at_corner[None], axis=2).min(axis=0)
    assert nearest.max() < 1e-6 * size
    off = np.sqrt(igl.point_mesh_squared_distance(new.points, part.points, part.faces.astype(np.int64))[0])
    assert off.max() < 1e-9 * size
    bent = new.edges[sharp_edges(new, 20.0)].astype(np.int64)
    along = np.ascontiguousarray(points_along(part, sharp, 1e-3 * size))
    tree = igl.AABB()
    tree.init(new.points, bent)
    from_crease = np.sqrt(tree.squared_distance(new.points, bent, along)[0])
    assert (from_crease < 1e-6 * size).mean() > 0.99
    assert new.n_points == n
    assert result.validity.euler == 2
    assert result.validity.inverted == 0


@pytest.mark.parametrize("name", ["gear", "screw", "washer stack"])
def test_round_creases_of_sparse_parts_are_covered_by_chords(name):
    part = sparse_parts()[name]
    result = anisomesh.remesh(part, n_vertices=300, max_iterations=20)
    kept = feature_preservation(
        part, result.surface, crease_angle=40.0, tolerance=0.1 * result.surface.edge_lengths.mean()
    )
    assert kept.crease_covered > 0.99
    assert result.validity.new_intersections == result.validity.inverted == 0
    assert result.surface.n_points == 300


def test_triangles_on_flat_faces_do_not_take_after_the_slivers_of_the_input():
    part = thick_comb(300, bulge=0.2)
    result = anisomesh.remesh(part, n_vertices=300, embedding="direct", max_iterations=20)
    new = result.surface
    quality = anisotropic_quality(new.points, new.faces, np.tile(np.eye(3), (new.n_points, 1, 1)))
    on_top = (np.abs(new.points[new.faces][:, :, 2] - 0.1) < 1e-9 * part.diagonal).all(axis=1)
    assert on_top.sum() > 50
    assert quality[on_top].mean() > 0.85
    assert result.validity.inverted == result.validity.new_intersections == 0

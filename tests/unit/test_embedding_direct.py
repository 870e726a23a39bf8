"""The direct embedding where the answer is known."""

import numpy as np
import pytest

from anisomesh.embedding.base import EmbeddingStatus, achieved_stretch, target_stretch
from anisomesh.embedding.direct import Start, embed
from anisomesh.embedding.gradient import face_frames, face_gradient, face_tensors
from anisomesh.errors import OptionError
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.sources import Curvature
from anisomesh.metric.tensors import compute_metric, uniform_metric
from anisomesh.shapes.analytic import box, cylinder, open_patch, sphere, torus
from anisomesh.working.surface import working_surface


def circular_metric(surface, stretch):
    """Tensors that stretch the direction around the z axis."""
    around = np.stack([-surface.points[:, 1], surface.points[:, 0], np.zeros(surface.n_points)], axis=1)
    around /= np.linalg.norm(around, axis=1)[:, None]
    return np.eye(3) + (stretch**2 - 1) * around[:, :, None] * around[:, None, :]


def embedded_tensors(surface, embedded):
    """First fundamental form of the embedding in the frames of the faces."""
    jacobian = (face_gradient(surface).operator @ embedded).reshape(surface.n_faces, 2, -1)
    return jacobian @ jacobian.transpose(0, 2, 1)


def relative_error(surface, tensors, embedded):
    asked = face_tensors(surface, tensors, face_frames(surface))
    difference = embedded_tensors(surface, embedded) - asked
    return np.sqrt((difference**2).sum(axis=(1, 2)) / (asked**2).sum(axis=(1, 2)))


def tilted(surface, seed=3):
    rotation = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return surface.with_points(surface.points @ rotation.T), rotation


@pytest.mark.parametrize("spectrum", [(1.0, 9.0, 4.0), (5.0, 0.2, 1.0), (100.0, 100.0, 100.0)])
def test_constant_metric_on_a_plane_is_reproduced(spectrum):
    surface, rotation = tilted(open_patch(lambda x, y: 0.0 * x, n=12))
    tensors = np.tile(rotation @ np.diag(spectrum) @ rotation.T, (surface.n_points, 1, 1))
    embedding = embed(surface, tensors, max_iterations=50, tolerance=0.0)
    a, b = surface.edges.T
    side = surface.points[a] - surface.points[b]
    asked = np.sqrt(np.einsum("ex,xy,ey->e", side, tensors[0], side))
    np.testing.assert_allclose(np.linalg.norm(embedding.points[a] - embedding.points[b], axis=1), asked, rtol=1e-9)
    assert embedding.residual < 1e-9


def test_cylinder_is_embedded_exactly_in_the_limit():
    errors = []
    for n in (24, 48, 96):
        surface, rotation = tilted(cylinder(0.15, 0.8, n_around=n, n_along=n // 2, closed=False))
        tensors = rotation @ circular_metric(surface.with_points(surface.points @ rotation), 3.0) @ rotation.T
        embedding = embed(surface, tensors)
        errors.append(relative_error(surface, tensors, embedding.points).max())
        assert embedding.scale == pytest.approx(1.0, abs=0.05)
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert errors[2] < 0.01


def test_first_columns_are_the_scaled_coordinates_and_the_rest_is_centred():
    surface = torus(0.35, 0.1, 48, 20)
    tensors = 7.0 * compute_metric(surface, "approximation")
    embedding = embed(surface, tensors)
    assert embedding.points.shape == (surface.n_points, 8)
    np.testing.assert_allclose(embedding.points[:, :3], embedding.scale * surface.points)
    smallest = np.linalg.eigvalsh(face_tensors(surface, tensors, face_frames(surface)))[:, 0].min()
    assert embedding.scale**2 == pytest.approx(smallest)
    areas = np.bincount(surface.faces.ravel(), np.repeat(surface.face_areas, 3))
    np.testing.assert_allclose(areas @ embedding.points[:, 3:], 0.0, atol=1e-12)


def test_paper_metric_keeps_the_coordinates_unscaled():
    surface = torus(0.35, 0.1, 96, 40)
    assert embed(surface, compute_metric(surface)).scale == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("extra", [3, 4, 5, 8])
def test_uniform_metric_needs_no_extra_coordinates_but_keeps_the_shape(extra):
    surface = box(n=3)
    embedding = embed(surface, 4.0 * uniform_metric(surface), start=Start(extra))
    assert embedding.status is EmbeddingStatus.EXACT
    assert (embedding.iterations, embedding.residual) == (0, 0.0)
    assert embedding.points.shape == (surface.n_points, 3 + extra)
    np.testing.assert_allclose(embedding.points[:, :3], 2.0 * surface.points)
    assert not embedding.points[:, 3:].any()


def test_components_do_not_interfere():
    """Two cylinders of different size and axis, far apart, each with an exact embedding."""
    parts = [cylinder(r, 0.5, n_around=60, n_along=20, closed=False) for r in (0.1, 0.2)]
    turned, rotation = tilted(parts[1])
    tensors = np.concatenate([circular_metric(parts[0], 2.0), rotation @ circular_metric(parts[1], 4.0) @ rotation.T])
    points = np.concatenate([parts[0].points, turned.points + np.array([3.0, 0, 0])])
    surface = Surface(points, np.concatenate([parts[0].faces, parts[1].faces + parts[0].n_points]))
    embedding = embed(surface, tensors)
    stretch = achieved_stretch(face_gradient(surface), embedding.points)
    np.testing.assert_allclose(stretch[: parts[0].n_faces], 2.0, rtol=0.02)
    np.testing.assert_allclose(stretch[parts[0].n_faces :], 4.0, rtol=0.02)
    first = embed(parts[0], tensors[: parts[0].n_points]).points[:, 3:]
    distance = np.linalg.norm(first[1:] - first[:-1], axis=1)
    inside = embedding.points[: parts[0].n_points, 3:]
    np.testing.assert_allclose(np.linalg.norm(inside[1:] - inside[:-1], axis=1), distance, rtol=0.05, atol=1e-3)


def test_flat_faces_and_points_without_faces_do_not_spoil_the_rest():
    surface = open_patch(lambda x, y: 0.3 * np.sin(3 * x), n=16)
    bare = compute_metric(surface)
    points = np.concatenate([surface.points, [[5.0, 5, 5]], 0.5 * (surface.points[:1] + surface.points[1:2])])
    flat = np.array([[0, len(points) - 1, 1], [4, 4, 5], [7, 7, 7]])
    spoiled = Surface(points, np.concatenate([surface.faces, flat]))
    tensors = np.concatenate([bare, np.tile(np.eye(3), (2, 1, 1))])
    embedding = embed(spoiled, tensors)
    assert np.isfinite(embedding.points).all()
    assert np.isfinite(embedding.residual)
    expected = embed(surface, bare)
    assert embedding.stretch.achieved_mean == pytest.approx(expected.stretch.achieved_mean, rel=0.01)
    assert (achieved_stretch(face_gradient(spoiled), embedding.points)[-3:] == 1.0).all()


def test_surface_without_area_embeds_without_nan():
    surface = Surface(np.outer(np.arange(4.0), [1, 1, 1]), np.array([[0, 1, 2], [1, 2, 3]]))
    embedding = embed(surface, np.tile(np.diag([1.0, 2, 3]), (4, 1, 1)))
    assert np.isfinite(embedding.points).all()


def test_statistics_of_a_perfect_embedding():
    surface = open_patch(lambda x, y: 0.0 * x, n=6)
    tensors = np.tile(np.diag([9.0, 1.0, 1.0]), (surface.n_points, 1, 1))
    stretch = embed(surface, tensors).stretch
    values = (stretch.target_mean, stretch.target_max, stretch.achieved_mean, stretch.achieved_max)
    np.testing.assert_allclose(values, 3.0)
    np.testing.assert_allclose((stretch.low, stretch.median, stretch.high), 1.0)
    assert stretch.log_error < 1e-9


def test_target_stretch_is_the_ratio_of_the_eigenvalues_in_the_plane():
    surface, rotation = tilted(open_patch(lambda x, y: 0.0 * x, n=2))
    tensors = np.tile(rotation @ np.diag([2.0, 18.0, 1000.0]) @ rotation.T, (surface.n_points, 1, 1))
    np.testing.assert_allclose(target_stretch(face_tensors(surface, tensors, face_frames(surface))), 3.0)


@pytest.mark.parametrize("options", [{"start": Start(2)}, {"max_iterations": 0}, {"tolerance": -1.0}])
def test_options_out_of_range_are_refused(options):
    surface = sphere(1)
    with pytest.raises(OptionError, match=next(iter(options))):
        embed(surface, uniform_metric(surface), **options)


def test_the_embedding_of_a_needle_stays_small():
    """Regression: the global step failed by rounding on triangles of aspect 1e6, with points at 1e12."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0], [0.5, 0, 1e-9]])
    surface = Surface(points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    surface = surface.with_points(unit_frame(surface.points).to_unit(surface.points))
    none = np.zeros(len(surface.edges), dtype=bool)
    needle = working_surface(surface, 50, creases=none, tagged=none).surface
    field = Curvature()(needle)
    embedding = embed(needle, field.tensors, corner_tensors=field.corner_tensors)
    assert np.abs(embedding.points).max() < 1e6

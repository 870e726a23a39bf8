"""Filters against noise: planes and creases stay, noise gets less, boundaries are held, estimates are about right."""

import numpy as np
import pytest
import trimesh

from anisomesh.denoise.classical import NOISE_GATE, classically_denoised, estimated_noise
from anisomesh.denoise.filters import bilateral_filtered, neighbour_averages, taubin_smoothed
from anisomesh.denoise.noise import with_noise
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import box, open_patch, sphere, torus


def angles(surface, reference):
    """Return the angles between the normals of the faces of two surfaces (F,), in degrees."""
    cosine = np.einsum("fx,fx->f", surface.face_normals, reference.face_normals)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


@pytest.mark.parametrize("size", [0.05, 0.1, 0.2, 0.3])
def test_the_estimate_follows_the_noise(size):
    ball = sphere(4)
    assert estimated_noise(with_noise(ball, size, np.random.default_rng(0))) == pytest.approx(size, rel=0.25)


@pytest.mark.parametrize(
    "surface", [sphere(4), torus(1.0, 0.4, 60, 25), box(n=12), open_patch(lambda x, y: x * y, n=20)]
)
def test_clean_surfaces_stay_as_they_are(surface):
    assert estimated_noise(surface) < 0.5 * NOISE_GATE
    assert classically_denoised(surface) is surface


def test_filters_leave_planes_and_hold_boundaries():
    rng = np.random.default_rng(0)
    sheet = open_patch(lambda x, y: 0.0 * x, n=12)
    inner = ~sheet.on_boundary[:, None]
    rough = sheet.with_points(sheet.points + inner * rng.normal(size=sheet.points.shape) * [0.01, 0.01, 0.0])
    np.testing.assert_allclose(bilateral_filtered(rough).points, rough.points, atol=1e-12)
    np.testing.assert_array_equal(taubin_smoothed(rough, 5).points[~inner[:, 0]], rough.points[~inner[:, 0]])
    noisy = with_noise(sheet, 0.3, rng)
    np.testing.assert_array_equal(bilateral_filtered(noisy).points[~inner[:, 0]], noisy.points[~inner[:, 0]])


def test_a_box_keeps_its_creases():
    cube = box(n=10)
    assert angles(bilateral_filtered(cube), cube).max() < 1.0
    noisy = with_noise(cube, 0.1, np.random.default_rng(0))
    filtered = bilateral_filtered(noisy)
    assert angles(filtered, cube).mean() < 0.5 * angles(noisy, cube).mean()


@pytest.mark.parametrize("size", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("clean", [torus(1.0, 0.4, 80, 32), box(n=16)])
def test_noise_gets_less(clean, size):
    noisy = with_noise(clean, size, np.random.default_rng(1))
    denoised = classically_denoised(noisy)
    assert angles(denoised, clean).mean() < 0.6 * angles(noisy, clean).mean()


def test_taubin_smoothing_against_a_filter_of_frequencies():
    """A step is a polynomial of the matrix of averages."""
    ball = sphere(2)
    averages = neighbour_averages(ball).toarray()
    step = averages - np.eye(ball.n_points)
    once = (np.eye(ball.n_points) - 0.53 * step) @ (np.eye(ball.n_points) + 0.5 * step)
    np.testing.assert_allclose(
        taubin_smoothed(ball, 3).points, np.linalg.matrix_power(once, 3) @ ball.points, atol=1e-12
    )


def test_neighbour_averages_against_trimesh():
    mesh = trimesh.creation.icosphere(subdivisions=2)
    ball = Surface(np.array(mesh.vertices), np.array(mesh.faces))
    wanted = np.array([ball.points[near].mean(axis=0) for near in mesh.vertex_neighbors])
    np.testing.assert_allclose(neighbour_averages(ball) @ ball.points, wanted, atol=1e-12)

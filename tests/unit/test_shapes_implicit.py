"""Shapes with exact curvature: derivatives against differences, curvature against formulas and finer meshes."""

import numpy as np
import pytest

from anisomesh.errors import MeshError
from anisomesh.mesh import topology
from anisomesh.metric.curvature import principal_curvatures
from anisomesh.shapes.implicit import Blobs


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_agree_with_differences(seed):
    rng = np.random.default_rng(seed)
    blobs = Blobs.random(rng)
    points, step = rng.normal(scale=0.5, size=(20, 3)), 1e-5
    ahead, back = ([points + sign * step * axis for axis in np.eye(3)] for sign in (1.0, -1.0))
    gradient = np.stack([(blobs.value(a) - blobs.value(b)) / (2 * step) for a, b in zip(ahead, back, strict=True)], 1)
    hessian = np.stack(
        [(blobs.gradient(a) - blobs.gradient(b)) / (2 * step) for a, b in zip(ahead, back, strict=True)], 2
    )
    np.testing.assert_allclose(blobs.gradient(points), gradient, atol=1e-7)
    np.testing.assert_allclose(blobs.hessian(points), hessian, atol=1e-5)


def test_two_blobs_at_the_same_place_are_an_ellipsoid_with_its_curvatures():
    a, b, c = 1.3, 0.9, 0.6
    shape = np.log(2.0) * np.diag([a**-2, b**-2, c**-2])  # 2 exp(-log 2) = 1 where x^2/a^2 + y^2/b^2 + z^2/c^2 = 1
    blobs = Blobs(centres=np.zeros((2, 3)), shapes=np.stack([shape, shape]))
    tips = np.diag([a, b, c])
    assert np.abs(blobs.value(tips)).max() < 1e-14
    found = blobs.curvature(tips)
    exact = np.array([[a / b**2, a / c**2], [b / a**2, b / c**2], [c / a**2, c / b**2]])
    np.testing.assert_allclose(found.values, np.sort(exact, axis=1), rtol=1e-12)
    np.testing.assert_allclose(np.abs(found.directions[0]), [[0, 1, 0], [0, 0, 1]], atol=1e-9)
    surface = blobs.mesh()
    np.testing.assert_allclose((surface.points**2 / np.array([a, b, c]) ** 2).sum(axis=1), 1.0, rtol=1e-9)
    assert topology.euler_characteristic(surface.faces) == 2
    outward = np.einsum("fx,fx->f", surface.face_normals, surface.points[surface.faces].mean(axis=1))
    assert (outward > 0.0).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_fit_on_a_mesh_is_near_the_exact_curvature(seed):
    blobs = Blobs.random(np.random.default_rng(seed))
    surface = blobs.mesh()
    assert np.abs(blobs.value(surface.points)).max() < 1e-12
    exact, fitted = blobs.curvature(surface.points), principal_curvatures(surface)
    scale = np.median(np.abs(exact.values[:, 1]))
    assert np.median(np.abs(exact.values - fitted.values)) < 0.2 * scale
    normal = blobs.gradient(surface.points)
    assert np.abs(np.einsum("vkx,vx->vk", exact.directions, normal)).max() < 1e-9
    agree = np.abs(np.einsum("vx,vx->v", exact.directions[:, 1], fitted.directions[:, 1]))
    clear = np.abs(exact.values[:, 1]) > 1.5 * np.abs(exact.values[:, 0])
    assert np.median(agree[clear]) > 0.95


def test_a_level_set_that_is_empty_is_refused():
    with pytest.raises(MeshError, match="empty"):
        Blobs(
            centres=np.array([[0.0, 0.0, 0.0], [9.1, 3.3, 0.7]]), shapes=np.stack([np.eye(3), 1.7 * np.eye(3)])
        ).mesh()

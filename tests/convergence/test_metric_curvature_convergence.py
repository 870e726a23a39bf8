"""Curvatures of surfaces known in closed form, and how fast the error falls."""

import numpy as np
import pytest

from anisomesh.mesh.geometry import unit_frame
from anisomesh.metric.curvature import principal_curvatures
from anisomesh.metric.tensors import curvature_metric, metric_root
from anisomesh.shapes.analytic import cylinder, ellipsoid, sphere, torus

AXES = np.array([0.5, 0.4, 0.3])


def exact_ellipsoid_curvatures(points):
    """Curvatures sorted by magnitude, from the Hessian of the implicit equation restricted to the tangent plane."""
    gradient = 2 * points / AXES**2
    length = np.linalg.norm(gradient, axis=1)
    normal = gradient / length[:, None]
    project = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    shape = project @ np.diag(2 / AXES**2) @ project / length[:, None, None]
    return np.linalg.eigvalsh(shape)[:, 1:]


def ellipsoid_error(subdivisions):
    surface = ellipsoid(tuple(AXES), subdivisions)
    exact = exact_ellipsoid_curvatures(surface.points)
    found = principal_curvatures(surface).values
    return np.sqrt(np.mean(((found - exact) / exact) ** 2))


def test_ellipsoid_curvatures_converge_with_second_order():
    errors = [ellipsoid_error(k) for k in (3, 4, 5)]
    assert errors[0] > 3 * errors[1] > 9 * errors[2]
    assert errors[2] < 0.02


def test_ellipsoid_directions_are_the_principal_ones():
    surface = ellipsoid(tuple(AXES), 5)
    curvature = principal_curvatures(surface)
    gradient = surface.points / AXES**2
    normal = gradient / np.linalg.norm(gradient, axis=1)[:, None]
    project = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    shape = project @ np.diag(1 / AXES**2) @ project
    ratio = exact_ellipsoid_curvatures(surface.points)
    clear = ratio[:, 1] > 1.3 * ratio[:, 0]
    steepest = np.linalg.eigh(shape)[1][:, :, 2]
    agreement = np.abs(np.einsum("vx,vx->v", steepest, curvature.directions[:, 1]))[clear]
    assert agreement.min() > np.cos(np.radians(3))


@pytest.mark.parametrize("radius", [2, 3, 5])
def test_sphere_curvature_is_one_over_the_radius(radius):
    errors = [np.abs(principal_curvatures(sphere(k, 0.5), radius=radius).values * 0.5 - 1).max() for k in (3, 4)]
    assert errors[0] > 3 * errors[1]
    assert errors[1] < 0.06


def test_umbilic_sphere_is_not_stretched():
    surface = sphere(4, 0.5)
    metric = curvature_metric(surface, principal_curvatures(surface))
    assert np.linalg.eigvalsh(metric_root(metric)).max() < 1.01


def test_inward_normals_change_the_sign_only():
    surface = sphere(3, 0.5)
    inside_out = type(surface)(surface.points, surface.faces[:, ::-1])
    assert principal_curvatures(surface).values.min() > 0
    np.testing.assert_allclose(
        principal_curvatures(inside_out).values, -principal_curvatures(surface).values, rtol=1e-4
    )


def test_cylinder_has_one_curvature_across_its_axis():
    errors, along = [], []
    for n in (40, 80):
        surface = cylinder(0.2, 1.0, n_around=n, n_along=n // 2, closed=False)
        curvature = principal_curvatures(surface)
        inner = np.abs(surface.points[:, 2] - 0.5) < 0.3
        errors.append(np.abs(curvature.values[inner, 1] * 0.2 - 1).max())
        along.append(np.abs(curvature.values[inner, 0] * 0.2).max())
        assert np.abs(curvature.directions[inner, 1, 2]).max() < 0.01
        assert np.abs(curvature.directions[inner, 0, 2]).min() > 1 - 1e-4
    assert errors[0] > 3 * errors[1]
    assert along[0] > 3 * along[1]
    assert errors[1] < 0.04
    assert along[1] < 0.003


def torus_stretch_error(stretch, n_minor):
    """Error of the stretch on the outer equator, |k1 / k2| = (major + minor) / minor, at bounding-box diagonal 1."""
    minor = 1.0 / (stretch**2 - 1)
    surface = torus(1.0, minor, 2 * n_minor, n_minor)
    frame = unit_frame(surface.points)
    surface = surface.with_points(frame.to_unit(surface.points))
    exact = 1.0 / (minor / frame.scale)
    assert exact / stretch**2 > 1.0
    assert exact < 400.0
    metric = curvature_metric(surface, principal_curvatures(surface), smoothing=0)
    outer = np.hypot(surface.points[:, 0], surface.points[:, 1])
    outer = outer > outer.max() - 1e-3 * minor / frame.scale
    found = np.sqrt(np.linalg.eigvalsh(metric[outer])[:, 2])
    return np.abs(found / stretch - 1).max()


@pytest.mark.parametrize("stretch", [2.0, 6.0, 11.0])
def test_torus_stretch_converges(stretch):
    coarse, fine = torus_stretch_error(stretch, 40), torus_stretch_error(stretch, 80)
    assert coarse > 3 * fine
    assert fine < 0.03

"""The parts of the direct embedding against dense linear algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse

from anisomesh._kernels.local_step import local_step
from anisomesh.embedding.gradient import eigen_2x2, face_gradient, face_tensors
from anisomesh.embedding.ordering import nested_dissection
from anisomesh.embedding.poisson import factorise, poisson_solver
from anisomesh.mesh.surface import Surface
from anisomesh.shapes.analytic import ellipsoid, open_patch, sphere, torus
from conftest import examples


def two_shapes():
    """A closed and an open component, and a point without faces in between."""
    ball, patch = sphere(1), open_patch(lambda x, y: 0.3 * x * y, n=5)
    points = np.concatenate([ball.points, [[9.0, 9, 9]], patch.points + 4.0])
    return Surface(points, np.concatenate([ball.faces, patch.faces + ball.n_points + 1])), ball.n_points


def polar(maps, frames):
    """Return the polar factors of maps (F, 2, k): the local step towards gradients that keep lengths."""
    factors = np.empty_like(maps)
    local_step(maps, np.tile(np.eye(2), (len(maps), 1, 1)), np.ascontiguousarray(frames), np.ones(len(maps)), factors)
    return factors


@given(seed=st.integers(0, 2**31), k=st.integers(3, 6))
@examples(30)
def test_polar_factor_is_the_one_of_the_singular_value_decomposition(seed, k):
    rng = np.random.default_rng(seed)
    maps = rng.standard_normal((40, 2, k)) * 10.0 ** rng.uniform(-6, 6, (40, 1, 1))
    maps[:, 1] *= 10.0 ** rng.uniform(-4, 0, (40, 1))
    left, _, right = np.linalg.svd(maps, full_matrices=False)
    np.testing.assert_allclose(polar(maps, np.zeros((len(maps), 2, 3))), left @ right, atol=1e-8)


def test_polar_factor_of_a_nearly_deficient_map_is_orthonormal():
    maps = np.random.default_rng(0).standard_normal((200, 2, 5))
    maps[:, 1] = maps[:, 0] + 1e-8 * maps[:, 1]
    factor = polar(maps, np.zeros((len(maps), 2, 3)))
    np.testing.assert_allclose(factor @ factor.transpose(0, 2, 1), np.tile(np.eye(2), (200, 1, 1)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("case", ["rank one", "zero", "first zero", "second zero", "along the frame"])
def test_polar_factor_of_a_deficient_map_is_still_closest(case):
    rng = np.random.default_rng(1)
    maps = rng.standard_normal((50, 2, 5))
    frames = np.linalg.qr(rng.standard_normal((50, 3, 2)))[0].transpose(0, 2, 1)
    if case == "rank one":
        maps = rng.standard_normal((50, 2, 1)) * rng.standard_normal((50, 1, 5))
    elif case == "zero":
        maps = np.zeros_like(maps)
    elif case == "along the frame":
        maps = rng.standard_normal((50, 2, 1)) * np.pad(frames[:, :1], ((0, 0), (0, 0), (0, 2)))
    else:
        maps[:, ["first zero", "second zero"].index(case)] = 0.0
    factor = polar(maps, frames)
    np.testing.assert_allclose(factor @ factor.transpose(0, 2, 1), np.tile(np.eye(2), (50, 1, 1)), atol=1e-8)
    nuclear_norm = np.linalg.svd(maps, compute_uv=False).sum(axis=1)
    np.testing.assert_allclose(np.einsum("fik,fik->f", factor, maps), nuclear_norm, atol=1e-8)


def test_polar_factor_of_nothing_is_the_frame():
    np.testing.assert_array_equal(polar(np.zeros((1, 2, 5)), np.eye(3)[None, :2]), np.eye(5)[None, :2])


@given(seed=st.integers(0, 2**31))
@examples(20)
def test_local_step_is_the_nearest_gradient_of_the_wanted_lengths(seed):
    rng = np.random.default_rng(seed)
    jacobian, half = rng.standard_normal((30, 2, 5)), rng.standard_normal((30, 2, 2))
    root, areas = half @ half.transpose(0, 2, 1), rng.uniform(0.1, 2.0, 30)
    frames, target = np.tile(np.eye(3)[:2], (30, 1, 1)), np.empty((30, 2, 5))
    square = local_step(jacobian, root, frames, areas, target)
    np.testing.assert_allclose(target @ target.transpose(0, 2, 1), root @ root, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(square, (areas[:, None, None] * (jacobian - target) ** 2).sum(), rtol=1e-12)
    rows = np.linalg.qr(rng.standard_normal((200, 30, 5, 2)))[0].swapaxes(2, 3)
    others = ((jacobian - root @ rows) ** 2).sum(axis=(2, 3))
    assert (((jacobian - target) ** 2).sum(axis=(1, 2)) <= others.min(axis=0) + 1e-9).all()


@given(seed=st.integers(0, 2**31))
@examples(30)
def test_eigenvectors_of_2x2_tensors(seed):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((30, 2, 2))
    tensors = half @ half.transpose(0, 2, 1)
    tensors[:5] = np.eye(2)
    values, vectors = eigen_2x2(tensors)
    np.testing.assert_allclose(values[:, ::-1], np.linalg.eigvalsh(tensors), atol=1e-12)
    rebuilt = (vectors * values[:, None, :]) @ vectors.transpose(0, 2, 1)
    np.testing.assert_allclose(rebuilt, tensors, atol=1e-12)


def test_gradient_of_a_linear_function_is_its_tangent_part():
    surface = ellipsoid((1.0, 0.7, 0.4), 2)
    gradient = face_gradient(surface)
    direction = np.array([0.3, -1.2, 0.8])
    found = (gradient.operator @ (surface.points @ direction + 5.0)).reshape(-1, 2)
    in_space = np.einsum("fk,fkx->fx", found, gradient.frames)
    normal_part = surface.face_normals @ direction
    np.testing.assert_allclose(in_space, direction - normal_part[:, None] * surface.face_normals, atol=1e-12)


def test_tensors_of_the_faces_measure_their_sides():
    surface = ellipsoid((1.0, 0.7, 0.4), 1)
    rng = np.random.default_rng(0)
    half = rng.standard_normal((3, 3))
    tensors = np.tile(half @ half.T, (surface.n_points, 1, 1))
    gradient = face_gradient(surface)
    restricted = face_tensors(surface, tensors, gradient.frames)
    side = surface.points[surface.faces[:, 2]] - surface.points[surface.faces[:, 1]]
    local = np.einsum("fkx,fx->fk", gradient.frames, side)
    np.testing.assert_allclose(
        np.einsum("fi,fij,fj->f", local, restricted, local), np.einsum("fx,xy,fy->f", side, tensors[0], side)
    )


def test_poisson_solution_is_the_dense_least_squares_one():
    surface, n_ball = two_shapes()
    gradient = face_gradient(surface)
    target = np.random.default_rng(0).standard_normal((surface.n_faces, 2, 3))
    found = poisson_solver(surface, gradient)(target)
    weight = np.sqrt(np.repeat(gradient.areas, 2))[:, None]
    dense, *_ = np.linalg.lstsq(weight * gradient.operator.toarray(), weight * target.reshape(-1, 3), rcond=None)
    areas = np.bincount(surface.faces.ravel(), np.repeat(gradient.areas, 3), minlength=surface.n_points)
    for part in (slice(0, n_ball), slice(n_ball + 1, None)):
        dense[part] -= areas[part] @ dense[part] / areas[part].sum()
    dense[n_ball] = 0.0
    np.testing.assert_allclose(found, dense, atol=1e-10)


def test_poisson_solution_integrates_a_gradient_exactly():
    surface = torus(1.0, 0.4, 20, 12)
    gradient = face_gradient(surface)
    function = np.random.default_rng(0).standard_normal((surface.n_points, 2))
    target = (gradient.operator @ function).reshape(surface.n_faces, 2, 2)
    difference = poisson_solver(surface, gradient)(target) - function
    np.testing.assert_allclose(difference, np.broadcast_to(difference[0], difference.shape), atol=1e-10)


@pytest.mark.parametrize("size", [0, 1, 5])
def test_order_of_few_points_is_a_permutation(size):
    points = np.random.default_rng(0).random((size, 3))
    edges = np.zeros((0, 2), dtype=np.int32)
    np.testing.assert_array_equal(np.sort(nested_dissection(points, edges)), np.arange(size))


@pytest.mark.parametrize("n", [10, 40])
def test_factorisation_in_nested_order_solves_and_saves_fill(n):
    surface = open_patch(lambda x, y: 0.2 * x * y, n=n)
    rng = np.random.default_rng(0)
    shuffle = rng.permutation(surface.n_points)
    surface = Surface(surface.points[np.argsort(shuffle)], shuffle[surface.faces])
    order = nested_dissection(surface.points, surface.edges)
    np.testing.assert_array_equal(np.sort(order), np.arange(surface.n_points))
    operator = face_gradient(surface).operator
    matrix = (operator.T @ operator + sparse.identity(surface.n_points)).tocsc()
    right = rng.standard_normal((surface.n_points, 4))
    np.testing.assert_allclose(factorise(matrix, order)(right), np.linalg.solve(matrix.toarray(), right), atol=1e-9)
    entries = cholesky_entries(matrix, order)
    assert entries < 4 * surface.n_points * np.log2(surface.n_points)
    assert entries < (0.8 if n == 10 else 0.4) * cholesky_entries(matrix, np.arange(surface.n_points))


def cholesky_entries(matrix, order):
    """Entries of the dense Cholesky factor that are not zero, no cancellation occurring in general position."""
    factor = np.linalg.cholesky(matrix[order][:, order].toarray())
    return int((np.abs(factor) > 1e-300).sum())

"""Averages of scalars and line fields against sums over neighbours with explicit rotations."""

import numpy as np
from scipy.spatial.transform import Rotation

from anisomesh.metric.line_field import directions_of_line_field, line_field_of_directions, one_ring_averages
from anisomesh.metric.tangent import tangent_frames, unit_normals
from anisomesh.shapes.analytic import ellipsoid

SURFACE = ellipsoid((1.0, 0.5, 0.3), 1)


def neighbours(point):
    return np.setdiff1d(SURFACE.edges[(SURFACE.edges == point).any(axis=1)], point)


def smallest_rotation(start, end):
    axis = np.cross(start, end)
    length = np.linalg.norm(axis)
    return Rotation.from_rotvec(axis / length * np.arctan2(length, start @ end)).as_matrix()


def test_averages_match_sums_over_rotated_neighbours():
    rng = np.random.default_rng(0)
    normals = unit_normals(SURFACE)
    frames = tangent_frames(normals)
    angle = rng.uniform(0, 2 * np.pi, SURFACE.n_points)
    lines = np.cos(angle)[:, None] * frames[:, 0] + np.sin(angle)[:, None] * frames[:, 1]
    size, scalar = rng.uniform(1, 2, SURFACE.n_points), rng.standard_normal(SURFACE.n_points)
    scalar_average, line_average = one_ring_averages(SURFACE, normals, frames)
    found, found_scalar = line_average @ line_field_of_directions(lines, size, frames), scalar_average @ scalar
    for i in range(SURFACE.n_points):
        weight, tensor, total = 1.0, size[i] * np.outer(lines[i], lines[i]), scalar[i]
        for j in neighbours(i):
            cosine = max(normals[i] @ normals[j], 0.0)
            carried = smallest_rotation(normals[j], normals[i]) @ lines[j]
            weight += cosine
            tensor = tensor + cosine * size[j] * np.outer(carried, carried)
            total += cosine * scalar[j]
        low, high = np.linalg.eigvalsh(tensor / weight)[1:]
        np.testing.assert_allclose(abs(found[i]), high - low, atol=1e-12)
        direction = directions_of_line_field(found, frames)[i]
        np.testing.assert_allclose(direction @ tensor @ direction / weight, high, atol=1e-12)
        np.testing.assert_allclose(found_scalar[i], total / weight)


def test_lines_forget_their_sign_and_keep_their_direction():
    frames = tangent_frames(SURFACE.point_normals)
    lines = np.random.default_rng(1).standard_normal(SURFACE.points.shape)
    lines = np.einsum("vx,vkx,vky->vy", lines, frames, frames)
    lines /= np.linalg.norm(lines, axis=1)[:, None]
    ones = np.ones(SURFACE.n_points)
    np.testing.assert_allclose(
        line_field_of_directions(-lines, ones, frames), line_field_of_directions(lines, ones, frames), atol=1e-12
    )
    back = directions_of_line_field(line_field_of_directions(lines, ones, frames), frames)
    np.testing.assert_allclose(np.abs(np.einsum("vx,vx->v", back, lines)), 1.0)


def test_frames_are_orthonormal_and_right_handed():
    normals = np.concatenate([np.eye(3), -np.eye(3), SURFACE.point_normals])
    frames = tangent_frames(normals)
    full = np.concatenate([frames, normals[:, None]], axis=1)
    np.testing.assert_allclose(full @ full.transpose(0, 2, 1), np.tile(np.eye(3), (len(full), 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(full), 1.0)

"""Points of a fitted mesh in planes of the surface are exactly there, and others stay."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anisomesh.features.detect import sharp_edges
from anisomesh.fitting.planes import onto_planes
from anisomesh.fitting.samples import sample_surface
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.metric.field import MetricField
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.shapes import analytic as shapes


def samples_on(surface, count=4_000, creases=None):
    """Return samples of a surface and the faces that they are nearest to."""
    reference = ClosestPoints(surface)
    samples = sample_surface(
        surface,
        count,
        creases=np.zeros(len(surface.edges), dtype=bool) if creases is None else creases,
        metric=PlacedMetric(reference, MetricField(tensors=np.tile(np.eye(3), (surface.n_points, 1, 1)))),
        rng=np.random.default_rng(0),
    )
    return samples, reference.locate(samples.points)[0].astype(np.int32)


def test_points_of_a_box_come_back_to_its_planes():
    cube = shapes.box(n=6)
    samples, owner = samples_on(cube)
    noise = np.random.default_rng(1).uniform(-1e-7, 1e-7, cube.points.shape)
    moved = onto_planes(cube.points + noise, cube.faces, samples, owner, np.ones(cube.n_points, dtype=bool))
    off = np.abs(moved[cube.faces] - cube.points[cube.faces])
    normal = np.abs(cube.face_normals)[:, None, :]
    assert (off * normal).max() < 1e-15
    at_edge = np.unique(cube.edges[sharp_edges(cube, 40.0)])
    inner = np.setdiff1d(np.arange(cube.n_points), at_edge)
    along = np.abs(moved - cube.points - noise)[inner]
    assert np.sort(along, axis=1)[:, :2].max() < 1e-15  # no step within the plane


def test_points_come_back_to_planes_whose_facets_are_rounded_to_single_precision():
    rotation = Rotation.from_euler("xyz", [0.3, 0.4, 0.5]).as_matrix()
    exact = shapes.box(n=6).points @ rotation
    cube = shapes.box(n=6).with_points(exact.astype(np.float32).astype(np.float64))
    samples, owner = samples_on(cube)
    noise = np.random.default_rng(1).uniform(-1e-4, 1e-4, exact.shape)
    moved = onto_planes(exact + noise, cube.faces, samples, owner, np.ones(len(exact), dtype=bool))
    off = np.abs(moved @ rotation.T - shapes.box(n=6).points)  # 0 or 1 for two coordinates of a point at an edge
    assert np.sort(off, axis=1)[:, 0].max() < 1e-7


def test_samples_on_creases_do_not_keep_faces_from_their_planes():
    cube = shapes.box(n=6)
    creases = sharp_edges(cube, 40.0)
    samples, owner = samples_on(cube, creases=creases)
    across = np.flatnonzero(np.linalg.norm(samples.normals - cube.face_normals[owner], axis=1) > 0.5)
    assert len(across) > 0
    moved = onto_planes(cube.points * (1.0 + 1e-4), cube.faces, samples, owner, np.ones(cube.n_points, dtype=bool))
    assert np.abs(moved - 1.0)[cube.points == 1.0].max() < 1e-12


@pytest.mark.parametrize("size", [1e-2, 5e-3])
def test_points_farther_from_a_plane_than_a_fiftieth_of_an_edge_stay(size):
    cube = shapes.box(n=6)
    samples, owner = samples_on(cube)
    bent = cube.points * (1.0 + size) - np.where(cube.points == 0.0, size, 0.0)
    movable = np.ones(cube.n_points, dtype=bool)
    assert np.array_equal(onto_planes(bent, cube.faces, samples, owner, movable), bent)


def test_held_points_stay():
    cube = shapes.box(n=6)
    samples, owner = samples_on(cube)
    bent = cube.points * (1.0 + 1e-7)
    movable = np.zeros(cube.n_points, dtype=bool)
    assert np.array_equal(onto_planes(bent, cube.faces, samples, owner, movable), bent)


def test_a_coarse_mesh_of_a_sphere_stays():
    fine, coarse = shapes.sphere(subdivisions=5), shapes.sphere(subdivisions=2)
    samples, _ = samples_on(fine)
    owner = ClosestPoints(coarse).locate(samples.points)[0].astype(np.int32)
    movable = np.ones(coarse.n_points, dtype=bool)
    moved = onto_planes(coarse.points, coarse.faces, samples, owner, movable)
    assert np.array_equal(moved, coarse.points)


def test_points_of_a_round_rim_are_in_the_plane_of_its_cap():
    fine, coarse = (shapes.cylinder(radius=0.5, height=1.0, n_around=n) for n in (64, 60))
    samples, _ = samples_on(fine, 20_000)
    owner = ClosestPoints(coarse).locate(samples.points)[0].astype(np.int32)
    noise = np.random.default_rng(1).uniform(-1e-5, 1e-5, coarse.points.shape)
    moved = onto_planes(coarse.points + noise, coarse.faces, samples, owner, np.ones(coarse.n_points, dtype=bool))
    at_cap = np.unique(coarse.faces[np.abs(coarse.face_normals[:, 2]) > 0.9])
    assert len(at_cap) > 100
    assert np.abs(moved - coarse.points)[at_cap, 2].max() < 1e-12

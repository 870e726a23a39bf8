"""Compile nearly all kernels, in two parts that take about as long: ``compile_kernels.py first`` and ``second``."""

import sys

import numpy as np

import anisomesh
from anisomesh.fitting.arrays import FitTask
from anisomesh.fitting.fit import FitOptions, fit_mesh
from anisomesh.fitting.samples import sample_surface
from anisomesh.io.polygons import PolygonSoup, triangulate
from anisomesh.learn.inference.predict import predict
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.reduction import reduce_points
from anisomesh.metric.field import MetricField
from anisomesh.metric.transfer import PlacedMetric
from anisomesh.shapes.analytic import box, sphere


def first():
    """Run the stages of a remesh but the last."""
    for shape in (sphere(3), box((9.0, 1.0, 1.0), n=1)):
        anisomesh.remesh(shape, n_vertices=300, embedding="direct", fit=False)


def second():
    """Run the measures, the network, the decimation, the fit, and the triangulation of a concave polygon."""
    outline = np.array([(0, 0, 0), (3, 0, 0), (3, 3, 0), (2, 3, 0), (2, 1, 0), (1, 1, 0), (1, 3, 0), (0, 3, 0)], float)
    triangulate(PolygonSoup(points=outline, corners=np.arange(8), sizes=np.array([8])))
    ball = sphere(3)
    anisomesh.evaluate(ball, ball, samples=100)
    predict(ball.with_points(ball.points / ball.diagonal))
    coarse = decimate(ball, 100).surface
    reduce_points(ball, 100, held=np.zeros(ball.n_points, dtype=bool), labels=np.zeros(len(ball.edges), dtype=np.int32))
    identity = PlacedMetric(ClosestPoints(ball), MetricField(tensors=np.tile(np.eye(3), (ball.n_points, 1, 1))))
    none = np.zeros(len(ball.edges), dtype=bool)
    samples = sample_surface(ball, 2_000, creases=none, metric=identity, rng=np.random.default_rng(0))
    held, kept = np.zeros(coarse.n_points, dtype=bool), np.zeros(len(coarse.edges), dtype=bool)
    fit_mesh(FitTask(mesh=coarse, held=held, kept=kept, crease_angle=40.0), samples, FitOptions())


if __name__ == "__main__":
    {"first": first, "second": second}[sys.argv[1]]()

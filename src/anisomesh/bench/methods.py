"""The methods that a suite can run: anisomesh, and other remeshers if they are installed."""

from __future__ import annotations

import importlib.util
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from anisomesh.errors import AnisomeshError
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface

_ACVD_POINTS_PER_CLUSTER = 10  # input points per cluster, the advice of pyacvd's documentation
_MAX_MMG_RUNS = 8  # bounds the time; heuristic
_MMG_COUNT_TOLERANCE = 0.02  # of the requested number of vertices, as the tolerance of anisomesh itself
_MMG_START_HAUSDORFF = 1e-3  # diagonals; heuristic start of the search
_MMG_POWERS = (-4.0, -0.25)  # smallest and largest exponent of the vertex count as a power of the size; heuristic
_MMG_STEPS = (0.2, 5.0)  # smallest and largest factor between successive sizes; heuristic


class MethodResult(NamedTuple):
    """A remesh, and facts of the run for its row (seconds per stage, status)."""

    surface: Surface
    facts: dict[str, Any]


@dataclass(frozen=True)
class Method:
    """A method of the benchmarks: a function (surface, n_vertices, seed, options) -> result, and its packages."""

    run: Callable[[Surface, int, int, dict[str, Any]], MethodResult]
    packages: tuple[str, ...] = ()

    @property
    def missing(self) -> list[str]:
        """The required packages that are not installed."""
        return [name for name in self.packages if importlib.util.find_spec(name) is None]


def _anisomesh(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    from anisomesh.pipeline import remesh

    result = remesh(surface, n_vertices=n, seed=seed, **options)
    report = result.report()
    return MethodResult(result.surface, {key: report[key] for key in ("seconds", "status", "iterations", "warnings")})


def _vtk_quadric(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    mesh = _polydata(surface).decimate(_reduction(surface, n), **{"volume_preservation": True, **options})
    return MethodResult(_from_polydata(mesh), {})


def _fast_simplification(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    import fast_simplification

    points, faces = fast_simplification.simplify(
        np.array(surface.points), np.array(surface.faces), target_reduction=_reduction(surface, n), **options
    )
    return MethodResult(_used(points, faces), {})


def _acvd(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    import pyacvd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it calls deprecated functions of pyvista
        clustering = pyacvd.Clustering(_polydata(surface))
        while clustering.mesh.n_points < _ACVD_POINTS_PER_CLUSTER * n:
            clustering.subdivide(1)
        clustering.cluster(n, **options)
        return MethodResult(_from_polydata(clustering.create_mesh()), {})


def _pymeshlab(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.array(surface.points), np.array(surface.faces)))
    settings = {"preservenormal": True, "preservetopology": True, "planarquadric": True, **options}
    faces = round(surface.n_faces * (1.0 - _reduction(surface, n)))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces, **settings)
    mesh = meshes.current_mesh()
    return MethodResult(_used(mesh.vertex_matrix(), mesh.face_matrix()), {})


def _mmg(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    """Run mmgs with its own anisotropic metric and the Hausdorff distance that gives n vertices."""
    return _mmg_search(
        surface, n, lambda size, mesh: {"anisosize": 1, "hausd": size, **options}, start=_MMG_START_HAUSDORFF
    )


def _mmg_with_metric(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> MethodResult:
    """Run mmgs with the metric of anisomesh and the edge length that gives n vertices."""
    from anisomesh.metric.tensors import compute_metric

    frame = unit_frame(surface.points)
    unit = surface.with_points(frame.to_unit(surface.points))
    tensors = compute_metric(unit, options.get("metric", "curvature"))
    upper = np.ascontiguousarray(tensors[:, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]])

    def settings(size: float, mesh: Any) -> dict[str, Any]:
        mesh.set_field("tensor", upper / size**2)
        return {"hausd": 1.0, "hgrad": -1.0}  # the metric alone decides

    return _mmg_search(surface, n, settings, start=float(np.sqrt(unit.area / n)))


def _mmg_search(
    surface: Surface, n: int, settings: Callable[[float, Any], dict[str, Any]], *, start: float
) -> MethodResult:
    """Run mmgs at bounding-box diagonal 1 with better and better sizes until the count is within 2 % of n."""
    import mmgpy

    frame = unit_frame(surface.points)
    points = frame.to_unit(surface.points)
    size, power = start, -1.0  # the count is about proportional to size**power, fitted to the runs
    tried: list[tuple[float, int, Any]] = []
    while len(tried) < _MAX_MMG_RUNS:
        mesh = mmgpy.MmgMeshS(np.array(points), np.array(surface.faces))
        begin = time.perf_counter()
        mesh.remesh(verbose=-1, **settings(size, mesh))
        seconds = time.perf_counter() - begin
        tried.append((size, len(mesh.get_vertices()), mesh))
        best = min(tried, key=lambda run: abs(run[1] - n))
        if abs(best[1] - n) <= _MMG_COUNT_TOLERANCE * n:
            break
        if len(tried) > 1 and tried[-1][1] != tried[-2][1]:
            steps = [np.log(tried[-1][k] / tried[-2][k]) for k in (0, 1)]
            power = float(np.clip(steps[1] / steps[0], *_MMG_POWERS))
        size = best[0] * float(np.clip((n / best[1]) ** (1.0 / power), *_MMG_STEPS))
        size = _between(size, tried, n)
    result = _used(best[2].get_vertices(), best[2].get_triangles())
    model = Surface(frame.to_model(result.points), result.faces)
    return MethodResult(model, {"runs": len(tried), "seconds_of_one_run": seconds})


def _between(size: float, tried: list[tuple[float, int, Any]], n: int) -> float:
    """Return a size, or the geometric mean of the bracketing sizes of earlier runs if it is outside the bracket."""
    low = max((run[0] for run in tried if run[1] > n), default=0.0)
    high = min((run[0] for run in tried if run[1] <= n), default=np.inf)
    return size if low < size < high or low >= high else float(np.sqrt(low * high))


METHODS = {
    "anisomesh": Method(_anisomesh),
    "vtk-quadric": Method(_vtk_quadric, ("pyvista",)),
    "fast-simplification": Method(_fast_simplification, ("fast_simplification",)),
    "acvd": Method(_acvd, ("pyacvd", "pyvista")),
    "pymeshlab-quadric": Method(_pymeshlab, ("pymeshlab",)),
    "mmg": Method(_mmg, ("mmgpy",)),
    "mmg-metric": Method(_mmg_with_metric, ("mmgpy",)),
}
"""All methods by name. The options in a suite are passed to the function of the library."""


def _reduction(surface: Surface, n: int) -> float:
    """Return the share of faces to remove for about n points."""
    return float(np.clip(1.0 - n / surface.n_points, 0.0, 1.0))


def _polydata(surface: Surface) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(surface.points, surface.faces)


def _from_polydata(mesh: Any) -> Surface:
    return _used(np.asarray(mesh.points), np.asarray(mesh.regular_faces))


def _used(points: Any, faces: Any) -> Surface:
    """Return a surface without unused points."""
    if len(faces) == 0:
        raise AnisomeshError("the method left no triangles")
    used, inverse = np.unique(faces, return_inverse=True)
    return Surface(np.asarray(points)[used], inverse.reshape(-1, 3))

"""The methods that a suite can run: ours, and other remeshers where they are installed."""

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

_MOST_RUNS = 8


class Produced(NamedTuple):
    """A remesh, and what its method says about the run (seconds per stage, status), for the row."""

    surface: Surface
    facts: dict[str, Any]


@dataclass(frozen=True)
class Remesher:
    """A function (surface, vertices wanted, seed, options) -> produced, and the packages that it needs."""

    run: Callable[[Surface, int, int, dict[str, Any]], Produced]
    packages: tuple[str, ...] = ()
    isolated: bool = False  # in a process of its own, because it can end the process

    @property
    def missing(self) -> list[str]:
        """The packages that are not installed here."""
        return [name for name in self.packages if importlib.util.find_spec(name) is None]


def _anisomesh(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    from anisomesh.pipeline import remesh

    result = remesh(surface, n_vertices=n, seed=seed, **options)
    report = result.report()
    return Produced(result.surface, {key: report[key] for key in ("seconds", "status", "iterations", "warnings")})


def _vtk_quadric(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    mesh = _polydata(surface).decimate(_reduction(surface, n), **{"volume_preservation": True, **options})
    return Produced(_from_polydata(mesh), {})


def _fast_simplification(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    import fast_simplification

    points, faces = fast_simplification.simplify(
        np.array(surface.points), np.array(surface.faces), target_reduction=_reduction(surface, n), **options
    )
    return Produced(_used(points, faces), {})


def _acvd(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    import pyacvd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it uses what pyvista has deprecated
        clustering = pyacvd.Clustering(_polydata(surface))
        while clustering.mesh.n_points < 10 * n:  # its own advice: ten input points a cluster
            clustering.subdivide(1)
        clustering.cluster(n, **options)
        return Produced(_from_polydata(clustering.create_mesh()), {})


def _pymeshlab(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.array(surface.points), np.array(surface.faces)))
    settings = {"preservenormal": True, "preservetopology": True, "planarquadric": True, **options}
    faces = round(surface.n_faces * (1.0 - _reduction(surface, n)))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=faces, **settings)
    mesh = meshes.current_mesh()
    return Produced(_used(mesh.vertex_matrix(), mesh.face_matrix()), {})


def _mmg(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    """Run mmgs with its own anisotropic metric, at the Hausdorff distance that gives the number of vertices."""
    return _mmg_search(surface, n, lambda size, mesh: {"anisosize": 1, "hausd": size, **options}, start=1e-3)


def _mmg_with_metric(surface: Surface, n: int, seed: int, options: dict[str, Any]) -> Produced:
    """Run mmgs with the metric of anisomesh, at the edge length that gives the number of vertices."""
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
) -> Produced:
    """Run mmgs at bounding-box diagonal 1 with ever better sizes, until the count is within 2 % of n."""
    import mmgpy

    frame = unit_frame(surface.points)
    points = frame.to_unit(surface.points)
    size, power = start, -1.0  # the count is about proportional to a power of the size, found from run to run
    tried: list[tuple[float, int, Any]] = []
    while len(tried) < _MOST_RUNS:
        mesh = mmgpy.MmgMeshS(np.array(points), np.array(surface.faces))
        begin = time.perf_counter()
        mesh.remesh(verbose=-1, **settings(size, mesh))
        seconds = time.perf_counter() - begin
        tried.append((size, len(mesh.get_vertices()), mesh))
        best = min(tried, key=lambda run: abs(run[1] - n))
        if abs(best[1] - n) <= 0.02 * n:
            break
        if len(tried) > 1 and tried[-1][1] != tried[-2][1]:
            steps = [np.log(tried[-1][k] / tried[-2][k]) for k in (0, 1)]
            power = float(np.clip(steps[1] / steps[0], -4.0, -0.25))
        size = best[0] * float(np.clip((n / best[1]) ** (1.0 / power), 0.2, 5.0))
        size = _between(size, tried, n)
    result = _used(best[2].get_vertices(), best[2].get_triangles())
    model = Surface(frame.to_model(result.points), result.faces)
    return Produced(model, {"runs": len(tried), "seconds_of_one_run": seconds})


def _between(size: float, tried: list[tuple[float, int, Any]], n: int) -> float:
    """Return a size, or the geometric middle where it is outside the sizes known to give too many and too few."""
    low = max((run[0] for run in tried if run[1] > n), default=0.0)
    high = min((run[0] for run in tried if run[1] <= n), default=np.inf)
    return size if low < size < high or low >= high else float(np.sqrt(low * high))


METHODS = {
    "anisomesh": Remesher(_anisomesh),
    "vtk-quadric": Remesher(_vtk_quadric, ("pyvista",)),
    "fast-simplification": Remesher(_fast_simplification, ("fast_simplification",)),
    "acvd": Remesher(_acvd, ("pyacvd", "pyvista")),
    "pymeshlab-quadric": Remesher(_pymeshlab, ("pymeshlab",), isolated=True),
    "mmg": Remesher(_mmg, ("mmgpy",), isolated=True),
    "mmg-metric": Remesher(_mmg_with_metric, ("mmgpy",), isolated=True),
}
"""All methods by name. The options of a suite go to the library's own function."""


def _reduction(surface: Surface, n: int) -> float:
    """Return the share of faces to remove so that about n points are left."""
    return float(np.clip(1.0 - n / surface.n_points, 0.0, 1.0))


def _polydata(surface: Surface) -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(surface.points, surface.faces)


def _from_polydata(mesh: Any) -> Surface:
    return _used(np.asarray(mesh.points), np.asarray(mesh.regular_faces))


def _used(points: Any, faces: Any) -> Surface:
    """Return a surface without unused points."""
    if len(faces) == 0:
        raise AnisomeshError("the method left no triangle")
    used, inverse = np.unique(faces, return_inverse=True)
    return Surface(np.asarray(points)[used], inverse.reshape(-1, 3))

"""The methods that a suite can run: ours, and other remeshers where they are installed."""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from anisomesh.errors import AnisomeshError
from anisomesh.surface.mesh import Surface


class Produced(NamedTuple):
    """A remesh, and what its method says about the run (seconds per stage, status), for the row."""

    surface: Surface
    facts: dict[str, Any]


@dataclass(frozen=True)
class Remesher:
    """A function (surface, vertices wanted, seed, options) -> produced, and the packages that it needs."""

    run: Callable[[Surface, int, int, dict[str, Any]], Produced]
    packages: tuple[str, ...] = ()

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


METHODS = {
    "anisomesh": Remesher(_anisomesh),
    "vtk-quadric": Remesher(_vtk_quadric, ("pyvista",)),
    "fast-simplification": Remesher(_fast_simplification, ("fast_simplification",)),
    "acvd": Remesher(_acvd, ("pyacvd", "pyvista")),
    "pymeshlab-quadric": Remesher(_pymeshlab, ("pymeshlab",)),
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

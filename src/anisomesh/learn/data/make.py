"""From one shape to the items that a network learns from: the even mesh, and other meshes of the same shape."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass, field
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from anisomesh._arrays import PointMask, Points, PointTensors
from anisomesh.embedding.direct import embed
from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.learn.data.items import Item
from anisomesh.learn.data.recipe import Recipe
from anisomesh.learn.data.retriangulate import with_random_triangles
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import Frame, thickness, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.working_surface import working_surface
from anisomesh.meshops.collapse import decimate
from anisomesh.metric.curvature import Curvature, principal_curvatures
from anisomesh.metric.quality import transfer_metric_roots
from anisomesh.metric.tensors import curvature_metric, metric_root
from anisomesh.pipeline import remesh
from anisomesh.repair.prepare import prepare
from anisomesh.shapes.implicit import Blobs

_REGULAR = 0.4330127  # thickness of an equilateral triangle
_COUNTS = (0.6, 1.6)  # of the wanted number of points that a mesh may have without being made anew
_EVEN = 0.7  # mean thickness, as a share of the regular one, from which on a mesh is even
_DECIMATED, _STRETCHED = (0.35, 0.75), (0.5, 1.0)  # of the points that such variants have
_GIVEN = 0.5  # mean thickness, as such a share, from which on the curvature of a mesh as it is given is worth learning
_MOST_GIVEN = 4  # times the wanted number of points that such a mesh may have
_SITES = (0.2, 1.0)  # of its points: the numbers of sites that its working surface is for
_SECONDS = 120.0  # for a remesh

MetricOn = Callable[[Surface], tuple[PointTensors, PointMask]]


def require_packages(recipe: Recipe) -> None:
    """Raise ``OptionError`` if a package is missing that a recipe needs."""
    if recipe.evening == "tetwild" and not importlib.util.find_spec("pytetwild"):
        raise OptionError("evening with tetwild needs the package pytetwild: pip install pytetwild")


class UnsuitableError(AnisomeshError):
    """A shape is left out of a data set, for a reason that is no fault."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Made:
    """An item, what kind of mesh it is, and what is written of it in the list of the data set."""

    kind: str
    item: Item
    facts: dict[str, Any] = field(default_factory=dict)


def items_of_mesh(surface: Surface, recipe: Recipe, rng: np.random.Generator) -> list[Made]:
    """Return the items of a mesh: its even mesh first, then the variants.

    Parameters
    ----------
    surface
        Any mesh, in any units.
    recipe
        How items are made.
    rng
        Of the variants.

    Raises
    ------
    UnsuitableError
        If it is flat or round everywhere, or its embedding has too large a residual.
    AnisomeshError
        If it is no mesh, or cannot be made even.

    Notes
    -----
    The targets of variants are the metric of the even mesh, from the closest point: a network that sees a bad
    triangulation is to find what a good one shows. That of the given mesh is its own metric, which depends on its
    triangles: the fit of curvature is over rings of edges.
    """
    given = prepare(surface).surface
    clean = evened(given, recipe)
    is_even = clean is given
    clean = clean.with_points(unit_frame(clean.points).to_unit(clean.points))
    curvature = principal_curvatures(clean)
    reference, roots = ClosestPoints(clean), metric_root(curvature_metric(clean, curvature))

    def metric_on(mesh: Surface) -> tuple[PointTensors, PointMask]:
        facet, weights = reference.locate(mesh.points)
        nearest = clean.faces[facet, weights.argmax(axis=1)]
        found = transfer_metric_roots(reference, roots, mesh.points)
        return found @ found, np.asarray(curvature.trusted[nearest])

    made = _items(clean, metric_on, lambda points: points, recipe, rng)
    if "given" in recipe.variants and not is_even:
        made += _given(given, recipe, rng)
    return made


def items_of_blobs(blobs: Blobs, recipe: Recipe, rng: np.random.Generator) -> list[Made]:
    """Return the same for a shape whose curvature is known exactly, at the points of every mesh of it."""
    rough = blobs.mesh()
    even = remesh(rough, n_vertices=recipe.target, metric="uniform", threads=1, time_limit=_SECONDS).surface
    points = blobs.project(even.points)
    frame = unit_frame(points)

    def metric_on(mesh: Surface) -> tuple[PointTensors, PointMask]:
        curvature = blobs.curvature(frame.to_model(mesh.points))
        scaled = Curvature(
            values=curvature.values * frame.scale, directions=curvature.directions, trusted=curvature.trusted
        )
        return curvature_metric(mesh, scaled), scaled.trusted

    clean = Surface(frame.to_unit(points), even.faces)
    return _items(clean, metric_on, _settling(blobs, frame), recipe, rng)


def evened(surface: Surface, recipe: Recipe) -> Surface:
    """Return a mesh of about the wanted number of even triangles: the same one, if it is like that."""
    low, high = (share * recipe.target for share in _COUNTS)
    if low <= surface.n_points <= high and _regularity(surface) >= _EVEN:
        return surface
    if recipe.evening == "tetwild":
        require_packages(recipe)
        surface = _tetwild(surface)
    result = remesh(surface, n_vertices=recipe.target, metric="uniform", threads=1, time_limit=_SECONDS)
    if result.validity.inverted or result.surface.n_points > high:
        raise UnsuitableError(f"cannot be made even: {'; '.join(result.warnings)}")
    return result.surface


def _items(
    clean: Surface, metric_on: MetricOn, settle: Callable[[Points], Points], recipe: Recipe, rng: np.random.Generator
) -> list[Made]:
    even = _made("even", clean, metric_on, recipe)
    residual, stretch = even.facts["residual"], even.facts["stretch"]
    if residual > recipe.max_residual:
        raise UnsuitableError(f"the embedding is off the metric by {residual:.2f}, more than {recipe.max_residual}")
    if stretch < recipe.min_stretch:
        raise UnsuitableError(f"flat or round everywhere: the mean stretch is {stretch:.3f}")
    makers = {"decimated": _decimated, "stretched": _stretched}
    meshes = {kind: makers[kind](clean, rng) for kind in recipe.variants if kind in makers}
    variants = {kind: mesh.with_points(settle(mesh.points)) for kind, mesh in meshes.items()}
    return [even, *(_made(kind, mesh, metric_on, recipe) for kind, mesh in variants.items())]


def _made(kind: str, mesh: Surface, metric_on: MetricOn, recipe: Recipe) -> Made:
    tensors, trusted = metric_on(mesh)
    embedding = embed(mesh, tensors, max_iterations=recipe.iterations)
    facts = {
        "points": mesh.n_points,
        "faces": mesh.n_faces,
        "residual": round(embedding.residual, 4),
        "stretch": round(embedding.stretch.asked_mean, 4),
        "trusted": round(float(trusted.mean()), 4),
    }
    return Made(kind=kind, item=Item.of(mesh, tensors, embedding.points[:, 3:], trusted), facts=facts)


def _given(surface: Surface, recipe: Recipe, rng: np.random.Generator) -> list[Made]:
    """Return the item of a mesh as it is given, with the curvature measured on it; none if it is not worth learning."""
    if _regularity(surface) < _GIVEN:
        return []
    surface = surface.with_points(unit_frame(surface.points).to_unit(surface.points))
    n_sites = round(surface.n_points * np.exp(rng.uniform(*np.log(_SITES))))
    working = working_surface(surface, n_sites).surface
    if working.n_points > _MOST_GIVEN * recipe.target:
        return []
    curvature = principal_curvatures(working)
    made = _made("given", working, lambda mesh: (curvature_metric(mesh, curvature), curvature.trusted), recipe)
    return [made] if made.facts["residual"] <= recipe.max_residual else []


def _regularity(surface: Surface) -> float:
    """Return the mean thickness of the triangles as a share of that of regular ones."""
    return float(thickness(surface.points[surface.faces]).mean()) / _REGULAR


def _decimated(clean: Surface, rng: np.random.Generator) -> Surface:
    n = round(rng.uniform(*_DECIMATED) * clean.n_points)
    points, faces, _ = decimate(clean.points, clean.faces, n, ClosestPoints(clean))
    return Surface(points, faces)


def _stretched(clean: Surface, rng: np.random.Generator) -> Surface:
    return with_random_triangles(clean, round(rng.uniform(*_STRETCHED) * clean.n_points), rng)


def _settling(blobs: Blobs, frame: Frame) -> Callable[[Points], Points]:
    return lambda points: frame.to_unit(blobs.project(frame.to_model(points)))


def _tetwild(surface: Surface) -> Surface:
    """Return the boundary, seen from outside, of the tetrahedra that pytetwild makes of a surface."""
    import pytetwild

    arrays = np.array(surface.points), np.array(surface.faces, dtype=np.int32)  # it takes no read-only ones
    with TemporaryDirectory() as folder, chdir(folder):  # it leaves a file in the current one
        points, cells = pytetwild.tetrahedralize(*arrays, optimize=False, quiet=True)
    inverted = np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) < 0.0
    cells[inverted] = cells[inverted][:, [1, 0, 2, 3]]
    faces = np.concatenate([cells[:, [1, 2, 3]], cells[:, [0, 3, 2]], cells[:, [0, 1, 3]], cells[:, [0, 2, 1]]])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = faces[first[count == 1]]
    used, outer = np.unique(outer, return_inverse=True)
    return prepare(Surface(points[used], outer.reshape(-1, 3))).surface

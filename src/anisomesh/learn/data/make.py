"""From one shape to its items: a mesh with even triangles, and variants of the same shape with other triangles."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from contextlib import chdir
from dataclasses import dataclass, field
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from anisomesh._arrays import PointMask, PointTensors
from anisomesh.embedding.direct import embed
from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.learn.data.items import Item
from anisomesh.learn.data.recipe import Recipe
from anisomesh.learn.data.remesher import REMESH_SECONDS, Remesher
from anisomesh.learn.data.retriangulate import with_random_triangles
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import thickness, unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.decimation import decimate
from anisomesh.metric.curvature import PrincipalCurvatures, principal_curvatures
from anisomesh.metric.tensors import curvature_metric, metric_root
from anisomesh.metric.transfer import transfer_metric_roots
from anisomesh.repair.prepare import prepare
from anisomesh.shapes.implicit import Blobs
from anisomesh.working.surface import working_surface

# Shares and limits below are heuristic, chosen on training meshes.
_EQUILATERAL_THICKNESS = 0.4330127  # sqrt(3) / 4, area over squared longest side
_EVEN_COUNT_RANGE = (0.6, 1.6)  # of the target: point counts of meshes that are used unchanged
_MIN_EVEN_REGULARITY = 0.7  # mean thickness over the equilateral one of such meshes
_DECIMATED_RANGE, _STRETCHED_RANGE = (0.35, 0.75), (0.5, 1.0)  # of the points of the even mesh: sizes of variants
_MIN_INPUT_REGULARITY = 0.5  # mean thickness over the equilateral one of input meshes whose own metric is an item
_MAX_INPUT_COUNT = 4  # times the target: point count of such meshes
_SITE_RANGE = (0.2, 1.0)  # of their points: numbers of sites that their long edges are split for

MetricOnMesh = Callable[[Surface], tuple[PointTensors, PointMask]]


class UnsuitableError(AnisomeshError):
    """A shape is left out of a data set because nothing can be learnt from it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelledItem:
    """An item, the kind of its mesh (``"even"`` or a variant), and the facts about it in the manifest."""

    kind: str
    item: Item
    facts: dict[str, Any] = field(default_factory=dict)


def require_packages(recipe: Recipe) -> None:
    """Raise ``OptionError`` if a package that a recipe needs is not installed."""
    if recipe.evening == "tetwild" and not importlib.util.find_spec("pytetwild"):
        raise OptionError("evening with tetwild needs the package pytetwild: pip install pytetwild")


def items_of_mesh(surface: Surface, recipe: Recipe, rng: np.random.Generator, remesher: Remesher) -> list[LabelledItem]:
    """Return the items of a mesh: the even mesh first, then the variants.

    Parameters
    ----------
    surface
        Any mesh, in any units.
    recipe
        How items are made.
    rng
        Random numbers of the variants.
    remesher
        Makes meshes even, and stretched.

    Raises
    ------
    UnsuitableError
        If the shape is flat or round everywhere, the residual of its embedding is too large, or it cannot be made even.
    AnisomeshError
        If the mesh cannot be used.

    Notes
    -----
    The target of a variant is the metric of the even mesh at the closest point, so that a network learns the same on a
    bad triangulation as on a good one. The target of the input mesh is its own metric, which depends on its
    triangles because curvature is fitted over rings of edges.
    """
    prepared = prepare(surface).surface
    even = even_mesh(prepared, recipe, remesher)
    clean = _in_unit_frame(even)
    curvature = principal_curvatures(clean)
    reference, roots = ClosestPoints(clean), metric_root(curvature_metric(clean, curvature))

    def metric_on(mesh: Surface) -> tuple[PointTensors, PointMask]:
        facet, weights = reference.locate(mesh.points)
        nearest = clean.faces[facet, weights.argmax(axis=1)]
        found = transfer_metric_roots(reference, roots, mesh.points)
        return found @ found, np.asarray(curvature.trusted[nearest])

    items = [_even_item(clean, metric_on, recipe)]
    variants = _random_variants(clean, recipe, rng, remesher)
    items += [_item_on(kind, mesh, metric_on, recipe) for kind, mesh in variants.items()]
    if "given" in recipe.variants and even is not prepared:
        items += _input_items(prepared, recipe, rng)
    return items


def items_of_blobs(blobs: Blobs, recipe: Recipe, rng: np.random.Generator, remesher: Remesher) -> list[LabelledItem]:
    """Return the items of an implicit shape, with its exact curvature at the points of each mesh.

    See :func:`items_of_mesh`; there is no input mesh.
    """
    rough = blobs.mesh()
    result = remesher(rough, n_vertices=recipe.target, metric="uniform", threads=1, time_limit=REMESH_SECONDS)
    points = blobs.project(result.surface.points)
    frame = unit_frame(points)

    def metric_on(mesh: Surface) -> tuple[PointTensors, PointMask]:
        curvature = blobs.curvature(frame.to_model(mesh.points))
        scaled = PrincipalCurvatures(
            values=curvature.values * frame.scale, directions=curvature.directions, trusted=curvature.trusted
        )
        return curvature_metric(mesh, scaled), scaled.trusted

    clean = Surface(frame.to_unit(points), result.surface.faces)
    items = [_even_item(clean, metric_on, recipe)]
    for kind, mesh in _random_variants(clean, recipe, rng, remesher).items():
        projected = frame.to_unit(blobs.project(frame.to_model(mesh.points)))
        items.append(_item_on(kind, mesh.with_points(projected), metric_on, recipe))
    return items


def even_mesh(surface: Surface, recipe: Recipe, remesher: Remesher) -> Surface:
    """Return a mesh of about the target number of even triangles: the surface itself if it is one.

    Raises
    ------
    UnsuitableError
        If every such mesh has inverted triangles, or the working surface has bad or too many triangles.
    """
    if recipe.evening == "working":
        working = _working_mesh(surface, recipe.target)
        if working.n_points > _MAX_INPUT_COUNT * recipe.target or _regularity(working) < _MIN_INPUT_REGULARITY:
            raise UnsuitableError(f"{working.n_points:,} points with a regularity of {_regularity(working):.2f}")
        return working
    low, high = (share * recipe.target for share in _EVEN_COUNT_RANGE)
    if low <= surface.n_points <= high and _regularity(surface) >= _MIN_EVEN_REGULARITY:
        return surface
    if recipe.evening == "tetwild":
        require_packages(recipe)
        surface = _tetwild_boundary(surface)
    result = remesher(surface, n_vertices=recipe.target, metric="uniform", threads=1, time_limit=REMESH_SECONDS)
    if result.validity.inverted or result.surface.n_points > high:
        raise UnsuitableError(f"cannot be made even: {'; '.join(result.warnings)}")
    return result.surface


def _random_variants(
    clean: Surface, recipe: Recipe, rng: np.random.Generator, remesher: Remesher
) -> dict[str, Surface]:
    """Return the decimated and stretched meshes of a recipe, in its order."""
    variants = {}
    for kind in recipe.variants:
        if kind == "decimated":
            n = round(rng.uniform(*_DECIMATED_RANGE) * clean.n_points)
            variants[kind] = decimate(clean, n, moves=False).surface
        elif kind == "stretched":
            n = round(rng.uniform(*_STRETCHED_RANGE) * clean.n_points)
            variants[kind] = with_random_triangles(clean, n, rng, remesher)
    return variants


def _even_item(clean: Surface, metric_on: MetricOnMesh, recipe: Recipe) -> LabelledItem:
    """Return the item of the even mesh, or raise UnsuitableError."""
    even = _item_on("even", clean, metric_on, recipe)
    residual, stretch = even.facts["residual"], even.facts["stretch"]
    if residual > recipe.max_residual:
        raise UnsuitableError(f"the residual of the embedding is {residual:.2f}, more than {recipe.max_residual}")
    if stretch < recipe.min_stretch:
        raise UnsuitableError(f"flat or round everywhere: the mean stretch is {stretch:.3f}")
    return even


def _item_on(kind: str, mesh: Surface, metric_on: MetricOnMesh, recipe: Recipe) -> LabelledItem:
    tensors, trusted = metric_on(mesh)
    embedding = embed(mesh, tensors, max_iterations=recipe.iterations)
    facts = {
        "points": mesh.n_points,
        "faces": mesh.n_faces,
        "residual": round(embedding.residual, 4),
        "stretch": round(embedding.stretch.target_mean, 4),
        "trusted": round(float(trusted.mean()), 4),
    }
    return LabelledItem(kind=kind, item=Item.of(mesh, tensors, embedding.points[:, 3:], trusted), facts=facts)


def _input_items(surface: Surface, recipe: Recipe, rng: np.random.Generator) -> list[LabelledItem]:
    """Return the item of an input mesh with its own curvature, none if its triangles are bad or too many."""
    if _regularity(surface) < _MIN_INPUT_REGULARITY:
        return []
    surface = _in_unit_frame(surface)
    n_sites = round(surface.n_points * np.exp(rng.uniform(*np.log(_SITE_RANGE))))
    working = _working_mesh(surface, n_sites)
    if working.n_points > _MAX_INPUT_COUNT * recipe.target:
        return []
    curvature = principal_curvatures(working)
    item = _item_on("given", working, lambda mesh: (curvature_metric(mesh, curvature), curvature.trusted), recipe)
    return [item] if item.facts["residual"] <= recipe.max_residual else []


def _working_mesh(surface: Surface, n_sites: int) -> Surface:
    """Return a surface as a remesh to a number of sites works on it."""
    none = np.zeros(len(surface.edges), dtype=bool)
    return working_surface(surface, n_sites, creases=none, tagged=none).surface


def _in_unit_frame(surface: Surface) -> Surface:
    return surface.with_points(unit_frame(surface.points).to_unit(surface.points))


def _regularity(surface: Surface) -> float:
    """Return the mean thickness of the triangles over the thickness of an equilateral one."""
    return float(thickness(surface.points[surface.faces]).mean()) / _EQUILATERAL_THICKNESS


def _tetwild_boundary(surface: Surface) -> Surface:
    """Return the outward oriented boundary of pytetwild's tetrahedral mesh of a surface."""
    import pytetwild

    arrays = np.array(surface.points), np.array(surface.faces, dtype=np.int32)  # it refuses read-only arrays
    with TemporaryDirectory() as folder, chdir(folder):  # it writes a file into the current folder
        points, cells = pytetwild.tetrahedralize(*arrays, optimize=False, quiet=True)
    inverted = np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) < 0.0
    cells[inverted] = cells[inverted][:, [1, 0, 2, 3]]
    faces = np.concatenate([cells[:, [1, 2, 3]], cells[:, [0, 3, 2]], cells[:, [0, 1, 3]], cells[:, [0, 2, 1]]])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    outer = faces[first[count == 1]]
    used, outer = np.unique(outer, return_inverse=True)
    return prepare(Surface(points[used], outer.reshape(-1, 3))).surface

"""The prepared input of a remesh, with everything that the options prescribe at its points and edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, PointMask, Points, PointScalars, PointTensors, real_array
from anisomesh.attributes.charts import Joints, with_seams_at_corners
from anisomesh.attributes.model import Mesh
from anisomesh.errors import MetricError, OptionError
from anisomesh.features.detect import sharp_edges
from anisomesh.features.tagged import tagged_edges
from anisomesh.junctions.cut import Junctions, cut_at_junctions
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.geometry import Frame, even_edge_length
from anisomesh.mesh.surface import Surface
from anisomesh.meshops.anchors import Anchors, places_found
from anisomesh.metric.curvature import DEFAULT_RADIUS
from anisomesh.metric.sizes import checked_sizes
from anisomesh.metric.solution.source import SolutionMetric, checked_values
from anisomesh.metric.tensors import validate_metric
from anisomesh.options import MIN_VERTICES, RemeshOptions
from anisomesh.repair.carried_data import without_t_junctions
from anisomesh.repair.near_points import weld_distance
from anisomesh.repair.prepare import Prepared, PrepareReport, prepare
from anisomesh.resolve import follows_creases, is_designed
from anisomesh.setup.fixed import with_fixed_points

_MAX_BORDER_SHARE = 0.4  # of the vertices asked for, that borders and seams may take; heuristic
_MAX_MEAN_DISTANCE = 0.05  # of the input from the surface of a solution, over the diagonal: another one is a mistake
_LARGEST_DENSITY = 1e30  # and inverse of the smallest, so that energies are far from overflow


class FollowedLines(NamedTuple):
    """Edges (E,) that are prescribed, on smooth borders between regions, and on smooth seams of corner data."""

    tagged: EdgeMask
    borders: EdgeMask
    seams: EdgeMask


class Followed(NamedTuple):
    """Edges (E,) to follow, what they are in words, and what has to be said about others, a sentence each."""

    edges: EdgeMask
    words: str
    remarks: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedInput:
    """A prepared surface with everything that belongs to its points and edges.

    Attributes
    ----------
    prepared
        The prepared surface, or its sheets if these are to be joined.
    junctions
        Where sheets are to be joined, None if nowhere.
    tensors, density
        Metric (V, 3, 3) and density (V,) at its points, None if they are not prescribed.
    solution
        The function to which the mesh is adapted, on a repaired surface, None if there is none.
    sizes
        Lengths of edges at its points (V,), None if there are none or they are a function.
    tagged
        Which of its edges (E,) are features in any case.
    borders, seams
        Which of its edges (E,) are smooth borders between regions, and smooth seams of corner data. Edges of the result
        follow them where there are enough vertices.
    fixed
        Which of its points (V,) stay.
    outline
        Which of its edges (E,) stay as they are: edges of the boundary between fixed points.
    least
        Vertices that a mesh has at least.
    rings
        Rings of edges over which curvature is fitted.
    """

    prepared: Prepared
    junctions: Junctions | None
    tensors: PointTensors | None
    density: PointScalars | None
    solution: SolutionMetric | None
    sizes: PointScalars | None
    tagged: EdgeMask
    borders: EdgeMask
    seams: EdgeMask
    fixed: PointMask
    outline: EdgeMask
    least: int = MIN_VERTICES
    rings: int = DEFAULT_RADIUS

    def checked_count(self, n_vertices: int) -> int:
        """Return a number of vertices, or raise OptionError if more points are kept."""
        if n_vertices < self.least:
            raise OptionError(
                f"{n_vertices:,} vertices are asked for, and keep_points and fixed points of the mesh are "
                f"{self.least:,}; ask for at least as many, or keep fewer points"
            )
        return n_vertices

    def anchors(self, n_vertices: int, frame: Frame) -> Anchors:
        """Return the anchors of a mesh of a number of vertices at bounding-box diagonal 1.

        There are none if more points are fixed than the mesh has vertices. Fixed points on junctions are nodes, at
        which all sheets get a vertex when they are joined.
        """
        surface, anchored = self.prepared.surface, self.fixed
        if self.junctions is not None:
            anchored = self.fixed & ~self.junctions.on_several
            anchored[surface.edges[self.outline]] = True
        if np.count_nonzero(anchored) > n_vertices:
            return Anchors()
        number = np.cumsum(anchored) - 1
        return Anchors(frame.to_unit(surface.points[anchored]), number[surface.edges[self.outline]])

    def to_model(self, points: Points, frame: Frame) -> Points:
        """Return points (n, 3) in model units, fixed ones exactly where they are on the prepared surface."""
        moved = frame.to_model(points)
        places = self.prepared.surface.points[self.fixed]
        if len(places):
            number = places_found(points, frame.to_unit(places))
            moved[number >= 0] = places[number[number >= 0]]
        return moved

    @property
    def surface(self) -> Surface:
        """The prepared surface, its sheets joined."""
        return self.prepared.surface if self.junctions is None else self.junctions.whole

    def features_at(self, n_vertices: int, surface: Surface) -> Followed:
        """Return the edges to follow with a number of vertices.

        ``surface`` is the prepared surface at bounding-box diagonal 1.

        Borders and then seams are followed as long as vertices on them, at the distance of even ones, are not more than
        a share of all.
        """
        spacing = even_edge_length(surface.area, n_vertices)
        followed, remarks = self.tagged.copy(), []
        kinds = ["prescribed edges"] if followed.any() else []
        for what, edges in (("borders between regions", self.borders), ("seams of corner data", self.seams)):
            needed = float(surface.edge_lengths[edges | followed].sum()) / spacing
            if not edges.any():
                continue
            if needed > _MAX_BORDER_SHARE * n_vertices:
                most = f"{_MAX_BORDER_SHARE:.0%} of {n_vertices:,} vertices"
                remarks.append(
                    f"edges do not follow all {what} where these are smooth: that would take about {needed:,.0f}, more "
                    f"than {most}"
                )
            else:
                followed |= edges
                kinds.append(what)
        return Followed(followed, " and ".join(kinds), tuple(remarks))


def prepared_input(mesh: Mesh, options: RemeshOptions, *, joined: bool = True) -> PreparedInput:
    """Return the prepared surface of a mesh, and what the mesh and the options say of its points and edges.

    Parameters
    ----------
    mesh, options
        The mesh and the options.
    joined
        Whether sheets that meet at non-manifold edges are to be joined in the result.

    Raises
    ------
    MeshError
        If nothing is left of the surface after the repair.
    MetricError
        If prescribed tensors are not symmetric positive definite, one per point of the input, or there is not one value
        of a solution per point.
    OptionError
        If densities or sizes are not positive, one per point, features are not edges of the input, or points to keep
        are not points of it.
    """
    surface = mesh.surface
    prepared, fixed = with_fixed_points(mesh, prepare(surface, weld_tolerance=options.weld_tolerance), options)
    least, junctions, lines = int(np.count_nonzero(fixed)), None, _lines(mesh, prepared, options)
    if joined and prepared.junctions.any():
        followed = lines.tagged | lines.borders | lines.seams
        crossing = np.zeros_like(fixed)
        crossing[prepared.surface.edges[followed & ~prepared.junctions]] = True
        junctions = cut_at_junctions(prepared, fixed | crossing)
    if junctions is not None:
        sheets, source = junctions.sheets, prepared.point_source[junctions.source]
        none = np.zeros(len(sheets.edges), dtype=bool)
        fixed = (fixed[junctions.source] & ~junctions.added) | junctions.graph.nodes
        prepared = replace(prepared, surface=sheets, point_source=source, junctions=none)
        inside = sheets.edge_face_count == 2  # junctions are boundaries, and followed as such
        lines = FollowedLines(*(edges & inside for edges in _lines(mesh, prepared, options)))
    tensors = density = None
    if options.has_tensors:
        given = _at_prepared("metric", options.metric, (surface.n_points, 3, 3), prepared, MetricError)
        tensors = validate_metric(given, prepared.surface, numbers=prepared.point_source)
    if options.density is not None:
        density = _at_prepared("density", options.density, (surface.n_points,), prepared, OptionError)
        invalid = np.flatnonzero(~((density > 1.0 / _LARGEST_DENSITY) & (density < _LARGEST_DENSITY)))
        if len(invalid):
            value, where = density[invalid[0]], prepared.point_source[invalid[0]]
            raise OptionError(
                f"density[{where}] = {value:g}; expected a positive weight for each point, below {_LARGEST_DENSITY:g}"
            )
    sizes = None
    if options.size_field is not None and not callable(options.size_field):
        given = _at_prepared("size_field", options.size_field, (surface.n_points,), prepared, OptionError)
        sizes = checked_sizes(given, prepared.surface.points, prepared.point_source)
    return PreparedInput(
        prepared=prepared,
        junctions=junctions,
        tensors=tensors,
        density=density,
        solution=_solution(options.metric, surface, prepared) if isinstance(options.metric, SolutionMetric) else None,
        sizes=sizes,
        tagged=lines.tagged,
        borders=lines.borders,
        seams=lines.seams,
        fixed=fixed,
        least=MIN_VERTICES if options.keep_points is None else max(MIN_VERTICES, least),
        outline=np.zeros(len(prepared.surface.edges), dtype=bool),
    )


def with_split_sides(mesh: Mesh, report: PrepareReport, options: RemeshOptions) -> Mesh:
    """Return a mesh with sides of faces split as the repair has split them, so that borders and seams are edges."""
    if mesh.is_bare or not (report.sides_split or report.faces_degenerate):
        return mesh
    return without_t_junctions(mesh, weld_distance(mesh.surface, options.weld_tolerance))


def _solution(metric: SolutionMetric, surface: Surface, prepared: Prepared) -> SolutionMetric:
    """Return the metric of a solution on a repaired surface: the prepared one, or the one that the metric has."""
    if metric.surface is None:
        values = checked_values(metric.values, surface.n_points)[prepared.point_source]
        return replace(metric, values=values, surface=prepared.surface)
    own = prepare(metric.surface)
    distance = np.sqrt(ClosestPoints(own.surface).squared_distances(prepared.surface.points)).mean()
    if distance > _MAX_MEAN_DISTANCE * prepared.surface.diagonal:
        raise MetricError(
            f"the surface of the solution is {distance:.3g} from the points of the input on average, "
            f"{distance / prepared.surface.diagonal:.0%} of the diagonal; expected a mesh of the same surface"
        )
    return replace(metric, values=checked_values(metric.values)[own.point_source], surface=own.surface)


def _lines(mesh: Mesh, prepared: Prepared, options: RemeshOptions) -> FollowedLines:
    """Return the lines on a prepared surface that the edges of the result are to follow."""
    prescribed = [mesh.features, *([] if options.features is None else [options.features])]
    tagged = _tagged(prescribed, mesh.surface, prepared.surface, options)
    return FollowedLines(tagged, *_borders(with_split_sides(mesh, prepared.report, options), prepared.surface, options))


def _tagged(
    prescribed: Sequence[npt.ArrayLike], surface: Surface, prepared: Surface, options: RemeshOptions
) -> EdgeMask:
    """Return the edges (E,) of the prepared surface that are in any of some lists of edges of the input (n, 2)."""
    tagged = np.zeros(len(prepared.edges), dtype=bool)
    for pairs in prescribed:
        tagged |= tagged_edges(surface, pairs, prepared, options.weld_tolerance)
    return tagged


def _borders(mesh: Mesh, prepared: Surface, options: RemeshOptions) -> tuple[EdgeMask, EdgeMask]:
    """Return the smooth borders between regions of a mesh, and the smooth seams of its corner data, as edges (E,).

    Sharp ones of designed surfaces are followed anyway.
    """
    borders, seams = np.zeros((2, len(prepared.edges)), dtype=bool)
    if not options.attributes or not options.regions or not (mesh.regions or mesh.corner_data or mesh.point_data):
        return borders, seams
    joints = Joints(mesh.surface, weld_distance(mesh.surface, options.weld_tolerance))
    lines = [joints.region_borders(mesh.parts)] if mesh.regions else []
    borders = _tagged(lines, mesh.surface, prepared, options)
    corner_data = with_seams_at_corners(mesh, joints).corner_data
    lines = [joints.seams(joints.continuous(values)) for values in corner_data.values()]
    seams = _tagged(lines, mesh.surface, prepared, options) & ~borders
    if follows_creases(options) and is_designed(prepared):
        smooth = ~sharp_edges(prepared, options.feature_angle)
        borders, seams = borders & smooth, seams & smooth
    return borders, seams


def _at_prepared(
    name: str, values: Any, shape: tuple[int, ...], prepared: Prepared, error: type[Exception]
) -> npt.NDArray[np.float64]:
    """Return values at the points of the input as values at the prepared points."""
    given = real_array(name, values, shape if len(shape) > 1 else (None,), error)
    if len(given) != shape[0]:
        raise error(f"{name} has {len(given):,} values; expected {shape[0]:,}, one for each point of the mesh")
    return np.asarray(given[prepared.point_source])

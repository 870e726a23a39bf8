"""The prepared input of a remesh, with everything that the options prescribe at its points and edges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, PointScalars, PointTensors, real_array
from anisomesh.errors import MetricError, OptionError
from anisomesh.features.tagged import tagged_edges
from anisomesh.mesh.surface import Surface
from anisomesh.metric.sizes import checked_sizes
from anisomesh.metric.tensors import validate_metric
from anisomesh.options import RemeshOptions
from anisomesh.repair.prepare import Prepared, prepare

_LARGEST_DENSITY = 1e30  # and inverse of the smallest, so that energies are far from overflow


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedInput:
    """A prepared surface with everything that belongs to its points and edges.

    Attributes
    ----------
    prepared
        The prepared surface.
    tensors, density
        Metric (V, 3, 3) and density (V,) at its points, None if they are not prescribed.
    sizes
        Lengths of edges at its points (V,), None if there are none or they are a function.
    tagged
        Which of its edges (E,) are features in any case.
    """

    prepared: Prepared
    tensors: PointTensors | None
    density: PointScalars | None
    sizes: PointScalars | None
    tagged: EdgeMask


def prepared_input(surface: Surface, options: RemeshOptions) -> PreparedInput:
    """Return the prepared surface and what the options say of its points and edges.

    Raises
    ------
    MeshError
        If nothing is left of the surface after the repair.
    MetricError
        If prescribed tensors are not symmetric positive definite, one per point of the input.
    OptionError
        If densities or sizes are not positive, one per point, or features are not edges of the input.
    """
    prepared = prepare(surface, weld_tolerance=options.weld_tolerance)
    tensors = density = None
    if not isinstance(options.metric, str) and not callable(options.metric):
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
    tagged = np.zeros(len(prepared.surface.edges), dtype=bool)
    if options.features is not None:
        tagged = tagged_edges(surface, options.features, prepared.surface, options.weld_tolerance)
    return PreparedInput(prepared=prepared, tensors=tensors, density=density, sizes=sizes, tagged=tagged)


def _at_prepared(
    name: str, values: Any, shape: tuple[int, ...], prepared: Prepared, error: type[Exception]
) -> npt.NDArray[np.float64]:
    """Return values at the points of the input as values at the prepared points."""
    return np.asarray(real_array(name, values, shape, error)[prepared.point_source])

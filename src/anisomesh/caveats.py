"""What a user should know about a result."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from anisomesh._arrays import Points
from anisomesh.cvt.lbfgs import Optimised, Status
from anisomesh.delaunay.meshing import ValidMesh
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity
from anisomesh.metric.conformity import Conformity
from anisomesh.options import RemeshOptions
from anisomesh.repair.prepare import PrepareReport
from anisomesh.resolve import embedding_name, is_designed

_AT_CORNER = 1e-3  # of the diagonal, within which a vertex is at a corner
_VOLUME_TOLERANCE = 0.05  # share by which the enclosed volume may change without a remark
_FEATURE_TOLERANCE = 0.25  # mean edge lengths from prescribed edges to edges of the result without a remark
_OFF_SHARE = 0.05  # of a mesh on which lengths may be off without a remark
COUNT_TOLERANCE = 0.02  # share of the vertices asked for by which a result may differ without a remark


def losses_of_repair(report: PrepareReport, *, joined: bool) -> Iterator[str]:
    """Yield one sentence for everything that the repair of the input has taken apart.

    ``joined`` if sheets are joined again.
    """
    if report.edges_nonmanifold_cut and not joined:
        count = report.edges_nonmanifold_cut
        yield f"the sheets that meet at {count:,} edges with more than two faces are separate in the result"
    if report.edges_nonorientable_cut:
        yield f"the surface has one side only, and was cut open along {report.edges_nonorientable_cut:,} edges"


def losses_of_shape(
    surface: Surface, mesh: Surface, corner_places: Points, feature_distance: float = 0.0, followed: str = "lines"
) -> Iterator[str]:
    """Yield one sentence for everything that a mesh has lost of the shape of a surface.

    Parameters
    ----------
    surface, mesh
        The surface and the mesh, in the same units.
    corner_places
        Where a designed surface has corners of creases and apexes (n, 3).
    feature_distance
        Largest distance from the lines that edges are to follow to the edges that do.
    followed
        What these lines are.
    """
    if feature_distance > _FEATURE_TOLERANCE * mesh.edge_lengths.mean():
        yield f"not all {followed} are edges of the result; ask for more vertices"
    if len(corner_places) and is_designed(surface):
        distance = cKDTree(mesh.points).query(corner_places)[0]
        lost = np.count_nonzero(distance > _AT_CORNER * surface.diagonal)
        if lost:
            yield f"{lost:,} of {len(corner_places):,} corners have no vertex; ask for more vertices"
    before, after = surface.volume, mesh.volume
    if before is not None and after is not None and abs(after - before) > _VOLUME_TOLERANCE * abs(before) > 0.0:
        change = abs(after - before) / abs(before)
        word = "larger" if abs(after) > abs(before) else "smaller"
        yield f"the enclosed volume is {change:.0%} {word} than before; ask for more vertices"


def unfollowed_sizes(agreement: Conformity) -> Iterator[str]:
    """Yield a sentence if edges do not have the lengths that a metric asks for on a considerable part of a mesh."""
    if agreement.off_share >= _OFF_SHARE:
        smaller = "more vertices" if agreement.asked is None else "smaller sizes"
        yield (
            f"edges do not have the lengths that the metric asks for on {agreement.off_share:.0%} of the mesh, where "
            f"they are up to {agreement.off_factor:.2f} times as long; ask for {smaller}, or sizes that vary less"
        )


def lengths_beyond(surface: Surface, options: RemeshOptions, max_error: float | None) -> Iterator[str]:
    """Yield one sentence for a length asked for, in model units, that is larger than a surface."""
    sizes = options.size_field
    lengths = {"max_error": max_error}
    if isinstance(options.metric, str) or callable(options.metric):  # else lengths are in a metric without a unit
        lengths["edge_length"] = options.edge_length
        if sizes is not None and not callable(sizes):
            lengths["size_field"] = float(np.min(np.asarray(sizes)))
        lengths["min_size"] = options.min_size
    for name, length in lengths.items():
        if length is not None and length > surface.diagonal:
            yield (
                f"{name} {length:g} is larger than the whole mesh, whose bounding-box diagonal is "
                f"{surface.diagonal:.4g}; the result has as few vertices as possible"
            )


def unused_metric(options: RemeshOptions) -> Iterator[str]:
    """Yield a sentence if sizes or tensors are prescribed, for a mesh of which the distance is prescribed too."""
    if options.size_field is not None or options.has_tensors:
        what = "sizes" if options.size_field is not None else "tensors"
        yield f"with max_error only the distance counts: edges do not have the lengths that the {what} ask for"


def caveats(
    n: int, noise: float, mesh: ValidMesh, validity: Validity, optimised: Optimised, options: RemeshOptions
) -> Iterator[str]:
    """Yield one sentence for everything that a user should know about a result of n vertices asked for."""
    n_points = len(mesh.points)
    name = embedding_name(options)
    if options.device != "cpu" and name in ("direct", "filtered"):
        yield f"the device {options.device!r} was not used, since the {name} embedding uses no network"
    if noise > 0.0:
        yield f"noise of {noise:.2f} mean edge lengths was removed first; the result follows the denoised surface"
    if optimised.status is Status.TIME_LIMIT:
        count = optimised.iterations
        yield f"the time limit of {options.time_limit:g} s ended the optimisation after {count} iterations"
    if mesh.from_input:
        yield (
            f"{n:,} vertices are too few for the topology of the surface; the input itself was coarsened instead, and "
            "its triangles do not follow the metric: ask for more vertices"
        )
    stays = options.lock is not None or options.keep_points is not None
    if abs(n_points - n) > (0.0 if stays else COUNT_TOLERANCE * n):
        why = "fewer would fold the surface or change its topology" if n_points > n else "it has no more"
        yield f"{n_points:,} vertices instead of {n:,}: {why}{', beside what stays' if stays else ''}"
    if validity.euler != validity.euler_input:
        yield f"the Euler characteristic is {validity.euler} instead of {validity.euler_input}; ask for more vertices"
    if validity.flat:
        yield f"{validity.flat:,} triangles have no area"
    if validity.inverted:
        yield f"{validity.inverted:,} triangles are inverted against the input surface"
    if validity.new_intersections:
        yield f"{validity.new_intersections:,} pairs of triangles intersect where the input does not"

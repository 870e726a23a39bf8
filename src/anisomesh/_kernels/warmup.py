"""Entry points of the kernels, and whether they are compiled."""

from __future__ import annotations

from pathlib import Path

from anisomesh._kernels import (
    connectivity,
    decimate,
    diagram,
    fit_moves,
    fit_planes,
    fit_samples,
    fit_splits,
    graph_hierarchy,
    integrate,
    intersections,
    local_step,
    messages,
    neighbours,
    orientation,
    products,
    rings,
)

_REMESH = (
    connectivity.sort_sides,
    connectivity.number_edges,
    connectivity.has_single_fans,
    integrate.integrate_chunk,
    integrate.gather,
    diagram.count_chunk,
    diagram.write_chunk,
    neighbours.refresh_lists,
    neighbours.age_lists,
    neighbours.displacements,
    neighbours.walk,
    local_step.local_step,
    rings.mean_ring_lengths,
)
_FIT = (  # exchanges of edges compile more, where there are any
    fit_moves.move_points,
    fit_moves.flip_edges,
    fit_samples.walk_samples,
    fit_samples.average_roots,
    fit_samples.list_samples,
    fit_samples.sample_errors,
    fit_samples.sum_in_order,
    fit_samples.quality_sum,
    fit_planes.face_planes,
    fit_planes.place_on_planes,
    fit_splits.split_gains,
)
_DECIMATE = (decimate.set_quadrics, decimate.decimate)
_NETWORK = (
    products.add_product,
    messages.mean_messages,
    graph_hierarchy.maximal_independent_set,
    graph_hierarchy.edge_geometry,
    graph_hierarchy.fit_normal_curvature,
    graph_hierarchy.edge_statistics,
    graph_hierarchy.edge_features,
    graph_hierarchy.transport_to_points,
)
_TRAIN = (
    *_NETWORK,
    messages.mean_messages_gradient,
    messages.max_messages,
    messages.max_messages_gradient,
    messages.feature_distances,
    messages.feature_distances_gradient,
)
_EVALUATE = (orientation.choose_axes, intersections.sort_into_tree, intersections.find_pairs)
ENTRY_POINTS = {
    "remesh": _REMESH,
    "fit": _FIT,
    "decimate": _DECIMATE,
    "evaluate": _EVALUATE,
    "network": _NETWORK,
    "train": _TRAIN,
}
"""Kernels that each command calls."""


def kernels_cached(work: str = "remesh") -> bool:
    """Return whether all kernels of a command are cached on disk and newer than their source, or compilation is off."""
    if not hasattr(integrate.gather, "py_func"):  # NUMBA_DISABLE_JIT
        return True
    for kernel in ENTRY_POINTS[work]:
        function = kernel.py_func
        pattern = f"{function.__module__.rsplit('.', 1)[-1]}.{function.__qualname__}-*.nbi"
        changed = Path(function.__code__.co_filename).stat().st_mtime
        indices = list(Path(kernel.stats.cache_path or "").glob(pattern))
        if not any(index.stat().st_mtime >= changed for index in indices):
            return False
    return True

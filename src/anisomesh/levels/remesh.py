"""The remesh to levels of detail, each of which begins with sites of the next finer one."""

from __future__ import annotations

import logging
import os
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise
from typing import Any

from anisomesh.counts.target import read_levels
from anisomesh.errors import OptionError, TimeLimitError
from anisomesh.execution.deadline import Deadline
from anisomesh.execution.progress import OnStep, StepInfo, ignore_steps
from anisomesh.execution.run import Run
from anisomesh.io.meshes import mesh_of
from anisomesh.levels.model import Levels
from anisomesh.options import MIN_VERTICES, RemeshOptions, with_overrides
from anisomesh.pipeline import Manner, RemeshedLevel, cut_input, joined_or_apart, with_attributes
from anisomesh.result import RemeshResult
from anisomesh.setup.lock import Cut

logger = logging.getLogger(__name__)


def remesh_levels(
    mesh: Any,
    *,
    n_vertices: Sequence[int] | None = None,
    ratios: Sequence[float] | None = None,
    options: RemeshOptions | None = None,
    on_step: OnStep | None = None,
    **overrides: Any,
) -> Levels:
    """Remesh a triangle mesh anisotropically with several numbers of vertices, its levels of detail.

    Parameters
    ----------
    mesh
        As for :func:`~anisomesh.pipeline.remesh`; arrays as ``Surface(points, faces)``.
    n_vertices
        Vertices of each level, at least 4, no two the same, in any order.
    ratios
        Instead of ``n_vertices``: shares of the vertices of the prepared input, such as ``[1, 0.5, 0.2, 0.05]``.
    options
        See :class:`RemeshOptions`; keyword arguments of the same names take precedence. The time limit is for all
        levels together; an ``edge_length`` is not possible.
    on_step
        As for :func:`~anisomesh.pipeline.remesh`.

    Returns
    -------
    Levels
        One result for each level, the finest first.

    Raises
    ------
    AnisomeshError
        As for :func:`~anisomesh.pipeline.remesh`; ``OptionError`` also if two levels have the same number of vertices,
        or one has fewer than are locked or kept.

    Notes
    -----
    The input is prepared, its metric measured and embedded once, for the finest level. Each level begins with the most
    evenly spread of the sites of the next finer one, which takes a short optimisation only; whatever else depends on
    the number of vertices, such as the creases that are followed and the fit, is as in a remesh with that number. The
    metric is embedded anew where it depends on that number too, at thin walls and narrow patches.
    """
    for name in ("ratio", "max_error"):
        if name in overrides:
            raise OptionError(f"{name} says how many vertices one mesh has; give the levels as n_vertices or as ratios")
    options = with_overrides(RemeshOptions() if options is None else options, overrides)
    if on_step is not None and not callable(on_step):
        raise OptionError(f"on_step = {on_step!r}; expected a function of a StepInfo")
    counts, shares = read_levels(n_vertices, ratios, options)
    total = Deadline(options.time_limit)
    run = Run(on_step or ignore_steps, total)
    with run.stage("load") if isinstance(mesh, str | os.PathLike) else nullcontext():
        given = mesh_of(mesh)
    cut = cut_input(given, options, run)
    if counts is None:
        counts = [max(MIN_VERTICES, round(share * cut.whole.surface.n_points)) for share in shares or []]
    counts = _checked(counts, cut)
    results: list[RemeshResult] = []
    level: RemeshedLevel | None = None
    for k, n in enumerate(counts):
        run = run if k == 0 else Run(run.on_step, Deadline())
        run.deadline = _deadline_of(total, run.deadline, counts[k:])
        run.on_step(StepInfo(stage="level", message=f"{k}: {n:,} vertices"))
        try:
            level = joined_or_apart(given, cut, n, options, run, Manner(finer=None if level is None else level.finer))
        except TimeLimitError as error:
            raise TimeLimitError(f"level {k} has its share of the time limit of {total.limit:g} s: {error}") from error
        result = replace(level.result, warnings=cut.remarks) if cut.is_all else level.result
        results.append(with_attributes(result, given, cut, options, run))
        logger.info("level %d: %r", k, results[-1])
    return Levels(tuple(results))


def _checked(counts: Sequence[int], cut: Cut) -> list[int]:
    """Return the numbers of vertices from the largest to the smallest, or raise OptionError before any work."""
    ordered = sorted(counts, reverse=True)
    for n, following in pairwise(ordered):
        if n == following:
            raise OptionError(f"two levels have {n:,} vertices; give levels with different numbers")
    if cut.is_all and len(ordered) > 1:
        raise OptionError("all faces are locked, so all levels would be the input; lock fewer")
    for n in ordered:
        cut.count_of_rest(n)
    return ordered


def _deadline_of(total: Deadline, own: Deadline, counts: Sequence[int]) -> Deadline:
    """Return the deadline of the first of some levels, which has a share of the time left in proportion to its count.

    It counts from the start of the level.
    """
    if total.limit is None:
        return own
    gone = own.start - total.start
    return Deadline((total.limit - gone) * counts[0] / sum(counts), own.start)

"""Levels of detail: one mesh with several numbers of vertices, each level made from the next finer one."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, overload

import numpy.typing as npt

from anisomesh.counts.target import read_levels
from anisomesh.errors import OptionError
from anisomesh.execution.deadline import Deadline
from anisomesh.execution.progress import OnStep, StepInfo, ignore_steps
from anisomesh.execution.run import Run
from anisomesh.io.describe import html_table
from anisomesh.io.levels import save_meshes
from anisomesh.io.meshes import mesh_of
from anisomesh.options import MIN_VERTICES, RemeshOptions, with_overrides
from anisomesh.pipeline import Remeshed, cut_input, joined_or_apart, with_attributes
from anisomesh.result import RemeshResult
from anisomesh.setup.lock import Cut

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Levels(Sequence[RemeshResult]):
    """Levels of detail, from the finest to the coarsest; a sequence of :class:`~anisomesh.result.RemeshResult`.

    Attributes
    ----------
    results
        The levels. Each has its own seconds; what is computed once for all is in the seconds of the first.
    """

    results: tuple[RemeshResult, ...]

    def __len__(self) -> int:
        return len(self.results)

    @overload
    def __getitem__(self, index: int) -> RemeshResult: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[RemeshResult, ...]: ...

    def __getitem__(self, index: int | slice) -> RemeshResult | tuple[RemeshResult, ...]:
        return self.results[index]

    def __iter__(self) -> Iterator[RemeshResult]:
        return iter(self.results)

    def __repr__(self) -> str:
        counts = ", ".join(f"{level.surface.n_points:,}" for level in self)
        return f"Levels({counts} vertices, {self.seconds:.1f} s)"

    def _repr_html_(self) -> str:
        return html_table("Levels", [(f"level {k}", repr(level)) for k, level in enumerate(self)])

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of all levels together."""
        return sum(level.seconds["total"] for level in self)

    def report(self) -> dict[str, Any]:
        """Return the figures of all levels as a dictionary that JSON can hold."""
        return {"levels": [level.report() for level in self], "seconds": self.seconds}


def remesh_levels(
    mesh: Any,
    faces: npt.NDArray[Any] | None = None,
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
    mesh, faces
        As for :func:`~anisomesh.pipeline.remesh`.
    n_vertices
        Vertices of each level, at least 4, no two the same, in any order.
    ratios
        Instead of ``n_vertices``: vertices as shares of those of the prepared input, such as ``[1, 0.5, 0.2, 0.05]``.
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
    options = with_overrides(RemeshOptions() if options is None else options, overrides)
    if on_step is not None and not callable(on_step):
        raise OptionError(f"on_step = {on_step!r}; expected a function of a StepInfo")
    counts, shares = read_levels(n_vertices, ratios, options)
    total = Deadline(options.time_limit)
    run = Run(on_step or ignore_steps, total)
    with run.stage("load") if isinstance(mesh, str | os.PathLike) else nullcontext():
        given = mesh_of(mesh, faces)
    cut = cut_input(given, options, run)
    if counts is None:
        counts = [max(MIN_VERTICES, round(share * cut.whole.surface.n_points)) for share in shares or []]
    counts = _checked(counts, cut)
    results: list[RemeshResult] = []
    level: Remeshed | None = None
    for k, n in enumerate(counts):
        run = run if k == 0 else Run(run.on_step, Deadline())
        run.deadline = _deadline_of(total, run.deadline, counts[k:])
        run.on_step(StepInfo(stage="level", message=f"{k}: {n:,} vertices"))
        level = joined_or_apart(given, cut, n, options, run, finer=None if level is None else level.finer)
        result = replace(level.result, warnings=cut.remarks) if cut.is_all else level.result
        results.append(with_attributes(result, given, cut, options, run) if options.attributes else result)
        logger.info("level %d: %r", k, results[-1])
    return Levels(tuple(results))


def save_levels(levels: Levels, path: str | os.PathLike[str], *, file_format: str | None = None) -> list[Path]:
    """Write levels of detail with everything that they carry, all or none of their files.

    Parameters
    ----------
    levels
        The levels.
    path
        For ``out.ply`` the files are ``out.lod0.ply``, ``out.lod1.ply``, ..., the finest first. A ``.glb`` file holds
        all levels, by the extension MSFT_lod; :func:`~anisomesh.io.meshes.load` reads the finest of them.
    file_format
        The format, such as ``"ply"``, if the extension does not name it.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    MeshFileError
        As for :func:`~anisomesh.io.meshes.save`.
    """
    return save_meshes([level.mesh for level in levels], path, file_format=file_format)


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

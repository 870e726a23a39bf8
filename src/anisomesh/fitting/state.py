"""The arrays of a mesh on its way to a fit, and the kernels on them as methods."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from anisomesh._kernels import fit_arrays, fit_collapses, fit_moves, fit_samples, fit_splits
from anisomesh.execution.threads import Workers, blocks
from anisomesh.fitting.arrays import STAYS, FitTask, fit_arrays_of, workspace
from anisomesh.fitting.planes import onto_planes
from anisomesh.fitting.samples import SurfaceSamples
from anisomesh.mesh.surface import Surface

_MIN_RMS = 1e-8  # of the diagonal of the surface: an error that counts as exact
_MAX_DISTANCE = 5.0  # of a vertex from the surface, in root mean squared errors at the start; heuristic
_CHEAP_FACTOR = 8  # times as many splits and collapses as are needed are looked at closely; heuristic
_LISTED_SLACK = 1.5  # factor of the listed cost of a collapse, up to which it is done when its turn comes; heuristic
_PARTS, _MIN_PART = 4, 64  # parts of the points of a colour for each thread, and points of all but the last
_MIN_ITEMS = 2_048  # samples, faces or sides of a part; fewer are done before another thread has started
_ALLOWED = 0.5 * fit_splits.REFUSED

Work = Callable[[int, fit_arrays.Fit, int, int], None]
"""Work of a thread, on its view of the arrays, on items from one number to another."""


class FitState:
    """A mesh that is changed in place, with room for more points while it is.

    Parameters
    ----------
    task
        The mesh at the start.
    samples
        Samples of the surface that it is fitted to.
    n_spare
        Points that it may have more while edges are exchanged.
    threads
        Number of threads that move points.

    Attributes
    ----------
    fit
        The arrays.
    mean_square
        Mean squared distance of the samples at the start, at least the one that counts as exact.
    """

    def __init__(self, task: FitTask, samples: SurfaceSamples, n_spare: int, threads: int = 1) -> None:
        self.fit = fit_arrays_of(task, samples, n_spare)
        self._samples = samples
        self._workers = Workers(threads)
        patches = (workspace(len(self.fit.freedom)) for _ in range(threads - 1))
        others = (self.fit._replace(patch=patch, place=np.zeros(3)) for patch in patches)
        self._views = [self.fit, *others]  # each with a workspace of its own
        self._colours = np.empty(len(self.fit.freedom), dtype=np.int32)
        self._totals = np.zeros(len(self.fit.mesh.faces))
        self._errors = np.zeros(samples.count)
        self._crease_cosine = float(np.cos(np.radians(task.crease_angle)))
        self._refresh(everywhere=True)
        self._area = float(samples.weights.sum())
        self.mean_square = max(self.error / self._area, _MIN_RMS**2)
        self._max_square = _MAX_DISTANCE**2 * self.mean_square

    @property
    def error(self) -> float:
        """Sum of the weighted squared distances of the samples."""
        return float(fit_samples.sum_in_order(self._sample_errors()))

    @property
    def present_mean_square(self) -> float:
        """Mean squared distance of the samples."""
        return self.error / self._area

    @property
    def mean_triangle_error(self) -> float:
        """Error at the start for each triangle, at least the one that counts as exact."""
        return self.mean_square * self._area / max(self._count_faces(), 1)

    @property
    def mean_quality(self) -> float:
        """Mean quality G of the triangles."""
        total, count = fit_samples.quality_sum(self.fit)
        return float(total / count)

    def energy(self, price: float) -> float:
        """Return error + price sum (1 - G)."""
        total, count = fit_samples.quality_sum(self.fit)
        return float(self.error + price * (count - total))

    def sweep(self, price: float) -> None:
        """Move all active points and flip edges once."""
        self.move(price)
        self.flip(price)
        self._refresh()

    def move(self, price: float) -> int:
        """Move all active points, and return how many have moved; the result is the same for any number of threads."""
        n_colours = fit_moves.colour_points(self.fit, self._colours)
        order = np.argsort(self._colours, kind="stable")
        bounds = np.searchsorted(self._colours[order], np.arange(n_colours + 1))
        count = 0

        def work(thread: int, points: npt.NDArray[np.int64]) -> int:
            return int(fit_moves.move_points(self._views[thread], points, price, self._max_square))

        for start, end in pairwise(bounds.tolist()):
            size = max(_MIN_PART, -(-(end - start) // (_PARTS * len(self._views))))
            count += sum(self._workers.map(work, blocks(order[start:end], size)))
        return count

    def flip(self, price: float) -> int:
        """Flip edges once, and return how many were flipped."""
        return int(fit_moves.flip_edges(self.fit, price))

    def wake(self) -> None:
        """Make all points active."""
        self.fit.active[:] = 1

    def split(self, price: float, count: int) -> int:
        """Split up to ``count`` edges that lower the energy, and return how many; two triangles more cost nothing.

        Every mesh with as many points has as many triangles, so what two triangles of mean quality add to the energy is
        left out.
        """
        fit = self.fit
        points = np.flatnonzero(fit.face_at < 0)[:count].astype(np.int32)
        faces = np.flatnonzero(fit.mesh.faces[:, 0] < 0)[: 2 * count].astype(np.int32)
        sides = self._sides_of_largest_error(_CHEAP_FACTOR * count)
        gains = np.empty(len(sides))

        def work(thread: int, view: fit_arrays.Fit, first: int, last: int) -> None:
            own = points[thread]  # there are as many where there are several parts
            fit_splits.split_gains(view, sides[first:last], price, self._max_square, own, gains[first:last])

        self._in_parts(work, len(sides))
        largest = 2.0 * price * (1.0 - self.mean_quality)
        order = np.argsort(gains, kind="stable")
        sides = sides[order[gains[order] < largest]]
        settings = price, self._max_square, self._crease_cosine, largest
        touched = np.zeros(len(fit.freedom), dtype=np.uint8)
        done = int(fit_splits.split_edges(fit, sides, settings, points, faces, touched))
        self._refresh()
        return done

    def _sides_of_largest_error(self, count: int) -> npt.NDArray[np.int64]:
        """Return sides between two faces, as 3 face + side (n,), the ones with the largest errors of both faces."""
        mesh, errors = self.fit.mesh, np.empty(len(self.fit.mesh.faces))
        fit_samples.face_errors(self.fit, self._sample_errors(), errors)
        own = np.arange(len(errors))[:, None]
        one_of_two = (mesh.faces[:, :1] >= 0) & (own < mesh.neighbours)
        both = np.where(one_of_two, -(errors[:, None] + errors[mesh.neighbours]), np.inf)
        return _cheapest(both, np.inf)[:count]

    def collapse(self, price: float, count: int) -> int:
        """Collapse up to ``count`` edges, the ones that raise the energy least, and return how many.

        Edges are looked at closely in the order of what their quadrics say.
        """
        fit, done = self.fit, 0
        quadrics, estimates = np.empty((len(fit.mesh.faces), 10)), np.empty((len(fit.mesh.faces), 3))
        fit_samples.face_quadrics(fit, quadrics)
        self._in_parts(
            lambda _, view, *part: fit_collapses.collapse_estimates(view, price, quadrics, estimates, *part),
            len(estimates),
        )
        candidates, n_looked = _cheapest(estimates, _ALLOWED), _CHEAP_FACTOR * count
        while done < count and len(candidates):
            sides, candidates = candidates[:n_looked], candidates[n_looked:]
            costs = self._collapse_costs(sides, price)
            order = np.argsort(costs, kind="stable")
            order = order[costs[order] < _ALLOWED]
            limits = np.where(costs > 0.0, _LISTED_SLACK * costs, costs / _LISTED_SLACK)[order]
            now = 1
            while now > 0 and done < count:
                settings, touched = (price, self._max_square, count - done), np.zeros(len(fit.freedom), dtype=np.uint8)
                now = int(fit_collapses.collapse_edges(fit, sides[order], limits, settings, touched))
                done += now
        self._refresh()
        return done

    def _collapse_costs(self, sides: npt.NDArray[np.int64], price: float) -> npt.NDArray[np.float64]:
        """Return what collapses of sides (n,) change the energy by (n,)."""
        fit, costs = self.fit, np.empty(len(sides))
        moved = [fit.mesh._replace(points=fit.mesh.points.copy()) for _ in self._views[1:]]  # points of each thread
        views = [fit, *(view._replace(mesh=mesh) for view, mesh in zip(self._views[1:], moved, strict=True))]

        def work(_: int, view: fit_arrays.Fit, first: int, last: int) -> None:
            fit_collapses.collapse_costs(view, sides[first:last], price, self._max_square, costs[first:last])

        self._in_parts(work, len(sides), views)
        return costs

    def saved(self) -> list[npt.NDArray[np.generic]]:
        """Return copies of all arrays that change."""
        return [array.copy() for array in self._changing()]

    def restore(self, saved: list[npt.NDArray[np.generic]]) -> None:
        """Go back to arrays that were saved."""
        for array, before in zip(self._changing(), saved, strict=True):
            array[...] = before

    def surface(self) -> Surface:
        """Return the mesh, exact in planes; without exchange its points are the ones of the start, in their order."""
        mesh = self.fit.mesh
        movable = self.fit.freedom != STAYS
        points = onto_planes(mesh.points, mesh.faces, self._samples, self.fit.samples.owner, movable)
        used, position = np.unique(mesh.faces[mesh.faces[:, 0] >= 0], return_inverse=True)
        return Surface(points[used], position.reshape(-1, 3).astype(np.int32))

    def _changing(self) -> list[npt.NDArray[np.generic]]:
        fit = self.fit
        mesh, samples = fit.mesh, fit.samples
        lists = [samples.first, samples.following, samples.owner]
        return [mesh.points, mesh.faces, mesh.neighbours, mesh.labels, *lists, fit.roots, fit.face_at, fit.freedom]

    def _count_faces(self) -> int:
        return int(np.count_nonzero(self.fit.mesh.faces[:, 0] >= 0))

    def _refresh(self, *, everywhere: bool = False) -> None:
        """Move samples around active points to the nearest faces, and take the metric of all faces from samples."""
        n_samples, n_faces = len(self._errors), len(self._totals)
        self._in_parts(lambda _, view, *part: fit_samples.walk_samples(view, everywhere, *part), n_samples)
        fit_samples.list_samples(self.fit)
        threads = min(len(self._views), 1 + n_samples // _MIN_ITEMS)
        bounds = np.linspace(0, n_faces, threads + 1).astype(int).tolist()  # each looks at all samples
        self._workers.map(
            lambda _, part: fit_samples.average_roots(self.fit, self._totals, *part), list(pairwise(bounds))
        )

    def _sample_errors(self) -> npt.NDArray[np.float64]:
        """Return the weighted squared distances of the samples (S,), in an array that is used again."""
        self._in_parts(lambda _, view, *part: fit_samples.sample_errors(view, self._errors, *part), len(self._errors))
        return self._errors

    def _in_parts(self, work: Work, n: int, views: list[fit_arrays.Fit] | None = None) -> None:
        """Let the workers do ``work(thread, view, first, last)`` on all of n items, in parts."""
        views = self._views if views is None else views
        n_parts = _PARTS * len(views) if len(views) > 1 else 1
        size = max(_MIN_ITEMS, -(-n // n_parts))
        parts = [(first, min(first + size, n)) for first in range(0, n, size)]
        self._workers.map(lambda thread, part: work(thread, views[thread], *part), parts)


def _cheapest(values: npt.NDArray[np.float64], limit: float) -> npt.NDArray[np.int64]:
    """Return the sides, as 3 face + side (n,), with values (F, 3) below a limit, the lowest first."""
    sides = np.flatnonzero(values.ravel() < limit)
    return sides[np.argsort(values.ravel()[sides], kind="stable")].astype(np.int64)

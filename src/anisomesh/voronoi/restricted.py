"""The Voronoi diagram of moving sites in R^d, restricted to an embedded surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Sites, SiteScalars
from anisomesh._kernels import clip, diagram, integrate
from anisomesh.errors import OptionError
from anisomesh.execution.threads import Workers, blocks
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.voronoi.diagram import Diagram, DiagramPart, assemble
from anisomesh.voronoi.neighbour_lists import NeighbourLists

# facets per chunk: depends only on their number, so that sums do not depend on the number of threads; large, because a
# thread that returns from a kernel may wait for the interpreter (benchmarks/speed.py)
_MIN_CHUNK, _MAX_CHUNK, _MIN_CHUNKS = 1024, 4096, 4
_MAX_REPAIR_ROUNDS = 40  # each doubles buffers or lengthens lists, so far fewer suffice for any memory
_MAX_SITE_COORDINATE = 1e50  # of sites: squared distances stay far from overflow
_INITIAL_BUFFER_SIZE = 64  # polygon vertices per facet

_T = TypeVar("_T")
Chunk = npt.NDArray[np.int32]  # facets
Problems = npt.NDArray[np.int32]  # (n, 2): facet, status
Part = tuple[npt.NDArray[np.int32], npt.NDArray[np.float64]]


@dataclass(frozen=True, kw_only=True, eq=False)
class EnergyValue:
    """An energy of sites and its derivatives.

    Attributes
    ----------
    value
        The energy; embedding units to the fourth power for the CVT energies.
    gradient
        Its derivative by the sites (S, d).
    mass
        Weight of each cell (S,): its area times the density. Lloyd's step is gradient / (2 mass).
    per_cell
        What each cell contributes (S,); the sum is ``value``.
    """

    value: float
    gradient: Sites
    mass: SiteScalars
    per_cell: SiteScalars


class RestrictedVoronoi:
    """Restricted Voronoi diagrams of a set of sites that moves over one embedded surface.

    Parameters
    ----------
    embedded
        The embedded surface.
    threads
        Worker threads; the result does not depend on their number.

    Raises
    ------
    OptionError
        If ``threads`` is less than 1.

    Notes
    -----
    The diagram on a facet is the lower envelope of planes over a triangle (see ``_kernels.clip``), so the dimension
    enters only in a table of squared distances, and all predicates are two-dimensional. Neighbour lists and one owner
    per facet are kept from call to call; they change the time of an evaluation and its value only by rounding. An
    evaluation costs O(F + S) for a bounded number of neighbours.

    References
    ----------
    Yan, Levy, Liu, Sun, Wang, "Isotropic remeshing with fast and exact computation of restricted Voronoi
    diagram", SGP 2009; Levy and Bonneel, "Variational anisotropic surface meshing with Voronoi parallel
    linear enumeration", 2012 (security radius).
    """

    def __init__(self, embedded: EmbeddedSurface, *, threads: int = 2) -> None:
        if threads < 1:
            raise OptionError(f"threads = {threads}; expected at least 1")
        self.embedded = embedded
        self._corners = embedded.points[embedded.faces[:, 0]]  # one of each facet
        self._workers = Workers(threads)
        self._chunk = int(np.clip(-(-embedded.surface.n_faces // _MIN_CHUNKS), _MIN_CHUNK, _MAX_CHUNK))
        self._lists = NeighbourLists(self._workers)
        self._owners = np.zeros(0, dtype=np.int32)
        self._buffers: list[_Buffers] = []
        self._size = _INITIAL_BUFFER_SIZE

    def integrate(self, sites: Sites, sharpness: float = 1.0) -> EnergyValue:
        """Return the energy of the CVT with the normal metric I + (s - 1) N N^t, times the density, and its gradient.

        Parameters
        ----------
        sites
            Positions (S, d).
        sharpness
            The factor s; 1 is the plain CVT energy, whose gradient is 2 mass (site - centroid).

        References
        ----------
        NASM, energy of the normal-metric CVT; closed form in ``_kernels.integrate``.
        """

        def integrate_chunk(chunk: Chunk, buffers: _Buffers) -> tuple[Part, Problems]:
            n, n_problems = integrate.integrate_chunk(
                chunk,
                self._owners,
                self.embedded.weighted_facets,
                self._table,
                buffers.workspace,
                sharpness,
                buffers.row_of,
                buffers.touched,
                buffers.accumulated,
                buffers.problems,
            )
            part = (buffers.touched[:n].copy(), buffers.accumulated[:n].copy())
            return part, buffers.problems[:n_problems].copy()

        sites = self._prepare(sites)
        gradient, mass, energy = np.zeros_like(sites), np.zeros(len(sites)), np.zeros(len(sites))
        for touched, accumulated in self._run(integrate_chunk, sites):
            integrate.gather(touched, accumulated, gradient, mass, energy)
        return EnergyValue(value=float(energy.sum()), gradient=gradient, mass=mass, per_cell=energy)

    def diagram(self, sites: Sites, facets: Chunk | None = None) -> Diagram:
        """Return the diagram in symbolic form: polygons, their vertices and what bounds each edge.

        Parameters
        ----------
        sites
            Positions (S, d).
        facets
            The facets (n,) to which the diagram is restricted; all of the surface by default.
        """

        def write_chunk(chunk: Chunk, buffers: _Buffers) -> tuple[DiagramPart, Problems]:
            n, n_vertices, n_problems = diagram.count_chunk(
                chunk, self._owners, self.embedded.facets, self._table, buffers.workspace, buffers.problems
            )
            problems = buffers.problems[:n_problems].copy()
            part = DiagramPart.empty(n, n_vertices)
            good = np.setdiff1d(chunk, problems[:, 0]) if n_problems else chunk
            diagram.write_chunk(good, self._owners, self.embedded.facets, self._table, buffers.workspace, *part)
            return part, problems

        sites = self._prepare(sites, exact=True)
        return assemble(self.embedded, np.array(sites), self._run(write_chunk, sites, facets))

    def _prepare(self, sites: Sites, *, exact: bool = False) -> Sites:
        # kernels are compiled anew for other types, orders and read-only arrays
        sites = np.require(sites, np.float64, ["C", "W"])
        if sites.ndim != 2 or sites.shape[1] != self.embedded.dimension or len(sites) == 0:
            raise OptionError(f"sites has shape {sites.shape}; expected (S, {self.embedded.dimension}) with S >= 1")
        if not (np.abs(sites) <= _MAX_SITE_COORDINATE).all():
            raise OptionError("a site is not finite or far beyond the surface, as after a step with masses of 0")
        new = len(sites) != self._lists.n_sites
        self._table = self._lists.table(sites, exact=exact)
        if new:
            self._owners = self._lists.nearest(self._corners, sites)
            self._buffers = []
        while len(self._buffers) < self._workers.threads:
            self._buffers.append(self._new_buffers(sites))
        return sites

    def _new_buffers(self, sites: Sites) -> _Buffers:
        return _Buffers(len(sites), sites.shape[1], self._size, self._chunk)

    def _run(
        self, work: Callable[[Chunk, _Buffers], tuple[_T, Problems]], sites: Sites, facets: Chunk | None = None
    ) -> list[_T]:
        """Run the work on facets by chunks, and again on the facets with problems once their cause is removed."""
        if facets is None:
            facets = np.arange(self.embedded.surface.n_faces, dtype=np.int32)
        parts: list[_T] = []
        for _ in range(_MAX_REPAIR_ROUNDS):
            results = self._workers.map(
                lambda thread, chunk: work(chunk, self._buffers[thread]), blocks(facets, self._chunk)
            )
            parts.extend(part for part, _ in results)
            problems = np.concatenate([problems for _, problems in results])
            if len(problems) == 0:
                return parts
            self._repair(problems, sites)
            facets = np.ascontiguousarray(problems[:, 0])  # kernels are compiled anew for other memory layouts
        raise RuntimeError(f"{len(problems)} facets could not be clipped, the first: {problems[0].tolist()}")

    def _repair(self, problems: Problems, sites: Sites) -> None:
        """Give workspaces more room, facets the nearest owner, lists more neighbours."""
        facet, status = problems.T
        needed = np.max([buffers.workspace.needed for buffers in self._buffers], axis=0)
        if (status == clip.BUFFER_TOO_SMALL).any():
            self._size *= 2
            self._buffers = [self._new_buffers(sites) for _ in self._buffers]
        for buffers in self._buffers:
            buffers.workspace.needed[:] = 0.0
        far, none = facet[status == clip.START_TOO_FAR], facet[status == clip.NO_OWNER]
        if len(far):
            old, corner = self._owners[far], self._corners[far]
            new = self._lists.near(corner, sites)
            distance, old_distance = ((sites[[new, old]] - corner) ** 2).sum(axis=2)
            # of sites at the same place the one of larger index owns all
            better = (distance < old_distance) | ((distance == old_distance) & (new > old))
            self._owners[far[better]] = new[better]
            needed[old[better]] = 0.0
        if len(none):
            self._owners[none] = self._lists.nearest(self._corners[none], sites)
        if needed.any():
            self._table = self._lists.grow(sites, needed)


class _Buffers:
    """What one thread writes into."""

    def __init__(self, n_sites: int, dimension: int, size: int, chunk: int) -> None:
        candidates = min(n_sites, 8 * size)
        vertices = 64 * size
        self.workspace = clip.Workspace(
            counter=np.zeros(2, dtype=np.int64),
            stamp=np.zeros(n_sites, dtype=np.int64),
            slot=np.zeros(n_sites, dtype=np.int32),
            candidate=np.zeros(candidates, dtype=np.int32),
            table=np.zeros((candidates, 3)),
            queued=np.zeros(candidates, dtype=np.uint8),
            queue=np.zeros(candidates, dtype=np.int32),
            polygon_slot=np.zeros(candidates, dtype=np.int32),
            polygon_start=np.zeros(candidates + 1, dtype=np.int32),
            label=np.zeros(vertices, dtype=np.int32),
            vertex=np.zeros((vertices, 3)),
            work=np.zeros((2, size, 7)),
            needed=np.zeros(n_sites),
        )
        rows = min(n_sites + candidates, chunk * size)
        self.row_of = np.full(n_sites, -1, dtype=np.int32)
        self.touched = np.zeros(rows, dtype=np.int32)
        self.accumulated = np.zeros((rows, dimension + 2))
        self.problems = np.zeros((chunk, 2), dtype=np.int32)

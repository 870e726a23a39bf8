"""Regions that stay as they are: cut out of the input before the remesh, and joined to its result."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import FaceMask, PointMask
from anisomesh.attributes.charts import Joints
from anisomesh.attributes.exact import with_first_rows
from anisomesh.attributes.model import Ints, Mesh
from anisomesh.errors import OptionError
from anisomesh.execution.deadline import NO_DEADLINE, Deadline
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.meshops.anchors import places_found
from anisomesh.meshops.held import Held
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.self_intersections import remove_self_intersections
from anisomesh.options import RemeshOptions
from anisomesh.repair.near_points import weld_distance
from anisomesh.setup.inputs import PreparedInput
from anisomesh.setup.rest import rest_of
from anisomesh.setup.selection import selected_faces

_WAY_OUT = "fixed faces of the mesh, as required triangles, are locked unless no attributes are carried over"


@dataclass(frozen=True, kw_only=True, eq=False)
class Cut:
    """A prepared input, and the part of it that is remeshed.

    Attributes
    ----------
    whole
        The input.
    rest
        What is remeshed: the faces that are not locked, with its border to the others as its outline. The input itself
        if no face is locked, or all are.
    source
        Point of the sheets of the whole at each point of the rest (V',). Several are copies of one where the faces of
        the rest at it are apart; these have slightly different coordinates.
    locked
        Which faces of the whole surface (F,) stay as they are.
    face_source
        Face of the given mesh (n,) for each locked face.
    remarks
        What a user should know, one sentence each.
    weld
        Distance up to which points of the given mesh are the same, in model units.
    has_fixed_faces
        Whether fixed faces of the given mesh are among the locked ones.
    """

    whole: PreparedInput
    rest: PreparedInput
    source: Ints
    locked: FaceMask
    face_source: Ints
    remarks: tuple[str, ...]
    weld: float
    has_fixed_faces: bool = False

    @property
    def is_all(self) -> bool:
        """Whether all faces are locked."""
        return bool(self.locked.all())

    @property
    def _way_out(self) -> str:
        """What unlocks faces that no option has locked."""
        return f" ({_WAY_OUT})" if self.has_fixed_faces else ""

    @cached_property
    def points(self) -> Ints:
        """Points (n,) of the whole, its sheets joined, that stay; they are the first ones of the result."""
        return np.unique(self.whole.surface.faces[self.locked]).astype(np.int64)

    @cached_property
    def _border(self) -> PointMask:
        """Which points of the rest (V',) are on locked faces or junctions that stay."""
        surface = self.rest.prepared.surface
        mask = np.zeros(surface.n_points, dtype=bool)
        mask[surface.edges[self.rest.outline]] = True
        return mask

    @cached_property
    def _joined_source(self) -> Ints:
        """Point of the whole, its sheets joined, at each point of the rest (V',)."""
        junctions = self.whole.junctions
        return self.source if junctions is None or self.is_all else junctions.joined[self.source].astype(np.int64)

    @property
    def n_more(self) -> int:
        """Vertices that the result has more than the remeshed rest."""
        border = np.flatnonzero(self._border)
        border = border[np.isin(self._joined_source[border], self.points)]
        junctions = self.rest.junctions
        return len(self.points) - len(border if junctions is None else np.unique(junctions.joined[border]))

    @property
    def least(self) -> int:
        """Vertices that the result has at least."""
        return self.rest.least + self.n_more

    def count_of_rest(self, n_vertices: int) -> int:
        """Return the vertices of the rest in a result of a number of vertices.

        Raises
        ------
        OptionError
            If more are locked or kept.
        """
        if not self.locked.any():
            return self.whole.checked_count(n_vertices)
        if self.is_all:
            return self.rest.least
        if n_vertices < self.least:
            raise OptionError(
                f"{n_vertices:,} vertices are asked for, and the locked regions and points to keep have "
                f"{self.least:,}; ask for more, or lock less{self._way_out}"
            )
        return n_vertices - self.n_more

    def joined(self, rest: Surface) -> Surface:
        """Return a mesh of the rest, in model units, together with the locked faces, which come first."""
        if not self.locked.any():
            return rest
        return self._joined_at(rest, self.whole.surface, self.points, self._joined_source)

    def _reference(self, rest: Surface) -> Surface:
        """Return a surface of the rest, in model units, together with the locked faces, sheets apart."""
        sheets = self.whole.prepared.surface
        return self._joined_at(rest, sheets, np.unique(sheets.faces[self.locked]).astype(np.int64), self.source)

    def _joined_at(self, rest: Surface, surface: Surface, held: Ints, source: Ints) -> Surface:
        """Return a mesh of the rest joined to the locked faces of a surface at some of its points (n,).

        ``source`` is the point of that surface at each point of the rest.
        """
        points, faces = surface.points[held], np.searchsorted(held, surface.faces[self.locked])
        if self.is_all:
            return Surface(points, faces)
        border = np.flatnonzero(self._border)
        border = border[np.isin(source[border], held)]
        number = places_found(rest.points, self.rest.prepared.surface.points[border])
        shared = number >= 0
        index = len(points) + np.cumsum(~shared) - 1
        index[shared] = np.searchsorted(held, source[border[number[shared]]])
        return Surface(np.concatenate([points, rest.points[~shared]]), np.concatenate([faces, index[rest.faces]]))

    def checked(
        self, rest: Surface, reference: Surface, validity: Validity, deadline: Deadline = NO_DEADLINE
    ) -> tuple[Surface, Validity]:
        """Return the result with a mesh of the rest, and its validity.

        Parameters
        ----------
        rest, reference
            The mesh and the surface that it was made for, in model units.
        validity
            The validity of the mesh itself.
        deadline
            When to stop mending faults.

        Notes
        -----
        A mesh of the rest that is valid can be inverted against locked faces or intersect them, as on the other side of
        a thin plate. Such faults are mended by local changes, unless sheets are joined.
        """
        if not self.locked.any():
            return rest, validity
        whole, expected = self.joined(rest), self._reference(reference)
        is_cut = self.whole.junctions is not None
        validity = check_validity(whole, expected, self.whole.surface if is_cut else None)
        if validity.inverted + validity.new_intersections and not is_cut:
            mended = self._mended(whole, ClosestPoints(expected), deadline)
            after = check_validity(mended, expected)
            if after.inverted + after.new_intersections < validity.inverted + validity.new_intersections:
                return mended, after
        return whole, validity

    def _mended(self, mesh: Surface, reference: ClosestPoints, deadline: Deadline) -> Surface:
        """Return a result with faults removed by changes of faces that are not locked."""
        kept = self.rest.prepared.surface.points[self.rest.fixed & ~self._border]
        places = np.concatenate([mesh.points[: len(self.points)], kept])
        held = Held(places, int(np.count_nonzero(self.locked)))
        points, faces, _ = remove_inverted_triangles(mesh.points, mesh.faces, reference, held=held, deadline=deadline)
        points, faces, _ = remove_self_intersections(points, faces, reference, held=held, deadline=deadline)
        return Surface(points, faces)

    def with_exact_attributes(self, mesh: Mesh, given: Mesh) -> Mesh:
        """Return a result with everything that the given mesh carries on locked faces and their points."""
        if not self.locked.any():
            return mesh
        source, junctions = self.whole.prepared.point_source, self.whole.junctions
        if junctions is not None:
            source = source[np.unique(junctions.joined, return_index=True)[1]]
        points = source[self.points].astype(np.int64)
        return with_first_rows(mesh, given, points, self.face_source, self.weld)


def cut_locked(whole: PreparedInput, mesh: Mesh, options: RemeshOptions, *, connected: bool = False) -> Cut:
    """Return a prepared input with the faces cut out that the options lock.

    If ``connected``, junctions that are connected to these keep all edges.

    Raises
    ------
    OptionError
        If ``lock`` is neither a region nor a mask of the mesh.

    Notes
    -----
    Fixed faces of the mesh are locked too, unless its attributes are not looked at.
    """
    chosen = selected_faces("lock", mesh, options.lock)
    has_fixed_faces = options.attributes and len(mesh.fixed_faces) > 0
    if has_fixed_faces:
        chosen = chosen.copy()
        chosen[mesh.fixed_faces] = True
    surface, weld = whole.prepared.surface, weld_distance(mesh.surface, options.weld_tolerance)
    locked, face_source, lost = np.zeros(surface.n_faces, dtype=bool), np.zeros(0, dtype=np.int64), 0
    if chosen.any():
        locked, face_source = _found(whole, mesh, np.flatnonzero(chosen), weld)
        lost = int(np.count_nonzero(chosen)) - len(np.unique(face_source))
        if not locked.any() and options.lock is not None:
            raise OptionError("lock has only faces that the repair of the mesh changes; lock others")
    remarks = (
        [f"{lost:,} of {chosen.sum():,} locked faces were changed by the repair and are not locked"] if lost else []
    )
    if locked.all():
        way_out = f"; {_WAY_OUT}" if has_fixed_faces else ""
        remarks.append(f"all faces are locked: the result is the input{way_out}")
    is_part = locked.any() and not locked.all()
    rest, source = rest_of(whole, locked, connected=connected) if is_part else (whole, np.arange(surface.n_points))
    return Cut(
        whole=whole,
        rest=rest,
        source=source,
        locked=locked,
        face_source=face_source,
        remarks=tuple(remarks),
        weld=weld,
        has_fixed_faces=has_fixed_faces,
    )


def _found(whole: PreparedInput, mesh: Mesh, wanted: Ints, weld: float) -> tuple[FaceMask, Ints]:
    """Return which prepared faces (F,) are some faces (n,) of the mesh, and for each of them (m,) which one."""
    label = Joints(mesh.surface, weld).place
    known, first = np.unique(np.sort(label[mesh.surface.faces[wanted]], axis=1), axis=0, return_index=True)
    faces, source = whole.prepared.surface.faces, whole.prepared.point_source
    row = _rows_found(np.sort(label[source[faces]], axis=1), known)
    if whole.junctions is not None:  # points that were added have no source of their own
        row[whole.junctions.added[faces].any(axis=1)] = -1
    return row >= 0, wanted[first[row[row >= 0]]].astype(np.int64)


def _rows_found(rows: npt.NDArray[np.integer], known: npt.NDArray[np.integer]) -> Ints:
    """Return the number (n,) of each row (n, 3) among other ones (m, 3) in lexicographic order, -1 for new ones."""
    _, code = np.unique(np.concatenate([known, rows]), axis=0, return_inverse=True)
    number = np.full(code.max() + 1, -1)
    number[code.ravel()[: len(known)]] = np.arange(len(known))
    return np.asarray(number[code.ravel()[len(known) :]])

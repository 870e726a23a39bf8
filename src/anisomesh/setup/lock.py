"""Regions that stay as they are: cut out of the input before the remesh, and joined to its result."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
from anisomesh.mesh.geometry import sums_at_points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import corner_fans, edge_keys, side_pairs
from anisomesh.mesh.validity import Validity, check_validity
from anisomesh.mesh.weld import coincident
from anisomesh.meshops.anchors import places_found
from anisomesh.meshops.held import Held
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.self_intersections import remove_self_intersections
from anisomesh.options import MIN_VERTICES, RemeshOptions
from anisomesh.repair.near_points import weld_distance
from anisomesh.repair.prepare import Prepared
from anisomesh.setup.inputs import PreparedInput
from anisomesh.setup.selection import selected_faces

_APART = 1e-9  # of the size of the faces at a point: distance of copies of it from where it is, to tell them apart


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
        Point of the whole surface at each point of the rest (V',). Several are copies of one where the faces of the
        rest at it are apart; these have slightly different coordinates.
    locked
        Which faces of the whole surface (F,) stay as they are.
    face_source
        Face of the given mesh (n,) for each locked face.
    remarks
        What a user should know, one sentence each.
    weld
        Distance up to which points of the given mesh are the same, in model units.
    """

    whole: PreparedInput
    rest: PreparedInput
    source: Ints
    locked: FaceMask
    face_source: Ints
    remarks: tuple[str, ...]
    weld: float

    @property
    def is_all(self) -> bool:
        """Whether all faces are locked."""
        return bool(self.locked.all())

    @cached_property
    def points(self) -> Ints:
        """Points of the whole surface (n,) on locked faces; they are the first ones of the result."""
        return np.unique(self.whole.prepared.surface.faces[self.locked]).astype(np.int64)

    @cached_property
    def _border(self) -> PointMask:
        """Which points of the rest (V',) are on locked faces."""
        surface = self.rest.prepared.surface
        mask = np.zeros(surface.n_points, dtype=bool)
        mask[surface.edges[self.rest.outline]] = True
        return mask

    @property
    def n_more(self) -> int:
        """Vertices that the result has more than the remeshed rest."""
        return len(self.points) - int(np.count_nonzero(self._border))

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
                f"{self.least:,}; ask for more, or lock less"
            )
        return n_vertices - self.n_more

    def joined(self, rest: Surface) -> Surface:
        """Return a mesh of the rest, in model units, together with the locked faces, which come first."""
        if not self.locked.any():
            return rest
        surface = self.whole.prepared.surface
        points = surface.points[self.points]
        faces = np.searchsorted(self.points, surface.faces[self.locked])
        if self.is_all:
            return Surface(points, faces)
        border = np.flatnonzero(self._border)
        number = places_found(rest.points, self.rest.prepared.surface.points[border])
        shared = number >= 0
        index = len(points) + np.cumsum(~shared) - 1
        index[shared] = np.searchsorted(self.points, self.source[border[number[shared]]])
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
        a thin plate. Such faults are mended by local changes.
        """
        if not self.locked.any():
            return rest, validity
        whole, expected = self.joined(rest), self.joined(reference)
        validity = check_validity(whole, expected)
        if validity.inverted + validity.new_intersections:
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
        points = self.whole.prepared.point_source[self.points].astype(np.int64)
        return with_first_rows(mesh, given, points, self.face_source, self.weld)


def cut_locked(whole: PreparedInput, mesh: Mesh, options: RemeshOptions) -> Cut:
    """Return a prepared input with the faces cut out that the options lock.

    Raises
    ------
    OptionError
        If ``lock`` is no region or mask of the mesh.
    """
    chosen = selected_faces("lock", mesh, options.lock)
    surface, weld = whole.prepared.surface, weld_distance(mesh.surface, options.weld_tolerance)
    locked, face_source, lost = np.zeros(surface.n_faces, dtype=bool), np.zeros(0, dtype=np.int64), 0
    if chosen.any():
        locked, face_source = _found(whole.prepared, mesh, np.flatnonzero(chosen), weld)
        lost = int(np.count_nonzero(chosen)) - len(np.unique(face_source))
        if not locked.any():
            raise OptionError("lock has only faces that the repair of the mesh changes; lock others")
    remarks = (
        [f"{lost:,} of {chosen.sum():,} locked faces were changed by the repair and are not locked"] if lost else []
    )
    if locked.all():
        remarks.append("all faces are locked: the result is the input")
    is_part = locked.any() and not locked.all()
    rest, source = _rest_of(whole, locked) if is_part else (whole, np.arange(surface.n_points))
    return Cut(
        whole=whole,
        rest=rest,
        source=source,
        locked=locked,
        face_source=face_source,
        remarks=tuple(remarks),
        weld=weld,
    )


def _found(prepared: Prepared, mesh: Mesh, wanted: Ints, weld: float) -> tuple[FaceMask, Ints]:
    """Return which prepared faces (F,) are some faces (n,) of the mesh, and for each of them (m,) which one."""
    label = Joints(mesh.surface, weld).place
    known, first = np.unique(np.sort(label[mesh.surface.faces[wanted]], axis=1), axis=0, return_index=True)
    row = _rows_found(np.sort(label[prepared.point_source[prepared.surface.faces]], axis=1), known)
    return row >= 0, wanted[first[row[row >= 0]]].astype(np.int64)


def _rows_found(rows: npt.NDArray[np.integer], known: npt.NDArray[np.integer]) -> Ints:
    """Return the number (n,) of each row (n, 3) among other ones (m, 3) in lexicographic order, -1 for new ones."""
    _, code = np.unique(np.concatenate([known, rows]), axis=0, return_inverse=True)
    number = np.full(code.max() + 1, -1)
    number[code.ravel()[: len(known)]] = np.arange(len(known))
    return np.asarray(number[code.ravel()[len(known) :]])


def _rest_of(whole: PreparedInput, locked: FaceMask) -> tuple[PreparedInput, Ints]:
    """Return the part of an input that is not locked, and the point of the whole at each of its points (V',)."""
    surface = whole.prepared.surface
    faces = surface.faces[~locked]
    n_fans, fan = corner_fans(faces, side_pairs(faces))
    source = np.empty(n_fans, dtype=np.int64)
    source[fan] = faces.ravel()
    order = np.argsort(source, kind="stable")
    position = np.empty(n_fans, dtype=np.int32)
    position[order] = np.arange(n_fans)
    source = source[order]
    part = Surface(surface.points[source], position[fan].reshape(-1, 3))
    edge = np.searchsorted(edge_keys(surface.edges), edge_keys(source[part.edges]))
    outline = (part.edge_face_count == 1) & (surface.edge_face_count[edge] == 2)
    border = np.zeros(n_fans, dtype=bool)
    border[part.edges[outline]] = True
    fixed = whole.fixed[source] | border
    part = _told_apart(part, border)
    rest = replace(
        whole,
        prepared=replace(whole.prepared, surface=part, point_source=whole.prepared.point_source[source]),
        tensors=None if whole.tensors is None else whole.tensors[source],
        density=None if whole.density is None else whole.density[source],
        sizes=None if whole.sizes is None else whole.sizes[source],
        tagged=whole.tagged[edge],
        borders=whole.borders[edge],
        seams=whole.seams[edge],
        fixed=fixed,
        outline=outline,
        least=max(MIN_VERTICES, int(np.count_nonzero(fixed))),
    )
    return rest, source


def _told_apart(surface: Surface, border: PointMask) -> Surface:
    """Return a surface whose border points (V,) at the same place are moved into their faces by next to nothing."""
    label = coincident(surface.points)
    several = border & (np.bincount(label, minlength=surface.n_points) > 1)[label]
    if not several.any():
        return surface
    middle = surface.points[surface.faces].mean(axis=1)
    count = sums_at_points(np.ones(surface.n_faces), surface.faces, surface.n_points)
    inside = sums_at_points(middle, surface.faces, surface.n_points) / count[:, None]
    points = np.array(surface.points)
    points[several] += _APART * (inside - points)[several]
    return surface.with_points(points)

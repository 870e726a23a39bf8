"""The remesher that data sets are made with; it is passed in, for example :func:`anisomesh.pipeline.remesh`."""

from __future__ import annotations

from typing import Any, Protocol

from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity

REMESH_SECONDS = 120.0
"""Time limit of one remesh, heuristic: several times what a mesh of 5,000 vertices takes."""


class Remeshed(Protocol):
    """Result of a remesher."""

    @property
    def surface(self) -> Surface:
        """The mesh, in the units of the input."""

    @property
    def validity(self) -> Validity:
        """Validity of the mesh."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings, each a sentence."""


class Remesher(Protocol):
    """A remesher. It must be a function of a module, so that it can be sent to other processes."""

    def __call__(self, mesh: Surface, /, *, n_vertices: int, metric: Any, threads: int, time_limit: float) -> Remeshed:
        """Return a mesh of about ``n_vertices`` vertices for a metric: a name, or tensors (V, 3, 3)."""

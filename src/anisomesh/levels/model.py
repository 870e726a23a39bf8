"""What a remesh to levels of detail returns."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from anisomesh.levels.files import save_meshes
from anisomesh.mesh.html import html_table
from anisomesh.result import RemeshResult


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

    def save(self, path: str | os.PathLike[str], *, file_format: str | None = None) -> list[Path]:
        """Write the levels with everything that they carry, all or none of their files.

        Parameters
        ----------
        path
            For ``out.ply`` the files are ``out.lod0.ply``, ``out.lod1.ply``, ..., the finest first. A ``.glb`` file
            holds all levels, by the extension MSFT_lod; :func:`~anisomesh.io.meshes.load` reads the finest of them.
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
        return save_meshes([level.mesh for level in self], path, file_format=file_format)

    def report(self) -> dict[str, Any]:
        """Return the figures of all levels as a dictionary that JSON can hold."""
        return {"levels": [level.report() for level in self], "seconds": self.seconds}

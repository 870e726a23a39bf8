"""``mesh.anisomesh.remesh(...)`` on meshes of PyVista, which imports this module when the name is first used.

PyVista 0.48 and newer finds the module by the entry point ``pyvista.accessors``; older ones do not look for it.
"""

from __future__ import annotations

import logging
from typing import Any

import pyvista

from anisomesh.evaluation.report import Evaluation
from anisomesh.evaluation.report import evaluate as evaluate_meshes
from anisomesh.io.objects.write import to_pyvista
from anisomesh.pipeline import remesh as remesh_mesh

logger = logging.getLogger(__name__)


class Accessor:
    """The functions of anisomesh as methods of a mesh of PyVista, under ``mesh.anisomesh``.

    Parameters
    ----------
    mesh
        The mesh, any data set of PyVista whose cells are a surface, or a ``pyvista.MultiBlock``. It is not changed.
    """

    def __init__(self, mesh: Any) -> None:
        self._mesh = mesh

    def __repr__(self) -> str:
        return f"{type(self._mesh).__name__}.anisomesh: remesh(n_vertices, ...), evaluate(result, ...)"

    def remesh(self, n_vertices: int | None = None, **options: Any) -> Any:
        """Return the mesh remeshed anisotropically, with its point, cell and field data.

        Parameters
        ----------
        n_vertices
            Vertices of the result, at least 4; leave it out to give ``ratio`` or ``max_error``.
        **options
            The other arguments of :func:`anisomesh.pipeline.remesh`.

        Returns
        -------
        pyvista.PolyData
            The result, as :func:`~anisomesh.io.objects.write.to_pyvista` makes it. What a user should know about it is
            logged as warnings; :func:`~anisomesh.pipeline.remesh` takes the mesh as well and returns everything else.

        Raises
        ------
        AnisomeshError
            As :func:`~anisomesh.pipeline.remesh`.
        """
        result = remesh_mesh(self._mesh, n_vertices=n_vertices, **options)
        for text in result.warnings:
            logger.warning("%s", text)
        return to_pyvista(result.mesh)

    def evaluate(self, result: Any, **options: Any) -> Evaluation:
        """Measure a remesh against this mesh.

        Parameters
        ----------
        result
            The remesh, in the same coordinates.
        **options
            The other arguments of :func:`anisomesh.evaluation.report.evaluate`.
        """
        return evaluate_meshes(self._mesh, result, **options)


for _kind in (pyvista.DataSet, pyvista.MultiBlock):
    pyvista.register_dataset_accessor("anisomesh", _kind)(Accessor)

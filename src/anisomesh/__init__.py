"""Anisotropic surface remeshing: a centroidal Voronoi tessellation of the mesh embedded in 8-D.

>>> import anisomesh
>>> result = anisomesh.remesh(anisomesh.sample(), n_vertices=1000)  # doctest: +SKIP
>>> anisomesh.save(result.surface, "remeshed.ply")  # doctest: +SKIP

The public names are resolved on first use, so that ``import anisomesh`` costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from anisomesh.errors import AnisomeshError, MeshError, MeshFileError, MetricError, OptionError
    from anisomesh.evaluation.report import Evaluation, evaluate
    from anisomesh.io.meshes import load, save
    from anisomesh.mesh.surface import Surface
    from anisomesh.options import RemeshOptions
    from anisomesh.pipeline import remesh
    from anisomesh.progress import StepInfo
    from anisomesh.result import RemeshResult, save_rvd
    from anisomesh.shapes.analytic import sample
    from anisomesh.viz import side_by_side

    __version__: str

__all__ = [
    "AnisomeshError",
    "Evaluation",
    "MeshError",
    "MeshFileError",
    "MetricError",
    "OptionError",
    "RemeshOptions",
    "RemeshResult",
    "StepInfo",
    "Surface",
    "__version__",
    "evaluate",
    "load",
    "remesh",
    "sample",
    "save",
    "save_rvd",
    "side_by_side",
]

_HOME = {
    "AnisomeshError": "errors",
    "Evaluation": "evaluation.report",
    "MeshError": "errors",
    "MeshFileError": "errors",
    "MetricError": "errors",
    "OptionError": "errors",
    "RemeshOptions": "options",
    "RemeshResult": "result",
    "StepInfo": "progress",
    "Surface": "mesh.surface",
    "evaluate": "evaluation.report",
    "load": "io.meshes",
    "remesh": "pipeline",
    "sample": "shapes.analytic",
    "save": "io.meshes",
    "save_rvd": "result",
    "side_by_side": "viz",
}


def __getattr__(name: str) -> Any:
    """Import a public name from the module that defines it, once (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("anisomesh")
    elif name in _HOME:
        value = getattr(importlib.import_module(f"anisomesh.{_HOME[name]}"), name)
    else:
        raise AttributeError(f"module 'anisomesh' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, resolved or not."""
    return sorted({*globals(), *__all__})

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
    from anisomesh.attributes.model import Mesh, Regions
    from anisomesh.conformance import ConformanceError, check_embedder, check_energy_gradient, check_metric_source
    from anisomesh.cvt.energy import NormalMetric
    from anisomesh.cvt.polygon_energy import energy_from_kernel
    from anisomesh.cvt.schedule import CVTOptions, optimise_sites
    from anisomesh.delaunay.meshing import MeshingTask, mesh_from_sites
    from anisomesh.embedding.base import Embedding
    from anisomesh.embedding.embedder import Direct
    from anisomesh.embedding.precomputed import precomputed_embedding
    from anisomesh.errors import AnisomeshError, MeshError, MeshFileError, MetricError, OptionError
    from anisomesh.evaluation.report import Evaluation, evaluate
    from anisomesh.execution.progress import StepInfo
    from anisomesh.features.network import trace_features
    from anisomesh.io.meshes import load, load_mesh, save
    from anisomesh.io.transfer import transfer_attributes
    from anisomesh.learn.inference.source import Hybrid, Neural
    from anisomesh.levels.model import Levels
    from anisomesh.levels.remesh import remesh_levels
    from anisomesh.mesh.embedded_surface import EmbeddedSurface
    from anisomesh.mesh.surface import Surface
    from anisomesh.metric.field import MetricField
    from anisomesh.metric.sources import Approximation, Curvature, Uniform
    from anisomesh.options import RemeshOptions
    from anisomesh.pipeline import remesh
    from anisomesh.repair.prepare import prepare
    from anisomesh.result import RemeshResult, save_rvd
    from anisomesh.shapes.analytic import sample
    from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi

    __version__: str

_MODULE_OF = {
    # the main job
    "remesh": "pipeline",
    "remesh_levels": "levels.remesh",
    "Levels": "levels.model",
    "RemeshOptions": "options",
    "RemeshResult": "result",
    "StepInfo": "execution.progress",
    # meshes in and out, and judged
    "Surface": "mesh.surface",
    "Mesh": "attributes.model",
    "Regions": "attributes.model",
    "transfer_attributes": "io.transfer",
    "load": "io.meshes",
    "load_mesh": "io.meshes",
    "save": "io.meshes",
    "save_rvd": "result",
    "sample": "shapes.analytic",
    "evaluate": "evaluation.report",
    "Evaluation": "evaluation.report",
    # the stages by themselves
    "prepare": "repair.prepare",
    "MetricField": "metric.field",
    "Curvature": "metric.sources",
    "Approximation": "metric.sources",
    "Uniform": "metric.sources",
    "Neural": "learn.inference.source",
    "Hybrid": "learn.inference.source",
    "Embedding": "embedding.base",
    "Direct": "embedding.embedder",
    "precomputed_embedding": "embedding.precomputed",
    "EmbeddedSurface": "mesh.embedded_surface",
    "RestrictedVoronoi": "voronoi.restricted",
    "trace_features": "features.network",
    "EnergyValue": "voronoi.restricted",
    "NormalMetric": "cvt.energy",
    "energy_from_kernel": "cvt.polygon_energy",
    "CVTOptions": "cvt.schedule",
    "optimise_sites": "cvt.schedule",
    "MeshingTask": "delaunay.meshing",
    "mesh_from_sites": "delaunay.meshing",
    # conformance tests of plug-ins
    "check_metric_source": "conformance",
    "check_embedder": "conformance",
    "check_energy_gradient": "conformance",
    "ConformanceError": "conformance",
    # errors
    "AnisomeshError": "errors",
    "MeshError": "errors",
    "MeshFileError": "errors",
    "MetricError": "errors",
    "OptionError": "errors",
}

__all__ = [
    "AnisomeshError",
    "Approximation",
    "CVTOptions",
    "ConformanceError",
    "Curvature",
    "Direct",
    "EmbeddedSurface",
    "Embedding",
    "EnergyValue",
    "Evaluation",
    "Hybrid",
    "Levels",
    "Mesh",
    "MeshError",
    "MeshFileError",
    "MeshingTask",
    "MetricError",
    "MetricField",
    "Neural",
    "NormalMetric",
    "OptionError",
    "Regions",
    "RemeshOptions",
    "RemeshResult",
    "RestrictedVoronoi",
    "StepInfo",
    "Surface",
    "Uniform",
    "__version__",
    "check_embedder",
    "check_energy_gradient",
    "check_metric_source",
    "energy_from_kernel",
    "evaluate",
    "load",
    "load_mesh",
    "mesh_from_sites",
    "optimise_sites",
    "precomputed_embedding",
    "prepare",
    "remesh",
    "remesh_levels",
    "sample",
    "save",
    "save_rvd",
    "trace_features",
    "transfer_attributes",
]


def __getattr__(name: str) -> Any:
    """Import a public name from the module that defines it, once (PEP 562)."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("anisomesh")
    elif name in _MODULE_OF:
        value = getattr(importlib.import_module(f"anisomesh.{_MODULE_OF[name]}"), name)
    else:
        raise AttributeError(f"module 'anisomesh' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names, resolved or not."""
    return sorted({*globals(), *__all__})

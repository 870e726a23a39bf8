"""The energy of a tessellation as a differentiable torch function of its sites and of the embedded surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from anisomesh._arrays import Faces
from anisomesh._kernels.embedding_gradient import add_embedding_gradient
from anisomesh.cvt.energy import NormalMetric
from anisomesh.errors import MeshError, OptionError
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.surface import Surface
from anisomesh.voronoi.restricted import RestrictedVoronoi


def tessellation_energy(
    sites: Tensor, vertices: Tensor, faces: Tensor | Faces, *, sharpness: float = 7.0, threads: int = 2
) -> Tensor:
    """Return the energy of the centroidal Voronoi tessellation with the normal metric, with gradients by both tensors.

    Parameters
    ----------
    sites
        Positions (S, d), float64 on the CPU.
    vertices
        Embedded vertices of the surface (V, d), d >= 3, float64 on the CPU; the first three coordinates are space.
    faces
        Vertex indices (F, 3), counter-clockwise seen from outside.
    sharpness
        Factor s of the normal metric I + (s - 1) N N^t, at least 1; 1 is the plain energy.
    threads
        Worker threads; they do not change the result.

    Returns
    -------
    Tensor
        The energy (), float64; the value of :class:`~anisomesh.cvt.energy.NormalMetric`. It can be differentiated once.

    Raises
    ------
    OptionError
        If sites, sharpness or threads are not as above, or a site is not finite or very far away.
    MeshError
        If vertices or faces are not as above, or a vertex is not finite.

    Notes
    -----
    The gradients are exact where the energy is differentiable, with the motion of the cell boundaries and of the
    normals. A face without area contributes no gradient by its vertices, and a site without a cell has none. Each call
    builds the diagram from nothing; the gradient by the vertices builds it a second time, and is computed only if
    ``vertices`` requires it. Both cost O(F + S), for a bounded number of neighbours.

    References
    ----------
    NASM names a differentiable tessellation as future work. Formulas: ``_kernels.integrate``,
    ``_kernels.embedding_gradient``.
    """
    if isinstance(faces, Tensor):
        faces = faces.detach().cpu().numpy()
    _require_table("sites", sites, OptionError)
    _require_table("vertices", vertices, MeshError)
    if not torch.isfinite(vertices).all():
        raise MeshError("vertices has a number that is not finite")
    energy: Tensor = _TessellationEnergy.apply(  # type: ignore[no-untyped-call]
        sites, vertices, np.asarray(faces), NormalMetric(sharpness), threads
    )
    return energy


def embedded_area(vertices: Tensor, faces: Tensor | Faces) -> Tensor:
    """Return the area () of the surface with vertices (V, d) and faces (F, 3), as a differentiable function."""
    indices = faces if isinstance(faces, Tensor) else torch.tensor(faces)
    corners = vertices[indices.to(vertices.device, torch.int64)]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    tiny = torch.finfo(vertices.dtype).tiny  # for faces without area
    along = (u * v).sum(dim=1) / (u * u).sum(dim=1).clamp(min=tiny)
    base, height = u.norm(dim=1), (v - along[:, None] * u).norm(dim=1)
    area: Tensor = 0.5 * (base * height).sum()
    return area


class _TessellationEnergy(torch.autograd.Function):
    """Value and gradient by the sites come together; the gradient by the vertices, if it is wanted, from a diagram."""

    @staticmethod
    def forward(
        context: Any, sites: Tensor, vertices: Tensor, faces: Faces, energy: NormalMetric, threads: int
    ) -> Tensor:
        # copies, since optimisers change tensors in place before a late backward pass
        positions, points = (np.array(table.detach().numpy()) for table in (sites, vertices))
        voronoi = RestrictedVoronoi(EmbeddedSurface(Surface(points[:, :3], faces), points), threads=threads)
        value = energy.evaluate(voronoi, positions)
        context.voronoi, context.positions, context.energy = voronoi, positions, energy
        context.by_sites = value.gradient
        return sites.new_tensor(value.value)

    @staticmethod
    @once_differentiable
    def backward(context: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        by_sites, by_vertices = None, None
        if context.needs_input_grad[0]:
            by_sites = gradient * torch.from_numpy(context.by_sites)
        if context.needs_input_grad[1]:
            diagram = context.voronoi.diagram(context.positions)
            polygons = (diagram.offset, diagram.facet, diagram.site, diagram.label, diagram.barycentric)
            total, sharpness = np.zeros_like(diagram.points), float(context.energy.sharpness)
            add_embedding_gradient(*polygons, diagram.embedded.facets, diagram.sites, sharpness, total)
            by_vertices = gradient * torch.from_numpy(total)
        return by_sites, by_vertices, None, None, None


def _require_table(name: str, table: Tensor, error: type[Exception]) -> None:
    """Raise an error of the given type unless the tensor is (n, d), d >= 3, float64 and on the CPU."""
    if not isinstance(table, Tensor):
        raise error(f"{name} is {type(table).__name__}; expected a torch tensor")
    if table.dtype != torch.float64 or table.device.type != "cpu":
        kind = f"{table.dtype} on {table.device}"
        raise error(f'{name} is {kind}; expected torch.float64 on cpu, as {name}.to("cpu", torch.float64)')
    if table.ndim != 2 or table.shape[1] < 3:
        raise error(f"{name} has shape {tuple(table.shape)}; expected (n, d) with d >= 3")

"""Learn the metric of a given mesh: a small network is trained through the energy of the tessellation.

The mesh of somebody else shows how its author likes triangles, but not the metric behind it. Here its vertices are the
sites of a tessellation, and a network turns positions in space into extra coordinates. It is trained until the cells of
the sites are as regular in that embedding as they can be. With the metric that it has learned, a finer mesh is made
that has triangles of the same kind.

Usage: python examples/learn_a_metric.py [OUT]    (extras: train, picture)
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
import torch

import anisomesh
from anisomesh.embedding.precomputed import pulled_back_metric
from anisomesh.learn import embedded_area, tessellation_energy
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring

REGULAR = 5 * np.sqrt(3) / 54  # energy of n regular hexagons of area 1 / n, times n


def known_metric(surface: anisomesh.Surface) -> anisomesh.MetricField:
    """Return the metric of the given mesh: triangles stretched around the z axis, up to 4 times at the equator."""
    x, y, z = surface.points.T
    circle = np.stack([-y, x, np.zeros_like(x)], axis=1)
    along_z = np.cross(circle, surface.point_normals)
    along_z /= np.maximum(np.linalg.norm(along_z, axis=1, keepdims=True), 1e-12)
    stretch = 1.0 + 3.0 * np.exp(-((z / (0.4 * z.max())) ** 2))
    return anisomesh.MetricField(
        tensors=np.eye(3) + ((stretch**2 - 1.0)[:, None] * along_z)[:, :, None] * along_z[:, None, :]
    )


@dataclass(frozen=True)
class LearnedMetric:
    """A metric source: lengths in space and in the extra coordinates that a network makes of positions."""

    network: torch.nn.Module

    def extra(self, points: torch.Tensor) -> torch.Tensor:
        """Return the extra coordinates (V, 5) at points (V, 3)."""
        return 0.3 * self.network(points / 0.3)  # a bounding-box diagonal of 1 is about 0.3 from the centre

    def __call__(self, surface: anisomesh.Surface) -> anisomesh.MetricField:
        """Return the metric at the points of a surface."""
        with torch.no_grad():
            extra = self.extra(torch.tensor(surface.points)).numpy()
        return anisomesh.MetricField(tensors=pulled_back_metric(surface, extra))


def train(learned: LearnedMetric, surface: anisomesh.Surface, given: anisomesh.Surface, steps: int) -> list[float]:
    """Train the network on the vertices of the given mesh; return the losses: 1 for regular hexagons."""
    points, faces = torch.tensor(surface.points), torch.tensor(surface.faces.astype(np.int64))
    facet, weights = (torch.tensor(table) for table in ClosestPoints(surface).locate(given.points))
    optimiser = torch.optim.Adam(learned.network.parameters(), lr=0.02)
    losses = []
    for _ in range(steps):
        vertices = torch.cat([points, learned.extra(points)], dim=1)
        sites = (weights[:, :, None] * vertices[faces[facet]]).sum(dim=1)  # they move with the embedded surface
        energy = tessellation_energy(sites, vertices, faces, sharpness=1.0)
        loss = energy * len(sites) / (REGULAR * embedded_area(vertices, faces) ** 2)
        optimiser.zero_grad()
        loss.log().backward()
        optimiser.step()
        losses.append(loss.item())
    return losses


def stretch_at(field: anisomesh.MetricField) -> np.ndarray:
    """Return the stretch (V,) of a metric that is 1 along the normal and at least 1 along the surface."""
    squares = np.linalg.eigvalsh(field.tensors)
    return np.sqrt(squares[:, 2] / squares[:, 1])


def main(out: str = "learn_a_metric.png", n_given: int = 400, n_vertices: int = 1200, steps: int = 80) -> list[float]:
    sphere = anisomesh.sample("sphere")
    surface = sphere.with_points(sphere.points / sphere.diagonal)
    known = known_metric(surface)
    given = anisomesh.remesh(surface, n_vertices=n_given, metric=known.tensors).surface

    torch.manual_seed(0)
    torch.set_num_threads(1)  # on tensors as small as these, threads mostly wait for each other
    network = torch.nn.Sequential(torch.nn.Linear(3, 32), torch.nn.Tanh(), torch.nn.Linear(32, 5)).double()
    learned = LearnedMetric(network)
    error = [np.abs(np.log(stretch_at(learned(surface)) / stretch_at(known))).mean()]
    losses = train(learned, surface, given, steps)
    error.append(np.abs(np.log(stretch_at(learned(surface)) / stretch_at(known))).mean())
    print(f"irregularity of the cells of the given mesh: {losses[0]:.3f} before, {losses[-1]:.3f} after {steps} steps")
    print(f"stretch off by a factor of {np.exp(error[0]):.2f} before, {np.exp(error[1]):.2f} after, on average")

    result = anisomesh.remesh(surface, n_vertices=n_vertices, metric=learned).surface
    panels = []
    for name, mesh in (("given mesh", given), ("remeshed with the learned metric", result)):
        note = f"{mesh.n_points:,} vertices, mean stretch {mesh.face_stretch.mean():.2f}"
        print(f"{name}: {note}")
        panels.append(Panel(surface=mesh, name=name, note=note, colouring=stretch_colouring(mesh, high=5.0)))
    gallery(panels, out, columns=2, same_view=True, options=PictureOptions(direction=(1.0, -0.6, 0.4), up=2, scale=2))
    return losses


if __name__ == "__main__":
    main(*sys.argv[1:])

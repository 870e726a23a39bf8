"""Write a metric source: triangles that are stretched along circles around the z axis.

Usage: python examples/own_metric_source.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

import anisomesh
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring


@dataclass(frozen=True)
class AroundAxis:
    """Triangles that are stretched along circles around the z axis.

    Attributes
    ----------
    stretch
        Length over width of the triangles, at least 1.
    """

    stretch: float

    def __call__(self, surface: anisomesh.Surface) -> anisomesh.MetricField:
        """Return the metric at the points of a surface: 1 / stretch^2 along the circles, 1 across."""
        x, y, _ = surface.points.T
        circle = np.stack([-y, x, np.zeros_like(x)], axis=1)
        circle /= np.maximum(np.linalg.norm(circle, axis=1, keepdims=True), 1e-12)
        along = circle[:, :, None] * circle[:, None, :]  # projection to the circles (V, 3, 3)
        return anisomesh.MetricField(tensors=np.eye(3) + (1.0 / self.stretch**2 - 1.0) * along)


def main(out: str = "own_metric_source.png", n_vertices: int = 600) -> list[anisomesh.RemeshResult]:
    surface = anisomesh.sample("torus")
    panels, results = [], []
    for source in (AroundAxis(1.0), AroundAxis(4.0), anisomesh.Curvature()):
        anisomesh.check_metric_source(source)
        result = anisomesh.remesh(surface, n_vertices=n_vertices, metric=source)
        note = f"mean stretch {result.embedding.stretch.achieved_mean:.1f}"
        print(f"{source}: {note}")
        colouring = stretch_colouring(result.surface)
        panels.append(
            Panel(surface=result.surface, name=str(source).split("(limits")[0], note=note, colouring=colouring)
        )
        results.append(result)
    gallery(panels, out, columns=3, same_view=True, options=PictureOptions(scale=2))
    return results


if __name__ == "__main__":
    main(*sys.argv[1:])

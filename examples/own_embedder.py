"""Write an embedder: the surface with its normals as extra coordinates, as in Levy and Bonneel (2012).

Usage: python examples/own_embedder.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import anisomesh
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring


@dataclass(frozen=True)
class Normals:
    """The 6-D embedding (x, y, z, factor times the unit normal): triangles are stretched where normals change little.

    Attributes
    ----------
    factor
        Weight of the normals against the position, in bounding-box diagonals.
    """

    factor: float

    def __call__(self, surface: anisomesh.Surface, field: anisomesh.MetricField) -> anisomesh.Embedding:
        """Return the embedding of a surface; the metric counts only in the statistics of the stretch."""
        return anisomesh.precomputed_embedding(surface, self.factor * surface.point_normals, field.tensors)


def main(out: str = "own_embedder.png", n_vertices: int = 700) -> list[anisomesh.RemeshResult]:
    surface = anisomesh.sample("knot")
    panels, results = [], []
    for embedder in (Normals(0.05), Normals(0.2), anisomesh.Direct()):
        anisomesh.check_embedder(embedder)
        result = anisomesh.remesh(surface, n_vertices=n_vertices, embedding=embedder)
        quality = anisomesh.evaluate(surface, result.surface, samples=20_000).shape.g_mean
        note = f"mean quality G {quality:.2f} in the curvature metric"
        name = str(embedder).split("(iterations")[0]
        print(f"{name}: {result.embedding.points.shape[1]} dimensions, {note}")
        colouring = stretch_colouring(result.surface, high=6.0)
        panels.append(Panel(surface=result.surface, name=name, note=note, colouring=colouring))
        results.append(result)
    gallery(panels, out, columns=3, same_view=True, options=PictureOptions(scale=2))
    return results


if __name__ == "__main__":
    main(*sys.argv[1:])

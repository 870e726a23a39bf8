"""Draw the picture of the README: a shape, an isotropic remesh of it, and an anisotropic one.

Both remeshes have the same number of vertices and are coloured by the stretch of their triangles.

Usage: python examples/gallery.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys
from dataclasses import replace

import anisomesh
from anisomesh.shapes.analytic import trefoil_knot
from anisomesh.viz import Panel, PictureOptions, gallery, stretch_colouring

MAX_STRETCH = 6.0  # of the colour bar
BAR_LABEL = "stretch: length over width of a triangle"


def main(out: str = "gallery.png", n_vertices: int = 800) -> None:
    surface = trefoil_knot(radius=0.36, n_along=360, n_around=30)
    panels = [Panel(surface=surface, name="input", note=f"{surface.n_points:,} vertices")]
    for name, metric in (("isotropic", "uniform"), ("anisotropic", "curvature")):
        result = anisomesh.remesh(surface, n_vertices=n_vertices, metric=metric, embedding="direct").surface
        rms = anisomesh.evaluate(surface, result, samples=20_000).distance.rms
        note = f"{result.n_points:,} vertices, RMS distance {1e4 * rms:.1f}e-4"
        colouring = replace(stretch_colouring(result), name=BAR_LABEL, high=MAX_STRETCH)
        panels.append(Panel(surface=result, name=name, note=note, colouring=colouring))
        print(f"{name}: {note}")
    options = PictureOptions(scale=2)
    gallery(panels, out, columns=3, same_view=True, colour_bar=panels[-1].colouring, options=options)
    print(f"wrote {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Remesh three shapes made by code and draw the results in one picture, as in the README.

Usage: python examples/gallery.py [OUT]    (extra: picture)
"""

from __future__ import annotations

import sys

import numpy as np

import anisomesh
from anisomesh.shapes.analytic import torus
from anisomesh.viz import Panel, PictureOptions, gallery


def tube() -> anisomesh.Surface:
    """Return a closed tube that leaves its plane: it bends much around and little along."""
    surface = torus(1.0, 0.16, 160, 26)
    angle = np.arctan2(surface.points[:, 1], surface.points[:, 0])
    lift = 0.25 * np.sin(2.0 * angle)
    return surface.with_points(surface.points + lift[:, None] * np.array([0.0, 0.0, 1.0]))


def main(out: str = "gallery.png") -> None:
    shapes = {"stretched along": (tube(), 700), "creases kept": (anisomesh.sample("part"), 700)}
    shapes["both"] = anisomesh.sample("ring"), 1200
    panels = []
    for name, (surface, n) in shapes.items():
        result = anisomesh.remesh(surface, n_vertices=n).surface
        panels.append(Panel(surface=result, name=name, note=f"{surface.n_points:,} -> {result.n_points:,} vertices"))
    gallery(panels, out, columns=3, options=PictureOptions(scale=2))
    print(f"wrote {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])

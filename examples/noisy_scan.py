"""Remesh a noisy surface without and with the network, and draw both beside it.

Usage: python examples/noisy_scan.py [OUT]    (extras: picture, learn)
"""

from __future__ import annotations

import sys

import numpy as np

import anisomesh
from anisomesh.denoise.noise import with_noise
from anisomesh.viz import Panel, PictureOptions, gallery

NOISE = 0.3  # mean edge lengths


def main(out: str = "noisy_scan.png", n_vertices: int = 1_500) -> None:
    clean = anisomesh.sample("ring")
    noisy = with_noise(clean, NOISE, np.random.default_rng(0))
    panels = [Panel(surface=noisy, name="noisy input", note=f"{noisy.n_points:,} vertices")]
    for embedding in ("direct", "hybrid"):
        result = anisomesh.remesh(noisy, n_vertices=n_vertices, embedding=embedding)
        measured = anisomesh.evaluate(clean, result.surface, samples=20_000)
        note = f"G {measured.shape.g_mean:.2f}, RMS {1e4 * measured.distance.rms:.0f}e-4 from the clean surface"
        panels.append(Panel(surface=result.surface, name=embedding, note=note))
        print(f"{embedding}: {note}")
    gallery(panels, out, columns=3, options=PictureOptions(scale=2))
    print(f"wrote {out}")


if __name__ == "__main__":
    main(*sys.argv[1:])

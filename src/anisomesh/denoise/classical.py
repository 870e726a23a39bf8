"""Noise removal by filters of a strength that follows the noise."""

from __future__ import annotations

import numpy as np

from anisomesh.denoise.filters import bilateral_filtered, neighbour_averages, taubin_smoothed
from anisomesh.mesh.surface import Surface

_QUANTILE = 0.3  # of the heights of points over their surroundings, so that creases and detail do not count; heuristic
_HEIGHT_OF_QUANTILE = 2.0  # root mean square height of independent noise over this quantile; measured
NOISE_GATE = 0.08
"""In mean edge lengths: estimated noise from which on a surface is filtered; heuristic."""

_TAUBIN_STEPS = ((0.18, 2), (0.32, 6), (np.inf, 15))  # estimates up to which as many steps are taken; heuristic


def estimated_noise(surface: Surface) -> float:
    """Return an estimate of the root mean square height of noise, in mean edge lengths.

    It is a quantile of the components along the normals of the twofold umbrella operator, which is zero on planes and
    small on smooth surfaces: (A - I)^2 p with the mean over neighbours A.
    """
    averages = neighbour_averages(surface)
    once = averages @ surface.points - surface.points
    twice = averages @ once - once
    heights = np.abs(np.einsum("vx,vx->v", surface.point_normals, twice))[~surface.on_boundary]
    if len(heights) == 0:
        return 0.0
    return float(_HEIGHT_OF_QUANTILE * np.quantile(heights, _QUANTILE) / surface.edge_lengths.mean())


def classically_denoised(surface: Surface) -> Surface:
    """Return a surface without its noise: itself if it has less than ``NOISE_GATE``, else smoothed and filtered.

    Taubin smoothing, in more steps where there is more noise, then five rounds of bilateral filtering of the normals.
    """
    noise = estimated_noise(surface)
    if noise < NOISE_GATE:
        return surface
    steps = next(count for limit, count in _TAUBIN_STEPS if noise <= limit)
    return bilateral_filtered(taubin_smoothed(surface, steps))

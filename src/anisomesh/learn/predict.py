"""The metric that a trained network predicts."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import torch

from anisomesh._arrays import PointTensors
from anisomesh.learn.checkpoint import WeightsError, load_weights
from anisomesh.learn.lines import tensors_of
from anisomesh.learn.network import StretchNetwork
from anisomesh.learn.pyramid import pyramid
from anisomesh.surface.mesh import Surface


def predict_metric(surface: Surface, weights: str | os.PathLike[str]) -> PointTensors:
    """Return the metric (V, 3, 3) that a network predicts for a surface at bounding-box diagonal 1.

    Parameters
    ----------
    surface
        The surface; of points without an edge the metric is the identity.
    weights
        File that training has written.

    Raises
    ------
    WeightsError
        If the file cannot be read, or is of the paper's network.
    """
    path = Path(weights).resolve()
    network = _loaded(path, path.stat().st_mtime_ns if path.exists() else 0)
    seen = pyramid(surface, network.options.scales)
    with torch.inference_mode():
        return tensors_of(network(seen).numpy(), seen.frames)


@lru_cache(maxsize=4)
def _loaded(path: Path, changed: int) -> StretchNetwork:
    """Return the network in a file, read again when the file has changed."""
    network = load_weights(path)[0]
    if not isinstance(network, StretchNetwork):
        raise WeightsError(f"{path} has weights of the paper's network, which gives no metric; train the default one")
    return network.eval()

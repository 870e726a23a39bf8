"""Prediction of the metric (or embedding) of a surface by a trained network, and of the surface without noise."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch

from anisomesh._arrays import EmbeddedPoints, Points, PointTensors
from anisomesh.embedding.precomputed import pulled_back_metric
from anisomesh.learn.inference.pretrained import weights_path
from anisomesh.learn.models.checkpoint import Network, load_weights
from anisomesh.learn.models.device import deterministic, resolve_device
from anisomesh.learn.models.hierarchy import graph_hierarchy
from anisomesh.learn.models.paper import PaperNetwork, paper_input
from anisomesh.learn.models.stretch import StretchNetwork
from anisomesh.mesh.surface import Surface
from anisomesh.metric.line_field import tensors_of_line_field

NOISE_FLOOR = 0.05
"""In mean edge lengths: less noise is not removed. Heuristic; on clean meshes the default network finds less."""

MAX_DENOISING_STEPS = 3
"""Largest number of times that noise is removed; heuristic."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Predicted:
    """Prediction of a network for a surface.

    Attributes
    ----------
    tensors
        Metric (V, 3, 3).
    points
        Points without noise (V, 3); the points of the surface if none is removed.
    noise
        Removed noise: root mean square along the normals of the surface, in mean edge lengths.
    extra
        Coordinates of the embedding beyond the first three (V, 5), from the paper's network; None from the default one.
    """

    tensors: PointTensors
    points: Points
    noise: float = 0.0
    extra: EmbeddedPoints | None = None


def predict(
    surface: Surface, weights: str | os.PathLike[str] | None = None, *, device: str = "cpu", denoise: bool = True
) -> Predicted:
    """Return the prediction of a network for a surface at bounding-box diagonal 1.

    Parameters
    ----------
    surface
        The surface. The metric of points without edges is the identity.
    weights
        A file written by training, or the name of a pretrained network; None for the default network.
    device
        Torch device of the network.
    denoise
        Whether noise found by the default network is removed before its metric is predicted.

    Raises
    ------
    WeightsError
        If the file cannot be read as weights.
    OptionError
        If there is no such file or device.
    MemoryError
        If there is too little memory on the device or the host.

    Notes
    -----
    A surface on which the network finds less noise than ``NOISE_FLOOR`` is not changed. Otherwise the network is
    applied again to the surface without the noise, at most ``MAX_DENOISING_STEPS`` times.
    """
    path = weights_path(weights).resolve()
    network = _load_cached(path, path.stat().st_mtime_ns, resolve_device(device))
    with torch.inference_mode(), _one_thread(), deterministic():
        try:
            if isinstance(network, StretchNetwork):
                return _predict_stretch(network, surface, denoise=denoise)
            return _predict_embedding(network, surface)
        except RuntimeError as error:  # torch has no error type for host memory
            if isinstance(error, torch.OutOfMemoryError) or "allocate memory" in str(error):
                raise MemoryError(str(error)) from error
            raise


def _predict_stretch(network: StretchNetwork, surface: Surface, *, denoise: bool) -> Predicted:
    """Return the metric of the surface, or of the surface without noise after up to three steps if there is some."""
    current = surface
    for step in range(1 + MAX_DENOISING_STEPS):
        hierarchy = graph_hierarchy(current, network.options.scales)
        found = network(hierarchy)
        offsets = found.offsets.cpu().numpy().astype(np.float64)
        if not denoise or step == MAX_DENOISING_STEPS or _rms_height(current, offsets) < NOISE_FLOOR:
            break
        current = current.with_points(current.points + offsets)
    return Predicted(
        tensors=tensors_of_line_field(found.line_field.cpu().numpy(), hierarchy.frames),
        points=current.points,
        noise=_rms_height(surface, current.points - surface.points),
    )


def _predict_embedding(network: PaperNetwork, surface: Surface) -> Predicted:
    extra = network(paper_input(surface)).cpu().numpy().astype(np.float64)
    return Predicted(tensors=pulled_back_metric(surface, extra), points=surface.points, extra=extra)


def _rms_height(surface: Surface, offsets: Points) -> float:
    """Return the root mean square of the offsets (V, 3) along the normals, in mean edge lengths."""
    heights = np.einsum("nx,nx->n", surface.point_normals, offsets)
    return float(np.sqrt((heights**2).mean()) / surface.edge_lengths.mean())


@contextmanager
def _one_thread() -> Iterator[None]:
    """Use one thread of torch within the block, so that sums have the same order on every machine."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@lru_cache(maxsize=4)
def _load_cached(path: Path, changed: int, device: torch.device) -> Network:
    """Return the network in a file; ``changed``, its time of modification, invalidates the cache."""
    return load_weights(path)[0].to(device).eval()

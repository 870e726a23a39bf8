"""What a trained network makes of a surface: its metric or embedding, and the surface beneath the noise."""

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
from anisomesh.learn.models.device import deterministic, device_of
from anisomesh.learn.models.hierarchy import pyramid
from anisomesh.learn.models.paper import PaperNetwork, seen_of
from anisomesh.learn.models.stretch import StretchNetwork
from anisomesh.mesh.surface import Surface
from anisomesh.metric.line_field import tensors_of_line_field

NOISE_FLOOR = 0.05
"""Mean edge lengths; less noise than that is left."""

MAX_STEPS = 3
"""The most times that noise is taken away."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Predicted:
    """What a network predicts for a surface.

    Attributes
    ----------
    tensors
        The metric (V, 3, 3).
    points
        The points without noise (V, 3); those of the surface itself where none is taken away.
    noise
        What is taken away: root mean square along the normals of the surface, in mean edge lengths.
    extra
        Extra coordinates of the embedding (V, 5), by the paper's network; None by the default one.
    """

    tensors: PointTensors
    points: Points
    noise: float = 0.0
    extra: EmbeddedPoints | None = None


def predict(
    surface: Surface, weights: str | os.PathLike[str] | None = None, *, device: str = "cpu", denoise: bool = True
) -> Predicted:
    """Return what a network predicts for a surface at bounding-box diagonal 1.

    Parameters
    ----------
    surface
        The surface; of points without an edge the metric is the identity.
    weights
        A file that training has written, or the name of a shipped network; None for the default one.
    device
        Where the network runs, as torch names it.
    denoise
        Whether noise that the network finds is taken away before its metric is asked for.

    Raises
    ------
    WeightsError
        If the file cannot be read.
    OptionError
        If there is no such file or device.
    MemoryError
        If there is too little memory, on the device or beside it.

    Notes
    -----
    A surface on which the network finds less noise than ``NOISE_FLOOR`` stays as it is. Otherwise the network is asked
    again on the surface without it, which it sees better, until it finds no more, three times at most.
    """
    path = weights_path(weights).resolve()
    network = _loaded(path, path.stat().st_mtime_ns, device_of(device))
    with torch.inference_mode(), _one_thread(), deterministic():
        try:
            if isinstance(network, StretchNetwork):
                return _stretch(network, surface, denoise=denoise)
            return _extra(network, surface)
        except RuntimeError as error:  # of torch, which has no error of its own for the memory of the CPU
            if isinstance(error, torch.OutOfMemoryError) or "allocate memory" in str(error):
                raise MemoryError(str(error)) from error
            raise


def _stretch(network: StretchNetwork, surface: Surface, *, denoise: bool) -> Predicted:
    """Return the metric where no noise is found, and else that of the surface without it, after up to three steps."""
    current = surface
    for step in range(1 + MAX_STEPS):
        seen = pyramid(current, network.options.scales)
        found = network(seen)
        offsets = found.offsets.cpu().numpy().astype(np.float64)
        if not denoise or step == MAX_STEPS or _height(current, offsets) < NOISE_FLOOR:
            break
        current = current.with_points(current.points + offsets)
    return Predicted(
        tensors=tensors_of_line_field(found.lines.cpu().numpy(), seen.frames),
        points=current.points,
        noise=_height(surface, current.points - surface.points),
    )


def _extra(network: PaperNetwork, surface: Surface) -> Predicted:
    extra = network(seen_of(surface)).cpu().numpy().astype(np.float64)
    return Predicted(tensors=pulled_back_metric(surface, extra), points=surface.points, extra=extra)


def _height(surface: Surface, offsets: Points) -> float:
    """Return the root mean square of the offsets (V, 3) along the normals, in mean edge lengths."""
    heights = np.einsum("nx,nx->n", surface.point_normals, offsets)
    return float(np.sqrt((heights**2).mean()) / surface.edge_lengths.mean())


@contextmanager
def _one_thread() -> Iterator[None]:
    """Have torch take sums in the same order on every machine until the end of the block."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@lru_cache(maxsize=4)
def _loaded(path: Path, changed: int, device: torch.device) -> Network:
    """Return the network in a file, read again when the file has changed."""
    return load_weights(path)[0].to(device).eval()

"""Prediction of the metric (or embedding) of a surface by a trained network, and of the surface without noise."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from anisomesh._arrays import EmbeddedPoints, Points, PointTensors
from anisomesh.denoise.noise import noise_height
from anisomesh.embedding.precomputed import pulled_back_metric
from anisomesh.learn import require_torch
from anisomesh.learn.architecture import FilterOptions, PaperOptions
from anisomesh.learn.graphs.hierarchy import graph_hierarchy
from anisomesh.learn.inference.normals import NormalFilterInference
from anisomesh.learn.inference.paper import PaperInference
from anisomesh.learn.inference.pretrained import NORMAL_FILTER, weights_path
from anisomesh.learn.inference.stretch import StretchInference
from anisomesh.learn.weights_file import WeightsError, read_weights
from anisomesh.mesh.surface import Surface
from anisomesh.metric.line_field import tensors_of_line_field

NOISE_FLOOR, FULL_NOISE = 0.05, 0.075
"""In mean edge lengths: nothing is removed below the first, all above the second, in between an evenly growing share.

Heuristic; on clean meshes the default network finds less than the first.
"""

MAX_NOISE = 0.8
"""In mean edge lengths: more noise is not removed, since the default network was trained with at most .6. Heuristic."""

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
    remarks
        What a user should know, one sentence each.
    """

    tensors: PointTensors
    points: Points
    noise: float = 0.0
    extra: EmbeddedPoints | None = None
    remarks: tuple[str, ...] = ()


def predict(
    surface: Surface,
    weights: str | os.PathLike[str] | None = None,
    *,
    device: str = "cpu",
    denoise: bool = True,
    normal_filter: str | os.PathLike[str] | None = None,
) -> Predicted:
    """Return the prediction of a network for a surface at bounding-box diagonal 1.

    Parameters
    ----------
    surface
        The surface. The metric of points without edges is the identity.
    weights
        A file written by training, or the name of a pretrained network; None for the default network.
    device
        ``"cpu"``, or a torch device, which needs torch.
    denoise
        Whether noise found by the default network is removed before its metric is predicted.
    normal_filter
        A file of weights of a filter of normals, written by training, or the name of a pretrained one; None for the
        pretrained filter.

    Raises
    ------
    WeightsError
        If the file cannot be read as weights.
    OptionError
        If there is no such file or device.
    LearningError
        If the device needs torch, and it is not installed.
    MemoryError
        If there is too little memory on the device or the host.

    Notes
    -----
    A surface on which the network finds less noise than ``NOISE_FLOOR`` is not changed. Otherwise the network is
    applied again to the surface without the noise, at most ``MAX_DENOISING_STEPS`` times. Then a filter of the normals
    removes what is left, better than the network alone. Up to ``FULL_NOISE`` only a share is removed. A
    surface with more than ``MAX_NOISE`` stays as it is.
    """
    path = weights_path(weights).resolve()
    network = _network(path, path.stat().st_mtime_ns, device)
    if isinstance(network, PaperInference):
        extra = network(surface).astype(np.float64)
        return Predicted(tensors=pulled_back_metric(surface, extra), points=surface.points, extra=extra)
    return _predict_stretch(network, surface, denoise=denoise, normal_filter=normal_filter)


def moved_by_network(surface: Surface) -> Surface:
    """Return a surface at bounding-box diagonal 1 without the noise that the default network finds.

    What is left is for a filter of normals. The surface itself if the network finds less noise than ``NOISE_FLOOR``.
    """
    path = weights_path(None).resolve()
    network = _network(path, path.stat().st_mtime_ns, "cpu")
    assert isinstance(network, StretchInference)
    return _moved(network, surface).surface


@dataclass(frozen=True, kw_only=True, eq=False)
class _Moved:
    """A surface after steps of noise removal, the metric there, and the noise that the network found at first."""

    surface: Surface
    tensors: PointTensors
    noise: float


def _moved(network: StretchInference, surface: Surface, *, denoise: bool = True) -> _Moved:
    """Return a surface after up to three steps of noise removal, none if there is little."""
    current, first = surface, 0.0
    for step in range(1 + MAX_DENOISING_STEPS):
        hierarchy = graph_hierarchy(current, network.options.scales)
        line_field, offsets = network(hierarchy)
        height = noise_height(current, offsets)
        first = height if step == 0 else first
        if not denoise or step == MAX_DENOISING_STEPS or height < NOISE_FLOOR:
            break
        current = current.with_points(current.points + offsets.astype(np.float64))
    return _Moved(surface=current, tensors=tensors_of_line_field(line_field, hierarchy.frames), noise=first)


def _predict_stretch(
    network: StretchInference, surface: Surface, *, denoise: bool, normal_filter: str | os.PathLike[str] | None = None
) -> Predicted:
    """Return the metric of the surface, or of the surface without noise if there is some."""
    moved = _moved(network, surface, denoise=denoise)
    if moved.surface is surface:
        return Predicted(tensors=moved.tensors, points=surface.points)
    path = weights_path(NORMAL_FILTER if normal_filter is None else normal_filter).resolve()
    points = _normal_filter(path, path.stat().st_mtime_ns)(surface, moved.surface).points
    found = noise_height(surface, points - surface.points)
    if found > MAX_NOISE:
        remark = f"the network finds noise of {found:.2g} mean edge lengths, too much to judge; nothing was removed"
        return replace(_predict_stretch(network, surface, denoise=False), remarks=(remark,))
    share = min((moved.noise - NOISE_FLOOR) / (FULL_NOISE - NOISE_FLOOR), 1.0) if found > 0.0 else 0.0
    return Predicted(
        tensors=moved.tensors, points=surface.points + share * (points - surface.points), noise=share * found
    )


@lru_cache(maxsize=2)
def _normal_filter(path: Path, changed: int) -> NormalFilterInference:
    """Return the filter of normals in a file; ``changed``, its time of modification, invalidates the cache."""
    weights = read_weights(path)
    if not isinstance(weights.options, FilterOptions):
        raise WeightsError(f"{path}: holds the weights of a network, not of a filter of normals")
    return NormalFilterInference(weights.options, weights.arrays)


@lru_cache(maxsize=4)
def _network(path: Path, changed: int, device: str) -> StretchInference | PaperInference:
    """Return the network in a file; ``changed``, its time of modification, invalidates the cache."""
    if device != "cpu":
        require_torch()
        from anisomesh.learn.inference.on_device import network_on

        return network_on(path, device)
    weights = read_weights(path)
    try:
        if isinstance(weights.options, PaperOptions):
            return PaperInference(weights.options, weights.arrays)
        if isinstance(weights.options, FilterOptions):
            raise WeightsError("it is a filter of normals")
        return StretchInference(weights.options, weights.arrays)
    except WeightsError as error:
        raise WeightsError(f"{path}: does not hold the weights of a known network: {error}") from error

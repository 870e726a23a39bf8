"""Networks that run in torch, on a device that it knows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import torch

from anisomesh.learn.graphs.hierarchy import GraphHierarchy
from anisomesh.learn.inference.layers import Floats
from anisomesh.learn.inference.paper import PaperInference
from anisomesh.learn.inference.stretch import StretchInference
from anisomesh.learn.models.checkpoint import load_weights
from anisomesh.learn.models.device import deterministic, resolve_device
from anisomesh.learn.models.paper import PaperNetwork, paper_input
from anisomesh.learn.models.stretch import StretchNetwork
from anisomesh.learn.weights_file import WeightsError
from anisomesh.mesh.surface import Surface


class StretchOnDevice(StretchInference):
    """The default network on a device of torch."""

    def __init__(self, network: StretchNetwork) -> None:
        self.options = network.options
        self._network = network

    def __call__(self, hierarchy: GraphHierarchy) -> tuple[Floats, Floats]:
        """Return the line field (N, 2) and the offsets (N, 3) at the points of a hierarchy."""
        with _inference():
            found = self._network(hierarchy)
            return found.line_field.cpu().numpy(), found.offsets.cpu().numpy()


class PaperOnDevice(PaperInference):
    """The paper's network on a device of torch."""

    def __init__(self, network: PaperNetwork) -> None:
        self.options = network.options
        self._network = network

    def __call__(self, surface: Surface) -> Floats:
        """Return the extra coordinates (N, 5) of the points of a surface at bounding-box diagonal 1."""
        with _inference():
            extra: Floats = self._network(paper_input(surface)).cpu().numpy()
            return extra


def network_on(path: Path, device: str) -> StretchOnDevice | PaperOnDevice:
    """Return the network in a file of weights, on a torch device.

    Raises
    ------
    WeightsError
        If the file cannot be read as weights.
    OptionError
        If the device does not exist or cannot be used.
    """
    network = load_weights(path)[0].to(resolve_device(device)).eval()
    if isinstance(network, StretchNetwork):
        return StretchOnDevice(network)
    if isinstance(network, PaperNetwork):
        return PaperOnDevice(network)
    raise WeightsError(f"{path}: holds a filter of normals, not a network")


@contextmanager
def _inference() -> Iterator[None]:
    """Run without gradients and by deterministic algorithms; errors of memory are MemoryErrors."""
    with torch.inference_mode(), deterministic():
        try:
            yield
        except RuntimeError as error:  # torch has no error type for host memory
            if isinstance(error, torch.OutOfMemoryError) or "allocate memory" in str(error):
                raise MemoryError(str(error)) from error
            raise

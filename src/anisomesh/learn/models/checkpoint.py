"""Files of weights and checkpoints: safetensors with JSON in the header, written atomically; nothing is unpickled."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy.typing as npt
import torch
from safetensors.torch import save
from torch import Tensor, nn

from anisomesh.io.atomic import atomic_path
from anisomesh.learn.models.normals import NormalFilter
from anisomesh.learn.models.paper import PaperNetwork
from anisomesh.learn.models.stretch import StretchNetwork
from anisomesh.learn.weights_file import OPTIONS_OF_KIND, WeightsError, read_safetensors, read_weights

NETWORKS: dict[str, Any] = {"default": StretchNetwork, "paper": PaperNetwork, "filter": NormalFilter}
"""Class of the network for each kind in a file of weights."""

Network = StretchNetwork | PaperNetwork | NormalFilter


def save_weights(network: Network, path: Path, facts: dict[str, Any]) -> None:
    """Write the weights of a network, its options, and facts about it (as JSON) to one safetensors file.

    Raises
    ------
    MeshFileError
        If the file cannot be written.
    """
    kind = next(name for name, network_class in NETWORKS.items() if isinstance(network, network_class))
    header = {"kind": kind, "network": json.dumps(asdict(network.options)), "facts": json.dumps(facts)}
    _write(path, save({name: value.contiguous() for name, value in network.state_dict().items()}, metadata=header))


def load_weights(path: Path) -> tuple[Network, dict[str, Any]]:
    """Return the network in a file of weights, and the facts about it.

    Raises
    ------
    WeightsError
        If the file is missing, damaged, or has no weights of a known network.
    """
    found = read_weights(path)
    kind = next(name for name, options_class in OPTIONS_OF_KIND.items() if isinstance(found.options, options_class))
    network: Network = NETWORKS[kind](found.options)
    try:
        network.load_state_dict(tensors_of(found.arrays))
    except RuntimeError as error:
        raise WeightsError(f"{path}: does not hold the weights of a known network: {error}") from error
    return network, found.facts


def tensors_of(arrays: dict[str, npt.NDArray[Any]]) -> dict[str, Tensor]:
    """Return copies of arrays as tensors."""
    return {name: torch.from_numpy(array.copy()) for name, array in arrays.items()}


def save_state(path: Path, network: nn.Module, optimiser: torch.optim.Optimizer, state: dict[str, Any]) -> None:
    """Write a checkpoint: the weights, the moments of the optimiser, and the state of the run (as JSON).

    Raises
    ------
    MeshFileError
        If the file cannot be written.
    """
    tensors = {f"weights.{name}": value.contiguous() for name, value in network.state_dict().items()}
    names = [name for name, _ in network.named_parameters()]
    for number, values in optimiser.state_dict()["state"].items():  # parameters without a gradient have no moments
        tensors |= {f"optimiser.{names[number]}.{key}": value.contiguous() for key, value in values.items()}
    _write(path, save(tensors, metadata={"state": json.dumps(state)}))


def load_state(path: Path, network: nn.Module, optimiser: torch.optim.Optimizer) -> dict[str, Any]:
    """Restore network and optimiser from a checkpoint and return the state of the run.

    Raises
    ------
    WeightsError
        If the file is missing, damaged, or a checkpoint of another network.
    """
    arrays, header = read_safetensors(path)
    tensors = tensors_of(arrays)
    try:
        weights = {
            name.removeprefix("weights."): value for name, value in tensors.items() if name.startswith("weights.")
        }
        network.load_state_dict(weights)
        table = optimiser.state_dict()
        table["state"] = {}
        for number, (name, _) in enumerate(network.named_parameters()):
            start = f"optimiser.{name}."
            values: dict[str, Tensor] = {
                key.removeprefix(start): value for key, value in tensors.items() if key.startswith(start)
            }
            if values:
                table["state"][number] = values
        optimiser.load_state_dict(table)
        state: dict[str, Any] = json.loads(header["state"])
        return state
    except (KeyError, RuntimeError, ValueError) as error:
        raise WeightsError(f"{path}: does not hold a checkpoint of this run: {error}") from error


def _write(path: Path, data: bytes) -> None:
    with atomic_path(path) as temporary:
        Path(temporary).write_bytes(data)

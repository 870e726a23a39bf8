"""Weights and the state of a training run on disk: safetensors and JSON, each written in full or not at all."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor, nn

from anisomesh.errors import AnisomeshError
from anisomesh.io.atomic import atomic_path
from anisomesh.learn.models.paper import PaperNetwork, PaperOptions
from anisomesh.learn.models.stretch import NetworkOptions, StretchNetwork


class WeightsError(AnisomeshError):
    """A file of weights or a checkpoint cannot be read, or belongs to another network."""


KINDS: dict[str, tuple[Any, Any]] = {
    "default": (StretchNetwork, NetworkOptions),
    "paper": (PaperNetwork, PaperOptions),
}
"""Networks and their sizes, by the name that files have for them."""

Network = StretchNetwork | PaperNetwork


def save_weights(network: Network, path: Path, facts: dict[str, Any]) -> None:
    """Write the weights of a network, its sizes, and facts about it, in one file of safetensors.

    Raises
    ------
    MeshFileError
        If the file cannot be written.
    """
    kind = next(name for name, (made, _) in KINDS.items() if isinstance(network, made))
    head = {"kind": kind, "network": json.dumps(asdict(network.options)), "facts": json.dumps(facts)}
    _write(path, save({name: value.contiguous() for name, value in network.state_dict().items()}, metadata=head))


def load_weights(path: Path) -> tuple[Network, dict[str, Any]]:
    """Return the network in a file, and the facts about it.

    Raises
    ------
    WeightsError
        If the file is missing, damaged or of another kind.
    """
    tensors, head = _read(path)
    try:
        made, sizes = KINDS[head["kind"]]
        network: Network = made(sizes(**json.loads(head["network"])))
        network.load_state_dict(tensors)
        return network, json.loads(head["facts"])
    except (KeyError, TypeError, RuntimeError, json.JSONDecodeError) as error:
        raise WeightsError(f"{path}: no weights of this network: {error}") from error


def save_state(path: Path, network: nn.Module, optimiser: torch.optim.Optimizer, state: dict[str, Any]) -> None:
    """Write all that a training run needs to go on: weights, the moments of the optimiser, and numbers of its own.

    Raises
    ------
    MeshFileError
        If the file cannot be written.
    """
    tensors = {f"weights.{name}": value.contiguous() for name, value in network.state_dict().items()}
    names = [name for name, _ in network.named_parameters()]
    for number, values in optimiser.state_dict()["state"].items():  # parameters without a gradient have none
        tensors |= {f"optimiser.{names[number]}.{key}": value.contiguous() for key, value in values.items()}
    _write(path, save(tensors, metadata={"state": json.dumps(state)}))


def load_state(path: Path, network: nn.Module, optimiser: torch.optim.Optimizer) -> dict[str, Any]:
    """Bring network and optimiser to the state in a file and return the numbers beside it.

    Raises
    ------
    WeightsError
        If the file is damaged or of another network.
    """
    tensors, head = _read(path)
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
        state: dict[str, Any] = json.loads(head["state"])
        return state
    except (KeyError, RuntimeError, ValueError) as error:
        raise WeightsError(f"{path}: no checkpoint of this run: {error}") from error


def _write(path: Path, data: bytes) -> None:
    with atomic_path(path) as temporary:
        Path(temporary).write_bytes(data)


def _read(path: Path) -> tuple[dict[str, Tensor], dict[str, str]]:
    try:
        data = path.read_bytes()
        length = int.from_bytes(data[:8], "little")
        head = json.loads(data[8 : 8 + length]).get("__metadata__", {})
        return load(data), head
    except (OSError, ValueError, AttributeError, SafetensorError) as error:
        raise WeightsError(f"{path}: cannot be read as safetensors: {error}") from error

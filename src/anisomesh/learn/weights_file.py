"""Files of weights: safetensors with JSON in the header, read without torch."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh.errors import AnisomeshError, OptionError
from anisomesh.learn.architecture import FilterOptions, NetworkOptions, PaperOptions

_DTYPES: dict[str, np.dtype[Any]] = {
    "F32": np.dtype("<f4"),
    "F64": np.dtype("<f8"),
    "I32": np.dtype("<i4"),
    "I64": np.dtype("<i8"),
}

OPTIONS_OF_KIND: dict[str, type[NetworkOptions] | type[PaperOptions] | type[FilterOptions]] = {
    "default": NetworkOptions,
    "paper": PaperOptions,
    "filter": FilterOptions,
}
"""Class of the options for each kind of network in a file of weights."""

_IMPLIED: dict[str, dict[str, str]] = {"paper": {"skip": "after", "norm": "mesh"}}
"""For each kind, the values that options had before they existed; files that lack them were written then."""


class WeightsError(AnisomeshError):
    """A file of weights or a checkpoint cannot be read, or is of another network."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Weights:
    """Content of a file of weights.

    Attributes
    ----------
    options
        Sizes of the network; their class says which network it is.
    arrays
        Array for each name.
    facts
        Facts about the training.
    """

    options: NetworkOptions | PaperOptions | FilterOptions
    arrays: dict[str, npt.NDArray[Any]]
    facts: dict[str, Any]


def read_weights(path: Path) -> Weights:
    """Return the content of a file of weights.

    Raises
    ------
    WeightsError
        If the file is missing, damaged, or has no weights of a known network.
    """
    arrays, header = read_safetensors(path)
    try:
        kind, written = header["kind"], json.loads(header["network"])
        options = OPTIONS_OF_KIND[kind](**{**_IMPLIED.get(kind, {}), **written})
        return Weights(options=options, arrays=arrays, facts=json.loads(header["facts"]))
    except (KeyError, TypeError, ValueError, OptionError) as error:
        raise WeightsError(f"{path}: does not hold the weights of a known network: {error}") from error


def read_safetensors(path: Path) -> tuple[dict[str, npt.NDArray[Any]], dict[str, str]]:
    """Return the arrays and the metadata of a safetensors file.

    Raises
    ------
    WeightsError
        If the file is missing or damaged.

    Notes
    -----
    Eight bytes with the length of the header, the header in JSON with type, shape and byte range of each array, and the
    arrays in rows, all little-endian.
    """
    try:
        data = path.read_bytes()
        length = int.from_bytes(data[:8], "little")
        if not 2 <= length <= len(data) - 8:
            raise ValueError("the header is cut off")
        table = json.loads(data[8 : 8 + length])
        header = table.pop("__metadata__", {})
        body = memoryview(data)[8 + length :]
        return {name: _array(entry, body) for name, entry in table.items()}, header
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise WeightsError(f"{path}: cannot be read as safetensors: {error}") from error


def _array(entry: dict[str, Any], body: memoryview) -> npt.NDArray[Any]:
    """Return the array of an entry of the header."""
    start, end = entry["data_offsets"]
    if entry["dtype"] not in _DTYPES:
        raise ValueError(f"numbers of type {entry['dtype']}; expected one of {', '.join(_DTYPES)}")
    dtype, shape = _DTYPES[entry["dtype"]], tuple(entry["shape"])
    if not 0 <= start <= end <= len(body) or end - start != dtype.itemsize * int(np.prod(shape, dtype=np.int64)):
        raise ValueError(f"bytes {start} to {end} of {len(body)} do not hold an array of shape {shape}")
    return np.asarray(np.frombuffer(body[start:end], dtype=dtype).reshape(shape))

"""Layers of the networks in NumPy and compiled kernels; float32, with sums in a fixed order."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from anisomesh._kernels.products import add_product
from anisomesh.learn.architecture import LEAKY_SLOPE, NORM_EPSILON
from anisomesh.learn.weights_file import WeightsError

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[Any]


Shapes = dict[str, tuple[int, ...]]


def linear_shapes(name: str, inputs: int, outputs: int, *, bias: bool = True) -> Shapes:
    """Return the shapes of the arrays of a linear map."""
    shapes: Shapes = {f"{name}.weight": (outputs, inputs)}
    return shapes | {f"{name}.bias": (outputs,)} if bias else shapes


def norm_shapes(name: str, channels: int, *, running: bool = False) -> Shapes:
    """Return the shapes of the arrays of :meth:`Layers.mesh_norm` or, with ``running``, :meth:`Layers.batch_norm`."""
    names = ("scale", "shift", "mean", "variance") if running else ("scale", "shift")
    return {f"{name}.{part}": (channels,) for part in names}


class Layers:
    """The arrays of a network by their names in files of weights, and the layers that they are the weights of.

    Parameters
    ----------
    arrays
        Array for each name; matrices are (outputs, inputs), as torch keeps them.
    shapes
        Their shapes.

    Raises
    ------
    WeightsError
        If an array is missing, has another shape, or is not one of the network.
    """

    def __init__(self, arrays: dict[str, npt.NDArray[Any]], shapes: Shapes) -> None:
        found = {name: array.shape for name, array in arrays.items()}
        for name in sorted(found.keys() | shapes.keys()):
            if found.get(name) != shapes.get(name):
                wanted = shapes.get(name, "no such array")
                raise WeightsError(f"{name} has shape {found.get(name, 'missing')}; expected {wanted}")
        self._arrays = {name: np.array(array, dtype=np.float32, order="C") for name, array in arrays.items()}
        self._matrices = {name: np.ascontiguousarray(a.T) for name, a in self._arrays.items() if a.ndim == 2}

    def array(self, name: str) -> Floats:
        """Return an array by its name."""
        return self._arrays[name]

    def linear(self, name: str, x: Floats) -> Floats:
        """Return the linear map (V, C) of rows (V, K), with the bias if there is one."""
        return self._mapped(name, x, None)

    def linear_of_both(self, name: str, a: Floats, b: Floats) -> Floats:
        """Return the linear map (V, C) of the concatenated rows of (V, A) and (V, B), without concatenating them."""
        return self._mapped(name, a, b)

    def _mapped(self, name: str, a: Floats, b: Floats | None) -> Floats:
        matrix, bias = self._matrices[f"{name}.weight"], self._arrays.get(f"{name}.bias")
        out = np.zeros((len(a), matrix.shape[1]), dtype=np.float32)
        if bias is not None:
            out += bias
        add_product(np.ascontiguousarray(a), matrix[: a.shape[1]], out)
        if b is not None:
            add_product(np.ascontiguousarray(b), matrix[a.shape[1] :], out)
        return out

    def mesh_norm(self, name: str, x: Floats) -> Floats:
        """Return channels normalised to mean 0 and variance 1 over the nodes of a mesh, scaled and shifted."""
        centre = x.mean(axis=0, dtype=np.float64)
        variance = np.square(x - centre.astype(np.float32)).mean(axis=0, dtype=np.float64)
        return self._normalised(name, x, centre, variance)

    def batch_norm(self, name: str, x: Floats) -> Floats:
        """Return channels normalised by the mean and variance that training found, scaled and shifted."""
        centre, variance = (self._arrays[f"{name}.{part}"].astype(np.float64) for part in ("mean", "variance"))
        return self._normalised(name, x, centre, variance)

    def _normalised(
        self, name: str, x: Floats, centre: npt.NDArray[np.float64], variance: npt.NDArray[np.float64]
    ) -> Floats:
        factor = self._arrays[f"{name}.scale"] / np.sqrt(variance + NORM_EPSILON)
        shift = self._arrays[f"{name}.shift"] - centre * factor
        return np.asarray(x * factor.astype(np.float32) + shift.astype(np.float32))


def leaky(x: Floats) -> Floats:
    """Return the leaky rectifier of values, in their place."""
    np.maximum(x, np.float32(LEAKY_SLOPE) * x, out=x)
    return x


def sums_at_nodes(values: Floats, first: Ints) -> Floats:
    """Return the sums (V, ...) of the values of edges (E, ...) in compressed rows (V + 1,)."""
    total = np.zeros((len(first) - 1, *values.shape[1:]), dtype=np.float32)
    some = first[1:] > first[:-1]
    if some.any():
        total[some] = np.add.reduceat(values, first[:-1][some], axis=0)
    return total

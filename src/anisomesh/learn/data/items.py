"""Items of a data set: a mesh and what a network is to find on it, one file each."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointTensors
from anisomesh.errors import MeshFileError
from anisomesh.io.atomic import atomic_path
from anisomesh.mesh.surface import Surface

_UPPER = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])


@dataclass(frozen=True, kw_only=True, eq=False)
class Item:
    """A mesh at bounding-box diagonal 1 of its shape, and the metric and embedding of the clean shape on it.

    Attributes
    ----------
    points, faces
        The mesh (V, 3) float32, (F, 3) int32.
    metric
        Upper triangle of the metric tensors (V, 6) float32: xx, xy, xz, yy, yz, zz.
    extra
        The coordinates beyond the first three of the direct embedding with this metric (V, 5) float32.
    trusted
        Where the curvature behind the metric is known well (V,).
    """

    points: npt.NDArray[np.float32]
    faces: npt.NDArray[np.int32]
    metric: npt.NDArray[np.float32]
    extra: npt.NDArray[np.float32]
    trusted: npt.NDArray[np.bool_]

    @classmethod
    def of(
        cls, surface: Surface, tensors: PointTensors, extra: npt.NDArray[np.float64], trusted: npt.NDArray[np.bool_]
    ) -> Item:
        """Return the item of a surface, its metric (V, 3, 3) and its extra coordinates (V, 5)."""
        return cls(
            points=surface.points.astype(np.float32),
            faces=surface.faces.astype(np.int32),
            metric=tensors[:, _UPPER[0], _UPPER[1]].astype(np.float32),
            extra=extra.astype(np.float32),
            trusted=np.asarray(trusted, dtype=bool),
        )

    @property
    def surface(self) -> Surface:
        """The mesh."""
        return Surface(self.points, self.faces)

    @property
    def tensors(self) -> PointTensors:
        """The metric as tensors (V, 3, 3)."""
        full = np.empty((len(self.metric), 3, 3))
        full[:, _UPPER[0], _UPPER[1]] = self.metric
        full[:, _UPPER[1], _UPPER[0]] = self.metric
        return full


def save_item(item: Item, path: str | os.PathLike[str]) -> None:
    """Write an item as .npz, in full or not at all."""
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, **{field.name: getattr(item, field.name) for field in fields(Item)})


def load_item(path: str | os.PathLike[str]) -> Item:
    """Return the item in a file.

    Raises
    ------
    MeshFileError
        If the file is missing, damaged, or no item. Nothing in it is ever unpickled.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as archive:
            item = Item(**{field.name: archive[field.name] for field in fields(Item)})
    except Exception as error:  # zipfile and NumPy raise many kinds
        raise MeshFileError(f"{path}: no item of a data set: {error}") from error
    n = len(item.points)
    shapes = {"points": (n, 3), "faces": (len(item.faces), 3), "metric": (n, 6), "extra": (n, 5), "trusted": (n,)}
    for name, shape in shapes.items():
        if getattr(item, name).shape != shape:
            raise MeshFileError(f"{path}: {name} has shape {getattr(item, name).shape}; expected {shape}")
    return item

"""Items of a data set: a mesh with the metric and embedding to be learnt on it, in one file each."""

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

_UPPER_TRIANGLE = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])  # rows and columns


@dataclass(frozen=True, kw_only=True, eq=False)
class Item:
    """A mesh of a shape at bounding-box diagonal 1, with the metric and embedding of the clean shape at its points.

    Attributes
    ----------
    points, faces
        The mesh, (V, 3) float32 and (F, 3) int32.
    metric
        Upper triangle of the metric tensors (V, 6) float32: xx, xy, xz, yy, yz, zz.
    extra
        Coordinates of the direct embedding of this metric beyond the first three (V, 5) float32.
    trusted
        Whether the curvature of the metric is reliable at each point (V,).
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
        """Return the item of a surface with metric (V, 3, 3), extra coordinates (V, 5) and reliability (V,)."""
        return cls(
            points=surface.points.astype(np.float32),
            faces=surface.faces.astype(np.int32),
            metric=tensors[:, _UPPER_TRIANGLE[0], _UPPER_TRIANGLE[1]].astype(np.float32),
            extra=extra.astype(np.float32),
            trusted=np.asarray(trusted, dtype=bool),
        )

    @property
    def surface(self) -> Surface:
        """The mesh as a surface."""
        return Surface(self.points, self.faces)

    @property
    def tensors(self) -> PointTensors:
        """The metric as tensors (V, 3, 3)."""
        full = np.empty((len(self.metric), 3, 3))
        full[:, _UPPER_TRIANGLE[0], _UPPER_TRIANGLE[1]] = self.metric
        full[:, _UPPER_TRIANGLE[1], _UPPER_TRIANGLE[0]] = self.metric
        return full


def save_item(item: Item, path: str | os.PathLike[str]) -> None:
    """Write an item as .npz, atomically.

    Raises
    ------
    MeshFileError
        If the file cannot be written.
    """
    with atomic_path(path) as temporary:
        np.savez_compressed(temporary, **{field.name: getattr(item, field.name) for field in fields(Item)})


def load_item(path: str | os.PathLike[str]) -> Item:
    """Return the item in a .npz file; nothing is unpickled.

    Raises
    ------
    MeshFileError
        If the file is missing, damaged, or not an item.
    """
    try:
        with np.load(Path(path), allow_pickle=False) as archive:
            item = Item(**{field.name: archive[field.name] for field in fields(Item)})
    except Exception as error:  # zipfile and NumPy raise many types
        raise MeshFileError(f"{path}: is not an item of a data set: {error}") from error
    n = len(item.points)
    shapes = {"points": (n, 3), "faces": (len(item.faces), 3), "metric": (n, 6), "extra": (n, 5), "trusted": (n,)}
    for name, shape in shapes.items():
        if getattr(item, name).shape != shape:
            raise MeshFileError(f"{path}: {name} has shape {getattr(item, name).shape}; expected {shape}")
    return item

"""Array types with their shapes, and the reading of a user's values as an array.

``V`` is the number of points, ``F`` of faces, ``E`` of edges, ``S`` of sites; ``d`` is the dimension of the embedding.
Geometry is float64; indices are int32, and -1 means "none". Types of numbers and shapes are documentation:
type checkers see plain NumPy arrays.
"""

from typing import Annotated as Bool
from typing import Annotated as Float64
from typing import Annotated as Int32
from typing import Annotated as Int64
from typing import Any

import numpy as np
import numpy.typing as npt

Points = Float64[np.ndarray, "V 3"]
Faces = Int32[np.ndarray, "F 3"]
Edges = Int32[np.ndarray, "E 2"]
EdgeEnds = Int64[np.ndarray, "n 2"]
FaceIndices = Int32[np.ndarray, "F 3"]
EdgeIndices = Int32[np.ndarray, "E 2"]

PointScalars = Float64[np.ndarray, "V"]
PointVectors = Float64[np.ndarray, "V 3"]
PointTensors = Float64[np.ndarray, "V 3 3"]
CornerTensors = Float64[np.ndarray, "F 3 3 3"]
FaceScalars = Float64[np.ndarray, "F"]
FaceVectors = Float64[np.ndarray, "F 3"]
PointLabels = Int32[np.ndarray, "V"]
FaceLabels = Int32[np.ndarray, "F"]
FaceMask = Bool[np.ndarray, "F"]
PointMask = Bool[np.ndarray, "V"]
EdgeMask = Bool[np.ndarray, "E"]
EdgeLabels = Int32[np.ndarray, "E"]

EmbeddedPoints = Float64[np.ndarray, "V d"]
Sites = Float64[np.ndarray, "S d"]
SiteScalars = Float64[np.ndarray, "S"]

Vector3 = Float64[np.ndarray, "3"]
Floats = Float64[np.ndarray, "n"]
Indices = Int32[np.ndarray, "n"]


def real_array(
    name: str, values: Any, shape: tuple[int | None, ...], error: type[Exception]
) -> npt.NDArray[np.float64]:
    """Return values as a new float64 array; raise an error of the given type unless they are real and fit the shape.

    None in the shape stands for any size.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biufO":
            raise TypeError(f"type {array.dtype}")
        array = array.astype(np.float64, order="C")
    except (TypeError, ValueError) as reason:
        raise error(f"{name} cannot be read as real numbers: {reason}") from reason
    if len(array.shape) != len(shape) or any(b not in (None, a) for a, b in zip(array.shape, shape, strict=True)):
        expected = ", ".join("k" if size is None else str(size) for size in shape)
        raise error(f"{name} has shape {array.shape}; expected ({expected}{',' * (len(shape) == 1)})")
    return array

"""How to remesh."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from numbers import Number
from typing import TYPE_CHECKING, Any, Literal, get_args

from anisomesh._values import LARGEST_SIZE, real_number, whole_number
from anisomesh.errors import OptionError
from anisomesh.metric.names import METRIC_NAMES, MetricName
from anisomesh.toml import hint

if TYPE_CHECKING:  # the command line imports this module, and has to start at once
    import numpy.typing as npt

    from anisomesh._arrays import Points
    from anisomesh.cvt.energy import Energy
    from anisomesh.embedding.embedder import Embedder
    from anisomesh.metric.field import MetricSource

EmbeddingName = Literal["auto", "direct", "filtered", "neural", "hybrid"]
DeviceName = Literal["cpu", "cuda"]
MAX_THREADS = 1024
MIN_VERTICES = 4  # a tetrahedron
_NUMBERS = ("sharpness", "feature_angle", "weld_tolerance", "shape_weight")
_SIZES = ("edge_length", "min_size", "max_size", "gradation")
_OPTIONAL_NUMBERS = ("final_sharpness", "time_limit", *_SIZES)
_LEAST = {"seed": 0, "threads": 1, "lloyd_iterations": 0, "max_iterations": 0, "embedding_iterations": 1}

EMBEDDINGS: tuple[EmbeddingName, ...] = get_args(EmbeddingName)
DEVICES: tuple[DeviceName, ...] = get_args(DeviceName)


@dataclass(frozen=True, kw_only=True)
class RemeshOptions:
    """How to remesh.

    Attributes
    ----------
    sharpness
        The factor s of the normal metric, at least 1: 1 is the plain CVT with the most regular elements, 7 the
        paper's value, larger values keep the surface and its creases more exactly.
    final_sharpness
        If given, the optimisation ends with this factor (30 brings vertices onto corners and creases).
    metric
        ``"curvature"``, ``"approximation"``, ``"uniform"``; tensors (V, 3, 3) at the points of the input, in model
        units; or a :class:`~anisomesh.metric.field.MetricSource`, such as ``Curvature()`` or ``Neural("file")``.
    edge_length
        Instead of a number of vertices, which then follows: the length of the edges in the metric, in model units if it
        is ``"curvature"`` (there of edges along the smaller curvature) or ``"uniform"``, and as M measures it if it is
        tensors; with tensors alone it is 1.
    size_field
        Lengths of edges in model units, for the metric ``"uniform"``: one for each point of the input (V,), or a
        function of points (n, 3) that returns lengths (n,). Without a number of vertices they are absolute, and the
        number follows; with one only their ratios matter.
    min_size, max_size
        Bounds of the sizes in ``size_field``, in model units.
    gradation
        Largest difference of the sizes in ``size_field`` over the distance along edges of the surface: larger sizes are
        lowered.
    embedding
        ``"direct"``: the metric is measured; ``"filtered"``: the same after filters have removed noise;
        ``"neural"``: short for ``metric=Neural(weights, device, denoise)``; ``"hybrid"``: the same for ``Hybrid``, a
        mean of measured and predicted metric; ``"auto"``: hybrid where the metric is ``"curvature"``, the only one that
        networks predict, and fewer than a tenth of the edges of the input are flat, as on measured surfaces; else
        direct. Or an
        :class:`~anisomesh.embedding.embedder.Embedder`, such as ``Direct(iterations=20)``.
    energy
        The energy that the sites minimise, an :class:`~anisomesh.cvt.energy.Energy`; by default
        ``NormalMetric(sharpness)``.
    density
        Positive weights of the energy at the points of the input (V,): triangles are smaller where it is larger, their
        area inversely proportional to its square root.
    weights
        For ``"neural"`` and ``"hybrid"``: a file of ``anisomesh train``, or the name of a pretrained network; by
        default the one called ``default``.
    device
        Where the network runs, ``"cpu"``, or ``"cuda"``, which needs torch.
    denoise
        Whether noise that a network or filters find in the input is removed first. Designed surfaces, on which a tenth
        of the edges or more are flat, are left as they are.
    reduce
        Whether an input with more than 24 points for each vertex asked for is first reduced to about 16, unless a
        metric, sizes or a density are prescribed or sheets are to be joined.
    fit
        Whether the mesh is fitted to the input at the end: vertices move and edges are flipped such that distance and
        shape of the triangles get better together. Without it the result is the dual of the tessellation, as in the
        paper; so it is with an ``energy`` other than ``NormalMetric``. With a ``density`` no points are exchanged.
    shape_weight
        How much the shape of triangles counts in the fit, against their distance from the input: larger than 1 for
        better shaped triangles, smaller for nearer ones.
    seed
        Seed of the start positions; the same seed and input give the same result. If the mesh has inverted or
        intersecting triangles that the input does not explain, the next two seeds are tried.
    threads
        Worker threads; they do not change the result.
    lloyd_iterations, max_iterations
        Iterations of Lloyd's algorithm at the start, and the bound on iterations of L-BFGS after it; by default 50 if
        the mesh is fitted, which makes more of them useless, and else 150.
    embedding_iterations
        Bound on the local/global steps of the direct embedding.
    weld_tolerance
        Points of the input up to this distance (model units) are merged; ``"auto"`` is 1e-5 of the diagonal.
    feature_angle
        Edges of the input whose dihedral angle deviates from flat by more degrees than this are creases, which edges of
        the result follow where there are enough vertices, and across which no curvature is measured; 180 for none. The
        plain CVT (``sharpness`` 1) does not follow them.
    features
        Edges of the input that are creases in any case, as pairs of its points (n, 2).
    keep_points
        Points of the input (n,) that are vertices of the result, at the same coordinates.
    lock
        Regions of the input whose points and triangles stay as they are, while the rest is remeshed up to them: the
        name or label of a region of the :class:`~anisomesh.attributes.model.Mesh`, several of these, or a mask of the
        faces (F,). Fixed faces of the mesh are locked too.
    regions
        Whether edges of the result follow the borders between regions of a :class:`~anisomesh.attributes.model.Mesh`
        and the seams of its corner data, also where the surface is smooth, and has vertices at the ends of regions of
        its features.
    attributes
        Whether the result has everything that a :class:`~anisomesh.attributes.model.Mesh` carries, and its fixed faces
        are locked. If not, the mesh is taken for a mere surface, but for its features and fixed points.
    time_limit
        Wall-clock seconds after which the optimisation and the repair of faults end with what they have; the first
        60 % are for the optimisation. What a valid mesh needs is done regardless, so a run may take somewhat longer.
    """

    sharpness: float = 7.0
    final_sharpness: float | None = None
    metric: MetricName | npt.NDArray[Any] | MetricSource = "curvature"
    edge_length: float | None = None
    size_field: npt.ArrayLike | Callable[[Points], npt.ArrayLike] | None = None
    min_size: float | None = None
    max_size: float | None = None
    gradation: float | None = None
    embedding: str | Embedder = "auto"
    energy: Energy | None = None
    density: npt.ArrayLike | None = None
    weights: str | os.PathLike[str] | None = None
    device: str = "cpu"
    denoise: bool = True
    reduce: bool = True
    fit: bool = True
    shape_weight: float = 1.0
    seed: int = 0
    threads: int = 2
    lloyd_iterations: int = 9
    max_iterations: int | None = None
    embedding_iterations: int = 10
    weld_tolerance: float | Literal["auto"] = 0.0
    feature_angle: float = 40.0
    features: npt.ArrayLike | None = None
    keep_points: npt.ArrayLike | None = None
    lock: str | int | Sequence[str | int] | npt.NDArray[Any] | None = None
    regions: bool = True
    attributes: bool = True
    time_limit: float | None = None

    def __post_init__(self) -> None:
        self._read_numbers()
        for name in ("sharpness", "final_sharpness"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 1.0):
                raise OptionError(f"{name} = {value}; expected a finite number of at least 1 (1 is the plain CVT)")
        if not 0.0 <= self.feature_angle <= 180.0:
            raise OptionError(f"feature_angle = {self.feature_angle}; expected 0 to 180 degrees")
        if self.weld_tolerance != "auto" and not (self.weld_tolerance >= 0.0 and math.isfinite(self.weld_tolerance)):
            raise OptionError(f"weld_tolerance = {self.weld_tolerance}; expected a length of at least 0, or 'auto'")
        if not (self.shape_weight > 0.0 and math.isfinite(self.shape_weight)):
            raise OptionError(f"shape_weight = {self.shape_weight}; expected a positive number, such as 4 or 0.25")
        if self.time_limit is not None and not self.time_limit > 0.0:
            raise OptionError(f"time_limit = {self.time_limit}; expected a positive number of seconds")
        if self.threads > MAX_THREADS:
            raise OptionError(f"threads = {self.threads}; expected at most {MAX_THREADS}")
        for name in ("denoise", "reduce", "fit", "regions", "attributes"):
            if not isinstance(getattr(self, name), bool):
                raise OptionError(f"{name} = {getattr(self, name)!r}; expected True or False")
        if not isinstance(self.weights, str | os.PathLike | None):
            raise OptionError(f"weights = {self.weights!r}; expected the name of a network or of a file")
        self._check_sizes()
        self._check_stages()

    def _read_numbers(self) -> None:
        """Turn numbers of any type, such as NumPy's, into Python's."""
        for name in (*_NUMBERS, *_OPTIONAL_NUMBERS):
            value = getattr(self, name)
            is_word = isinstance(value, str) and (name, value) == ("weld_tolerance", "auto")
            if not (is_word or (value is None and name in _OPTIONAL_NUMBERS)):
                object.__setattr__(self, name, real_number(name, value))
        for name, low in _LEAST.items():
            if name == "max_iterations" and self.max_iterations is None:
                continue
            object.__setattr__(self, name, whole_number(name, getattr(self, name), low))

    def _check_sizes(self) -> None:
        """Check edge length, size field and its limits, and that they fit each other and the metric."""
        for name in _SIZES:
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise OptionError(f"{name} = {value}; expected a positive finite number")
            if value is not None and name != "gradation" and not 1.0 / LARGEST_SIZE < value < LARGEST_SIZE:
                limits = f"{1.0 / LARGEST_SIZE:g} to {LARGEST_SIZE:g}"
                raise OptionError(f"{name} = {value:g}; expected a length that fits the mesh, from {limits}")
        for name, remedy in (("size_field", ", or a function of points; edge_length is one length"), ("density", "")):
            value = getattr(self, name)
            if isinstance(value, Number | str):
                raise OptionError(f"{name} = {value!r}; expected an array (V,), a value for each point{remedy}")
        if (self.edge_length is not None or self.size_field is not None) and self.density is not None:
            raise OptionError(
                "a density and an edge_length or size_field both say how large triangles are; leave one out"
            )
        metric = self.metric if isinstance(self.metric, str) else type(self.metric).__name__
        if self.size_field is None:
            for name in _SIZES[1:]:
                if getattr(self, name) is not None:
                    raise OptionError(f"{name} limits a size_field, and there is none; give one or leave it out")
            if self.edge_length is not None and metric in ("approximation", "Approximation"):
                raise OptionError("lengths in the metric 'approximation' have no unit; use max_error, or n_vertices")
            if self.edge_length is not None and metric == "SolutionMetric":
                raise OptionError("lengths in the metric of a solution have no unit; give n_vertices or ratio")
            return
        if metric != "uniform":
            raise OptionError(f"a size_field goes with metric='uniform', and the metric is {metric!r}")
        if self.edge_length is not None:
            raise OptionError(
                "edge_length is one length for all edges, and size_field says it everywhere; leave one out"
            )
        if self.min_size is not None and self.max_size is not None and self.min_size > self.max_size:
            raise OptionError(f"min_size = {self.min_size} is above max_size = {self.max_size}")

    @property
    def has_tensors(self) -> bool:
        """Whether the metric is tensors at the points of the input."""
        return not isinstance(self.metric, str) and not callable(self.metric)

    @property
    def absolute_length(self) -> float | None:
        """Length in the metric that edges are to have if no number of vertices is given, None if there is none."""
        if self.edge_length is None and (self.size_field is not None or self.has_tensors):
            return 1.0
        return self.edge_length

    def _check_stages(self) -> None:
        """Check metric, embedding and energy, and that they fit each other."""
        if isinstance(self.metric, str) and self.metric not in METRIC_NAMES:
            raise OptionError(
                f"metric = {self.metric!r}; expected one of {', '.join(METRIC_NAMES)}, tensors or a source"
            )
        if isinstance(self.embedding, str):
            if self.embedding not in EMBEDDINGS:
                raise OptionError(f"embedding = {self.embedding!r}; expected one of {', '.join(EMBEDDINGS)}")
        elif not callable(self.embedding):
            raise OptionError(f"embedding = {self.embedding!r}; expected a name or an embedder")
        for name in ("metric", "embedding", "energy"):
            if isinstance(given := getattr(self, name), type):
                raise OptionError(f"{name} = {given.__name__} is a class; expected an object, {given.__name__}(...)")
        if not isinstance(self.device, str) or self.device not in DEVICES:
            raise OptionError(f"device = {self.device!r}; expected one of {', '.join(DEVICES)}")
        if self.energy is not None:
            if not callable(getattr(self.energy, "evaluate", None)):
                raise OptionError(f"energy = {self.energy!r}; expected an object with evaluate(voronoi, sites)")
            if self.sharpness != type(self).sharpness:
                raise OptionError("sharpness belongs to the built-in energy; give it to NormalMetric or leave it out")
            if self.final_sharpness is not None:
                raise OptionError("final_sharpness ends with the built-in energy in place of yours; leave one out")
        if self.embedding in ("direct", "filtered") and self.weights is not None:
            raise OptionError(
                f"weights belong to a network, and embedding {self.embedding!r} has none; use 'neural' or 'hybrid'"
            )
        curvature = isinstance(self.metric, str) and self.metric == "curvature"
        if (self.embedding in ("neural", "hybrid") or self.weights is not None) and not curvature:
            name = "embedding" if self.weights is None else "weights"
            network = f"{name} = {str(getattr(self, name))!r}"
            raise OptionError(f"{network} predicts the curvature metric and no other; leave it out, or the metric")
        if self.embedding == "filtered" and not curvature:
            raise OptionError("embedding 'filtered' measures the curvature metric and no other")


def with_overrides(options: Any, overrides: dict[str, Any]) -> RemeshOptions:
    """Return options with some fields replaced, or an error for another type or an unknown name."""
    if not isinstance(options, RemeshOptions):
        raise OptionError(f"options is of type {type(options).__name__}; expected RemeshOptions")
    known = [field.name for field in fields(RemeshOptions)]
    for name in overrides:
        if name not in known:
            names = ["n_vertices", "ratio", "max_error", *known]
            remedy = hint(name, names) or f"; expected one of {', '.join(names)}"
            raise OptionError(f"remesh has no option {name!r}{remedy}")
    return replace(options, **overrides)

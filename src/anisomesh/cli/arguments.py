"""Arguments that several commands share: the input, the options of a remesh, silence."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from anisomesh.metric.names import MetricName
from anisomesh.options import MAX_THREADS, DeviceName, EmbeddingName, RemeshOptions

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface

DEFAULT_OPTIONS = RemeshOptions()
_option = partial(typer.Option, rich_help_panel="Remeshing")
_Command = TypeVar("_Command", bound=Callable[..., None])


def positive(value: float | None) -> float | None:
    """Return the value of an option unless it is not a positive finite number.

    Raises
    ------
    typer.BadParameter
        If the value is given and is not a positive finite number.
    """
    if value is not None and not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"{value} is not a positive finite number")
    return value


REMESH_OPTIONS: dict[str, Any] = {
    "metric": Annotated[
        MetricName,
        _option(
            help="curvature: stretched along small curvature, as in the paper; approximation: least distance from the "
            "input; uniform: equilateral triangles."
        ),
    ],
    "sharpness": Annotated[
        float,
        _option(
            callback=positive,
            help="Weight of the normals, from 1: 1 ignores creases, 7 as in the paper, more keeps them more exactly.",
        ),
    ],
    "final_sharpness": Annotated[
        float | None,
        _option(
            callback=positive,
            help="Finish the optimisation with this sharpness; 30 moves vertices onto corners and creases.",
        ),
    ],
    "feature_angle": Annotated[
        float,
        _option(
            min=0.0,
            max=180.0,
            help="Edges of the input that bend by more than this many degrees are creases; 180 for no creases.",
        ),
    ],
    "embedding": Annotated[
        EmbeddingName,
        _option(
            help="Source of the metric. direct: measured curvature; filtered: the same after filters have removed "
            "noise; neural: a network; hybrid: the mean of measured and predicted curvature; auto: hybrid if the "
            "metric is curvature and the input is not a designed part, else direct."
        ),
    ],
    "weights": Annotated[
        str | None,
        _option(
            metavar="FILE",
            help="Network to use: a file written by anisomesh train, or the name of a pretrained network.",
        ),
    ],
    "device": Annotated[DeviceName, _option(help="Where the network runs.")],
    "denoise": Annotated[
        bool,
        _option("--denoise/--keep-noise", help="Remove the noise that the network or the filters find, or keep it."),
    ],
    "fit": Annotated[
        bool,
        _option("--fit/--no-fit", help="Fit the mesh to the input at the end, or leave the dual of the tessellation."),
    ],
    "shape_weight": Annotated[
        float,
        _option(
            callback=positive,
            help="How much the shape of triangles counts in the fit: above 1 for better shaped triangles, below 1 for "
            "a smaller distance.",
        ),
    ],
    "seed": Annotated[
        int,
        _option(min=0, help="Seed of the initial sites; the same seed and input give the same result."),
    ],
    "threads": Annotated[int, _option(min=1, max=MAX_THREADS, help="Worker threads; they do not change the result.")],
    "time_limit": Annotated[
        float | None,
        _option(
            callback=positive,
            metavar="SECONDS",
            help="Stop the optimisation after this time and finish with the result so far.",
        ),
    ],
}
"""Types, checks and help texts of the fields of :class:`RemeshOptions` that commands offer."""

COMMON_REMESH_OPTIONS = ("metric", "sharpness", "final_sharpness", "seed", "threads")


def takes_remesh_options(*names: str) -> Callable[[_Command], _Command]:
    """Return a decorator that adds remesh options to a command, which gets them as keyword arguments ``**options``.

    Parameters
    ----------
    *names
        Keys of :data:`REMESH_OPTIONS`. Defaults are those of :class:`RemeshOptions`.

    Notes
    -----
    typer reads the parameters of a command from its signature, so the decorator extends the signature.
    """

    def decorate(command: _Command) -> _Command:
        own = [p for p in signature(command, eval_str=True).parameters.values() if p.kind is not Parameter.VAR_KEYWORD]
        added = [
            Parameter(
                name, Parameter.KEYWORD_ONLY, default=getattr(DEFAULT_OPTIONS, name), annotation=REMESH_OPTIONS[name]
            )
            for name in names
        ]
        command.__signature__ = Signature([*own, *added])  # type: ignore[attr-defined]
        return command

    return decorate


@dataclass(frozen=True)
class Length:
    """A length in model units, or in per cent of the bounding-box diagonal of the mesh."""

    value: float
    relative: bool

    @classmethod
    def parse(cls, text: str, option: str) -> Length:
        """Return the length in a text such as ``0.2`` or ``0.1%``.

        Raises
        ------
        typer.BadParameter
            If the text is not a positive finite number, with or without a per cent sign.
        """
        try:
            value = float(text.removesuffix("%"))
        except ValueError:
            raise typer.BadParameter(
                f"{option} {text}: expected a length such as 0.2, or 0.1% of the diagonal"
            ) from None
        positive(value)
        return cls(value, text.endswith("%"))

    def on(self, surface: Surface) -> float:
        """Return the length for a mesh, in model units."""
        return self.value / 100.0 * surface.diagonal if self.relative else self.value


Source = Annotated[Path, typer.Argument(metavar="IN", help="Mesh to remesh: OBJ, OFF, PLY, STL, GLB, 3MF, VTU, ...")]
Vertices = Annotated[int | None, typer.Option("--vertices", "-n", min=4, help="Number of vertices of the result.")]
Ratio = Annotated[
    float | None,
    typer.Option("--ratio", callback=positive, help="Vertices of the result per vertex of the repaired input."),
]
InputFormat = Annotated[
    str | None, typer.Option(metavar="FORMAT", help="Format of IN, if its suffix does not name it: ply, obj, ...")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary.")]

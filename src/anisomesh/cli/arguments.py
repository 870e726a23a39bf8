"""Arguments that several commands share: the input, the options of a remesh, silence."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from anisomesh._values import Length
from anisomesh.errors import OptionError
from anisomesh.metric.names import MetricName
from anisomesh.options import MAX_THREADS, DeviceName, EmbeddingName, RemeshOptions

DEFAULT_OPTIONS = RemeshOptions()
_option = partial(typer.Option, rich_help_panel="How to remesh")
target_option = partial(typer.Option, rich_help_panel="Number of vertices")
input_option = partial(typer.Option, rich_help_panel="Input")
_advanced = partial(typer.Option, rich_help_panel="Advanced")
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


def at_least_one(value: float | None) -> float | None:
    """Return the value of an option unless it is not a finite number of at least 1.

    Raises
    ------
    typer.BadParameter
        If the value is given and is not a finite number of at least 1.
    """
    if value is not None and not (math.isfinite(value) and value >= 1.0):
        raise typer.BadParameter(f"{value:g} is not a finite number of at least 1")
    return value


def share(text: str | float) -> float:
    """Return the share in a text such as ``0.2`` or ``20%``.

    Raises
    ------
    typer.BadParameter
        If the text is not a positive finite number, with or without a per cent sign.
    """
    word = str(text)
    try:
        value = float(word.removesuffix("%"))
    except ValueError:
        raise typer.BadParameter(f"{word!r} is not a share such as 0.2, or 20%") from None
    positive(value)
    return value / 100.0 if word.endswith("%") else value


REMESH_OPTIONS: dict[str, Any] = {
    "metric": Annotated[
        MetricName,
        _option(
            metavar="NAME",
            help="curvature: long where the surface is straight, as in the paper; approximation: least distance from "
            "the input; uniform: equilateral.",
        ),
    ],
    "sharpness": Annotated[
        float,
        _option(
            callback=at_least_one,
            metavar="X",
            help="How strongly vertices are drawn onto creases: 1 not at all, 7 as in the paper.",
        ),
    ],
    "final_sharpness": Annotated[
        float | None,
        _option(
            callback=at_least_one,
            metavar="X",
            help="End with this sharpness; 30 moves vertices onto corners and creases.",
        ),
    ],
    "feature_angle": Annotated[
        float,
        _option(
            min=0.0,
            max=180.0,
            metavar="DEGREES",
            help="Edges of the input that bend by more than this are creases; 180 for none.",
        ),
    ],
    "denoise": Annotated[
        bool,
        _option("--denoise/--keep-noise", help="Remove noise that is found in a scan, or keep it."),
    ],
    "reduce": Annotated[
        bool,
        _option("--reduce/--no-reduce", help="Reduce an input with far more points than the result first, or do not."),
    ],
    "regions": Annotated[
        bool,
        _option(
            "--regions/--no-regions",
            help="Follow the borders between regions of the input, or only what is sharp or prescribed.",
        ),
    ],
    "attributes": Annotated[
        bool,
        _option("--attributes/--no-attributes", help="Carry over all that the input file has, or its shape only."),
    ],
    "fit": Annotated[
        bool,
        _option("--fit/--no-fit", help="Fit the mesh to the input at the end, or leave the dual of the tessellation."),
    ],
    "shape_weight": Annotated[
        float,
        _option(
            callback=positive,
            metavar="X",
            help="Weight of the shape of triangles in the fit: above 1 for better shapes, below 1 for a smaller "
            "distance.",
        ),
    ],
    "threads": Annotated[
        int, _option(min=1, max=MAX_THREADS, metavar="N", help="Worker threads; they do not change the result.")
    ],
    "time_limit": Annotated[
        float | None,
        _option(
            callback=positive,
            metavar="SECONDS",
            help="Stop the optimisation after this time and finish with the result so far.",
        ),
    ],
    "embedding": Annotated[
        EmbeddingName,
        _advanced(
            metavar="NAME",
            help="Where the metric comes from. direct: measured curvature; filtered: the same after filters have "
            "removed noise; neural: a network; hybrid: the mean of direct and neural; auto: hybrid for scans, direct "
            "for designed parts and for other metrics.",
        ),
    ],
    "weights": Annotated[
        str | None,
        _advanced(
            metavar="FILE",
            help="Network to use: a file written by anisomesh train, or the name of a pretrained network.",
        ),
    ],
    "device": Annotated[
        DeviceName, _advanced(metavar="NAME", help="Where the network runs: cpu, or cuda (extra: train).")
    ],
    "seed": Annotated[
        int,
        _advanced(min=0, metavar="N", help="Seed of the start; the same seed and input give the same result."),
    ],
    "lloyd_iterations": Annotated[int, _advanced(min=0, metavar="N", help="Steps of Lloyd's algorithm at the start.")],
    "max_iterations": Annotated[
        int | None,
        _advanced(
            min=0, metavar="N", show_default="50, or 150 with --no-fit", help="Largest number of steps of L-BFGS."
        ),
    ],
    "embedding_iterations": Annotated[
        int, _advanced(min=1, metavar="N", help="Largest number of steps of the direct embedding.")
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


def length(text: str, option: str) -> Length:
    """Return the length in the text of an option, such as ``0.2`` or ``0.1%``.

    Raises
    ------
    typer.BadParameter
        If the text is not a positive finite number, with or without a per cent sign; ``--weld`` may be 0.
    """
    try:
        return Length.tolerance(text, option) if option == "--weld" else Length.parse(text, option)
    except OptionError as error:
        raise typer.BadParameter(str(error)) from None


Source = Annotated[Path, typer.Argument(metavar="IN", help="Mesh to remesh: OBJ, OFF, PLY, STL, GLB, 3MF, VTU, ...")]
Vertices = Annotated[
    int | None,
    target_option("--vertices", "-n", min=4, metavar="N", help="Number of vertices of the result, at least 4."),
]
Ratio = Annotated[
    float | None,
    target_option(
        "--ratio", parser=share, metavar="SHARE", help="Vertices as a share of the input's, such as 0.2 or 20%."
    ),
]
InputFormat = Annotated[
    str | None, typer.Option(metavar="FORMAT", help="Format of IN, if its suffix does not name it: ply, obj, ...")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no summary, only warnings.")]
Workers = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="N",
        help="Processes, one thread each (extra: batch); 0 for none but this one.",
        show_default="one per core",
    ),
]

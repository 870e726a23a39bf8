"""Options that ``remesh`` and ``batch`` share: levels of detail, and metrics from fields at points."""

from __future__ import annotations

from typing import Annotated

from anisomesh.cli.arguments import input_option, positive, target_option

Ratios = Annotated[
    str | None,
    target_option(
        "--ratios",
        metavar="R [R ...]",
        help="Levels of detail, such as 1 0.5 0.2 0.05: each made from the next finer.",
    ),
]
MetricFileName = Annotated[
    str | None,
    input_option(
        metavar="FILE[:NAME]",
        help="Lengths of edges, or metric tensors, at the points of IN, in model units: .sol, .solb, .npy, or "
        "point data of .vtu, .vtp, .ply, .msh. Enough without a number of vertices, which then follows.",
    ),
]
MinSize = Annotated[
    str | None,
    input_option(metavar="LENGTH", help="With sizes of --metric-file: raise smaller ones to this, such as 0.2 or 1%."),
]
MaxSize = Annotated[
    str | None, input_option(metavar="LENGTH", help="With sizes of --metric-file: lower larger ones to this.")
]
Gradation = Annotated[
    float | None,
    input_option(
        callback=positive,
        metavar="X",
        help="With sizes of --metric-file: the most that they differ by over a distance of 1; larger are lowered.",
    ),
]
AdaptedTo = Annotated[
    str | None,
    input_option(
        metavar="[FILE:]FIELD",
        help="Adapt the mesh to this field at the vertices of IN, or of another mesh of the surface: small and "
        "stretched triangles where the field bends. With -n or --ratio.",
    ),
]
NormOfAdaption = Annotated[
    str | None,
    input_option(
        metavar="P",
        help="With --adapt-to: the L^p norm in which the error is to be small, a number of at least 1, or inf.",
        show_default="2",
    ),
]

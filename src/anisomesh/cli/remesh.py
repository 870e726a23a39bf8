"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from anisomesh.cli.adapt_to import DEFAULT_NORM, AdaptTo
from anisomesh.cli.arguments import (
    DEFAULT_OPTIONS,
    REMESH_OPTIONS,
    Length,
    Quiet,
    Ratio,
    Source,
    Vertices,
    takes_remesh_options,
    target_option,
)
from anisomesh.cli.job import STANDARD_STREAM, Outputs, check_input_format, default_output, read_mesh, run_remesh
from anisomesh.cli.progress import progress
from anisomesh.cli.report import as_json, hints, summary

_output = partial(typer.Option, rich_help_panel="Output")
_input = partial(typer.Option, rich_help_panel="Input")


@takes_remesh_options(*REMESH_OPTIONS)
def command(
    source: Source,
    n_vertices: Vertices = None,
    ratio: Ratio = None,
    max_error: Annotated[
        str | None,
        target_option(
            metavar="LENGTH",
            help="As few vertices as keep within this distance of the input, such as 0.2 or 0.1% of the diagonal.",
        ),
    ] = None,
    edge_length: Annotated[
        str | None,
        target_option(
            metavar="LENGTH",
            help="As many vertices as edges of this length take, such as 0.2 or 2% of the diagonal; with metric "
            "curvature along the smaller curvature.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        _output(
            "--out",
            "-o",
            metavar="OUT",
            help="Mesh to write; the suffix is the format. By default part_remeshed.ply for part.ply; may be IN.",
        ),
    ] = None,
    input_format: Annotated[
        str | None, _input(metavar="FORMAT", help="Format of IN, if its suffix does not name it: ply, obj, ...")
    ] = None,
    output_format: Annotated[
        str | None, _output(metavar="FORMAT", help="Format of OUT, if its suffix does not name it.")
    ] = None,
    features: Annotated[
        Path | None,
        _input(metavar="FILE", help="Edges to keep: a text file, two vertex numbers of IN per line, from 0."),
    ] = None,
    density: Annotated[
        Path | None,
        _input(
            metavar="FILE",
            help="Weights of the vertices of IN, larger for smaller triangles: a text file, one number per line.",
        ),
    ] = None,
    adapt_to: Annotated[
        str | None,
        _input(
            metavar="[FILE:]FIELD",
            help="Adapt the mesh to this field at the vertices of IN, or of another mesh of the surface: small and "
            "stretched triangles where the field bends. With -n or --ratio.",
        ),
    ] = None,
    norm: Annotated[
        str | None,
        _input(
            metavar="P",
            help="With --adapt-to: the L^p norm in which the error is to be small, a number of at least 1, or inf.",
            show_default="2",
        ),
    ] = None,
    weld: Annotated[
        str | None,
        _input(
            metavar="LENGTH",
            help="Join points of the input up to this distance, in model units or % of the diagonal; auto: 0.001%.",
        ),
    ] = None,
    report: Annotated[Path | None, _output(metavar="JSON", help="Write the report to this file.")] = None,
    rvd: Annotated[
        Path | None, _output(metavar="FILE", help="Write the Voronoi cells on the surface: .vtu or .obj.")
    ] = None,
    picture: Annotated[
        Path | None,
        _output(metavar="FILE", help="Draw input and result side by side: .png or .pdf (extra: picture)."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")] = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Remesh IN with anisotropic triangles. Give -n, --ratio, --max-error or --edge-length; - is standard input."""
    if (n_vertices, ratio, max_error, edge_length).count(None) != 3:
        raise typer.BadParameter("give one of -n (number of vertices), --ratio, --max-error and --edge-length")
    length = None if edge_length is None else Length.parse(edge_length, "--edge-length")
    error = None if max_error is None else Length.parse(max_error, "--max-error")
    solution = None if adapt_to is None else AdaptTo.parse(adapt_to, norm or DEFAULT_NORM)
    if solution is None and norm is not None:
        raise typer.BadParameter("--norm goes with --adapt-to; give both or leave it out")
    if solution is not None and (error is not None or length is not None):
        raise typer.BadParameter("--adapt-to says where triangles are small, not how small; give -n or --ratio with it")
    if solution is not None and options["metric"] != DEFAULT_OPTIONS.metric:
        raise typer.BadParameter("--adapt-to and --metric both say what the metric is; leave one out")
    gap = None if weld in (None, "auto") else Length.parse(weld, "--weld")
    out = default_output(source, input_format, output_format) if out is None else out
    outputs = Outputs(mesh=out, mesh_format=output_format, report=report, rvd=rvd, picture=picture)
    to_stdout = out == STANDARD_STREAM
    if to_stdout and json_:
        raise typer.BadParameter("-o - and --json both write to standard output; use --report FILE")
    weights = options.get("weights")
    check_input_format(source, input_format)
    others = features, density, None if weights is None else Path(weights), None if solution is None else solution.file
    outputs.check(None if source == STANDARD_STREAM else source, *others)
    if features is not None or density is not None:
        from anisomesh.io.text_tables import load_numbers, load_pairs

        options["features"] = None if features is None else load_pairs(features)
        options["density"] = None if density is None else load_numbers(density)
    with progress(quiet) as display:
        mesh, seconds = read_mesh(source, input_format)
        options |= {"n_vertices": n_vertices, "ratio": ratio}
        if solution is not None:
            options["metric"] = solution.metric(mesh, options["feature_angle"])
        options["max_error"] = None if error is None else error.on(mesh.surface)
        options["edge_length"] = None if length is None else length.on(mesh.surface)
        if weld is not None:
            options["weld_tolerance"] = "auto" if gap is None else gap.on(mesh.surface)
        result, facts = run_remesh(mesh, display, name=str(source), load_seconds=seconds, **options)
        facts["hints"] = hints(result.prepared)
        facts["options"] |= {
            "features": None if features is None else str(features),
            "density": None if density is None else str(density),
        }
        if solution is not None:
            facts["options"] |= {"metric": None, "adapt_to": adapt_to, "norm": norm or DEFAULT_NORM}
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif not quiet:
        typer.echo(summary(facts, outputs.paths, result.prepare_report.lines()), err=to_stdout)

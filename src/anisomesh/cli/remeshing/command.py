"""``anisomesh remesh``: one mesh file in, one anisotropic mesh file out."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.arguments import (
    REMESH_OPTIONS,
    Quiet,
    Source,
    input_option,
    length,
    share,
    takes_remesh_options,
    target_option,
)
from anisomesh.cli.inputs import check_present
from anisomesh.cli.job import (
    STANDARD_STREAM,
    Outputs,
    check_input_format,
    default_output,
    read_mesh,
    run_remesh,
)
from anisomesh.cli.log import log_warnings
from anisomesh.cli.progress import progress
from anisomesh.cli.remeshing.levels import LevelOutputs, levels_summary, run_levels, targets_of
from anisomesh.cli.remeshing.prescribed_metric import (
    check_limits,
    check_targets,
    file_named,
    file_of,
    prescribed_metric,
)
from anisomesh.cli.remeshing.shared_options import (
    AdaptedTo,
    Gradation,
    MaxSize,
    MetricFileName,
    MinSize,
    NormOfAdaption,
    Ratios,
)
from anisomesh.cli.report import as_json, hints, summary, warnings_in

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface

_output = partial(typer.Option, rich_help_panel="Output")


@takes_remesh_options(*REMESH_OPTIONS)
def command(
    context: typer.Context,
    source: Source,
    n_vertices: Annotated[
        list[int] | None,
        target_option(
            "--vertices", "-n", min=4, metavar="N", help="Number of vertices, at least 4; several for levels of detail."
        ),
    ] = None,
    ratio: Annotated[
        list[float] | None,
        target_option(
            "--ratio", parser=share, metavar="SHARE", help="Vertices as a share of the input's, such as 0.2 or 20%."
        ),
    ] = None,
    ratios: Ratios = None,
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
            help="Mesh to write; the suffix is the format. By default part_remeshed.ply for part.ply; may be IN. "
            "Levels of detail are out.lod0.ply, out.lod1.ply, ... for out.ply, and one file for out.glb.",
        ),
    ] = None,
    input_format: Annotated[
        str | None, input_option(metavar="FORMAT", help="Format of IN, if its suffix does not name it: ply, obj, ...")
    ] = None,
    output_format: Annotated[
        str | None, _output(metavar="FORMAT", help="Format of OUT, if its suffix does not name it.")
    ] = None,
    features: Annotated[
        Path | None,
        input_option(metavar="FILE", help="Edges to keep: a text file, two vertex numbers of IN per line, from 0."),
    ] = None,
    keep_points: Annotated[
        Path | None,
        input_option(
            metavar="FILE", help="Vertices to keep where they are: a text file, a vertex number of IN per line, from 0."
        ),
    ] = None,
    lock: Annotated[
        list[str] | None,
        input_option(
            metavar="REGION",
            help="Leave the triangles of this region of IN as they are, by its name or label; may be repeated.",
        ),
    ] = None,
    density: Annotated[
        Path | None,
        input_option(
            metavar="FILE",
            help="Weights of the vertices of IN, larger for smaller triangles: a text file, one number per line.",
        ),
    ] = None,
    metric_file: MetricFileName = None,
    min_size: MinSize = None,
    max_size: MaxSize = None,
    gradation: Gradation = None,
    adapt_to: AdaptedTo = None,
    norm: NormOfAdaption = None,
    weld: Annotated[
        str | None,
        input_option(
            metavar="LENGTH",
            help="Join points of the input up to this distance, in model units or % of the diagonal; auto: 0.001%.",
        ),
    ] = None,
    report: Annotated[Path | None, _output(metavar="JSON", help="Write the report to this file.")] = None,
    rvd: Annotated[
        Path | None, _output(metavar="FILE", help="Write the Voronoi cells on the surface: .vtu or .obj.")
    ] = None,
    save_metric: Annotated[
        Path | None,
        _output(
            metavar="FILE",
            help="Write the metric at the points of OUT, in which its edges have the length 1: .sol or .solb "
            "(Mmg), .msh (Gmsh), .vtu, .vtp, .ply or .npy.",
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        _output(metavar="FILE", help="Draw input and result side by side: .png or .pdf (extra: picture)."),
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the report as JSON and nothing else.")] = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Remesh IN with anisotropic triangles. Give -n, --ratio, --ratios, --max-error, --edge-length or --metric-file.

    IN may be -, which is standard input.
    """
    targets = {"-n": n_vertices, "--ratio": ratio, "--ratios": ratios, "--max-error": max_error}
    check_targets({**targets, "--edge-length": edge_length}, metric_file, adapt_to)
    target, n_levels = targets_of(n_vertices, ratio, ratios)
    check_present(source, file_named(metric_file, adapt_to), features, density, keep_points)
    prescribed = prescribed_metric(context, metric_file, adapt_to, norm, edge_length=edge_length, max_error=max_error)
    limits = {"--min-size": min_size, "--max-size": max_size, "--gradation": gradation}
    check_limits(prescribed, [option for option, value in limits.items() if value is not None])
    texts = {
        "edge_length": edge_length,
        "max_error": max_error,
        "min_size": min_size,
        "max_size": max_size,
        "weld": None if weld == "auto" else weld,
    }
    lengths = {name: length(text, f"--{name.replace('_', '-')}") for name, text in texts.items() if text is not None}
    files_of = partial(LevelOutputs, levels=n_levels) if n_levels else Outputs
    outputs = files_of(
        mesh=default_output(source, input_format, output_format) if out is None else out,
        mesh_format=output_format,
        report=report,
        rvd=rvd,
        metric=save_metric,
        picture=picture,
    )
    if out is None:
        outputs.check_new()
    to_stdout = out == STANDARD_STREAM
    if to_stdout and json_:
        raise typer.BadParameter("-o - and --json both write to standard output; use --report FILE")
    weights = options.get("weights")
    check_input_format(source, input_format)
    others = features, density, keep_points, None if weights is None else Path(weights), file_of(prescribed)
    outputs.check(None if source == STANDARD_STREAM else source, *others)
    files = {"features": features, "keep_points": keep_points, "density": density}
    if any(path is not None for path in files.values()):
        from anisomesh.io.text_tables import load_numbers, load_pairs, load_points

        readers = {"features": load_pairs, "keep_points": load_points, "density": load_numbers}
        options |= {name: readers[name](path) for name, path in files.items() if path is not None}
    options["lock"] = lock or None
    with progress(quiet) as display:
        mesh, seconds = read_mesh(source, input_format)
        _check_tables(mesh.surface, options, features, density)
        options |= {**target, "gradation": gradation}
        options |= {name: given.on(mesh.surface.diagonal) for name, given in lengths.items()}
        if weld is not None:
            options["weld_tolerance"] = options.pop("weld", weld)
        if prescribed is not None:
            display.note(prescribed.description)
            options |= prescribed.options_for(mesh, str(source))
        with nullcontext() if prescribed is None else prescribed.named_in_errors():
            run: Any = run_levels if n_levels else run_remesh
            result, facts = run(mesh, display, name=str(source), load_seconds=seconds, **options)
        first = result[0] if n_levels else result
        facts["hints"] = hints(first.prepared)
        facts["options"] |= {name: None if path is None else str(path) for name, path in files.items()}
        if prescribed is not None:
            facts["options"] |= prescribed.facts
        outputs.write(result, facts, display)
    if json_:
        typer.echo(as_json(facts))
    elif quiet:
        log_warnings(warnings_in(facts))
    else:
        text = levels_summary if n_levels else summary
        typer.echo(text(facts, outputs.paths, first.prepare_report.lines()), err=to_stdout)


def _check_tables(surface: Surface, options: dict[str, Any], features: Path | None, density: Path | None) -> None:
    """Raise MeshFileError if files of edges or weights do not fit the points of a mesh."""
    from anisomesh.errors import MeshFileError

    n_points = surface.n_points
    if density is not None and len(options["density"]) != n_points:
        found = len(options["density"])
        raise MeshFileError(
            f"{density}: found {found:,} numbers; expected {n_points:,}, one for each vertex of the mesh"
        )
    if features is not None and options["features"].size and options["features"].max() >= n_points:
        largest = options["features"].max()
        raise MeshFileError(
            f"{features}: found vertex {largest}; expected 0 to {n_points - 1}, the vertices of the mesh"
        )

"""``anisomesh info``: describe a mesh file and the repair before a remesh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from anisomesh.cli.arguments import InputFormat
from anisomesh.cli.info.contents import contents, contents_rows
from anisomesh.cli.job import check_input_format, read_mesh
from anisomesh.cli.report import as_json, counted, describe_validity, hints, table

if TYPE_CHECKING:
    from anisomesh.mesh.surface import Surface


def command(
    source: Annotated[Path, typer.Argument(metavar="IN", help="Mesh file: OBJ, OFF, PLY, STL, GLB, 3MF, VTU, ...")],
    input_format: InputFormat = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the facts as JSON and nothing else.")] = False,
) -> None:
    """Describe a mesh: size, topology, what it carries, defects, the repairs before a remesh; - is standard input."""
    check_input_format(source, input_format)
    mesh = read_mesh(source, input_format)[0]
    facts = describe(mesh.surface) | contents(mesh) | {"file": str(source)}
    typer.echo(as_json(facts) if json_ else _text(facts))


def describe(surface: Surface) -> dict[str, Any]:
    """Return the facts about a surface for JSON: lengths in model units, the area in their square.

    Notes
    -----
    The genus is the sum over the components, with every boundary loop closed by a disk. It is None unless the surface
    is an oriented manifold.
    """
    from anisomesh.junctions.cut import cut_at_junctions
    from anisomesh.repair.prepare import prepare

    validity = _validity(surface)
    prepared = prepare(surface)
    junctions = cut_at_junctions(prepared)
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    lengths = surface.edge_lengths
    return {
        "points": surface.n_points,
        "faces": surface.n_faces,
        "edges": len(surface.edges),
        "bounding_box": {"min": low.tolist(), "max": high.tolist(), "diagonal": surface.diagonal},
        "area": surface.area,
        "edge_length": {"min": float(lengths.min()), "mean": float(lengths.mean()), "max": float(lengths.max())},
        "validity": validity,
        "genus": _genus(validity),
        "prepare": {
            "changes": prepared.report.lines(),
            "points": prepared.surface.n_points,
            "faces": prepared.surface.n_faces,
        },
        "junction_curves": 0 if junctions is None else len(junctions.graph.curves),
        "hints": hints(prepared.surface),
    }


def _validity(surface: Surface) -> dict[str, Any]:
    from anisomesh.mesh import topology

    faces = surface.faces
    nonmanifold_edges = topology.count_nonmanifold_edges(faces)
    loops = len(topology.boundary_loops(faces))
    return {
        "closed": loops == 0,
        "boundary_loops": loops,
        "components": topology.connected_components(faces, surface.n_points)[0],
        "euler": topology.euler_characteristic(faces),
        "nonmanifold_edges": nonmanifold_edges,
        "nonmanifold_vertices": topology.count_nonmanifold_points(faces),
        "oriented": topology.is_oriented(faces),
    }


def _genus(validity: dict[str, Any]) -> int | None:
    if validity["nonmanifold_edges"] or validity["nonmanifold_vertices"] or not validity["oriented"]:
        return None
    twice = 2 * validity["components"] - validity["boundary_loops"] - validity["euler"]
    return int(twice // 2)


def _text(facts: dict[str, Any]) -> str:
    box, lengths, prepare = facts["bounding_box"], facts["edge_length"], facts["prepare"]
    corners = " to ".join(f"({', '.join(f'{x:.6g}' for x in box[end])})" for end in ("min", "max"))
    changes = prepare["changes"] or ["nothing to repair"]
    rows = [
        ("points", f"{facts['points']:,}"),
        ("faces", f"{facts['faces']:,}"),
        ("bounding box", f"{corners}, diagonal {box['diagonal']:.6g}"),
        ("area", f"{facts['area']:.6g}"),
        ("edge length", f"{lengths['min']:.4g} to {lengths['max']:.4g}, mean {lengths['mean']:.4g}"),
        ("surface", describe_validity(facts["validity"])),
        ("genus", "not defined" if facts["genus"] is None else str(facts["genus"])),
        *contents_rows(facts),
        *(("to prepare", change) for change in changes),
    ]
    if prepare["changes"]:
        size = f"{counted(prepare['points'], 'point')}, {counted(prepare['faces'], 'face')}"
        rows.append(("prepared", size))
    if facts["junction_curves"]:
        curves = counted(facts["junction_curves"], "curve")
        rows.append(("junctions", f"{curves} with more than two faces at each edge; joined in the result"))
    rows += [("hint", hint) for hint in facts["hints"]]
    return f"{facts['file']}\n{table(rows)}"

"""What a mesh carries besides its surface, as facts for JSON and in a few lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from anisomesh.cli.report import counted

if TYPE_CHECKING:
    from collections.abc import Mapping

    from anisomesh.attributes.model import Array, Mesh, Regions

_MAX_NAMED = 6  # regions of a division in a line of text
_DATA_TITLES = {"point_data": "point data", "face_data": "face data", "corner_data": "corner data"}


def contents(mesh: Mesh) -> dict[str, Any]:
    """Return what a mesh carries, for JSON: lengths in model units, areas in their square."""
    from anisomesh.attributes.model import UNIT

    ends = mesh.surface.points[mesh.features]
    unit = mesh.materials.get(UNIT)
    return {
        "unit": unit if isinstance(unit, str) else None,
        "regions": {name: _regions(regions, mesh.surface.face_areas) for name, regions in mesh.regions.items()},
        **{kind: _arrays(getattr(mesh, kind), 2 if kind == "corner_data" else 1) for kind in _DATA_TITLES},
        "prescribed_edges": {
            "count": len(mesh.features),
            "length": float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()),
        },
        "edge_regions": _marked(mesh.feature_regions, "edges"),
        "fixed_points": len(mesh.fixed_points),
        "fixed_faces": len(mesh.fixed_faces),
        "point_regions": _marked(mesh.fixed_point_regions, "points"),
        "materials": sorted(mesh.materials.keys() - {UNIT}),
    }


def _regions(regions: Regions, areas: Array) -> list[dict[str, Any]]:
    labels, own = np.unique(regions.labels, return_inverse=True)
    own = own.reshape(-1)
    faces, area = np.bincount(own), np.bincount(own, areas)
    return [
        {"label": label, "name": regions.names.get(label), "faces": int(faces[k]), "area": float(area[k])}
        for k, label in enumerate(labels.tolist())
    ]


def _marked(divisions: Mapping[str, Regions], what: str) -> dict[str, list[dict[str, Any]]]:
    """Return label, name and number of edges or points of each region of divisions, without the ones in no region."""
    return {
        name: [
            {"label": label, "name": regions.names.get(label), what: int(np.count_nonzero(regions.labels == label))}
            for label in np.unique(regions.labels[regions.labels != 0]).tolist()
        ]
        for name, regions in divisions.items()
    }


def _arrays(data: Mapping[str, Array], n_leading: int) -> dict[str, dict[str, Any]]:
    """Return the type and the components of arrays, with so many dimensions in front of them."""
    return {
        name: {"type": values.dtype.name, "components": int(np.prod(values.shape[n_leading:], dtype=np.int64))}
        for name, values in data.items()
    }


def contents_rows(facts: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the lines of text for :func:`contents`, of what there is."""
    rows = [("unit", facts["unit"])] if facts["unit"] else []
    rows += _region_rows("regions", facts["regions"])
    for kind, title in _DATA_TITLES.items():
        if facts[kind]:
            rows.append((title, ", ".join(_array_text(name, facts[kind][name]) for name in facts[kind])))
    edges = facts["prescribed_edges"]
    if edges["count"]:
        rows.append(("prescribed", f"{counted(edges['count'], 'edge')} of length {edges['length']:.6g}"))
    rows += _region_rows("prescribed", facts["edge_regions"])
    if facts["fixed_points"]:
        rows.append(("fixed", counted(facts["fixed_points"], "point")))
    if facts["fixed_faces"]:
        rows.append(("fixed", counted(facts["fixed_faces"], "face")))
    rows += _region_rows("fixed", facts["point_regions"])
    if facts["materials"]:
        rows.append(("materials", ", ".join(facts["materials"])))
    return rows


def _region_rows(title: str, divisions: dict[str, list[dict[str, Any]]]) -> list[tuple[str, str]]:
    """Return a line for each division into regions, with the first names or labels."""
    rows = []
    for name, regions in divisions.items():
        texts = [
            f"{region['name']} = {region['label']}" if region["name"] else str(region["label"]) for region in regions
        ]
        more = f" and {len(texts) - _MAX_NAMED:,} more" if len(texts) > _MAX_NAMED else ""
        rows.append((title, f"{name}: {len(texts):,} ({', '.join(texts[:_MAX_NAMED])}{more})"))
    return rows


def _array_text(name: str, fact: dict[str, Any]) -> str:
    width = f" x {fact['components']}" if fact["components"] > 1 else ""
    what = ", texture coordinates" if name.rstrip("0123456789") == "uv" else ""
    return f"{name} ({fact['type']}{width}{what})"

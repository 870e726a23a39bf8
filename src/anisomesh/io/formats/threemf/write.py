"""Writing of 3MF archives, in float64."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import COLOUR, Array, Integers
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.formats.threemf.properties import MATERIAL, OBJECT
from anisomesh.io.formats.threemf.read import CORE, MATERIALS, MODEL_TYPE, ROOT
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding import Losses, by_label, main_division

_DATE = (1980, 1, 1, 0, 0, 0)  # of all entries, so that the same mesh gives the same file
_GREY = "#808080FF"
_MATERIAL_GROUP, _COLOUR_GROUP, _FIRST_OBJECT = 1, 2, 3  # numbers of resources
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_NOT_IN_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_UNITS = ("micron", "millimeter", "centimeter", "inch", "foot", "meter")


def threemf_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a 3MF archive, in millimetres unless the input had another unit.

    Notes
    -----
    A division becomes objects, the one called ``material`` base materials; otherwise colours of points or corners are
    kept. Regions keep their names, not their numbers.
    """
    others = {name: regions for name, regions in mesh.regions.items() if name != MATERIAL}
    found = main_division(others, OBJECT)
    resources, properties = _properties(mesh, losses)
    losses.add("regions", *(name for name in others if found is None or name != found[0]))
    losses.add("face data", *mesh.face_data)
    losses.features(mesh)
    objects = _objects(mesh, None if found is None else found[1], properties, losses)
    items = "".join(f'<item objectid="{_FIRST_OBJECT + k}"/>' for k in range(len(objects)))
    unit = mesh.materials.get("unit", "millimeter")
    losses.add("materials", *(name for name in mesh.materials if name not in ("unit", "display_colours")))
    if unit not in _UNITS:
        losses.say(f"the unit {unit!r}, for which the file has millimeter")
        unit = "millimeter"
    model = (
        f'{_HEAD}<model unit="{unit}" xmlns="{CORE}" xmlns:m="{MATERIALS}">\n<resources>{resources}{"".join(objects)}'
        f"</resources><build>{items}</build></model>\n"
    )
    return _archive(model)


def _properties(mesh: Mesh, losses: Losses) -> tuple[str, Array]:
    """Return the groups of materials or colours, and the attributes of each triangle as text (F,)."""
    colours = mesh.corner_data.get(COLOUR)
    if colours is None and COLOUR in mesh.point_data:
        colours = mesh.point_data[COLOUR][mesh.surface.faces]
    materials, n_faces = mesh.regions.get(MATERIAL), mesh.surface.n_faces
    rgba = None if colours is None or materials is not None else _rgba(colours)
    losses.add("point data", *(name for name in mesh.point_data if name != COLOUR or rgba is None))
    losses.add("corner data", *(name for name in mesh.corner_data if name != COLOUR or rgba is None))
    if materials is not None:
        return _materials(mesh, materials, losses)
    if rgba is None:
        return "", np.full(n_faces, "")
    table, numbers = np.unique(rgba.reshape(-1, 4), axis=0, return_inverse=True)
    entries = "".join(f'<m:color color="#{bytes(row.tolist()).hex().upper()}"/>' for row in table)
    members = numbers.reshape(-1, 3).tolist()
    attributes = [f' pid="{_COLOUR_GROUP}" p1="{a}" p2="{b}" p3="{c}"' for a, b, c in members]
    return f'<m:colorgroup id="{_COLOUR_GROUP}">{entries}</m:colorgroup>', np.array(attributes)


def _materials(mesh: Mesh, materials: Regions, losses: Losses) -> tuple[str, Array]:
    """Return the group of base materials and the attributes of triangles; label 0 without a name stands for none."""
    given = mesh.materials.get("display_colours")
    displayed = given if isinstance(given, Mapping) else {}
    texts = region_texts(materials, losses, _in_xml, distinct=True)
    labels = [label for label in texts if label != 0 or label in materials.names or len(texts) == 1]
    entries = []
    for label in labels:
        name = quoteattr(texts[label])
        entries.append(f'<base name={name} displaycolor="{displayed.get(label) or _GREY}"/>')
    attributes = np.full(mesh.surface.n_faces, "", dtype=object)
    for k, label in enumerate(labels):
        attributes[materials.labels == label] = f' pid="{_MATERIAL_GROUP}" p1="{k}"'
    group = f'<basematerials id="{_MATERIAL_GROUP}">{"".join(entries)}</basematerials>' if entries else ""
    return group, attributes


def _rgba(colours: Array) -> Array | None:
    """Return colours as bytes (..., 4), None if they are not three or four bytes or shares of 1 each."""
    if colours.shape[-1:] not in ((3,), (4,)) or colours.dtype.kind not in "uf":
        return None
    largest = np.iinfo(colours.dtype).max if colours.dtype.kind == "u" else 1.0
    shares = colours.astype(np.float64) / largest
    if not ((shares >= 0.0) & (shares <= 1.0)).all():
        return None
    if colours.shape[-1] == 3:
        shares = np.concatenate([shares, np.ones((*shares.shape[:-1], 1))], axis=-1)
    return np.rint(255.0 * shares).astype(np.uint8)


def _objects(mesh: Mesh, division: Regions | None, properties: Array, losses: Losses) -> list[str]:
    """Return the objects, each with its points."""
    points, faces = mesh.surface.points, mesh.surface.faces.astype(np.int64)
    if division is None:
        return [_object(_FIRST_OBJECT, "", points, faces, properties)]
    objects, texts = [], region_texts(division, losses, _in_xml)
    for k, ((label,), chosen) in enumerate(by_label(division.labels)):
        used, corners = np.unique(faces[chosen], return_inverse=True)
        objects.append(
            _object(_FIRST_OBJECT + k, texts[label], points[used], corners.reshape(-1, 3), properties[chosen])
        )
    return objects


def _object(number: int, name: str, points: Array, faces: Integers, properties: Array) -> str:
    vertices = format_rows('<vertex x="%r" y="%r" z="%r"/>\n', points)
    rows = zip(*faces.T.tolist(), properties.tolist(), strict=True)
    triangles = "".join(map('<triangle v1="%d" v2="%d" v3="%d"%s/>\n'.__mod__, rows))
    mesh = f"<mesh><vertices>\n{vertices}</vertices><triangles>\n{triangles}</triangles></mesh>"
    named = f" name={quoteattr(name)}" if name else ""
    return f'<object id="{number}" type="model"{named}>{mesh}</object>'


def _in_xml(text: str) -> str:
    """Return a text without the characters that XML does not allow."""
    return _NOT_IN_XML.sub(" ", text)


def _archive(model: str) -> bytes:
    """Return the archive of a model."""
    types = "http://schemas.openxmlformats.org/package/2006/content-types"
    relationships = "http://schemas.openxmlformats.org/package/2006/relationships"
    entries: dict[str, Any] = {
        "[Content_Types].xml": f'{_HEAD}<Types xmlns="{types}">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>\n',
        "_rels/.rels": f'{_HEAD}<Relationships xmlns="{relationships}">'
        f'<Relationship Target="/{ROOT}" Id="rel0" Type="{MODEL_TYPE}"/></Relationships>\n',
        ROOT: model,
    }
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in entries.items():
            archive.writestr(zipfile.ZipInfo(name, _DATE), text.encode("utf-8", errors="replace"), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()

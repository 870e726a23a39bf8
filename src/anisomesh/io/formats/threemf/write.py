"""Writing of 3MF archives, in float64."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from anisomesh.attributes.model import UNIT, Mesh, Regions
from anisomesh.io.carried import COLOUR, UV, Array, Integers
from anisomesh.io.formats.region_names import region_texts
from anisomesh.io.formats.threemf.properties import MATERIAL, OBJECT, TEXTURE, TEXTURES
from anisomesh.io.formats.threemf.read import MODEL_TYPE, ROOT
from anisomesh.io.formats.threemf.resources import CORE, MATERIALS
from anisomesh.io.formats.threemf.textures import Images, Textured, in_xml, textured
from anisomesh.io.formats.units import OF_3MF
from anisomesh.io.formats.words import format_rows
from anisomesh.io.holding.divisions import by_label, main_division
from anisomesh.io.holding.losses import Losses
from anisomesh.io.holding.values import share_not_finite

_DATE = (1980, 1, 1, 0, 0, 0)  # of all entries, so that the same mesh gives the same file
_GREY = "#808080FF"
_MATERIAL_GROUP, _COLOUR_GROUP, _FIRST_FREE = 1, 2, 3  # numbers of resources
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
_RELATIONSHIPS = "http://schemas.openxmlformats.org/package/2006/relationships"
_TEXTURE_TYPE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dtexture"
_UNITS = ("micron", "millimeter", "centimeter", "inch", "foot", "meter")


def threemf_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of a 3MF archive, in millimetres unless the mesh has another unit.

    Notes
    -----
    A division becomes objects, the one called ``material`` base materials; otherwise colours of points or corners are
    kept. Regions keep their names, not their numbers.
    """
    textures = textured(mesh, _FIRST_FREE, losses)
    held = (MATERIAL,) if textures is None else (MATERIAL, TEXTURE)
    others = {name: regions for name, regions in mesh.regions.items() if name not in held}
    found = main_division(others, OBJECT)
    resources, properties = _properties(mesh, textures, losses)
    losses.add("regions", *(name for name in others if found is None or name != found[0]))
    losses.add("face data", *mesh.face_data)
    losses.features(mesh)
    first = _FIRST_FREE if textures is None else textures.next_number
    objects = _objects(mesh, None if found is None else found[1], properties, first, losses)
    items = "".join(f'<item objectid="{first + k}"/>' for k in range(len(objects)))
    unit = mesh.materials.get(UNIT, OF_3MF)
    known = (UNIT, "display_colours") if textures is None else (UNIT, "display_colours", TEXTURES)
    losses.add("materials", *(name for name in mesh.materials if name not in known))
    if unit not in _UNITS:
        losses.say(f"the unit {unit!r}, for which the file has {OF_3MF}")
        unit = OF_3MF
    model = (
        f'{_HEAD}<model unit="{unit}" xmlns="{CORE}" xmlns:m="{MATERIALS}">\n<resources>{resources}{"".join(objects)}'
        f"</resources><build>{items}</build></model>\n"
    )
    return _archive(model, {} if textures is None else textures.images)


def _properties(mesh: Mesh, textures: Textured | None, losses: Losses) -> tuple[str, Array]:
    """Return the groups of textures, materials or colours, and the attributes of each triangle as text (F,)."""
    colours = mesh.corner_data.get(COLOUR)
    if colours is None and COLOUR in mesh.point_data:
        colours = mesh.point_data[COLOUR][mesh.surface.faces]
    materials, n_faces = mesh.regions.get(MATERIAL), mesh.surface.n_faces
    rgba = None if colours is None or materials is not None else _rgba(colours)
    held = [*([] if rgba is None else [COLOUR]), *([] if textures is None else [UV])]
    for what, where, data in (("point data", "points", mesh.point_data), ("corner data", "corners", mesh.corner_data)):
        losses.add(what, *(name for name in data if name not in held))
        if COLOUR in data and COLOUR not in held:
            rows = data[COLOUR].reshape(-1, data[COLOUR].shape[-1])
            if rows.dtype.kind == "f" and (reason := share_not_finite(rows, where)):
                losses.because(what, COLOUR, reason)
    if materials is not None:
        group, attributes = _materials(mesh, materials, losses)
    elif rgba is not None:
        group, attributes = _colours(rgba)
    else:
        group, attributes = "", np.full(n_faces, "", dtype=object)
    if textures is None:
        return group, attributes
    is_textured = textures.attributes != ""
    hidden = np.count_nonzero(is_textured & (attributes != "")) if materials is not None else 0
    if rgba is not None:
        hidden = np.count_nonzero(is_textured & (rgba != 255).any(axis=(1, 2)))
    if hidden:
        losses.say(f"the {'colours' if materials is None else 'materials'} of {hidden} face(s) that have a texture")
    return textures.resources + group, np.where(is_textured, textures.attributes, attributes)


def _colours(rgba: Array) -> tuple[str, Array]:
    """Return the group of colours, given at corners (F, 3, 4), and the attributes of triangles."""
    table, numbers = np.unique(rgba.reshape(-1, 4), axis=0, return_inverse=True)
    entries = "".join(f'<m:color color="#{bytes(row.tolist()).hex().upper()}"/>' for row in table)
    members = numbers.reshape(-1, 3).tolist()
    attributes = [f' pid="{_COLOUR_GROUP}" p1="{a}" p2="{b}" p3="{c}"' for a, b, c in members]
    return f'<m:colorgroup id="{_COLOUR_GROUP}">{entries}</m:colorgroup>', np.array(attributes, dtype=object)


def _materials(mesh: Mesh, materials: Regions, losses: Losses) -> tuple[str, Array]:
    """Return the group of base materials and the attributes of triangles; label 0 without a name stands for none."""
    given = mesh.materials.get("display_colours")
    displayed = given if isinstance(given, Mapping) else {}
    texts = region_texts(materials, losses, in_xml, distinct=True)
    labels = [label for label in texts if label != 0 or label in materials.names or len(texts) == 1]
    entries = []
    if (n_unknown := sum(not displayed.get(label) for label in labels)) > 0:
        losses.say(f"unknown colours of {n_unknown} of {len(labels)} material(s): they are grey")
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


def _objects(mesh: Mesh, division: Regions | None, properties: Array, first: int, losses: Losses) -> list[str]:
    """Return the objects, each with its points, numbered from the first one on."""
    points, faces = mesh.surface.points, mesh.surface.faces.astype(np.int64)
    if division is None:
        return [_object(first, "", points, faces, properties)]
    objects, texts = [], region_texts(division, losses, in_xml)
    for k, ((label,), chosen) in enumerate(by_label(division.labels)):
        used, corners = np.unique(faces[chosen], return_inverse=True)
        objects.append(_object(first + k, texts[label], points[used], corners.reshape(-1, 3), properties[chosen]))
    return objects


def _object(number: int, name: str, points: Array, faces: Integers, properties: Array) -> str:
    vertices = format_rows('<vertex x="%r" y="%r" z="%r"/>\n', points)
    rows = zip(*faces.T.tolist(), properties.tolist(), strict=True)
    triangles = "".join(map('<triangle v1="%d" v2="%d" v3="%d"%s/>\n'.__mod__, rows))
    mesh = f"<mesh><vertices>\n{vertices}</vertices><triangles>\n{triangles}</triangles></mesh>"
    named = f" name={quoteattr(name)}" if name else ""
    return f'<object id="{number}" type="model"{named}>{mesh}</object>'


def _archive(model: str, images: Images) -> bytes:
    """Return the archive of a model with images of textures."""
    types = "http://schemas.openxmlformats.org/package/2006/content-types"
    kinds = "".join(
        f'<Override PartName="/{part}" ContentType={quoteattr(kind)}/>' for part, (kind, _) in images.items()
    )
    entries = {
        "[Content_Types].xml": f'{_HEAD}<Types xmlns="{types}">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
        f"{kinds}</Types>\n",
        "_rels/.rels": _relationships(MODEL_TYPE, [ROOT]),
        ROOT: model,
    }
    if images:
        folder, _, name = ROOT.rpartition("/")
        entries[f"{folder}/_rels/{name}.rels"] = _relationships(_TEXTURE_TYPE, list(images))
    content = {name: text.encode("utf-8", errors="replace") for name, text in entries.items()}
    content |= {part: data for part, (_, data) in images.items()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(zipfile.ZipInfo(name, _DATE), data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def _relationships(kind: str, targets: Sequence[str]) -> str:
    """Return the text that names other parts of the archive that a part needs."""
    rows = "".join(f'<Relationship Target="/{part}" Id="rel{k}" Type="{kind}"/>' for k, part in enumerate(targets))
    return f'{_HEAD}<Relationships xmlns="{_RELATIONSHIPS}">{rows}</Relationships>\n'

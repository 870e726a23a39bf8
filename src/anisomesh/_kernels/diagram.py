"""The restricted Voronoi diagram in symbolic form, chunk by chunk."""

from .clip import START_TOO_FAR, clip_facet
from .compiled import kernel


@kernel
def count_chunk(chunk, owners, facets, sites, ws, problems):
    """Return the numbers of polygons, polygon vertices and problems on a chunk of facets.

    ``owners`` (F,) are the start sites; they are updated. A facet that cannot be clipped is written to ``problems`` as
    (facet, status).
    """
    polygons = 0
    vertices = 0
    n_problems = 0
    for facet in chunk:
        n = clip_facet(facet, owners[facet], facets, sites, ws)
        if n < 0:
            problems[n_problems, 0] = facet
            problems[n_problems, 1] = n
            n_problems += 1
            if n == START_TOO_FAR:
                owners[facet] = ws.candidate[ws.polygon_slot[0]]
            continue
        owners[facet] = ws.candidate[ws.polygon_slot[0]]
        polygons += n
        vertices += ws.polygon_start[n]
    return polygons, vertices, n_problems


@kernel
def write_chunk(chunk, owners, facets, sites, ws, facet_of, site_of, size, label, vertex):
    """Write the polygons of a chunk of facets: facet, site and vertex count per polygon, label and position per vertex.

    Edge labels are sites, or -1 - c for the side of the facet opposite corner c. Every polygon starts at the vertex
    with the lowest label, so that the output does not depend on the owners.
    """
    p = 0
    v = 0
    for facet in chunk:
        n = clip_facet(facet, owners[facet], facets, sites, ws)
        for m in range(n):
            first = ws.polygon_start[m]
            count = ws.polygon_start[m + 1] - first
            facet_of[p] = facet
            site_of[p] = ws.candidate[ws.polygon_slot[m]]
            size[p] = count
            p += 1
            lowest = 0
            for k in range(count):
                slot = ws.label[first + k]
                if slot >= 0:
                    ws.label[first + k] = ws.candidate[slot]
                if ws.label[first + k] < ws.label[first + lowest]:
                    lowest = k
            for k in range(count):
                source = first + (k + lowest) % count
                label[v] = ws.label[source]
                for c in range(3):
                    vertex[v, c] = ws.vertex[source, c]
                v += 1

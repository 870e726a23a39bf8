"""Collapses of all edges that cost up to a limit, in passes over the faces instead of in the order of their costs."""

from .compiled import kernel
from .decimate import collapse, place_between


@kernel
def costs_of_edges(state, step, costs):
    """Set the costs of the edges of every ``step``-th face, and return their number."""
    mesh, count = state.mesh, 0
    for face in range(0, len(mesh.faces), step):
        if mesh.faces[face, 0] < 0:
            continue
        for side in range(3):
            p, q = mesh.faces[face, (side + 1) % 3], mesh.faces[face, (side + 2) % 3]
            if not (state.held[p] and state.held[q]):
                costs[count] = place_between(state, p, q)[0]
                count += 1
    return count


@kernel
def collapse_cheap_edges(state, limit, most, now):
    """Collapse edges that cost up to a limit, none at a point where one was in this pass, and return their number.

    There are at most ``most``; ``now`` is the number of the pass, from 1 on.
    """
    mesh, changed, count = state.mesh, state.changed, 0
    for face in range(len(mesh.faces)):
        for side in range(3):
            if mesh.faces[face, 0] < 0 or count == most:
                break
            if face < mesh.neighbours[face, side]:
                continue
            p, q = mesh.faces[face, (side + 1) % 3], mesh.faces[face, (side + 2) % 3]
            if changed[p] == now or changed[q] == now or (state.held[p] and state.held[q]):
                continue
            if place_between(state, p, q)[0] > limit:
                continue
            point = collapse(state, p, q)
            if point >= 0:
                changed[point] = now
                count += 1
    return count

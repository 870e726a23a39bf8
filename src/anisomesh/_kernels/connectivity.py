"""Tables of edges and neighbours of triangle lists, by counting instead of sorting all sides.

Side ``3 f + c`` is the edge opposite corner ``c`` of face ``f``, as in :mod:`anisomesh.mesh.topology`.
"""

from .compiled import kernel

_MAX_INSERTIONS = 64  # sides at one point that are sorted by insertion; more, as in a fan, by a heap


@kernel
def count_sides(faces, first):
    """Set in ``first`` (V + 1,), which is 0, the number of sides with lower ends before each point."""
    for face in range(len(faces)):
        for corner in range(3):
            a, b = faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]
            first[min(a, b) + 1] += 1
    for point in range(len(first) - 1):
        first[point + 1] += first[point]


@kernel
def sort_sides(faces, first, position, sides, ends):
    """Sort the sides by their lower end, then their higher end, then their number.

    Parameters
    ----------
    faces
        Point indices (F, 3).
    first
        Number of sides before the ones of each lower end (V + 1,).
    position
        Workspace (V,).
    sides, ends
        Set to the sides in order (3F,), and their higher ends.
    """
    for point in range(len(position)):
        position[point] = first[point]
    for face in range(len(faces)):
        for corner in range(3):
            a, b = faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]
            low = min(a, b)
            sides[position[low]], ends[position[low]] = 3 * face + corner, max(a, b)
            position[low] += 1
    for point in range(len(position)):
        start, stop = first[point], first[point + 1]
        if stop - start <= _MAX_INSERTIONS:
            _sort_by_insertion(sides, ends, start, stop)
        else:
            _sort_by_heap(sides, ends, start, stop)


@kernel
def _sort_by_insertion(sides, ends, start, stop):
    """Sort sides from ``start`` to ``stop`` by their higher ends; equal ones stay in order."""
    for k in range(start + 1, stop):
        side, end, j = sides[k], ends[k], k
        while j > start and ends[j - 1] > end:
            sides[j], ends[j] = sides[j - 1], ends[j - 1]
            j -= 1
        sides[j], ends[j] = side, end


@kernel
def _sort_by_heap(sides, ends, start, stop):
    """Sort sides from ``start`` to ``stop`` by their higher ends, then their numbers."""
    size = stop - start
    for root in range(size // 2 - 1, -1, -1):
        _sift(sides, ends, start, root, size)
    for last in range(size - 1, 0, -1):
        sides[start], sides[start + last] = sides[start + last], sides[start]
        ends[start], ends[start + last] = ends[start + last], ends[start]
        _sift(sides, ends, start, 0, last)


@kernel
def _sift(sides, ends, start, root, size):
    """Let an entry of a heap of this size, from ``start`` on, sink to its place."""
    while 2 * root + 1 < size:
        child = start + 2 * root + 1
        if child + 1 < start + size and _is_before(sides, ends, child, child + 1):
            child += 1
        if not _is_before(sides, ends, start + root, child):
            return
        sides[start + root], sides[child] = sides[child], sides[start + root]
        ends[start + root], ends[child] = ends[child], ends[start + root]
        root = child - start


@kernel
def _is_before(sides, ends, j, k):
    """Return whether an entry is before another one."""
    return ends[j] < ends[k] or (ends[j] == ends[k] and sides[j] < sides[k])


@kernel
def number_edges(first, sides, ends, edges, edge_of_side):
    """Set the edges, of which there are at most as many as sides, and the edge of each side; return their number."""
    count = -1
    for point in range(len(first) - 1):
        for k in range(first[point], first[point + 1]):
            if k == first[point] or ends[k] != ends[k - 1]:
                count += 1
                edges[count, 0], edges[count, 1] = point, ends[k]
            edge_of_side[sides[k]] = count
    return count + 1


@kernel
def edge_faces(face_edges, counts, pairs):
    """Set the faces at each edge (E, 2), which are -1: two, one and -1 at the boundary, both -1 if there are more.

    ``counts`` (E,) is 0 before, and the number of faces at each edge after.
    """
    for face in range(len(face_edges)):
        for corner in range(3):
            edge = face_edges[face, corner]
            if counts[edge] < 2:
                pairs[edge, counts[edge]] = face
            counts[edge] += 1
    for edge in range(len(counts)):
        if counts[edge] > 2:
            pairs[edge, 0], pairs[edge, 1] = -1, -1


@kernel
def face_neighbours(face_edges, pairs, neighbours):
    """Set the face across each side (F, 3), -1 at the boundary and non-manifold edges."""
    for face in range(len(face_edges)):
        for corner in range(3):
            edge = face_edges[face, corner]
            other = pairs[edge, 1]
            neighbours[face, corner] = pairs[edge, 0] if other == face else other


@kernel
def is_oriented(faces, face_edges, counts, balance):
    """Return whether each edge with two faces has a side in each direction.

    ``counts`` are the numbers of faces at the edges (E,), and ``balance`` (E,) is 0 before.
    """
    for face in range(len(faces)):
        for corner in range(3):
            upward = faces[face, (corner + 1) % 3] < faces[face, (corner + 2) % 3]
            balance[face_edges[face, corner]] += 1 if upward else -1
    one_way = 0
    for edge in range(len(counts)):
        one_way += counts[edge] == 2 and balance[edge] != 0
    return one_way == 0


@kernel
def has_single_fans(faces, neighbours, n_faces):
    """Return whether the faces at each point form one fan, if edges have at most two faces, which are oriented.

    ``n_faces`` (V,) is 0 before. It is set to the number of faces at each point, then to 0 where these are one fan.
    """
    for face in range(len(faces)):
        for corner in range(3):
            n_faces[faces[face, corner]] += 1
    for face in range(len(faces)):
        for corner in range(3):
            point = faces[face, corner]
            if n_faces[point] == 0:
                continue
            if _fan_size(faces, neighbours, face, corner) != n_faces[point]:
                return False
            n_faces[point] = 0
    return True


@kernel
def _fan_size(faces, neighbours, face, corner):
    """Return the number of faces around the corner of a face."""
    point, size = faces[face, corner], 1
    for turn in range(1, 3):
        other = neighbours[face, (corner + turn) % 3]
        while other >= 0 and other != face:
            size += 1
            own = 0
            while faces[other, own] != point:
                own += 1
            other = neighbours[other, (own + turn) % 3]
        if other == face:
            break
    return size

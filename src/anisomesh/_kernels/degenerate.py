"""Faces that may have no area, found fast."""

from .compiled import kernel
from .vectors import coordinates, cross, squared_length, subtract


@kernel
def thin_faces(points, faces, ratio, is_thin):
    """Set which faces (F,) have twice their area up to a ratio of the square of their longest side."""
    for face in range(len(faces)):
        a = coordinates(points, faces[face, 0])
        u, v = subtract(coordinates(points, faces[face, 1]), a), subtract(coordinates(points, faces[face, 2]), a)
        longest = max(squared_length(u), squared_length(v), squared_length(subtract(v, u)))
        is_thin[face] = not squared_length(cross(u, v)) > (ratio * longest) ** 2

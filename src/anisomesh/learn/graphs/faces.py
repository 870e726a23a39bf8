"""The graph of the faces of a surface for the filter of normals, with features that no rotation changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from anisomesh._arrays import FaceScalars, FaceVectors
from anisomesh.denoise.filters import FaceNeighbours, bilateral_normals
from anisomesh.learn.graphs.graph import Floats, Graph
from anisomesh.mesh.surface import Surface

N_FACE_FEATURES, N_NEIGHBOUR_FEATURES = 6, 10
"""Numbers of features of a face, and of a pair of neighbours."""

FILTER_ROUNDS, NORMAL_WIDTH = 3, 0.25
"""Rounds and width of the bilateral filter that the learnt one starts from; heuristic."""


@dataclass(frozen=True, eq=False)
class FaceGraph:
    """The faces of a surface whose noise was removed in part, as nodes with edges to their neighbours and themselves.

    Attributes
    ----------
    graph
        Neighbours of each face, with features of the pairs (E, ``N_NEIGHBOUR_FEATURES``).
    nodes
        Features of the faces (F, ``N_FACE_FEATURES``).
    normals
        Unit normals (F, 3), float32.
    weight
        Weights of the neighbours (E,) by area and distance, relative to the mean area.
    neighbours
        The neighbours as the filters need them.
    surface
        The surface.
    """

    graph: Graph
    nodes: Floats
    normals: Floats
    weight: Floats
    neighbours: FaceNeighbours
    surface: Surface


def face_graph(noisy: Surface, surface: Surface) -> FaceGraph:
    """Return the graph of the faces of a surface, the points of ``noisy`` moved to where there is less noise."""
    neighbours = FaceNeighbours.of(surface)
    normals, before = surface.face_normals, noisy.face_normals
    filtered = bilateral_normals(neighbours, normals, rounds=FILTER_ROUNDS, width=NORMAL_WIDTH)
    areas = np.maximum(surface.face_areas / neighbours.spacing**2, 1e-6)
    pairs = _pair_features(surface, neighbours, (normals, before, filtered), areas)
    return FaceGraph(
        graph=Graph(first=neighbours.first, neighbour=neighbours.neighbour, features=pairs),
        nodes=_face_features(noisy, surface, (normals, before, filtered), areas),
        normals=normals.astype(np.float32),
        weight=(neighbours.weight / neighbours.spacing**2).astype(np.float32),
        neighbours=neighbours,
        surface=surface,
    )


def _face_features(noisy: Surface, surface: Surface, normals: tuple[FaceVectors, ...], areas: FaceScalars) -> Floats:
    """Return how far the normal of each face was and would be rotated, its size, and how far its points moved."""
    now, before, filtered = normals
    moved = (surface.points - noisy.points) / noisy.edge_lengths.mean()
    heights = np.einsum("fkx,fx->fk", moved[surface.faces], now)
    columns = [
        np.linalg.norm(now - before, axis=1),
        np.linalg.norm(now - filtered, axis=1),
        np.log(areas),
        np.sqrt((heights**2).mean(axis=1)),
        np.abs(heights.mean(axis=1)),
        surface.on_boundary[surface.faces].any(axis=1),
    ]
    return np.stack(columns, axis=1).astype(np.float32)


def _pair_features(
    surface: Surface, neighbours: FaceNeighbours, normals: tuple[FaceVectors, ...], areas: FaceScalars
) -> Floats:
    """Return how the normals of each pair differ, how it is bent and apart, and how many points it shares."""
    face, other, (now, _, filtered) = neighbours.face, neighbours.neighbour, normals
    centres = surface.points[surface.faces].mean(axis=1) / neighbours.spacing
    apart = centres[other] - centres[face]
    corners, theirs = surface.faces[face], surface.faces[other]
    shared = (corners[:, :, None] == theirs[:, None, :]).any(axis=2).sum(axis=1)
    columns = [
        *(np.linalg.norm(each[face] - each[other], axis=1) for each in normals),
        np.linalg.norm(now[face] - filtered[other], axis=1),
        np.einsum("ex,ex->e", apart, now[face]),
        -np.einsum("ex,ex->e", apart, now[other]),
        np.linalg.norm(apart, axis=1),
        np.log(areas[other] / areas[face]),
        shared == 2,
        shared == 3,
    ]
    return np.stack(columns, axis=1).astype(np.float32)

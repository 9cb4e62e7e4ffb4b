"""Closed triangle meshes that face outwards, made by formulae."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Points = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.int64]


def ball(halvings: int) -> tuple[Points, Triangles]:
    """A unit sphere of 20 triangles, each cut into four as often as this."""
    golden = (1 + 5**0.5) / 2
    corners = [[0, a, b] for a in (-1, 1) for b in (-golden, golden)]
    points = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners], float)
    # A face: three corners at the distance of an edge, 2.
    near = np.isclose(np.linalg.norm(points[:, None] - points, axis=2), 2)
    faces = [
        [a, b, c]
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ]
    triangles = np.array([_outwards(points, face) for face in faces])
    for _ in range(halvings):
        points, triangles = halved(points, triangles)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, triangles


def _outwards(points: Points, face: list[int]) -> list[int]:
    a, b, c = points[face]
    return face if np.dot(a, np.cross(b, c)) > 0 else face[::-1]


def halved(points: Points, triangles: Triangles) -> tuple[Points, Triangles]:
    """Each triangle as four, with a vertex in the middle of each edge."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, edge = np.unique(sides, axis=0, return_inverse=True)
    middle = edge.reshape(-1, 3) + len(points)
    (a, b, c), (ab, bc, ca) = triangles.T, middle.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    both = np.concatenate([points, points[edges].mean(axis=1)])
    return both, np.concatenate([np.stack(each, axis=1) for each in four])


def tube(rings: int, around: int) -> Triangles:
    """Triangles of the wall of a tube. Vertices go around, ring after ring."""
    ring, place = np.divmod(np.arange((rings - 1) * around), around)
    a = ring * around + place
    b = ring * around + (place + 1) % around
    halves = [(a, b, b + around), (a, b + around, a + around)]
    return np.concatenate([np.stack(half, axis=1) for half in halves])


def slab(cells: int) -> tuple[Points, Triangles]:
    """A box from -1 to 1: cells * cells squares above and below, and a rim. The third coordinate is 1 or -1."""
    line = np.linspace(-1, 1, cells + 1)
    x, y = (each.ravel() for each in np.meshgrid(line, line, indexing="ij"))
    above = np.stack([x, y, np.ones_like(x)], axis=1)
    number = np.arange(len(x)).reshape(cells + 1, cells + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    halves = [np.stack([each.ravel() for each in half], axis=1) for half in [(a, b, c), (a, c, d)]]
    top = np.concatenate(halves)
    border = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    after = np.roll(border, -1)
    below = len(x)
    rim = [(border + below, after + below, after), (border + below, after, border)]
    parts = [top, top[:, ::-1] + below, *(np.stack(each, axis=1) for each in rim)]
    return np.concatenate([above, above * [1, 1, -1]]), np.concatenate(parts)

"""Distances and sides by all triangles in double precision, and in whole numbers where that leaves a doubt."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

import exact
from shapes import Points, Triangles

# Of a point and a triangle whose coordinates are in single precision, times the largest coordinate.
ERROR = 1e-14
# Points times triangles: what fits into a cache.
CHUNK = 1 << 14


class Truth(NamedTuple):
    distance: Points
    winding: npt.NDArray[np.int64]
    """0 outside, 1 inside; another number where the surface cuts itself."""
    on_surface: npt.NDArray[np.bool_]
    """The point has no side."""
    by_whole_numbers: int
    """How many points were decided so."""

    @property
    def side(self) -> npt.NDArray[np.int64]:
        """1 outside, -1 inside, 0 where there is none."""
        has_side = ~self.on_surface & ((self.winding == 0) | (self.winding == 1))
        return np.where(has_side, 1 - 2 * self.winding, 0)


def truth(points: Points, positions: Points, triangles: Triangles) -> Truth:
    """Of points and one frame."""
    step = max(1, CHUNK // len(triangles))
    parts = [_chunk(points[at : at + step], positions, triangles) for at in range(0, len(points), step)]
    distance = np.concatenate([part[0] for part in parts])
    angle = np.concatenate([part[1] for part in parts])
    winding = np.rint(angle).astype(np.int64)
    size = np.abs(positions).max()
    in_doubt = (distance < 1e-10 * size) | (np.abs(angle - winding) > 1e-6)
    on_surface = np.zeros(len(points), bool)
    for number in np.flatnonzero(in_doubt):
        found = exact.winding(points[number], positions, triangles)
        on_surface[number] = found is None
        winding[number] = 0 if found is None else found
    return Truth(distance, winding, on_surface, int(in_doubt.sum()))


def _chunk(points: Points, positions: Points, triangles: Triangles) -> tuple[Points, Points]:
    """Distances and winding numbers. Vectors are three arrays of a row a point and a column a triangle."""
    # Differences of numbers in single precision are exact, as long as their sizes are not too far apart.
    ways = [[corner[:, axis] - points[:, axis, None] for axis in range(3)] for corner in _corners(positions, triangles)]
    a, b, c = ways
    near = np.minimum(np.minimum(_to_edge(a, b), _to_edge(b, c)), _to_edge(c, a))
    normal = _cross(_less(b, a), _less(c, a))
    bc, ca, ab = _cross(b, c), _cross(c, a), _cross(a, b)
    above = _dot(a, bc)
    is_over = (_dot(normal, bc) >= 0) & (_dot(normal, ca) >= 0) & (_dot(normal, ab) >= 0)
    square = _dot(normal, normal)
    plane = np.divide(above**2, square, out=np.full_like(above, np.inf), where=is_over & (square > 0))
    la, lb, lc = (np.sqrt(_dot(way, way)) for way in ways)
    below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    angle = np.arctan2(above, below).sum(axis=1) / (2 * np.pi)
    return np.sqrt(np.minimum(near, plane).min(axis=1)), angle


def _corners(positions: Points, triangles: Triangles) -> list[Points]:
    return [positions[triangles[:, corner]] for corner in range(3)]


def _to_edge(a: list[Points], b: list[Points]) -> Points:
    """The square of the distance from the origin to the edge."""
    edge = _less(b, a)
    square = np.maximum(_dot(edge, edge), 1e-300)
    t = np.clip(-_dot(a, edge) / square, 0, 1)
    near = [start + t * way for start, way in zip(a, edge)]
    return _dot(near, near)


def _less(a: list[Points], b: list[Points]) -> list[Points]:
    return [one - other for one, other in zip(a, b)]


def _cross(a: list[Points], b: list[Points]) -> list[Points]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a: list[Points], b: list[Points]) -> Points:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

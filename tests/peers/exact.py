"""The side of a point in whole numbers: no rounding, any input in single precision."""

from __future__ import annotations

import math

from shapes import Points, Triangles

# The least number in single precision times this is a whole number.
SCALE = 149
Vector = tuple[int, int, int]


def winding(point: Points, positions: Points, triangles: Triangles) -> int | None:
    """How often the surface goes around the point: 0 outside, 1 inside. `None` on the surface."""
    origin = _whole(point)
    corners = [_less(_whole(position), origin) for position in positions]
    # A ray that meets an edge tells nothing: then another one.
    for direction in [(1, 0, 0), (317, 211, 101), (-503, 97, 389), (71, -613, 229), (-17, 401, -733)]:
        found = _crossings(direction, [(corners[a], corners[b], corners[c]) for a, b, c in triangles.tolist()])
        if found is None:
            return None
        count, meets_edge = found
        if not meets_edge:
            return count
    raise ArithmeticError("every ray meets an edge")


def _crossings(ray: Vector, faces: list[tuple[Vector, Vector, Vector]]) -> tuple[int, bool] | None:
    """The faces that a ray from the origin leaves through, less those that it enters by; and whether it meets an edge.

    `None` where a face contains the origin.
    """
    count = 0
    meets_edge = False
    for a, b, c in faces:
        shares = [_dot(ray, _cross(b, c)), _dot(ray, _cross(c, a)), _dot(ray, _cross(a, b))]
        if min(shares) < 0 < max(shares) or not any(shares):
            continue
        away = _dot(a, _cross(b, c))
        leaves = 1 if sum(shares) > 0 else -1
        if away == 0:
            return None
        if away * leaves > 0:
            meets_edge |= 0 in shares
            count += leaves
    return count, meets_edge


def _whole(point: Points) -> Vector:
    x, y, z = (int(math.ldexp(value, SCALE)) for value in point.tolist())
    return x, y, z


def _less(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Vector, b: Vector) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

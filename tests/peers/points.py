"""The points that are asked about: in the room, near faces, near edges and vertices, and at the surface."""

from __future__ import annotations

import numpy as np

from shapes import Points
from subjects import Subject

SHARES = {"in the room": 0.25, "near faces": 0.35, "near edges and vertices": 0.3, "at the surface": 0.1}


def points_of(subject: Subject, count: int) -> Points:
    """So many points for each frame, each coordinate a number in single precision."""
    seed = np.random.default_rng(list(subject.name.encode()))
    found = np.stack([_around(seed, subject, frame, count) for frame in subject.frames])
    return found.astype(np.float32).astype(np.float64)


def _around(seed: np.random.Generator, subject: Subject, frame: Points, count: int) -> Points:
    room, faces, edges, _ = (round(share * count) for share in SHARES.values())
    low, high = frame.min(axis=0), frame.max(axis=0)
    reach = 0.2 * (high - low).max()
    parts = [
        seed.uniform(low - reach, high + reach, (room, 3)),
        _near_faces(seed, subject, frame, faces, (-4, 1)),
        _near_edges(seed, subject, frame, edges),
        _near_faces(seed, subject, frame, count - room - faces - edges, (-7, -4)),
    ]
    return np.concatenate(parts)


def _near_faces(
    seed: np.random.Generator, subject: Subject, frame: Points, count: int, powers: tuple[float, float]
) -> Points:
    """From a place on a triangle along its normal, to both sides, by a power of ten of millimetres."""
    corners = frame[subject.triangles[seed.integers(len(subject.triangles), size=count)]]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    weights = seed.dirichlet([1, 1, 1], count)
    return np.einsum("pc,pci->pi", weights, corners) + normal * _lengths(seed, count, powers)


def _near_edges(seed: np.random.Generator, subject: Subject, frame: Points, count: int) -> Points:
    """From a vertex or from a place on an edge, in any direction."""
    corners = frame[subject.triangles[seed.integers(len(subject.triangles), size=count)]]
    along = seed.uniform(0, 1, (count, 1)) * seed.integers(0, 2, (count, 1))
    way = seed.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return corners[:, 0] + along * (corners[:, 1] - corners[:, 0]) + way * _lengths(seed, count, (-4, 0.5))


def _lengths(seed: np.random.Generator, count: int, powers: tuple[float, float]) -> Points:
    return 10 ** seed.uniform(*powers, (count, 1)) * seed.choice([-1, 1], (count, 1))

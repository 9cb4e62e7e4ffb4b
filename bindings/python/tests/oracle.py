"""Distances and sides by trimesh and formulae that share no code with dibs."""

import numpy as np
import trimesh


def distances(points, vertices, triangles):
    """From each point to the nearest of all triangles, by trimesh."""
    corners = vertices[triangles]
    found = []
    for point in points:
        nearest = trimesh.triangles.closest_point(corners, np.broadcast_to(point, (len(corners), 3)))
        found.append(np.linalg.norm(nearest - point, axis=1).min())
    return np.array(found)


def winding(points, vertices, triangles):
    """Generalised winding numbers, by solid angles (Van Oosterom and Strackee 1983)."""
    ways = vertices[triangles][np.newaxis] - points[:, np.newaxis, np.newaxis]
    a, b, c = ways[:, :, 0], ways[:, :, 1], ways[:, :, 2]
    la, lb, lc = (np.linalg.norm(way, axis=-1) for way in (a, b, c))
    above = np.einsum("pti,pti->pt", a, np.cross(b, c))
    dot = lambda one, other: np.einsum("pti,pti->pt", one, other)
    below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.arctan2(above, below).sum(axis=1) / (2 * np.pi)

"""Open3D's ray casting scene, which is Embree's point query, and Embree's rays for the side."""

from __future__ import annotations

import numpy as np
import open3d.core as o3c
from open3d.t.geometry import RaycastingScene

from library import Answers, Library, signed
from shapes import Points, Triangles


class Peer(Library):
    name = "Open3D (Embree's point query)"
    package = "open3d"
    stated = "none; 64 units in the last place, single"
    update_by = "rebuild"
    inside = "negative by the depth; parity of a ray"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        self.faces = o3c.Tensor(triangles.astype(np.uint32))
        self.update(frames[0])

    def update(self, positions: Points) -> None:
        self.scene = RaycastingScene(nthreads=1)
        self.scene.add_triangles(o3c.Tensor(positions.astype(np.float32)), self.faces)
        # It builds its search structure at the first question.
        self.batch(positions[:1])

    def batch(self, points: Points) -> Answers:
        tensor = o3c.Tensor(points.astype(np.float32))
        return signed(self.scene.compute_signed_distance(tensor, nthreads=1).numpy())

    def accuracy(self, size: float) -> float:
        return 64 * 2.0**-24 * size

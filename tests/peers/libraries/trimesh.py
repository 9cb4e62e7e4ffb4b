"""trimesh, with its own rays."""

from __future__ import annotations

import numpy as np
import trimesh

from library import Answers, Library, signed
from shapes import Points, Triangles

# It draws the directions of some rays: the same in each run.
trimesh.util._RANDOM_DEFAULT = np.random.default_rng(1)


class Peer(Library):
    name = "trimesh"
    package = "trimesh"
    stated = "none; its `tol.merge`, 1e-8"
    update_by = "rebuild"
    inside = "by the depth (positive inside); plane of the closest triangle, else rays"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        super().__init__(triangles, frames)
        self.update(frames[0])

    def update(self, positions: Points) -> None:
        self.mesh = trimesh.Trimesh(positions, self.triangles, process=False, use_embree=False)
        # It builds its search structure at the first question.
        self.batch(positions[:1])

    def batch(self, points: Points) -> Answers:
        return signed(-trimesh.proximity.signed_distance(self.mesh, points))

    def accuracy(self, size: float) -> float:
        return 1e-8

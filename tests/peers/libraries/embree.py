"""Embree by embreex, which has rays only, as trimesh asks it."""

from __future__ import annotations

import numpy as np
import trimesh

from library import Answers, Library
from shapes import Points, Triangles

# It draws the directions of some rays: the same in each run.
trimesh.util._RANDOM_DEFAULT = np.random.default_rng(1)


class Peer(Library):
    name = "Embree by embreex and trimesh"
    package = "embreex"
    stated = "no distance: rays only"
    update_by = "rebuild"
    inside = "yes or no; parity of rays"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        super().__init__(triangles, frames)
        self.update(frames[0])

    def update(self, positions: Points) -> None:
        self.mesh = trimesh.Trimesh(positions, self.triangles, process=False, use_embree=True)
        # It builds its search structure at the first question.
        self.batch(positions[:1])

    def batch(self, points: Points) -> Answers:
        side = np.where(self.mesh.contains(points), -1, 1)
        return Answers(np.full(len(points), np.nan), side)

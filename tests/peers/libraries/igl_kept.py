"""libigl's two trees that are kept: boxes for the distance, and the fast winding number for the side."""

from __future__ import annotations

import igl
import numpy as np

from library import Answers, Library
from shapes import Points


class Peer(Library):
    name = "libigl, `AABB` and fast winding number"
    package = "libigl"
    update_by = "rebuild"
    inside = "the caller puts both together; sign of an approximate winding number"

    def update(self, positions: Points) -> None:
        self.positions = positions
        self.boxes, self.winding = igl.AABB(), igl.FastWindingNumberBVH()
        self.boxes.init(positions, self.triangles)
        self.winding.init(positions, self.triangles)

    def batch(self, points: Points) -> Answers:
        square = self.boxes.squared_distance(self.positions, self.triangles, points)[0]
        is_inside = self.winding.winding_number(points) > 0.5
        return Answers(np.sqrt(square), np.where(is_inside, -1, 1))

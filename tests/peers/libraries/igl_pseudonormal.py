"""libigl's `signed_distance`, which keeps nothing from call to call."""

from __future__ import annotations

import igl

from library import Answers, Library, signed
from shapes import Points


class Peer(Library):
    name = "libigl, pseudonormal"
    package = "libigl"
    update_by = "none; each call builds anew"
    inside = "negative by the depth; sign of the pseudonormal"
    sign = igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL

    def update(self, positions: Points) -> None:
        self.positions = positions

    def batch(self, points: Points) -> Answers:
        return signed(igl.signed_distance(points, self.positions, self.triangles, self.sign)[0])

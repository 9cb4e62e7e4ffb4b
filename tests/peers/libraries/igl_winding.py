"""libigl's `signed_distance` by the winding number, exact to rounding."""

from __future__ import annotations

import igl

from .igl_pseudonormal import Peer as Pseudonormal


class Peer(Pseudonormal):
    name = "libigl, winding number"
    inside = "negative by the depth; sign of the winding number"
    sign = igl.SIGNED_DISTANCE_TYPE_WINDING_NUMBER

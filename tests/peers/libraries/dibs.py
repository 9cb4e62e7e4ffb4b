"""This library, by its Python package."""

from __future__ import annotations

import dibs
import numpy as np

from library import Answers, Library
from shapes import Points, Triangles

SIDES = {dibs.Side.OUTSIDE: 1, dibs.Side.INSIDE: -1}


class Peer(Library):
    name = "DIBS"
    package = "dibs"
    stated = "with each answer"
    update_by = "no refit: the stretch is measured"
    inside = "negative by the depth; undefined is said"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        mesh = dibs.Mesh(frames[0], triangles)
        limits = dibs.MotionStretch(mesh, frames).limits(0.1)
        self.tree = dibs.build(mesh, limits=limits)
        self.surface = self.tree.rest

    def update(self, positions: Points) -> None:
        self.surface = self.tree.surface(positions)

    def batch(self, points: Points) -> Answers:
        found = self.surface.query(np.column_stack([points, np.zeros(len(points))]))
        side = np.zeros(len(points), np.int64)
        for of_dibs, of_ours in SIDES.items():
            side[found["side"] == of_dibs] = of_ours
        distance = np.abs(found["separation"].astype(np.float64))
        return Answers(distance, side, found["accuracy"].astype(np.float64))

    def one(self, point: Points) -> None:
        self.surface.query([*point, 0.0])

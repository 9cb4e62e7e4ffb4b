"""coal, once hpp-fcl: a tree of oriented boxes, refitted, against a sphere of radius 0."""

from __future__ import annotations

import coal
import numpy as np

from library import Answers, Library, unsigned
from shapes import Points, Triangles


class Peer(Library):
    name = "coal"
    package = "coal"
    stated = "`gjk_tolerance`, 1e-6"
    update_by = "refit (`endReplaceModel`)"
    inside = "the distance, as outside"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        self.model = coal.BVHModelOBBRSS()
        self.model.beginModel(len(triangles), len(frames[0]))
        faces = coal.StdVec_Triangle()
        faces.extend([coal.Triangle(*face) for face in triangles.tolist()])
        self.model.addSubModel(_vertices(frames[0]), faces)
        self.model.endModel()
        self.point, self.still, self.at = coal.Sphere(0.0), coal.Transform3s(), coal.Transform3s()
        self.request, self.result = coal.DistanceRequest(), coal.DistanceResult()

    def update(self, positions: Points) -> None:
        self.model.beginReplaceModel()
        self.model.replaceSubModel(_vertices(positions))
        self.model.endReplaceModel(True, True)

    def batch(self, points: Points) -> Answers:
        return unsigned([self.one(point) for point in points])

    def one(self, point: Points) -> float:
        self.at.setTranslation(point)
        self.result.clear()
        return coal.distance(self.model, self.still, self.point, self.at, self.request, self.result)

    def accuracy(self, size: float) -> float:
        return 1e-6


def _vertices(positions: Points) -> coal.StdVec_Vec3s:
    vertices = coal.StdVec_Vec3s()
    vertices.extend(list(np.ascontiguousarray(positions)))
    return vertices

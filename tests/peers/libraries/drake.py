"""Drake's signed distance of points to a mesh. Deforming geometry has none: a scene is made anew for each frame."""

from __future__ import annotations

import numpy as np
from pydrake.common import MemoryFile
from pydrake.geometry import GeometryInstance, InMemoryMesh, Mesh, ProximityProperties, SceneGraph
from pydrake.math import RigidTransform

from library import Answers, Library, signed
from shapes import Points, Triangles


class Peer(Library):
    name = "Drake, `ComputeSignedDistanceToPoint`"
    package = "drake"
    stated = "6e-15 observed at a size of 0.2; in proportion"
    update_by = "rebuild, of the text of an OBJ file"
    inside = "negative by the depth; sign of the pseudonormal"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        self.faces = "".join(f"f {a} {b} {c}\n" for a, b, c in (triangles + 1).tolist())
        self.update(frames[0])

    def update(self, positions: Points) -> None:
        text = "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in positions.tolist()) + self.faces
        mesh = Mesh(InMemoryMesh(mesh_file=MemoryFile(text, ".obj", "surface")), 1.0)
        self.graph = SceneGraph()
        instance = GeometryInstance(RigidTransform(), mesh, "surface")
        instance.set_proximity_properties(ProximityProperties())
        self.graph.RegisterAnchoredGeometry(self.graph.RegisterSource("peers"), instance)
        self.context = self.graph.CreateDefaultContext()
        self.query = self.graph.get_query_output_port().Eval(self.context)

    def batch(self, points: Points) -> Answers:
        return signed([self.one(point) for point in points])

    def one(self, point: Points) -> float:
        found = self.query.ComputeSignedDistanceToPoint(point)
        return found[0].distance if found else np.nan

    def accuracy(self, size: float) -> float:
        return 6e-15 / 0.2 * size

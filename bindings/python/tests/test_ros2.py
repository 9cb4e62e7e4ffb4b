"""examples/ros2/surface_node.py, between topics of this process and the packets of its sender."""

import importlib.util
import sys
import time
import unittest

import numpy as np

from subjects import BEAT, HEART, ROOT, TREE

try:
    import rclpy
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import Point
    from sensor_msgs.msg import PointCloud2, PointField
    from shape_msgs.msg import Mesh, MeshTriangle
    from std_msgs.msg import Header
except ImportError:
    rclpy = None


def cloud(positions, captured):
    """A cloud in metres, each point with an intensity before and after it."""
    point = np.dtype({"names": ["x", "y", "z"], "formats": ["<f4"] * 3, "offsets": [4, 8, 12], "itemsize": 20})
    points = np.zeros(len(positions), point)
    points["x"], points["y"], points["z"] = positions.T / 1000
    fields = [PointField(name=name, offset=4 + 4 * at, datatype=PointField.FLOAT32, count=1) for at, name in enumerate("xyz")]
    stamp = Time(sec=int(captured), nanosec=int(captured % 1 * 1e9))
    size = {"height": 1, "width": len(points), "point_step": 20, "row_step": 20 * len(points)}
    return PointCloud2(header=Header(stamp=stamp), fields=fields, data=points.tobytes(), **size)


def mesh(positions, triangles):
    corners = [MeshTriangle(vertex_indices=list(map(int, triangle))) for triangle in triangles]
    return Mesh(triangles=corners, vertices=[Point(x=x, y=y, z=z) for x, y, z in positions / 1000])


@unittest.skipIf(rclpy is None, "no rclpy: pip install ros-rclpy ros-sensor-msgs ros-shape-msgs ros-rmw-fastrtps-cpp")
class Surfaces(unittest.TestCase):
    def setUp(self):
        path = ROOT / "examples/ros2/surface_node.py"
        spec = importlib.util.spec_from_file_location("surface_node", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        rclpy.init()
        self.addCleanup(rclpy.shutdown)
        self.node = module.SurfaceNode(TREE, HEART.triangles, None, quantised=False, heartbeat=None)
        self.addCleanup(self.node.destroy_node)

    def frames(self, seconds=10.0):
        """Spins until a frame was sent; otherwise for so long. Returns how many were."""
        before, end = self.node.sender.totals.frames, time.monotonic() + seconds
        while time.monotonic() < end and self.node.sender.totals.frames == before:
            rclpy.spin_once(self.node, timeout_sec=0.1)
        return self.node.sender.totals.frames - before

    def publish(self, publisher, message):
        end = time.monotonic() + 10
        while publisher.get_subscription_count() == 0 and time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.05)
        publisher.publish(message)

    def test_clouds_and_meshes_become_frames(self):
        clouds = self.node.create_publisher(PointCloud2, "surface", 5)
        meshes = self.node.create_publisher(Mesh, "surface_mesh", 5)
        messages = [
            # A cloud's metres are f32, a mesh's f64.
            (clouds, lambda at: cloud(at, time.time()), lambda at: (at / 1000).astype("<f4").astype("f8") * 1000),
            (meshes, lambda at: mesh(at, HEART.triangles), lambda at: at.astype("f8") / 1000 * 1000),
        ]
        for (publisher, message, sent), frame in zip(messages, BEAT.frames):
            self.publish(publisher, message(frame))
            self.assertEqual(self.frames(), 1)
            every = b"".join(self.node.sender.packets())
            self.assertTrue(all(row.tobytes() in every for row in sent(frame).astype("<f4")))
        other = HEART.triangles.copy()
        other[0] = other[0] + 1
        with_nan = BEAT.frames[2].copy()
        with_nan[7] = np.nan
        wrong = [
            (meshes, mesh(BEAT.frames[2], other)),
            (clouds, cloud(with_nan, time.time())),
            (clouds, cloud(BEAT.frames[2][1:], time.time())),
        ]
        for publisher, message in wrong:
            self.publish(publisher, message)
            self.assertEqual(self.frames(1.0), 0)


if __name__ == "__main__":
    sys.exit(unittest.main())

"""A ROS 2 node that sends the surface of a topic to a controller.

    python3 surface_node.py heart.ply heart.dibs udp:192.168.1.20:5000

`/surface`, a PointCloud2, has the vertices of the tree's mesh in the order of its file, in metres (REP 103), and the
time of capture. `/surface_mesh`, a shape_msgs/Mesh, has triangles as well, which are compared with the tree's, but no
time. Axes must be those of the mesh's file: convert them first. A cloud that does not fit is refused with the cause,
and the receiver's surface ages. bindings/python/tests/test_ros2.py runs this if rclpy is installed.
"""

import sys

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.time import Time
from sensor_msgs.msg import PointCloud2, PointField
from shape_msgs.msg import Mesh

import dibs


def positions(cloud):
    """x, y and z of every point of a cloud, in metres."""
    offsets = [field.offset for name in "xyz" for field in cloud.fields if field.name == name]
    types = {field.datatype for field in cloud.fields if field.name in ("x", "y", "z")}
    if len(offsets) != 3 or types != {PointField.FLOAT32}:
        raise ValueError("the cloud has no x, y and z of float32")
    order = ">f4" if cloud.is_bigendian else "<f4"
    point = np.dtype({"names": ["x", "y", "z"], "formats": [order] * 3, "offsets": offsets, "itemsize": cloud.point_step})
    rows = np.frombuffer(bytes(cloud.data), np.uint8).reshape(cloud.height, cloud.row_step)
    rows = np.ascontiguousarray(rows[:, : cloud.width * cloud.point_step])
    points = rows.reshape(-1).view(point)
    return np.stack([points[name] for name in "xyz"], axis=1).astype(np.float64)


class SurfaceNode(Node):
    """Sends each surface as it arrives."""

    def __init__(self, tree, triangles, to, **choices):
        super().__init__("dibs_surface")
        self.sender = dibs.Sender(tree, to, unit="m", **choices)
        self.triangles = {tuple(sorted(corners)) for corners in triangles}
        self.create_subscription(PointCloud2, "surface", self.cloud, qos_profile_sensor_data)
        self.create_subscription(Mesh, "surface_mesh", self.mesh, qos_profile_sensor_data)
        self.create_timer(0.01, self.beat)

    def beat(self):
        """Sends heartbeats, and receives statuses."""
        try:
            self.sender.poll()
        except ConnectionError as error:
            self.get_logger().error(str(error), throttle_duration_sec=1.0)

    def cloud(self, cloud):
        """Sends a surface that has a time of capture."""
        age = (self.get_clock().now() - Time.from_msg(cloud.header.stamp)).nanoseconds * 1e-9
        self.send(lambda: positions(cloud), max(age, 0.0))

    def mesh(self, mesh):
        """Sends a surface that has triangles, but no time of capture: if it stops moving, it ages."""
        if not self.triangles <= {tuple(sorted(triangle.vertex_indices)) for triangle in mesh.triangles}:
            self.get_logger().error("another mesh: its triangles are not the tree's", throttle_duration_sec=1.0)
            return
        self.send(lambda: np.array([[at.x, at.y, at.z] for at in mesh.vertices]), None)

    def send(self, surface, age):
        try:
            self.sender.send(surface(), age=age)
        except (ValueError, ConnectionError) as error:
            self.get_logger().error(str(error), throttle_duration_sec=1.0)


def main():
    rclpy.init()
    mesh, tree, to = sys.argv[1:]
    mesh = dibs.read(mesh)
    node = SurfaceNode(dibs.Tree.load(tree), mesh.triangles, to)
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()


if __name__ == "__main__":
    main()

"""What goes to another process."""

import pickle
import tempfile
import unittest
from pathlib import Path

import dibs
import numpy as np

from subjects import spheres


def again(value):
    return pickle.loads(pickle.dumps(value))


class Pickle(unittest.TestCase):
    def setUp(self):
        self.mesh, self.motion = dibs.generate("heart", 320)
        self.tree = dibs.build(self.mesh, stretch=1.5)

    def test_a_mesh_keeps_its_repairs_and_its_tree(self):
        soup = self.mesh.vertices[self.mesh.triangles].reshape(-1, 3) + [5_000, 0, 0]
        corners = np.arange(len(soup)).reshape(-1, 3)
        inward = corners[:, ::-1]
        # Far from its file's origin, so that its positions are rounded; soup, turned inside out; in another unit.
        welded = dibs.Mesh(soup, corners)
        metres = dibs.Mesh(soup * 1e-3, corners, unit="m")
        for mesh in [self.mesh, welded, dibs.Mesh(soup, inward, orient=True), metres]:
            copy = again(mesh)
            np.testing.assert_array_equal(copy.vertices, mesh.vertices)
            np.testing.assert_array_equal(copy.triangles, mesh.triangles)
            np.testing.assert_array_equal(copy.origin, mesh.origin)
            self.assertEqual((copy.report, copy.warnings, copy.groups), (mesh.report, mesh.warnings, mesh.groups))
            self.assertEqual(dibs.build(copy).blob, dibs.build(mesh).blob)
        self.assertGreater(again(welded).report["position_error"], 0)
        self.assertEqual(again(metres).report["unit"], "m")

    def test_a_mesh_keeps_its_groups(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "heart.obj"
            corners = [f"v {x} {y} {z}" for x, y, z in self.mesh.vertices]
            faces = [f"f {a} {b} {c}" for a, b, c in self.mesh.triangles + 1]
            lines = [*corners, "g atria", *faces[:100], "g ventricles", *faces[100:]]
            path.write_text("\n".join(lines), encoding="utf-8")
            mesh = dibs.read(path, groups=True)
        copy = again(mesh)
        self.assertEqual([(group["name"], group["triangles"]) for group in copy.groups], [("atria", 100), ("ventricles", 220)])
        self.assertEqual(copy.groups, mesh.groups)
        np.testing.assert_array_equal(copy.labels, mesh.labels)
        self.assertEqual(len(np.unique(copy.labels)), 2)
        self.assertEqual(dibs.build(copy).blob, dibs.build(mesh).blob)

    def test_a_surface_is_that_of_its_moment(self):
        positions = np.array(self.motion.frames[3])
        flow = np.ones_like(positions)
        surface = self.tree.surface(positions, velocities=flow)
        before = surface.query(spheres(20))
        # The caller's buffer holds the next frame by now.
        positions += 100
        flow *= 2
        copy = again(surface)
        np.testing.assert_array_equal(copy.query(spheres(20)), before)
        np.testing.assert_array_equal(copy.contacts(spheres(20), 20).found, surface.contacts(spheres(20), 20).found)
        scene = dibs.Scene(each for each in [surface, self.tree])
        np.testing.assert_array_equal(again(scene).query(spheres(20)), scene.query(spheres(20)))

    def test_a_controllers_parts_begin_anew(self):
        tool = [0, 0, 115, 0, 0, 140, 2]
        commands = dibs.Filter(self.tree, 1.0, 300.0, approach=0.01)
        tracker = dibs.Tracker(self.tree)
        region = dibs.ForbiddenRegion(1.0, 0.002, max_force=5.0, margin=90.0)
        rest = self.tree.rest
        closest = tracker.closest(tool, rest)
        self.assertEqual(again(tracker).closest(tool, rest).fallback, "start")
        self.assertEqual(tracker.closest(tool, rest).fallback, None)
        np.testing.assert_array_equal(again(region).force(closest).force, region.force(closest).force)
        self.assertTrue(np.any(region.force(closest).force))
        command = dibs.RigidMotion([0, 0, 0], [0, 0, -100])
        admitted = [each.admit(tool, command, 0.001, rest) for each in (commands, again(commands))]
        self.assertEqual(repr(admitted[0]), repr(admitted[1]))
        guard = dibs.Guard(self.tree, speed_mm_per_s=300, age_ms=80, automatic=True)
        guard.frame(self.mesh.vertices, 0)
        while guard.work() == "pending":
            pass
        copy = again(guard)
        self.assertEqual(guard.closest(tool, 1).epoch, 1)
        self.assertEqual(copy.closest(tool, 1).epoch, None)

    def test_what_is_of_one_process_says_so(self):
        guard = dibs.Guard(self.tree, speed_mm_per_s=300, age_ms=80)
        bound = [
            guard.closest(None, 0),
            dibs.Tracker(self.tree).closest([0, 0, 115, 0, 0, 140, 2], self.tree.rest),
            dibs.Sender(self.tree),
            dibs.MotionStretch(self.mesh, self.motion.frames),
        ]
        for value in bound:
            with self.assertRaisesRegex(TypeError, f"{type(value).__name__}: it cannot be copied or pickled; (send|make)"):
                pickle.dumps(value)


if __name__ == "__main__":
    unittest.main()

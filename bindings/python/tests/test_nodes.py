"""Surfaces that the nodes of a volume move."""

import itertools
import unittest

import numpy as np

import dibs
from test_guard import SPHERE, Loop


def lattice(low, high, cells):
    """Nodes and tetrahedra of a box of cells, six to each."""
    axes = [np.linspace(low[i], high[i], cells[i] + 1) for i in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    size = np.array(cells) + 1

    def number(point):
        return (point[0] * size[1] + point[1]) * size[2] + point[2]

    tetrahedra = []
    for cell in itertools.product(*map(range, cells)):
        for order in itertools.permutations(range(3)):
            corners = [np.array(cell)]
            for axis in order:
                corners.append(corners[-1] + np.eye(3, dtype=int)[axis])
            four = [number(corner) for corner in corners]
            if order not in [(0, 1, 2), (1, 2, 0), (2, 0, 1)]:
                four[2], four[3] = four[3], four[2]
            tetrahedra.append(four)
    return nodes, np.array(tetrahedra)


class Nodes(unittest.TestCase):
    """A heart in a box of cells."""

    def setUp(self):
        self.mesh, _ = dibs.generate("heart", 1_000)
        vertices = self.mesh.vertices
        self.nodes, self.tetrahedra = lattice(vertices.min(0) - 1, vertices.max(0) + 1, (3, 3, 4))

    def build(self, **how):
        how = {"nodes": self.nodes, "tetrahedra": self.tetrahedra, **how}
        return dibs.build(self.mesh, **how)

    def test_nodes_move_the_surface(self):
        tree = self.build(stretch=1.3)
        self.assertEqual(tree.summary["volume"]["nodes"], len(self.nodes))
        plain = dibs.build(self.mesh, stretch=1.3)
        matrix = np.array([[1.05, 0.0, 0.1], [0.0, 0.98, 0.0], [0.0, 0.05, 1.0]])
        tools = [dibs.spheres((90.0, 10.0, 20.0), 5.0), dibs.spheres((0.0, 0.0, 150.0), 5.0)]
        for change in (np.eye(3), matrix):
            surface = tree.surface(self.nodes @ change.T)
            self.assertAlmostEqual(surface.stretch, np.linalg.svd(change)[1].max(), delta=1e-4)
            beside = plain.surface(self.mesh.vertices @ change.T)
            for tool in tools:
                one, other = surface.query(tool), beside.query(tool)
                np.testing.assert_allclose(one["separation"], other["separation"], atol=2e-3)
                self.assertTrue(np.all(one["coverage"] == dibs.Coverage.MEASURED))
        again = dibs.Tree(tree.blob).rest.query(tools[0])["separation"]
        np.testing.assert_array_equal(again, tree.query(tools[0])["separation"])

    def test_a_guard_takes_nodes(self):
        tree = self.build(stretch=1.3)
        matrix = np.array([[1.05, 0.0, 0.1], [0.0, 0.98, 0.0], [0.0, 0.05, 1.0]])
        moved = self.nodes @ matrix.T
        loop = Loop(tree, moved)
        answer = loop.run(1_200)
        self.assertEqual((answer.state, answer.reason), (dibs.State.NOMINAL, None))
        truth = tree.query(SPHERE, surface=moved)
        low, high = answer.closest["interval"]
        self.assertTrue(low <= truth["separation"] <= high)
        for wrong, why in [(moved * [1, 1, -1], "inverted or flat"), (moved * 1.5, "stretched by")]:
            with self.assertRaisesRegex(ValueError, why):
                Loop(tree, wrong).send()
            # After a good frame they come too fast, and the good one stays.
            with self.assertRaisesRegex(ValueError, "moved by"):
                loop.send(wrong)
            after = loop.tick()
            self.assertAlmostEqual(float(after.closest["separation"]), float(answer.closest["separation"]), places=2)

    def test_limits_of_each_tetrahedron(self):
        limits = np.full(len(self.tetrahedra), 1.5)
        limits[: len(limits) // 2] = 1.1
        tree = self.build(limits=limits)
        self.assertAlmostEqual(tree.summary["stretch"], 1.5, delta=1e-3)
        self.assertAlmostEqual(tree.rest.stretch, 1.0, places=6)
        with self.assertRaisesRegex(ValueError, r"is stretched by 1\.2\d*, the tree allows 1\.1\b"):
            tree.surface(self.nodes * [1.0, 1.0, 1.2])
        with self.assertRaisesRegex(ValueError, "limits"):
            self.build(limits=limits[:-1])

    def test_vertices_outside_are_bound(self):
        nodes = self.nodes * 0.97
        with self.assertRaisesRegex(ValueError, "bind vertices within that distance"):
            self.build(nodes=nodes, bind_within=0.01)
        tree = self.build(nodes=nodes, bind_within=3.0)
        self.assertGreater(tree.summary["volume"]["amplification"], 1.01)
        self.assertEqual(self.build().summary["volume"]["amplification"], 1.0)
        matrix = np.array([[1.05, 0.0, 0.1], [0.0, 0.98, 0.0], [0.0, 0.05, 1.0]])
        tool = dibs.spheres((90.0, 10.0, 20.0), 5.0)
        found = tree.surface(nodes @ matrix.T).query(tool)["separation"]
        truth = dibs.build(self.mesh).surface(self.mesh.vertices @ matrix.T).query(tool)["separation"]
        np.testing.assert_allclose(found, truth, atol=2e-2)

    def test_what_is_no_volume_is_refused(self):
        tree = self.build()
        for scale, why in [
            ([1, 1, 1.6], "is stretched by"),
            ([1, 1, -1], "inverted or flat"),
        ]:
            with self.assertRaisesRegex(ValueError, why):
                tree.surface(self.nodes * scale)
        with self.assertRaisesRegex(ValueError, "has 5 points and the tree has 80 nodes"):
            tree.surface(self.nodes[:5])
        with self.assertRaisesRegex(TypeError, "go together"):
            dibs.build(self.mesh, nodes=self.nodes)
        missing = self.tetrahedra.copy()
        missing[2, 1] = 80
        for wrong, why in [
            ({"tetrahedra": self.tetrahedra[:, :3]}, "N x 4 integers"),
            ({"tetrahedra": missing}, "number 2 has node 80, and there are 80"),
            ({"tetrahedra": self.tetrahedra[:, [1, 0, 2, 3]]}, "inverted at rest"),
            ({"nodes": self.nodes + 50.0}, "outside the volume"),
        ]:
            with self.assertRaisesRegex(ValueError, why):
                self.build(**wrong)


if __name__ == "__main__":
    unittest.main()

"""Chains, scenes, budgets and velocities, against trimesh and against one pair after another."""

import unittest

import numpy as np

import dibs
from oracle import distances, winding
from subjects import ASIDE, BEAT, HEART, OTHER, TREE, capsules, chains, spheres


def signed(points, vertices):
    """Distance from the surface, negative inside, by trimesh."""
    inside = winding(points, vertices, HEART.triangles) > 0.5
    return np.where(inside, -1, 1) * distances(points, vertices, HEART.triangles)


class Scenes(unittest.TestCase):
    def test_a_chain_of_spheres_in_a_scene_of_two_hearts(self):
        tools = spheres(90).reshape(30, 3, 4)
        # Some poses between the hearts, some in the second.
        tools[10:, :, :3] += ASIDE / 2
        tools[20:, :, :3] += ASIDE / 2
        shapes = [BEAT.frames[9], HEART.vertices + ASIDE]
        truth = np.stack([signed(tools[:, :, :3].reshape(-1, 3), shape).reshape(30, 3) for shape in shapes], axis=1)
        truth -= tools[:, np.newaxis, :, 3]
        closest = truth.reshape(30, -1).argmin(axis=1)
        answers = dibs.Scene([TREE.surface(BEAT.frames[9]), OTHER]).query(tools)
        np.testing.assert_allclose(answers["separation"], truth.min(axis=(1, 2)), atol=1e-3)
        np.testing.assert_array_equal(answers["surface"], closest // 3)
        np.testing.assert_array_equal(answers["tool"], closest % 3)
        self.assertEqual({0, 1}, set(answers["surface"]))
        self.assertEqual({0, 1, 2}, set(answers["tool"]))
        # Points are in the coordinates of the files, whatever the origin of the tree.
        for answer in answers:
            corners = shapes[answer["surface"]][answer["triangle"]]
            np.testing.assert_allclose(answer["barycentric"] @ corners, answer["point_on_surface"], atol=1e-3)

    def test_a_chain_is_the_closest_of_its_tools(self):
        tools = chains(300, 4)
        answers = TREE.query(tools)
        pairs = TREE.query(tools.reshape(-1, 7)).reshape(300, 4)
        closest = pairs[np.arange(300), pairs["separation"].argmin(axis=1)]
        for name in ["separation", "point_on_surface", "triangle", "side"]:
            np.testing.assert_array_equal(answers[name], closest[name], err_msg=name)
        np.testing.assert_array_equal(answers["lower"], pairs["lower"].min(axis=1))
        np.testing.assert_array_equal(answers["accuracy"], pairs["accuracy"].max(axis=1))
        np.testing.assert_array_equal(answers["node_tests"], pairs["node_tests"].sum(axis=1))
        self.assertEqual(TREE.query(tools[:0]).shape, (0,))
        self.assertEqual(dibs.Scene([TREE]).query(tools[0, 0]), pairs[0, 0])

    def test_contacts_of_all_pairs_are_in_one_list(self):
        tools = chains(200, 3)
        tools[:, :, :6] += np.tile(ASIDE / 2, 2)
        surfaces = [TREE.surface(BEAT.frames[3]), OTHER.rest]
        # A budget that some pairs exceed gives them bounds of their own.
        budget = 1_080
        found, bound, accuracy = dibs.Scene(surfaces).contacts(tools, 25, budget=budget)
        pairs = [[surface.contacts(tools[:, tool], 25, budget=budget) for tool in range(3)] for surface in surfaces]
        self.assertGreater(len(np.unique(found[["surface", "tool"]])), 5)
        for pose in range(200):
            expected = sorted(
                (contact["separation"], number, tool)
                for number, tools_of in enumerate(pairs)
                for tool, (contacts, *_) in enumerate(tools_of)
                for contact in contacts[contacts["pose"] == pose]
            )
            mine = found[found["pose"] == pose]
            self.assertEqual(expected, sorted(zip(mine["separation"], mine["surface"], mine["tool"])))
            self.assertTrue((np.diff(mine["separation"]) >= 0).all())
        least = np.min([one.bound for tools_of in pairs for one in tools_of], axis=0)
        np.testing.assert_array_equal(bound, least)
        most = np.max([one.accuracy for tools_of in pairs for one in tools_of], axis=0)
        np.testing.assert_array_equal(accuracy, most)
        self.assertTrue((0 < accuracy).any() and (accuracy < 1e-2).all())
        self.assertGreater(len(np.unique(least)), 3)

    def test_contacts_move_as_the_surface_does(self):
        velocities = (BEAT.frames[4] - BEAT.frames[3]) * BEAT.rate
        tools = capsules(200)
        still = TREE.contacts(tools, 12, surface=BEAT.frames[3]).found
        self.assertFalse(still["velocity"].any())
        found = TREE.surface(BEAT.frames[3], velocities=velocities).contacts(tools, 12).found
        corners = velocities[found["triangle"]]
        expected = np.einsum("pc,pci->pi", found["barycentric"], corners)
        self.assertGreater(np.linalg.norm(expected, axis=1).max(), 10)
        np.testing.assert_allclose(found["velocity"], expected, atol=1e-3)
        # The contact's place a frame later, by way of its corners.
        later = np.einsum("pc,pci->pi", found["barycentric"], BEAT.frames[4][found["triangle"]])
        reached = found["point_on_surface"] + found["velocity"] / BEAT.rate
        np.testing.assert_allclose(reached, later, atol=1e-2)


class Budgets(unittest.TestCase):
    def test_an_interval_holds_the_truth_however_small_the_budget(self):
        tools = spheres(60)
        truth = signed(tools[:, :3], BEAT.frames[9]) - tools[:, 3]
        surface = TREE.surface(BEAT.frames[9])
        widths = []
        for tests in [0, 5, 20, 80, 1_000_000]:
            answers = TREE.query(tools, surface, budget=tests)
            # The root is tested always, and a warm triangle comes on top.
            self.assertTrue((answers["node_tests"] + 8 * answers["triangle_tests"] <= tests + 9).all())
            # A side that the budget left open is none, and its separation that of a tool outside.
            known = answers["side"] != dibs.Side.UNDEFINED
            expected = np.where(known, truth, np.abs(truth + tools[:, 3]) - tools[:, 3])
            slack = answers["accuracy"] + 1e-3
            self.assertTrue((answers["lower"] <= expected + slack).all())
            self.assertTrue((expected <= answers["separation"] + slack).all())
            widths.append((answers["separation"] - answers["lower"]).mean())
        self.assertEqual(widths, sorted(widths, reverse=True))
        self.assertGreater(widths[1], 1)
        self.assertEqual(widths[-1], 0)
        np.testing.assert_array_equal(answers, TREE.query(tools, surface))
        # More than 32 bits hold is no limit.
        np.testing.assert_array_equal(answers, TREE.query(tools, surface, budget=10**12))

    def test_a_pair_that_is_cut_short_leaves_a_chain_open(self):
        tools = chains(100, 3)
        answers = TREE.query(tools, budget=180)
        pairs = TREE.query(tools.reshape(-1, 7), budget=180).reshape(100, 3)
        closest = pairs[np.arange(100), pairs["separation"].argmin(axis=1)]
        np.testing.assert_array_equal(answers["lower"], pairs["lower"].min(axis=1))
        short = [dibs.SIDE_REASONS[reason].startswith("the budget") for reason in range(len(dibs.SIDE_REASONS))]
        is_short = np.array(short)[pairs["side_reason"]].any(axis=1)
        self.assertTrue((is_short & (closest["side"] != dibs.Side.UNDEFINED)).any() and not is_short.all())
        np.testing.assert_array_equal(np.array(short)[answers["side_reason"]], is_short)

    def test_contacts_below_the_bound_are_all_listed(self):
        tools = capsules(300)
        whole = TREE.contacts(tools, 15).found
        found, bound, _ = TREE.contacts(tools, 15, budget=620)
        self.assertTrue((bound < 15).any() and np.isfinite(bound).any())
        # Inside, the only contact is the deepest pair. A budget that ends leaves its point open, but not its depth.
        pairs, short = TREE.query(tools), TREE.query(tools, budget=620)
        is_open = (short["side"] == dibs.Side.INSIDE) & (short["separation"] > pairs["separation"])
        self.assertTrue(is_open.any() and not is_open.all())
        for pose in range(300):
            certain = whole[(whole["pose"] == pose) & (whole["separation"] < bound[pose] - 1e-3)]
            mine = found[found["pose"] == pose]
            if is_open[pose]:
                self.assertEqual(len(mine), 1)
                self.assertTrue((mine["separation"] <= certain["separation"] + 1e-3).all())
                continue
            for contact in certain:
                apart = np.linalg.norm(mine["point_on_surface"] - contact["point_on_surface"], axis=1)
                self.assertLess(apart.min(), 1e-2)


if __name__ == "__main__":
    unittest.main()

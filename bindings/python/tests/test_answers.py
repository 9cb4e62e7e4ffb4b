"""Answers against trimesh and scipy, which share no code with dibs."""

import itertools
import pathlib
import pickle
import threading
import time
import unittest

import numpy as np
import scipy.optimize
import scipy.spatial
import trimesh

import dibs
from oracle import distances, winding
from subjects import BEAT, HEART, TREE, capsules, poses, spheres


class Answers(unittest.TestCase):
    def check(self, answers, truth, radii):
        error = np.abs(answers["axis_distance"] - truth)
        self.assertTrue((error <= answers["accuracy"] + 1e-6).all(), error.max())
        outside = answers["side"] == dibs.Side.OUTSIDE
        np.testing.assert_allclose(
            answers["separation"][outside], (truth - radii)[outside], atol=1e-3
        )

    def test_spheres_on_rest_and_moving_surface(self):
        tools = spheres(60)
        for positions in [HEART.vertices, BEAT.frames[9], BEAT.frames[16]]:
            truth = distances(tools[:, :3], positions, HEART.triangles)
            answers = TREE.query(tools, surface=positions)
            self.check(answers, truth, tools[:, 3])
            inside = winding(tools[:, :3], positions, HEART.triangles) > 0.5
            self.assertTrue(inside.any() and not inside.all())
            np.testing.assert_array_equal(answers["side"] == dibs.Side.INSIDE, inside)
            np.testing.assert_array_equal(answers["side"] == dibs.Side.OUTSIDE, ~inside)
            np.testing.assert_allclose(
                answers["separation"][inside], (-truth - tools[:, 3])[inside], atol=1e-3
            )

    def test_capsules(self):
        tools = capsules(8)
        answers = TREE.query(tools)
        self.assertIn(dibs.Side.CROSSING, answers["side"])
        seen = 0
        for tool, answer in zip(tools, answers):
            start, way = tool[:3], tool[3:6] - tool[:3]
            at = lambda share: distances([start + share * way], HEART.vertices, HEART.triangles)[0]
            shares = np.linspace(0, 1, 101)
            coarse = distances(start + shares[:, np.newaxis] * way, HEART.vertices, HEART.triangles)
            # A distance changes by at most as much as its point moves.
            near = coarse <= coarse.min() + np.linalg.norm(way) / 100
            best = coarse.min()
            for share in shares[near]:
                bounds = (max(share - 0.01, 0), min(share + 0.01, 1))
                found = scipy.optimize.minimize_scalar(
                    at, bounds=bounds, method="bounded", options={"xatol": 1e-7}
                )
                best = min(best, found.fun)
            if answer["side"] == dibs.Side.CROSSING:
                self.assertLess(best, 1e-3)
                continue
            seen += 1
            self.assertAlmostEqual(answer["axis_distance"], best, delta=answer["accuracy"] + 1e-4)
        self.assertGreater(seen, 3)

    def test_many_poses_lie_between_the_bounds_of_a_k_d_tree(self):
        tools = spheres(20_000, seed=3)
        for positions in [BEAT.frames[0], BEAT.frames[12]]:
            answers = TREE.query(tools, surface=positions)
            nearest, _ = scipy.spatial.cKDTree(positions).query(tools[:, :3])
            self.assertTrue((answers["axis_distance"] <= nearest + answers["accuracy"]).all())
            corners = positions[HEART.triangles]
            edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
            self.assertTrue((answers["axis_distance"] >= nearest - edge).all())

    def test_points_triangles_and_weights_agree(self):
        tools = spheres(500)
        answers = TREE.query(tools, surface=BEAT.frames[5])
        self.assertTrue((answers["lower"] <= answers["separation"]).all())
        known = {tuple(sorted(corners)) for corners in HEART.triangles.tolist()}
        self.assertTrue(all(tuple(sorted(corners)) in known for corners in answers["triangle"].tolist()))
        corners = BEAT.frames[5][answers["triangle"]]
        points = np.einsum("pc,pci->pi", answers["barycentric"], corners)
        np.testing.assert_allclose(points, answers["point_on_surface"], atol=1e-3)
        apart = np.linalg.norm(tools[:, :3] - answers["point_on_surface"], axis=1)
        np.testing.assert_allclose(apart, answers["axis_distance"], atol=1e-3)

    def test_far_from_the_origin_nothing_is_lost(self):
        far = np.array([4e6, -3e6, 5e5])
        tree = dibs.build(HEART.vertices + far, HEART.triangles, stretch=1.5)
        self.assertTrue(np.any(tree.origin != 0))
        tools = spheres(300)
        near = TREE.query(tools, surface=BEAT.frames[7])
        tools[:, :3] += far
        moved = tree.query(tools, surface=BEAT.frames[7] + far)
        np.testing.assert_allclose(moved["separation"], near["separation"], atol=2e-4)
        np.testing.assert_allclose(
            moved["point_on_surface"] - far, near["point_on_surface"], atol=2e-2
        )

    def test_contacts_begin_with_the_closest_pair(self):
        tools = capsules(200)
        contacts = TREE.contacts(tools, 12, surface=BEAT.frames[3])
        answers = TREE.query(tools, surface=BEAT.frames[3])
        # Where the axis crosses, another part of it may be inside, less deep.
        crossing = answers["side"] == dibs.Side.CROSSING
        self.assertTrue((contacts.bound >= 12)[~crossing].all())
        self.assertTrue((contacts.found["separation"] <= 12).all())
        apart = (answers["side"] == dibs.Side.OUTSIDE) & (answers["separation"] < 12)
        self.assertGreater(apart.sum(), 10)
        for pose in np.flatnonzero(apart):
            of_pose = contacts.found[contacts.found["pose"] == pose]
            least = of_pose["separation"].min()
            self.assertAlmostEqual(least, answers[pose]["separation"], delta=1e-3)
            self.assertTrue((np.diff(of_pose["separation"]) >= 0).all())

    def test_without_a_side_the_distance_is_that_of_the_nearest_triangle(self):
        outside = [100.0, 10.0, 30.0, 5.0]
        near = TREE.query(outside)
        within = [*(near["point_on_surface"] - 3.0 * near["direction"]), 5.0]
        for surface in [TREE, TREE.rest, dibs.Scene([TREE])]:
            inside, plain = (surface.query(within, signed=signed) for signed in [True, False])
            self.assertEqual((inside["side"], plain["side"]), (dibs.Side.INSIDE, dibs.Side.UNDEFINED))
            self.assertLess(inside["separation"], -5.0)
            self.assertAlmostEqual(plain["separation"], -inside["separation"] - 10.0, places=3)
            one, other = (surface.query(outside, signed=signed)["separation"] for signed in [True, False])
            self.assertEqual(one, other)

    def test_the_direction_is_the_gradient(self):
        at, step = np.array([100.0, 10.0, 30.0]), 1e-2
        gradient = [
            (TREE.query([*(at + way), 2.0])["separation"] - TREE.query([*(at - way), 2.0])["separation"]) / (2 * step)
            for way in step * np.eye(3)
        ]
        np.testing.assert_allclose(TREE.query([*at, 2.0])["direction"], gradient, atol=2e-2)

    def test_labels_follow_their_triangles(self):
        labels = np.arange(len(HEART.triangles)) % 250
        tree = dibs.build(HEART, labels=labels)
        answers = tree.query(spheres(300))
        row = {tuple(sorted(t)): label for t, label in zip(HEART.triangles.tolist(), labels)}
        expected = [row[tuple(sorted(corners))] for corners in answers["triangle"].tolist()]
        np.testing.assert_array_equal(answers["label"], expected)
        self.assertTrue((TREE.query(spheres(3))["label"] == -1).all())

    def test_every_field_is_described(self):
        lines = pathlib.Path(dibs._tree.__file__).read_text(encoding="utf-8").splitlines()
        start = lines.index("CONTACT = _dtype(_dibs.CONTACT)")
        of_contact = " ".join(itertools.takewhile(lambda line: not line.endswith('"""'), lines[start + 2 :]))
        for dtype, described in [(dibs.ANSWER, dibs.Tree.query.__doc__), (dibs.CONTACT, of_contact)]:
            for field in dtype.names:
                self.assertIn(f"`{field}`", described)

    def test_one_row_many_and_none(self):
        tools = spheres(300)
        answers = TREE.query(tools)
        single = TREE.query(tools[7])
        self.assertEqual(single.dtype, dibs.ANSWER)
        self.assertEqual(single, answers[7])
        self.assertEqual(TREE.query(tools[:0]).shape, (0,))
        found, bound, accuracy = TREE.contacts(tools[:0], 5)
        self.assertEqual((len(found), len(bound), len(accuracy)), (0, 0, 0))
        answers["separation"] = 0

    def test_another_librarys_mesh_is_taken_as_it_is(self):
        other = trimesh.Trimesh(HEART.vertices, HEART.triangles, process=False)
        self.assertEqual(dibs.build(other).blob, dibs.build(HEART.vertices, HEART.triangles).blob)
        self.assertEqual(dibs.build(other, unit="m").summary["unit"], "m")
        with self.assertRaisesRegex(TypeError, "groups are of a file"):
            dibs.build(other, groups=True)

    def test_a_tree_survives_pickle_and_file(self):
        again = pickle.loads(pickle.dumps(TREE))
        self.assertEqual(again.blob, TREE.blob)
        np.testing.assert_array_equal(again.query(spheres(9)), TREE.query(spheres(9)))
        self.assertEqual(again.summary["triangles"], 1_000)

    def test_python_runs_while_a_batch_is_answered(self):
        tools = spheres(200_000, seed=5)
        ended = threading.Event()
        batch = threading.Thread(target=lambda: (TREE.query(tools), ended.set()))
        turns = 0
        batch.start()
        # Behind a held lock this loop would get its first turn when the batch has ended.
        while not ended.is_set():
            time.sleep(0.001)
            turns += 1
        batch.join()
        self.assertGreater(turns, 10)


class Stretch(unittest.TestCase):
    def test_it_is_the_largest_singular_value(self):
        needed = dibs.MotionStretch(HEART, BEAT.frames)

        def in_plane(corners):
            along, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
            length = np.linalg.norm(along, axis=1)
            x = np.einsum("ti,ti->t", along, other) / length
            y = np.linalg.norm(other - (x / length)[:, np.newaxis] * along, axis=1)
            return np.stack([np.stack([length, x], 1), np.stack([0 * x, y], 1)], 1)

        rest = np.linalg.inv(in_plane(HEART.vertices[HEART.triangles]))
        stretch = np.array(
            [
                np.linalg.norm(in_plane(frame[HEART.triangles]) @ rest, ord=2, axis=(1, 2))
                for frame in BEAT.frames
            ]
        )
        np.testing.assert_allclose(needed.stretch, stretch.max(axis=0), rtol=1e-5)
        np.testing.assert_allclose(
            stretch[needed.frame, np.arange(len(needed.frame))], needed.stretch, rtol=1e-5
        )
        limits = needed.limits(0.1)
        # No corner of the heart is sharp, so the check rounds by little more than its least.
        least = np.maximum(needed.stretch, 1) * 1.1 * 1.0006
        self.assertTrue((limits >= least).all())
        np.testing.assert_allclose(limits, least, rtol=1e-4)
        tree = dibs.build(HEART, limits=limits)
        measured = [tree.stretch(frame) for frame in BEAT.frames]
        self.assertLess(max(measured), tree.summary["stretch"])
        # Smaller spheres, the same answers.
        tools = spheres(300)
        mine = tree.query(tools, surface=BEAT.frames[8])["separation"]
        np.testing.assert_allclose(
            mine, TREE.query(tools, surface=BEAT.frames[8])["separation"], atol=1e-4
        )


if __name__ == "__main__":
    unittest.main()

"""Ticks within a budget, and commands that a filter admits."""

import runpy
import unittest

import numpy as np

import dibs
from subjects import ASIDE, BEAT, HEART, OTHER, ROOT, TREE, WithProgram

PERIOD = 0.001
# The side that a shaft is pushed into is a vessel.
_IS_VESSEL = (HEART.vertices[HEART.triangles][..., 0] > 0).all(axis=1)
LABELLED = dibs.build(HEART, labels=2 * _IS_VESSEL.astype(np.uint8))
TOOL = np.array([95.0, 3.0, 60.0, 95.0, 80.0, 90.0, 2.5])


def shaft(tick):
    """Pushed into the side of the heart."""
    return TOOL - np.array([0.1, 0, 0, 0.1, 0, 0, 0]) * tick


class Trackers(unittest.TestCase):
    def test_a_tick_is_the_query_and_a_budget_keeps_the_side(self):
        whole, limited, contacts = dibs.Tracker(TREE), dibs.Tracker(TREE), 0
        kept, wide = 0, 0
        for tick in range(600):
            surface = TREE.surface(BEAT.frames[tick // 40])
            truth = TREE.query(shaft(tick), surface=surface)
            low, high = truth["interval"]
            found = whole.closest(shaft(tick), surface, margin=6.0)
            self.assertTrue(found.closest["interval"][0] <= high and found.closest["interval"][1] >= low)
            self.assertEqual(found.closest["side"], truth["side"])
            self.assertEqual((found.is_kept, found.fallback), (False, "start" if tick == 0 else None))
            listed = TREE.contacts(shaft(tick), 6.0, surface=surface)
            self.assertAlmostEqual(found.contacts.bound[0], listed.bound[0], delta=0.2)
            if truth["side"] == dibs.Side.OUTSIDE:
                self.assertEqual(len(found.contacts.found), len(listed.found))
            contacts += len(listed.found)
            cut = limited.closest(shaft(tick), surface, instructions=20_000)
            self.assertTrue(cut.closest["interval"][0] <= high and cut.closest["interval"][1] >= low, tick)
            if tick > 100:
                self.assertNotEqual(cut.closest["side"], dibs.Side.UNDEFINED)
            kept += cut.is_kept
            wide += cut.closest["separation"] - cut.closest["lower"] > 0.2
        self.assertGreater(contacts, 100)
        self.assertGreater(min(kept, wide), 5)
        self.assertAlmostEqual(found.moved, 0.1, places=3)

    def test_a_wall_acts_on_a_trackers_answer(self):
        wall = dibs.ForbiddenRegion(stiffness=1.0, damping=0.002, max_force=5.0, margin=5.0)
        found = dibs.Tracker(TREE).closest(shaft(350), TREE)
        still, moving = wall.force(found), wall.force(found, [-100.0, 0.0, 0.0])
        self.assertEqual(still.state, dibs.ForceState.SATURATED if still.force @ still.force > 24 else dibs.ForceState.ACTIVE)
        self.assertGreater(still.force @ found.closest["direction"], 0)
        self.assertGreaterEqual(np.linalg.norm(moving.force), np.linalg.norm(still.force))


class Filters(WithProgram):
    def test_commands_are_those_of_the_program(self):
        """The same path as `dibs filter`'s, on a surface that does not move."""
        commands = [shaft(tick) for tick in range(700)]
        text = "".join("capsule:" + ",".join(map(str, command)) + "\n" for command in commands)
        (self.folder / "commands.csv").write_text(text, encoding="utf-8")
        np.save(self.folder / "still.npy", np.array([HEART.vertices] * 2))
        lines = self.lines(
            "filter", "heart.dibs", "--motion", "still.npy", "--motion-rate", "1", "--path", "commands.csv", "--stand-off", "1",
            "--json",
        )  # fmt: skip
        guard, tool = dibs.Filter(TREE, 1.0, 1_001.0), commands[0]
        surface = TREE.surface(HEART.vertices)
        reasons = set()
        for command, line in zip(commands, lines):
            motion = dibs.RigidMotion(tool[:3], command[:3] - tool[:3])
            admitted = guard.admit(tool, motion, PERIOD, surface)
            self.assertEqual(admitted.reason, line["reason"])
            self.assertAlmostEqual(admitted.least_separation, line["least_separation"], places=2)
            self.assertTrue(admitted.queries >= 1 and admitted.instructions <= 200_000)
            tool = command if admitted.reason == "commanded" else admitted.motion.apply(tool)
            expected = [float(number) for number in line["admitted"].split(":")[1].split(",")]
            np.testing.assert_allclose(tool, expected, atol=2e-2)
            reasons.add(admitted.reason)
        self.assertEqual(reasons, {"commanded", "nearest"})

    def test_a_hand_does_not_get_in(self):
        simulate = runpy.run_path(str(ROOT / "examples/python/closed_loop.py"))["simulate"]
        least, unfiltered, reasons, instructions = simulate(1_000)
        self.assertGreater(least, 0.98)
        self.assertLess(unfiltered, -10)
        self.assertGreater(reasons["nearest"], 100)
        self.assertGreater(reasons["commanded"], 100)
        self.assertEqual(reasons["no safe motion"], 0)
        self.assertLessEqual(instructions, 200_000)

    def test_a_chain_turns_and_keeps_rows(self):
        guard, chain = dibs.Filter(OTHER, 1.0, 400.0), np.array([TOOL, [95, 80, 90, 140, 90, 120, 4.0]])
        chain[:, :3] += ASIDE
        chain[:, 3:6] += ASIDE
        axis = np.linalg.norm(chain[0, :3] - chain[0, 3:6])
        for tick in range(400):
            command = dibs.RigidMotion(chain[0, 3:6], [-0.2, 0, -0.05], [0, 0.001, 0.0005])
            # The reference point does not sink.
            admitted = guard.admit(chain, command, PERIOD, OTHER, rows=[[0, 0, 1, 0, 0, 0, 0]])
            self.assertGreaterEqual(admitted.motion.translation[2], -1e-3)
            self.assertGreater(admitted.least_separation, 0.98)
            chain = admitted.motion.apply(chain)
        self.assertAlmostEqual(np.linalg.norm(chain[0, :3] - chain[0, 3:6]), axis, places=9)
        self.assertLess(chain[0, 0] - ASIDE[0], 90)
        self.assertGreater(OTHER.query(chain)["lower"].min(), 0.98)

    def test_a_label_has_a_larger_stand_off(self):
        """The side that the shaft is pushed into is a vessel."""

        def least(of):
            guard, tool, nearest = dibs.Filter(LABELLED, 1.0, 200.0, stand_off_of=of), TOOL, np.inf
            for _ in range(400):
                admitted = guard.admit(tool, dibs.RigidMotion(tool[:3], [-0.1, 0, 0]), PERIOD, LABELLED)
                self.assertNotEqual(admitted.reason, "no safe motion")
                nearest = min(nearest, admitted.least_separation)
                tool = admitted.motion.apply(tool)
            return nearest

        self.assertEqual(least({}), least({0: 3.0}))
        self.assertAlmostEqual(least({}), 1.0, delta=0.02)
        self.assertAlmostEqual(least({2: 3.0}), 3.0, delta=0.05)

    def test_a_start_inside_is_said(self):
        guard = dibs.Filter(TREE, 1.0, 200.0)
        inside = [56, 3, 60, 56, 3, 61, 2]
        admitted = guard.admit(inside, dibs.RigidMotion(inside[:3]), PERIOD, TREE)
        self.assertEqual(admitted.reason, "no safe motion")
        self.assertLess(admitted.least_separation, 0)
        beyond = dibs.Filter(TREE, 1e6, 200.0)
        admitted = beyond.admit(TOOL, dibs.RigidMotion(TOOL[:3], [0.1, 0, 0]), PERIOD, TREE)
        self.assertEqual(admitted.reason, "no safe motion")
        starved = dibs.Filter(TREE, 1.0, 200.0, instructions=0)
        admitted = starved.admit(TOOL, dibs.RigidMotion(TOOL[:3], [0.1, 0, 0]), PERIOD, TREE)
        self.assertEqual((admitted.reason, admitted.motion.translation.tolist()), ("no safe motion", [0, 0, 0]))

    def test_wrong_arguments_are_named(self):
        guard, tracker = dibs.Filter(TREE, 1.0, 200.0), dibs.Tracker(TREE)
        motion, nan = dibs.RigidMotion(TOOL[:3]), float("nan")
        admit = guard.admit
        for name, error, call in [
            ("tree", TypeError, lambda: dibs.Filter(HEART, 1, 200)),
            ("tree", TypeError, lambda: dibs.Tracker(None)),
            ("stand_off", ValueError, lambda: dibs.Filter(TREE, -1, 200)),
            ("stand_off", ValueError, lambda: dibs.Filter(TREE, nan, 200)),
            ("stand_off", ValueError, lambda: dibs.Filter(TREE, 1e300, 200)),
            ("stand_off_of", TypeError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of=[(2, 3)])),
            ("stand_off_of", ValueError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of={256: 3})),
            ("stand_off_of[2]", ValueError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of={2: 0.5})),
            ("stand_off_of[2]", ValueError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of={2: nan})),
            ("stand_off_of", ValueError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of={at: 3 for at in range(8)})),
            ("stand_off_of", ValueError, lambda: dibs.Filter(TREE, 1, 200, stand_off_of={2: 3})),
            ("stand_off_of", ValueError, lambda: dibs.Filter(LABELLED, 1, 200, stand_off_of={2: 3, 3: 3})),
            ("speed", ValueError, lambda: dibs.Filter(TREE, 1, 0)),
            ("speed", TypeError, lambda: dibs.Filter(TREE, 1, "fast")),
            ("lever", ValueError, lambda: dibs.Filter(TREE, 1, 200, lever=0.5)),
            ("approach", ValueError, lambda: dibs.Filter(TREE, 1, 200, approach=-0.1)),
            ("instructions", ValueError, lambda: dibs.Filter(TREE, 1, 200, instructions=-1)),
            ("instructions", TypeError, lambda: tracker.closest(TOOL, TREE, instructions=0.5)),
            ("margin", ValueError, lambda: tracker.closest(TOOL, TREE, margin=-1)),
            ("tool", ValueError, lambda: tracker.closest([TOOL], TREE)),
            ("tool", ValueError, lambda: tracker.closest([0, 0, 0, -1], TREE)),
            ("surface", TypeError, lambda: tracker.closest(TOOL, HEART)),
            ("surface", ValueError, lambda: tracker.closest(TOOL, OTHER)),
            ("surface", ValueError, lambda: admit(TOOL, motion, PERIOD, OTHER)),
            ("tools", ValueError, lambda: admit([0, 0, 0, 1], motion, PERIOD, TREE)),
            ("tools", ValueError, lambda: admit([TOOL] * 9, motion, PERIOD, TREE)),
            ("tools", ValueError, lambda: admit([*TOOL[:6], -1], motion, PERIOD, TREE)),
            ("tools", ValueError, lambda: admit([*TOOL[:6], nan], motion, PERIOD, TREE)),
            ("command", TypeError, lambda: admit(TOOL, [0.1, 0, 0], PERIOD, TREE)),
            ("command.translation", ValueError, lambda: admit(TOOL, dibs.RigidMotion([0, 0, 0], [nan, 0, 0]), PERIOD, TREE)),
            ("command.rotation", ValueError, lambda: admit(TOOL, dibs.RigidMotion([0] * 3, [0] * 3, [1]), PERIOD, TREE)),
            ("command", ValueError, lambda: admit(TOOL, dibs.RigidMotion([0, 0, 0], [1e300, 0, 0]), PERIOD, TREE)),
            ("period", ValueError, lambda: admit(TOOL, motion, 0, TREE)),
            ("period", ValueError, lambda: admit(TOOL, motion, nan, TREE)),
            ("tissue_speed", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, tissue_speed=-1)),
            ("error", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, error=nan)),
            ("error", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, error=1e300)),
            ("rows", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, rows=[[1, 2]])),
            ("rows", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, rows=[[0] * 7] * 9)),
            ("rows", ValueError, lambda: admit(TOOL, motion, PERIOD, TREE, rows=[[nan] * 7])),
            ("velocity", ValueError, lambda: WALL.force(tracker.closest(TOOL, TREE), [1, 2])),
        ]:
            with self.subTest(name), self.assertRaises(error) as raised:
                call()
            sentence = str(raised.exception)
            self.assertTrue(sentence.startswith(name + ":"), sentence)
            self.assertNotRegex(sentence, "--|`dibs")


WALL = dibs.ForbiddenRegion(stiffness=1.0, damping=0.002, max_force=5.0, margin=5.0)

if __name__ == "__main__":
    unittest.main()

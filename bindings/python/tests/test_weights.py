"""Frames of weights: a guard's answers are those of the positions that docs/format.md says."""

import struct
import unittest

import numpy as np

import dibs
from subjects import TREE, WithProgram

SPHERE = [100.0, 0.0, 30.0, 2.5]
POSE = ([0.0, 0.0, 0.6, 0.8], [20.0, -3.0, 5.0])


class Modes:
    """The modes in a tree's bytes."""

    def __init__(self, blob):
        width, (vertices,) = blob[6], struct.unpack_from("<I", blob, 12)
        (sections,) = struct.unpack_from("<I", blob, 48)
        rows = [struct.unpack_from("<3I", blob, 80 + 12 * number) for number in range(sections)]
        at = {kind: offset for kind, offset, _ in rows}
        self.order = np.frombuffer(blob, f"<u{width}", vertices, at[3])
        self.rest = np.frombuffer(blob, "<f4", 3 * vertices, at[4]).reshape(-1, 3)
        count, anchors, self.unit, self.error = struct.unpack_from("<2H2f", blob, at[7])
        records = np.frombuffer(blob, "<f4", 4 * count, at[7] + 32).reshape(-1, 4)
        self.low, self.high, self.gain, _ = records.T
        start = at[7] + 32 + 16 * count + anchors * (4 * count + 8)
        self.moves = np.frombuffer(blob, "<i2", 3 * count * vertices, start).reshape(vertices, count, 3)

    def positions(self, weights):
        """In the order of the mesh's file."""
        gains = np.trunc(np.float32(weights) * self.gain).astype(np.int64)
        sums = (gains[np.newaxis, :, np.newaxis] * self.moves >> 16).sum(axis=1)
        rows = self.rest + sums.astype(np.float32) * np.float32(self.unit)
        of_file = np.empty_like(rows)
        of_file[self.order] = rows
        return of_file


class Weights(WithProgram):
    def setUp(self):
        super().setUp()
        self.dibs("generate", "heart", "--triangles", "1000", "-o", "heart.ply", "--motion", "heart.pc2")
        self.dibs(*"build heart.ply -o heart.dibs --stretch 1.5 --motion heart.pc2 --modes 2".split())
        self.tree = dibs.Tree.load(self.folder / "heart.dibs")
        self.modes = Modes(self.tree.blob)

    def guard(self):
        return dibs.Guard(self.tree, 3_000.0, 80, automatic=True, without_transit=True)

    def answers(self, send, pose):
        """Of each tick, on a surface that moves."""
        guard = self.guard()
        for now in range(1_000, 2_600):
            if now % 30 == 10:
                send(guard, self.modes.high * 0.8 * np.sin(0.005 * now) ** 2, now, pose)
                while guard.work() == "pending":
                    pass
            yield guard.closest(SPHERE, now)
        self.assertEqual(guard.counters["published"], 54)

    def test_answers_are_those_of_the_positions(self):
        def by_weights(guard, weights, now, pose):
            guard.frame_of_weights(weights, now, captured=now - 3, pose=pose)

        def by_positions(guard, weights, now, pose):
            guard.frame(self.modes.positions(weights), now, captured=now - 3, pose=pose)

        self.assertGreater(self.modes.error, 0)
        for pose in (None, POSE):
            compared = 0
            for one, other in zip(self.answers(by_weights, pose), self.answers(by_positions, pose)):
                self.assertEqual((one.epoch, one.age, one.state), (other.epoch, other.age, other.state))
                if one.closest is None:
                    self.assertIsNone(other.closest)
                    continue
                compared += 1
                for field in ("separation", "side", "point_on_surface", "triangle"):
                    np.testing.assert_array_equal(one.closest[field], other.closest[field])
                wider = float(one.closest["accuracy"]) - float(other.closest["accuracy"])
                # An extrapolation by up to two intervals has five times a frame's own.
                self.assertTrue(0.99 * self.modes.error < wider < 5.01 * self.modes.error, wider)
            self.assertGreater(compared, 400)

    def test_wrong_weights_are_refused(self):
        guard = self.guard()
        good = self.modes.high * 0.5
        guard.frame_of_weights(good, 1_000)
        while guard.work() == "pending":
            pass
        beyond = np.float64([good[0], self.modes.high[1] * 1.01])
        for weights, sentence, event in [
            (good[:1], "1 weights for a surface of 2 modes", "row count"),
            (beyond, "of mode 1 is out of its range", "too far"),
        ]:
            with self.assertRaisesRegex(ValueError, sentence):
                guard.frame_of_weights(weights, 1_010)
            self.assertEqual(guard.counters[event], 1)
        for weights, error in [([0.0, np.nan], ValueError), ([[0.0, 0.0]], ValueError), ("ab", TypeError)]:
            with self.assertRaisesRegex(error, "weights: "):
                guard.frame_of_weights(weights, 1_010)
        with self.assertRaisesRegex(ValueError, "the quaternion|is no rotation"):
            guard.frame_of_weights(good, 1_010, pose=([0.0, 0.0, 0.0, 1.1], [0.0, 0.0, 0.0]))
        self.assertEqual((guard.closest(SPHERE, 1_010).epoch, guard.work()), (1, "idle"))
        plain = dibs.Guard(TREE, 300.0, 80)
        with self.assertRaisesRegex(ValueError, "without modes"):
            plain.frame_of_weights(good, 1_000)


if __name__ == "__main__":
    unittest.main()

"""Tests of the counts and of the truth: `python -m unittest discover -s tests/peers`."""

import pathlib
import tempfile
import unittest
from fractions import Fraction

import numpy as np

import cases
import exact
import points
import run
import score
import subjects
import truth


class Truth(unittest.TestCase):
    def test_distances_are_those_of_rational_numbers(self):
        for subject in [subjects.needles(12), subjects.sheet(), subjects.folds()]:
            asked, frame = points.points_of(subject, 8)[-1], subject.frames[-1]
            found = truth.truth(asked, frame, subject.triangles).distance
            allowed = truth.ERROR * np.abs(frame).max()
            for point, distance in zip(asked, found):
                square = min(_square(point, frame[face]) for face in subject.triangles)
                self.assertLess(abs(float(square) ** 0.5 - distance), allowed, subject.name)

    def test_sides_are_those_of_whole_numbers(self):
        for subject in [subjects.needles(12), subjects.spikes(), subjects.folds()]:
            asked, frame = points.points_of(subject, 20)[-1], subject.frames[-1]
            found = truth.truth(asked, frame, subject.triangles)
            whole = [exact.winding(point, frame, subject.triangles) for point in asked]
            self.assertEqual([None if on else way for way, on in zip(found.winding, found.on_surface)], whole)
            self.assertTrue({0, 1} <= set(whole), subject.name)

    def test_points_on_the_surface_have_no_side(self):
        four = subjects.tetrahedron()
        asked = np.array([[0, 0, 0], [5, 0, 0], [2, 0, 3], [1, 1, 1], [2, -(2.0**-40), 3]])
        self.assertEqual(truth.truth(asked, four.frames[0], four.triangles).side.tolist(), [0, 0, 0, -1, 1])

    def test_a_ray_through_an_edge_is_not_counted_twice(self):
        four = subjects.tetrahedron()
        asked = np.array([-1.0, 1.0, 0.5])
        self.assertEqual(exact.winding(asked, four.frames[0], four.triangles), 0)
        self.assertEqual(exact.winding(asked + [2, 0, 0], four.frames[0], four.triangles), 1)


class Counts(unittest.TestCase):
    def setUp(self):
        seed = np.random.default_rng(1)
        self.distance, self.side = seed.uniform(0.01, 10, (5, 2_000)), seed.choice([-1, 1], (5, 2_000))
        self.case = score.Case(100.0, self.distance, self.side, np.zeros((5, 2_000), bool))

    def counts(self, distance, side):
        answers = {"distance": distance, "side": side, "accuracy": np.full(side.shape, 1e-6), "refused": []}
        return score.score(self.case, answers)

    def test_a_side_turned_in_a_thousand_is_counted(self):
        self.assertEqual(self.counts(self.distance, self.side)["wrong sides"], 0)
        turned = self.side.copy()
        turned[:, ::1_000] *= -1
        found = self.counts(self.distance, turned)
        self.assertEqual(found["wrong sides"] * 1_000, found["clear"])
        self.assertEqual(found["farthest wrong side"], self.distance[:, ::1_000].max())

    def test_the_band_is_counted_apart(self):
        self.distance[0, :10] = score.BAND * 100 / 2
        turned = self.side.copy()
        turned[0, :15] *= -1
        found = self.counts(self.distance, turned)
        self.assertEqual([found["wrong sides"], found["wrong in band"], found["in band"]], [5, 10, 10])

    def test_distances_are_held_to_the_accuracy(self):
        off = self.distance.copy()
        off[1, :7] += 1.1e-6
        off[2, :7] -= 0.9e-6
        off[3, :7] = np.nan
        found = self.counts(off, self.side)
        self.assertEqual([found["wrong distances"], found["distances"]], [7, self.side.size - 7])
        self.assertAlmostEqual(found["largest error"], 1.1e-6)

    def test_no_side_is_not_a_wrong_one(self):
        side = self.side.copy()
        side[0, :3] = 0
        found = self.counts(self.distance, side)
        self.assertEqual([found["wrong sides"], found["no side"]], [0, 3])


class Runs(unittest.TestCase):
    def test_planted_sides_are_found_and_failures_have_a_reason(self):
        with tempfile.TemporaryDirectory() as name:
            path = cases.write(pathlib.Path(name), subjects.spikes(), 1_500)
            case = cases.judge(path)
            wrong = [score.score(case, run.run("answers", each, path))["wrong sides"] for each in ("dibs", "planted")]
            # Two a frame; one without a side cannot be turned.
            self.assertGreater(wrong[1] - wrong[0], len(case.side))
            self.assertIn("No module", run.run("answers", "nobody", path))
            self.assertIn("longer", run.run("answers", "dibs", path, limit=0.01))


def _square(point, corners):
    """The square of the distance to a triangle, in rational numbers."""
    a, b, c = ([Fraction(value) - Fraction(at) for value, at in zip(corner, point)] for corner in corners.tolist())
    edges = [_to_edge(a, b), _to_edge(b, c), _to_edge(c, a)]
    normal = _cross(_less(b, a), _less(c, a))
    over = [_dot(normal, _cross(*each)) >= 0 for each in [(b, c), (c, a), (a, b)]]
    plane = [_dot(a, normal) ** 2 / _dot(normal, normal)] if all(over) and any(normal) else []
    return min(edges + plane)


def _to_edge(a, b):
    edge = _less(b, a)
    t = min(max(-_dot(a, edge) / _dot(edge, edge), Fraction(0)), Fraction(1))
    near = [start + t * way for start, way in zip(a, edge)]
    return _dot(near, near)


def _less(a, b):
    return [x - y for x, y in zip(a, b)]


def _cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _dot(a, b):
    return sum(x * y for x, y in zip(a, b))


if __name__ == "__main__":
    unittest.main()

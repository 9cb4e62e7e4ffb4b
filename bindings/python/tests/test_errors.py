"""Wrong input is named in one sentence, and never answered."""

import pathlib
import tempfile
import unittest
import warnings

import numpy as np

import dibs
from subjects import BEAT, HEART, TREE, spheres

VERTICES, TRIANGLES = HEART.vertices, HEART.triangles
NAN = VERTICES.copy()
NAN[3, 1] = np.nan
TOOL = [0, 0, 150, 5]


def changed(array, at, value):
    array = array.copy()
    array[at] = value
    return array


TRIANGLE = [[0, 0, 0], [9, 0, 0], [0, 9, 0]]

CASES = [
    # Meshes.
    (TypeError, "build() got an unexpected keyword argument 'streach'", lambda: dibs.build(HEART, streach=1.5)),
    (TypeError, "read() got an unexpected keyword argument 'units'", lambda: dibs.read("no.ply", units="mm")),
    (TypeError, "Mesh() got an unexpected keyword argument 'wield'", lambda: dibs.Mesh(VERTICES, TRIANGLES, wield=1)),
    (ValueError, "vertices: the shape is (3,); give (points, 3)", lambda: dibs.build([1, 2, 3], TRIANGLES)),
    (ValueError, "vertices: nan at [3, 1] is not a finite number", lambda: dibs.build(NAN, TRIANGLES)),
    (TypeError, "vertices: an array of numbers is needed, not of <U1", lambda: dibs.build([["a", "b", "c"]], [[0, 1, 2]])),
    (TypeError, "not of complex128", lambda: dibs.build(VERTICES * 1j, TRIANGLES)),
    (TypeError, "not of bool", lambda: dibs.build(VERTICES > 0, TRIANGLES)),
    (ValueError, "vertices: not an array", lambda: dibs.build([[1, 2, 3], [1, 2]], TRIANGLES)),
    (TypeError, "triangles: vertex numbers are integers, not float64", lambda: dibs.build(VERTICES, TRIANGLES * 1.0)),
    (ValueError, "triangles: the shape is (3, 1000)", lambda: dibs.build(VERTICES, TRIANGLES.T)),
    (ValueError, "triangle 0 has vertex 502, and there are 502", lambda: dibs.build(VERTICES, [[0, 1, 502]])),
    (ValueError, "triangle 1 has vertex -1", lambda: dibs.build(VERTICES, [[0, 1, 2], [0, 1, -1]])),
    (ValueError, "no triangles", lambda: dibs.build(VERTICES, np.empty((0, 3), int))),
    (ValueError, "read it with strict=False to drop them", lambda: dibs.build(VERTICES, [[0, 1, 1]], strict=True)),
    (ValueError, "largest_component=True", lambda: dibs.build(np.concatenate([np.add(TRIANGLE, [20 * part, 0, 0]) for part in range(65)]), np.arange(195).reshape(65, 3))),
    (ValueError, "unit is 'ft'; give 'mm', 'cm', 'm', 'in' or 'um'", lambda: dibs.build(VERTICES, TRIANGLES, unit="ft")),
    (ValueError, "weld tolerance is -1", lambda: dibs.build(VERTICES, TRIANGLES, weld=-1)),
    (ValueError, "origin: the shape is (1, 2)", lambda: dibs.build(VERTICES, TRIANGLES, origin=[0, 0])),
    (TypeError, "a Mesh has its triangles", lambda: dibs.build(HEART, TRIANGLES)),
    (TypeError, "give a file, a Mesh, vertices and triangles, or an object", lambda: dibs.build(VERTICES)),
    (ValueError, "a generated heart cannot have 7 triangles", lambda: dibs.generate("heart", 7)),
    (ValueError, "kind is 'liver'", lambda: dibs.generate("liver", 100)),
    # Trees.
    (ValueError, "a stretch limit of 0.5 makes no sense", lambda: dibs.build(HEART, stretch=0.5)),
    (ValueError, "stretch: nan is not a finite number", lambda: dibs.build(HEART, stretch=float("nan"))),
    (ValueError, "limits: the shape is (3,) for 1000 triangles", lambda: dibs.build(HEART, limits=[1, 1, 1])),
    (ValueError, "triangle 4 has a stretch limit of 0.5", lambda: dibs.build(HEART, limits=changed(np.ones(1000), 4, 0.5))),
    (ValueError, "labels: 256 of triangle 2 is not a label", lambda: dibs.build(HEART, labels=changed(np.zeros(1000, int), 2, 256))),
    (TypeError, "labels: labels are integers, not float64", lambda: dibs.build(HEART, labels=np.zeros(1000))),
    (ValueError, "not a valid tree", lambda: dibs.Tree(b"no tree")),
    (ValueError, "not a valid tree", lambda: dibs.Tree(TREE.blob[:-1] + b"x")),
    # Surfaces.
    (ValueError, "surface: the shape is (3,)", lambda: TREE.query(TOOL, surface=[0, 0, 0])),
    (ValueError, "surface: 501 positions, and the mesh has 502 vertices", lambda: TREE.query(TOOL, surface=VERTICES[1:])),
    (ValueError, "has 501 vertices and the tree's mesh has 502", lambda: dibs.Tree(TREE.blob).query(TOOL, surface=VERTICES[1:])),
    (ValueError, "surface: nan at [3, 1]", lambda: TREE.query(TOOL, surface=NAN)),
    (ValueError, "build the tree with a larger stretch", lambda: TREE.surface(VERTICES * [2, 1, 1])),
    (ValueError, "surface: is of another tree", lambda: dibs.Tree(TREE.blob).query(TOOL, surface=TREE.rest)),
    # Tools.
    (ValueError, "tools: the shape is (1, 5); give (poses, 4) for spheres", lambda: TREE.query([[1, 2, 3, 4, 5]])),
    (ValueError, "tools: the shape is (1, 1, 1, 4)", lambda: TREE.query([[[TOOL]]])),
    (ValueError, "tools: the shape is (2, 0, 4)", lambda: TREE.query(np.zeros((2, 0, 4)))),
    (ValueError, "tools: row 1, tool 2: ", lambda: TREE.query(changed(np.tile(TOOL, (2, 3, 1)), (1, 2, 3), -1))),
    (ValueError, "budget: -1 tests are below 0", lambda: TREE.query(TOOL, budget=-1)),
    (TypeError, "budget: give a number of tests, not (5, 6)", lambda: TREE.query(TOOL, budget=(5, 6))),
    (TypeError, "budget: give a number of tests, not 1.5", lambda: TREE.contacts(TOOL, 1, budget=1.5)),
    (ValueError, "velocities: 501 velocities, and the mesh has 502 vertices", lambda: TREE.surface(velocities=VERTICES[1:])),
    (ValueError, "velocities: nan at [3, 1]", lambda: TREE.surface(velocities=NAN)),
    (ValueError, "501 velocities and the tree uses 502 vertices", lambda: dibs.Tree(TREE.blob).surface(velocities=VERTICES[1:])),
    (ValueError, "surfaces: a scene has at least one", lambda: dibs.Scene([])),
    (TypeError, "surfaces: number 1 is no Surface and no Tree", lambda: dibs.Scene([TREE, VERTICES])),
    (ValueError, "tools: inf at [1, 0] is not a finite number", lambda: TREE.query([TOOL, [np.inf, 0, 0, 1]])),
    (ValueError, "tools: row 1: ", lambda: TREE.query([TOOL, [0, 0, 0, -1]])),
    (ValueError, "tools: row 70001: ", lambda: TREE.query(changed(np.tile(TOOL, (70_005, 1)), (70_001, 3), -1))),
    (TypeError, "tools: an array of numbers is needed, not of object", lambda: TREE.query([[None] * 4])),
    (ValueError, "points and radii of different numbers: 2, 3", lambda: dibs.spheres(np.zeros((2, 3)), [1, 2, 3])),
    (ValueError, "radius: the shape is (1, 1)", lambda: dibs.spheres([0, 0, 0], [[1]])),
    (ValueError, "margin: nan is not a finite number", lambda: TREE.contacts(TOOL, float("nan"))),
    (ValueError, "margin: the shape is (2,); give one number", lambda: TREE.contacts(TOOL, [1, 2])),
    # Motions.
    (ValueError, "frames: the shape is (502, 3); give (frames, points, 3)", lambda: dibs.MotionStretch(HEART, VERTICES)),
    (ValueError, "frames: 501 positions a frame, and the mesh has 502", lambda: dibs.MotionStretch(HEART, BEAT.frames[:, 1:])),
    (ValueError, "frames: nan at [0, 3, 1]", lambda: dibs.MotionStretch(HEART, NAN[np.newaxis])),
    (ValueError, "margin: -0.1 is below 0", lambda: dibs.MotionStretch(HEART, BEAT.frames).limits(-0.1)),
    # Streams.
    (ValueError, "positions: 501 positions", lambda: dibs.Sender(TREE).send(VERTICES[1:])),
    (ValueError, "positions: nan at [3, 1]", lambda: dibs.Sender(TREE).send(NAN)),
    (ValueError, "mtu is 100; give 64 (CAN-FD) or 1024", lambda: dibs.Sender(TREE, mtu=100)),
    (ValueError, "-1 s is no time", lambda: dibs.Sender(TREE, heartbeat=-1)),
    (ValueError, "partial: a tolerance is a length of at least 0", lambda: dibs.Sender(TREE, partial=-1)),
    (ValueError, "rate: 0.0 frames a second are none", lambda: dibs.Sender(TREE).play(BEAT.frames, 0)),
    (ValueError, "ttyUSB0", lambda: dibs.Sender(TREE, "ttyUSB0")),
    (ValueError, "key: 5 bytes; give 16", lambda: dibs.Sender(TREE, key=b"short")),
    (TypeError, "key: bytes are needed, not str", lambda: dibs.Sender(TREE, key="0" * 16)),
    (TypeError, "receiver and challenge are of tags; give key, too", lambda: dibs.Sender(TREE, challenge=3)),
    (ConnectionError, "no genuine status", lambda: dibs.Sender(TREE, key=bytes(16)).send(VERTICES)),
    (ConnectionError, "no genuine status came within 0.01 s", lambda: dibs.Sender(TREE, key=bytes(16)).wait(0.01)),
    (OSError, "unix:/nowhere/at/all", lambda: dibs.Sender(TREE, "unix:/nowhere/at/all")),
    (ValueError, "make the sender with to=None", lambda: dibs.Sender(TREE, "udp:127.0.0.1:9").packets()),
    # Files.
    (FileNotFoundError, "absent.ply: cannot be read", lambda: dibs.read("absent.ply")),
    (FileNotFoundError, "absent.pc2: cannot be read", lambda: dibs.read_motion("absent.pc2", HEART)),
    (FileNotFoundError, "absent.dibs", lambda: dibs.Tree.load("absent.dibs")),
]


class Errors(unittest.TestCase):
    def test_each_is_named(self):
        for kind, part, call in CASES:
            with self.subTest(part=part), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                with self.assertRaises(kind) as caught:
                    call()
                self.assertIs(type(caught.exception), kind)
                self.assertIn(part, str(caught.exception))
                self.assertEqual(str(caught.exception).count("\n"), 0)
                self.assertNotIn("--", str(caught.exception))

    def test_files_are_named(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bad.dibs"
            path.write_bytes(b"no tree")
            with self.assertRaisesRegex(ValueError, "bad.dibs: not a valid tree"):
                dibs.Tree.load(path)
            path = path.with_name("bad.obj")
            path.write_text("v 0 0 0\nv 1 0\n")
            with self.assertRaisesRegex(ValueError, r"bad.obj: not valid OBJ, line 2"):
                dibs.read(path)

    def test_oddities_are_warned_of(self):
        with self.assertWarnsRegex(dibs.MeshWarning, "3 open border edges"):
            tree = dibs.build(TRIANGLE, [[0, 1, 2]])
        answer = tree.query([1, 1, 4, 1])
        self.assertEqual(answer["separation"], 3)
        answer = tree.query([20, -5, 4, 1])
        self.assertEqual(answer["side"], dibs.Side.UNDEFINED)
        self.assertIn("open boundary", dibs.SIDE_REASONS[answer["side_reason"]])
        with self.assertWarnsRegex(dibs.MeshWarning, "degenerate triangle dropped"):
            dibs.build(TRIANGLE, [[0, 1, 2], [0, 1, 1]])
        with self.assertWarnsRegex(dibs.MeshWarning, "as in unit='m'"):
            dibs.build(np.array(TRIANGLE) / 1e4, [[0, 1, 2]])

    def test_a_mesh_turns_outwards(self):
        inward = dibs.Mesh(VERTICES, TRIANGLES[:, ::-1])
        self.assertRegex("".join(inward.warnings), "orient=True")
        self.assertNotIn("--", "".join(inward.warnings))
        outward = dibs.Mesh(VERTICES, TRIANGLES[:, ::-1], orient=True)
        self.assertEqual(outward.warnings, [])
        answers = dibs.build(outward).query(spheres(50))
        np.testing.assert_array_equal(answers["side"], TREE.query(spheres(50))["side"])


if __name__ == "__main__":
    unittest.main()

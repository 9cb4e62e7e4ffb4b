"""The same numbers as the program's, to the bit.

The program searches one subtree at a time, and the package by batches: where two triangles are equally close each may
name another, and where an axis crosses the surface each has an interval of its own.
"""

import json
import pathlib
import pydoc
import re
import sys
import unittest
from unittest import mock

import numpy as np

import dibs
from subjects import BEAT, HEART, OTHER, ROOT, TREE, WithProgram, capsules, chains, spheres


def lines_of(tools):
    return "\n".join(",".join(repr(float(number)) for number in tool) for tool in tools)


class Program(WithProgram):
    def compare(self, records, answers, names):
        for name in names:
            expected = np.array([answer[name] for answer in answers])
            np.testing.assert_array_equal(records[name], expected, err_msg=name)

    def overlap(self, records, answers):
        """The certified intervals have a number in common."""
        lower, upper = (np.array([answer[name] for answer in answers]) for name in ["lower", "separation"])
        slack = records["accuracy"]
        self.assertTrue((records["lower"] - slack <= upper).all() and (lower - slack <= records["separation"]).all())

    def test_answers_and_contacts(self):
        np.save(self.folder / "beat.npy", BEAT.frames)
        options = ["--vertices", "beat.npy", "--frame", "9", "--stretch", "1.5", "--contacts", "30"]
        for tools in [spheres(150), capsules(150)]:
            (self.folder / "poses.csv").write_text(lines_of(tools))
            answers = self.lines("query", "heart.dibs", "--poses", "poses.csv", *options)
            mine = TREE.query(tools, surface=BEAT.frames[9])
            self.overlap(mine, answers)
            same = [tuple(one) == tuple(other["triangle"]) for one, other in zip(mine["triangle"], answers)]
            crossing = mine["side"] == dibs.Side.CROSSING
            self.assertGreater(np.count_nonzero(~crossing & same), 0.8 * np.count_nonzero(~crossing))
            exact = np.flatnonzero(~crossing)
            fields = ["separation", "lower", "accuracy", "axis_distance"]
            self.compare(mine[exact], [answers[pose] for pose in exact], fields)
            exact = np.flatnonzero(~crossing & same)
            fields += ["axis_parameter", "direction", "point_on_surface", "point_on_tool", "barycentric"]
            self.compare(mine[exact], [answers[pose] for pose in exact], fields)
            sides = [dibs.Side(side).name.lower() for side in mine["side"]]
            self.assertEqual(sides, [answer["side"] for answer in answers])
            reasons = [dibs.SIDE_REASONS[reason] or None for reason in mine["side_reason"]]
            self.assertEqual(reasons, [answer["side_reason"] for answer in answers])

            found, bound, _ = TREE.contacts(tools, 30, surface=BEAT.frames[9])
            self.compare({"contacts_bound": bound}, answers, ["contacts_bound"])
            contacts = [contact for answer in answers for contact in answer["contacts"]]
            self.assertGreater(len(contacts), 30)
            self.compare(found, contacts, ["separation", "point_on_surface", "point_on_tool", "normal", "triangle"])
            counts = [len(answer["contacts"]) for answer in answers]
            np.testing.assert_array_equal(np.bincount(found["pose"], minlength=len(tools)), counts)

    def test_chains_in_scenes(self):
        OTHER.save(self.folder / "other.dibs")
        tools = chains(60, 3)
        lines = [" ".join(f"capsule:{line}" for line in lines_of(chain).split("\n")) for chain in tools]
        (self.folder / "poses.txt").write_text("\n".join(lines))
        answers = self.lines("query", "heart.dibs", "other.dibs", "--poses", "poses.txt", "--stretch", "1.5", "--contacts", "30")
        scene = dibs.Scene([TREE, OTHER])
        mine = scene.query(tools)
        self.overlap(mine, answers)
        exact = np.flatnonzero(mine["side"] != dibs.Side.CROSSING)
        self.assertGreater(len(exact), 10)
        self.compare(mine[exact], [answers[pose] for pose in exact], ["separation", "lower", "accuracy", "tool"])
        names = np.array(["heart.dibs", "other.dibs"])
        self.assertEqual(names[mine["surface"]].tolist(), [answer["tree"] for answer in answers])
        found, bound, _ = scene.contacts(tools, 30)
        self.compare({"contacts_bound": bound}, answers, ["contacts_bound"])
        contacts = [contact for answer in answers for contact in answer["contacts"]]
        self.compare(found, contacts, ["separation", "point_on_surface", "tool"])
        self.assertEqual(names[found["surface"]].tolist(), [contact["tree"] for contact in contacts])

    def test_files_are_shared(self):
        self.dibs("generate", "heart", "--triangles", "1000", "-o", "heart.ply", "--motion", "heart.pc2")
        mesh = dibs.read(self.folder / "heart.ply")
        np.testing.assert_array_equal(mesh.vertices, HEART.vertices)
        np.testing.assert_array_equal(mesh.triangles, HEART.triangles)
        motion = dibs.read_motion(self.folder / "heart.pc2", mesh)
        np.testing.assert_array_equal(motion.frames, BEAT.frames)
        self.assertEqual(motion.rate, BEAT.rate)
        self.dibs("build", "heart.ply", "-o", "built.dibs")
        built = dibs.Tree.load(self.folder / "built.dibs")
        self.assertEqual(built.blob, dibs.build(self.folder / "heart.ply").blob)
        self.assertEqual(built.blob, dibs.build(HEART.vertices, HEART.triangles).blob)
        summary = json.loads(self.dibs("inspect", "built.dibs", "--json"))
        self.assertEqual(built.summary, summary)
        stretched = dibs.read(self.folder / "heart.ply", unit="cm").vertices
        np.testing.assert_allclose(stretched, 10 * HEART.vertices, rtol=1e-6)

    def test_groups_become_labels(self):
        path = ROOT / "dibs-build/tests/fixtures/labels_41.msh"
        mesh = dibs.read(path, groups=True)
        self.assertEqual(mesh.labels.tolist(), [0, 0, 3, 3, 3, 7, 7, 255])
        self.assertEqual(mesh.groups[1], {"label": 3, "name": "left wall", "triangles": 3})
        tree = dibs.build(path, groups=True)
        self.dibs("build", str(path), "-o", "labels.dibs", "--labels-from-groups")
        self.assertEqual(tree.blob, (self.folder / "labels.dibs").read_bytes())
        self.assertEqual(dibs.build(mesh).blob, tree.blob)
        with self.assertRaisesRegex(ValueError, "no groups of triangles"):
            dibs.read(ROOT / "dibs-build/tests/fixtures/gmsh_41.msh", groups=True)

    def test_the_first_lines_of_the_readme_give_the_right_answer(self):
        page = pathlib.Path(ROOT / "bindings/python/README.md").read_text(encoding="utf-8")
        first, *_ = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        scope = {}
        exec(compile(first, "README.md", "exec"), scope)
        answers, heart = scope["answers"], scope["heart"]
        # Of the vertices alone: each is a point of the surface, and no point is farther from one than the longest edge.
        moved = 1.1 * heart.vertices
        edges = moved[heart.triangles] - moved[np.roll(heart.triangles, 1, axis=1)]
        longest = np.linalg.norm(edges, axis=2).max()
        for answer, (*axis, radius) in zip(answers, scope["capsules"]):
            self.assertEqual(answer["side"], dibs.Side.OUTSIDE)
            start, end = np.reshape(axis, (2, 3))
            share = np.clip((moved - start) @ (end - start) / np.sum((end - start) ** 2), 0, 1)
            nearest = np.linalg.norm(moved - start - share[:, None] * (end - start), axis=1).min() - radius
            self.assertLessEqual(answer["interval"][0], nearest)
            self.assertLess(nearest - answer["separation"], longest)
        fields = re.findall(r"^\| (`.*?) \|", page, re.MULTILINE)
        named = {name for row in fields[:9] for name in re.findall(r"`(\w+)`", row)}
        self.assertEqual(named, set(dibs.ANSWER.names))

    def test_help_says_what_the_fields_of_an_answer_are(self):
        fields = re.findall(r"^[ |]*((?:`\w+`(?:, )?)+):", pydoc.render_doc(dibs.Tree.query), re.MULTILINE)
        self.assertEqual({name for row in fields for name in re.findall(r"`(\w+)`", row)}, set(dibs.ANSWER.names))

    def test_the_example_of_the_readme_draws_the_programs_answers(self):
        page = pathlib.Path(ROOT / "bindings/python/README.md").read_text(encoding="utf-8")
        *_, code = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
        drawing = mock.MagicMock()
        modules = {"matplotlib": drawing, "matplotlib.pyplot": drawing.pyplot}
        scope = {}
        with mock.patch.dict(sys.modules, modules):
            exec(compile(code, "README.md", "exec"), scope)
        (time, separation), _ = drawing.pyplot.plot.call_args_list[0]
        self.assertEqual(len(time), 20_000)
        self.assertTrue(separation.min() < -10 and separation.max() > 10)
        # The program asks one by one: a part of the path that crosses the wall.
        first = 1_500
        scope["tree"].save(self.folder / "heart.dibs")
        np.save(self.folder / "beat.npy", scope["beat"].frames)
        part = slice(0, first + 500)
        path = "\n".join("capsule:" + line for line in lines_of(scope["tools"][part]).split("\n"))
        (self.folder / "tools.csv").write_text(path)
        held = ["--surface", "held", "--full", "--motion-rate", repr(float(scope["beat"].rate)), "--json"]
        track = self.lines("track", "heart.dibs", "--motion", "beat.npy", "--path", "tools.csv", *held)
        ticks = [line for line in track if "tick" in line]
        mine = scope["answers"][part]
        self.overlap(mine, ticks)
        self.assertLess((mine["separation"] - mine["lower"]).max(), 0.2)
        exact = np.flatnonzero(mine["side"] != dibs.Side.CROSSING)
        self.assertGreater(len(exact), 1_000)
        self.compare(mine[exact], [ticks[tick] for tick in exact], ["separation", "lower"])
        self.assertIn("crossing", {line["side"] for line in ticks})


if __name__ == "__main__":
    unittest.main()

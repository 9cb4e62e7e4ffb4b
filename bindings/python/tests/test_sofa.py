"""examples/ros2/README.md's controller for SOFA, with a stand-in for SOFA's classes, to the answer of a guard."""

import os
import re
import socket
import sys
import tempfile
import time
import types
import unittest

import numpy as np

import dibs
from subjects import BEAT, ROOT, TREE


class Node:
    """A node of SOFA's graph."""

    def __init__(self):
        self.objects = []

    def addChild(self, name):
        return self

    def addObject(self, made, **arguments):
        if isinstance(made, str):
            made = types.SimpleNamespace(type=made, **arguments)
        self.objects.append(made)
        return made


class Controller:
    """SOFA's base of controllers in Python: it takes the names of its data alone."""

    def __init__(self, *, name):
        self.name = name


class Data:
    """A mechanical object's vectors: a view of SOFA's memory, of f64 here."""

    def __init__(self, rows):
        self.rows = np.asarray(rows, "f8")
        self.rows.flags.writeable = False

    def array(self):
        return self.rows


class Scene(unittest.TestCase):
    def test_a_step_of_a_scene_is_a_frame(self):
        page = (ROOT / "examples/ros2/README.md").read_text(encoding="utf-8")
        block = next(block for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "Sofa" in block)
        controller = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(controller.close)
        controller.bind(("127.0.0.1", 0))
        controller.settimeout(10)
        address = "127.0.0.1:{}".format(controller.getsockname()[1])
        self.assertIn("192.168.1.20:5000", block)
        block = block.replace("192.168.1.20:5000", address)

        sofa = types.ModuleType("Sofa")
        sofa.Core = types.SimpleNamespace(Controller=Controller)
        sys.modules["Sofa"] = sofa
        self.addCleanup(sys.modules.pop, "Sofa")
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            TREE.save("liver.dibs")
            scene = {}
            exec(compile(block, "README.md", "exec"), scene)
            root = Node()
            scene["createScene"](root)
            os.chdir(before)
        dofs, sender = root.objects
        self.assertEqual((dofs.type, sender.name), ("MechanicalObject", "sender"))

        guard = dibs.Guard(TREE, 300.0, 80, automatic=True, without_transit=True)
        sphere = [0.0, 0.0, 150.0, 5.0]
        start, sent, found = time.monotonic(), 0, None
        # A guard trusts its surface after a second of good ticks.
        while found is None:
            now = int(1_000 * (time.monotonic() - start))
            if now >= 25 * sent:
                # A scene that is paused sends the same frame, which grows old.
                dofs.position = Data(BEAT.frames[0] + 0.001 * (sent % 2))
                sender.onAnimateEndEvent({})
                sent += 1
                while guard.counters["published"] < sent:
                    guard.packet(controller.recv(65_536), now)
                    guard.work(1_000_000)
            answer = guard.closest(sphere, now)
            found = answer.closest
            self.assertLess(now, 20_000, answer.reason)
            time.sleep(0.001)
        lower, upper = found["interval"]
        truth = TREE.query(sphere, surface=BEAT.frames[0])["separation"]
        self.assertTrue(lower < truth < upper < lower + 50, (lower, upper, truth))


if __name__ == "__main__":
    unittest.main()

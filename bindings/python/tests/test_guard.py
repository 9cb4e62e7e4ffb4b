"""The loop of a controller: packets in, answers and forces out.

One file, because all tests need the same loop.
"""

import contextlib
import itertools
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import dibs
from subjects import ASIDE, BEAT, HEART, OTHER, TREE

PERIOD = 30
WALL = dibs.ForbiddenRegion(stiffness=1.0, damping=0.002, max_force=5.0, margin=5.0)
SPHERE = [100.0, 0.0, 30.0, 2.5]
# A pose: a rotation by twice the angle whose sine is 0.6, and a shift.
TURN, SHIFT = [0.0, 0.0, 0.6, 0.8], np.array([200.0, -30.0, 50.0])
ROTATION = np.array([[0.28, -0.96, 0.0], [0.96, 0.28, 0.0], [0.0, 0.0, 1.0]])

# Threads that ask for the contacts of one guard, or of one tracker: while one has the list, another waits for it.
SHARED = """
import sys, threading
import dibs
mesh, _ = dibs.generate("heart", 320)
tree = dibs.build(mesh)
tool = [100.0, 0.0, 30.0, 2.5]
if sys.argv[1] == "guard":
    guard = dibs.Guard(tree, 300.0, 80, automatic=True, without_transit=True)
    ask = lambda: guard.contacts(tool, 12.0, 0)
else:
    tracker = dibs.Tracker(tree)
    ask = lambda: tracker.closest(tool, tree.rest, margin=12.0)
threads = [threading.Thread(target=lambda: [ask() for _ in range(2_000)]) for _ in range(4)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
print("done")
"""


def cobs(packet):
    """A packet between zeros, as docs/wire.md has it for byte streams."""
    out = bytearray()
    for block in packet.split(b"\0"):
        while len(block) >= 254:
            out += b"\xff" + block[:254]
            block = block[254:]
        out += bytes([len(block) + 1]) + block
    return bytes(out) + b"\0"


class Loop:
    """A sender, a guard, and their clock."""

    def __init__(self, tree=TREE, frame=BEAT.frames[0], is_serial=False, **choices):
        choices = {"automatic": True, "without_transit": True, **choices}
        self.sender = dibs.Sender(tree, heartbeat=None, quantised=False)
        self.guard = dibs.Guard(tree, 300.0, 80, **choices)
        self.frame, self.is_serial, self.now = frame, is_serial, 1_000

    def send(self, frame=None):
        self.sender.send(self.frame if frame is None else frame, age=0)
        for packet in self.sender.packets():
            if self.is_serial:
                self.guard.receive(cobs(packet), self.now)
            else:
                self.guard.packet(packet, self.now)
        while True:
            outcome = self.guard.work(500)
            if outcome != "pending":
                return outcome

    def tick(self, tool=SPHERE):
        self.now += 1
        return self.guard.closest(tool, self.now)

    def run(self, ticks, tool=SPHERE):
        for tick in range(ticks):
            if tick % PERIOD == 0:
                self.send()
            answer = self.tick(tool)
        return answer


class Guards(unittest.TestCase):
    def test_a_frame_may_have_a_pose(self):
        turn, shift, rotation = TURN, SHIFT, ROTATION
        for tree, origin in ((TREE, np.zeros(3)), (OTHER, ASIDE)):
            guard = dibs.Guard(tree, 300.0, 80, automatic=True, without_transit=True)
            frame = BEAT.frames[0] + origin
            tool = [100.0, 0.0, 30.0] + origin
            there = rotation @ tool + shift
            for now in range(1_000, 2_600):
                if now % PERIOD == 0:
                    guard.frame(frame, now, pose=(turn, shift))
                    while guard.work(500) == "pending":
                        pass
                found = guard.closest([*there, 2.5], now).closest
            plain = tree.query([*tool, 2.5], surface=frame)
            self.assertAlmostEqual(float(found["separation"]), float(plain["separation"]), delta=1e-3)
            at = rotation @ plain["point_on_surface"] + shift
            self.assertLess(np.linalg.norm(found["point_on_surface"] - at), 1e-2)
            for wrong in ((turn[:3], shift), (turn, shift[:2]), ([0.0, 0.0, 0.0, 1.1], shift), (turn, [np.nan, 0, 0])):
                with self.assertRaises(ValueError):
                    guard.frame(frame, 2_610, pose=wrong)
            for wrong in (np.eye(4), 5):
                with self.assertRaisesRegex(ValueError, "give a rotation"):
                    guard.frame(frame, 2_610, pose=wrong)

    def test_a_sender_takes_the_same_pose(self):
        turn, shift = TURN, SHIFT
        for tree, origin, unit, metre in ((TREE, np.zeros(3), None, 1.0), (OTHER, ASIDE, "m", 1_000.0)):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
                line.bind(("127.0.0.1", 0))
                line.settimeout(5)
                to = f"udp:127.0.0.1:{line.getsockname()[1]}"
                sender = dibs.Sender(tree, to, quantised=False, heartbeat=None, unit=unit)
                guards = [dibs.Guard(tree, 300.0, 80, automatic=True, without_transit=True) for _ in range(2)]
                there = [*(ROTATION @ (SPHERE[:3] + origin) + shift), SPHERE[3]]
                compared = 0
                for now in range(1_000, 2_600):
                    if now % PERIOD == 10:
                        frame = BEAT.frames[0] + origin
                        at = shift + [0.0, 0.001 * now, 0.0]
                        guards[0].frame(frame, now, captured=now - 5, pose=(turn, at))
                        sent = sender.send(frame / metre, age=0.005, pose=(turn, at / metre))
                        for _ in range(sent.packets):
                            guards[1].packet(line.recv(2_048), now)
                        for guard in guards:
                            while guard.work(500) == "pending":
                                pass
                    called, sent = (guard.closest(there, now).closest for guard in guards)
                    self.assertEqual(called is None, sent is None)
                    if called is not None:
                        compared += 1
                        for field in ("separation", "point_on_surface", "accuracy"):
                            np.testing.assert_allclose(called[field], sent[field], rtol=0, atol=1e-3 if unit else 0)
                self.assertGreater(compared, 500)
                for wrong, reason in (
                    (([0.0, 0.0, 0.0, 1.1], shift), "is no rotation"),
                    ((turn, [np.nan, 0, 0]), "is not finite"),
                    ((turn[:3], shift), "give 4 numbers"),
                    (np.eye(4), "give a rotation"),
                ):
                    with self.assertRaisesRegex(ValueError, reason):
                        sender.send(BEAT.frames[0] + origin, age=0, pose=wrong)
                with self.assertRaisesRegex(ValueError, "age: with a pose"):
                    sender.send(BEAT.frames[0] / metre + origin / metre, pose=(turn, shift / metre))

    def test_the_answer_is_that_of_the_frame(self):
        for tree, frame, shift, is_serial in [
            (TREE, BEAT.frames[0], 0, False),
            (TREE, BEAT.frames[4], 0, True),
            (OTHER, HEART.vertices + ASIDE, ASIDE, False),
        ]:
            for tool in [SPHERE, [100.0, 0.0, 30.0, 140.0, 10.0, 60.0, 2.5]]:
                tool = np.array(tool)
                for corner in range(0, len(tool) - 3, 3):
                    tool[corner : corner + 3] += shift
                loop = Loop(tree, frame, is_serial)
                answer = loop.run(1_200, tool)
                self.assertEqual((answer.state, answer.cause, answer.reason), (dibs.State.NOMINAL, None, None))
                truth = tree.query(tool, surface=frame)
                low, high = answer.closest["interval"]
                self.assertTrue(low <= truth["separation"] <= high)
                self.assertAlmostEqual(float(answer.closest["separation"]), float(truth["separation"]), places=3)
                np.testing.assert_allclose(answer.closest["point_on_surface"], truth["point_on_surface"], atol=1e-3)
                self.assertEqual(answer.age, loop.now - 1_000 - 39 * PERIOD)
                self.assertEqual((answer.epoch, answer.waits_for_acknowledgement), (40, False))
                self.assertTrue(0 <= answer.margin < 30 and answer.lag is not None)
                self.assertEqual(loop.guard.counters["published"], 40)
                # The same pose ten times: no velocity; then 0.1 mm in a tick.
                np.testing.assert_allclose(answer.velocity, 0, atol=1e-3)
                moved = loop.tick(tool + np.array([0.1, 0, 0] * (len(tool) // 3) + [0]))
                np.testing.assert_allclose(moved.velocity, [100, 0, 0], atol=0.1)

    def test_contacts_are_those_of_the_frame(self):
        loop, listed = Loop(OTHER, HEART.vertices + ASIDE, budget=2_000), 0
        tool = np.array([16.0, -15, 88, 52, 72, 106, 2.5]) + np.array([*ASIDE, *ASIDE, 0])
        for tick in range(1_200):
            if tick % PERIOD == 0:
                loop.send()
            loop.now += 1
            answer, (found, bound, accuracy) = loop.guard.contacts(tool, 12.0, loop.now)
            if tick % 100 == 99 and answer.closest is not None:
                truth = OTHER.contacts(tool, 12.0, surface=loop.frame)
                self.assertEqual(len(found), len(truth.found))
                self.assertAlmostEqual(float(bound[0]), float(truth.bound[0]), places=3)
                # As the pair's, it includes the surface's age.
                self.assertGreaterEqual(accuracy[0], answer.closest["accuracy"])
                self.assertGreater(accuracy[0], answer.margin + truth.accuracy[0] / 2)
                for field in ["separation", "point_on_surface", "normal"]:
                    np.testing.assert_allclose(found[field], truth.found[field], atol=1e-3)
                listed += len(found)
        self.assertEqual(answer.state, dibs.State.NOMINAL)
        self.assertGreater(listed, 5)
        # A tick within a tiny budget lists less, and says how far it is complete.
        few = Loop(OTHER, HEART.vertices + ASIDE, budget=40)
        few.send()
        self.assertLess(few.guard.contacts(tool, 12.0, few.now)[1].bound[0], 12)

    def test_threads_share_a_list_of_contacts(self):
        for name in ["guard", "tracker"]:
            # In a process of its own: one that hangs holds Python's lock, and with it the test's own clock.
            with self.subTest(name):
                shared = subprocess.run([sys.executable, "-c", SHARED, name], timeout=60, check=True, stdout=subprocess.PIPE)
                self.assertEqual(shared.stdout.split(), [b"done"])

    def test_a_frame_of_this_process_is_that_of_packets(self):
        answers = []
        for is_called in [False, True]:
            loop = Loop(OTHER, HEART.vertices + ASIDE)
            if is_called:
                loop.send = lambda: loop.guard.frame(loop.frame, loop.now) or [*iter(lambda: loop.guard.work(500), "published")]
            answer = loop.run(1_200, SPHERE + np.array([*ASIDE, 0]))
            answers.append((answer.closest["separation"], answer.state, answer.age, answer.epoch))
        self.assertEqual(*answers)

    def test_a_wrong_frame_of_this_process_is_refused(self):
        loop = Loop()
        loop.guard.frame(loop.frame, 1_000, captured=993)
        self.assertEqual([*iter(lambda: loop.guard.work(500), "published")][-1:], ["pending"])
        self.assertEqual(loop.tick().age, 8)
        wrong = loop.frame.copy()
        wrong[5] = np.inf
        for positions, captured, sentence in [
            (loop.frame[1:], None, f"{len(loop.frame) - 1} rows"),
            (loop.frame, 100, "before the published"),
            (loop.frame, 1_200, "ms old"),
        ]:
            with self.assertRaisesRegex(ValueError, sentence):
                loop.guard.frame(positions, 1_010, captured=captured)
        with self.assertRaisesRegex(ValueError, "positions"):
            loop.guard.frame(wrong, 1_010)
        self.assertEqual(loop.guard.counters["row count"], 1)
        self.assertEqual(loop.tick().age, 9)

    def test_the_state_is_safe_until_acknowledged_and_after_the_age(self):
        loop = Loop(automatic=False)
        first = loop.tick()
        self.assertEqual((first.closest, first.epoch, first.age, first.lag), (None, None, None, None))
        self.assertIn("no surface", first.reason)
        with self.assertRaisesRegex(ValueError, "acknowledg"):
            loop.guard.acknowledge()
        answer = loop.run(1_200)
        self.assertEqual((answer.state, answer.waits_for_acknowledgement), (dibs.State.SAFE, True))
        self.assertIsNone(answer.closest)
        self.assertEqual(answer.reason, "the safe state was not acknowledged")
        self.assertEqual(answer.cause, answer.reason)
        loop.guard.acknowledge()
        self.assertEqual(loop.tick().state, dibs.State.NOMINAL)
        states = [loop.tick() for _ in range(100)]
        for answer in states:
            expected = 0 if answer.age <= 60 else 1 if answer.age <= 80 else 2
            self.assertEqual(answer.state, expected, answer.age)
        self.assertIn("old", states[-1].cause)

    def test_a_wall_pushes_out_and_holds(self):
        loop = Loop()
        held = WALL.force(loop.tick())
        self.assertEqual((held.state, held.force.tolist()), (dibs.ForceState.SAFE, [0, 0, 0]))
        self.assertIn("no surface", held.cause)
        loop.run(1_200)
        far = WALL.force(loop.tick([200.0, 0.0, 30.0, 2.5]))
        self.assertEqual((far.state, far.cause), (dibs.ForceState.INACTIVE, None))
        # 2 mm from the surface.
        touch = TREE.query(SPHERE, surface=loop.frame)
        beside = touch["point_on_surface"] + touch["direction"] * 4.5
        for _ in range(3):
            answer = loop.tick([*beside, 2.5])
        near = WALL.force(answer)
        self.assertIn(near.state, (dibs.ForceState.ACTIVE, dibs.ForceState.SATURATED))
        self.assertGreater(np.dot(near.force, answer.closest["direction"]), 0)
        self.assertLessEqual(np.linalg.norm(near.force), 5.0001)
        blind = loop.tick(None)
        self.assertTrue(np.isnan(blind.velocity).all())
        self.assertEqual(WALL.force(blind).state, dibs.ForceState.SAFE)

    def test_a_command_is_admitted_by_the_guards_own_limits(self):
        loop, guard = Loop(), dibs.Filter(TREE, 1.0, 300.0)
        tool = np.array([110.0, 3.0, 60.0, 140.0, 10.0, 80.0, 2.5])
        answer, admitted = loop.guard.admit(guard, tool, dibs.RigidMotion(tool[:3]), loop.now)
        self.assertIsNone(admitted)
        self.assertIn("no surface", answer.reason)
        loop.run(1_200, tool)
        reasons = set()
        for tick in range(800):
            if tick % PERIOD == 0:
                loop.send()
            loop.now += 1
            push = dibs.RigidMotion(tool[:3], [-0.1, 0.0, 0.0])
            answer, admitted = loop.guard.admit(guard, tool, push, loop.now)
            self.assertGreater(admitted.least_separation, 0.98)
            tool = admitted.motion.apply(tool)
            reasons.add(admitted.reason)
        nowhere = dibs.RigidMotion(tool[:3], [float("nan"), 0.0, 0.0])
        with self.assertRaisesRegex(ValueError, "command"):
            loop.guard.admit(guard, tool, nowhere, loop.now)
        self.assertIn("commanded", reasons)
        self.assertGreater(len(reasons), 1)
        self.assertGreater(TREE.query(tool, surface=loop.frame)["lower"], 0.98)

    def test_a_status_goes_back_when_it_is_due(self):
        loop = Loop()
        loop.run(1)
        status = loop.guard.status(loop.now)
        self.assertEqual(status[0], 4)
        self.assertIsNone(loop.guard.status(loop.now))
        framed = loop.guard.status(loop.now + 100, framed=True)
        self.assertTrue(framed.endswith(b"\0") and framed.count(b"\0") == 1)

    def test_refusals_are_named_and_counted(self):
        loop = Loop()
        loop.run(1)
        with self.assertRaisesRegex(ValueError, "checksum|short"):
            loop.guard.packet(bytes(40), loop.now)
        loop.now += 30
        far = BEAT.frames[0].copy()
        far[100] += [0, 0, 25]
        with self.assertRaises(ValueError):
            loop.send(far)
        counters = loop.guard.counters
        self.assertEqual((counters["published"], sum(counters.values())), (1, 3), counters)
        loop.guard.receive(b"\x05no\0", loop.now)
        self.assertEqual(sum(loop.guard.counters.values()), 4)
        loop.guard.register()

    def test_a_clock_may_wrap(self):
        loop = Loop()
        loop.now = (1 << 32) - 600
        self.assertEqual(loop.run(1_200).state, dibs.State.NOMINAL)

    def test_wrong_arguments_are_named(self):
        guard = dibs.Guard(TREE, 300, 80)
        answer = guard.closest(SPHERE, 0)
        for name, error, call in [
            ("tree", TypeError, lambda: dibs.Guard(HEART, 300, 80)),
            ("speed_mm_per_s", ValueError, lambda: dibs.Guard(TREE, -1, 80)),
            ("speed_mm_per_s", ValueError, lambda: dibs.Guard(TREE, float("nan"), 80)),
            ("speed_mm_per_s", ValueError, lambda: dibs.Guard(TREE, 1e300, 80)),
            ("speed_mm_per_s", TypeError, lambda: dibs.Guard(TREE, "fast", 80)),
            ("age_ms", ValueError, lambda: dibs.Guard(TREE, 300, 0)),
            ("age_ms", ValueError, lambda: dibs.Guard(TREE, 300, 1 << 31)),
            ("age_ms", TypeError, lambda: dibs.Guard(TREE, 300, 80.5)),
            ("ticks_a_second", ValueError, lambda: dibs.Guard(TREE, 300, 80, ticks_a_second=0)),
            ("budget", TypeError, lambda: dibs.Guard(TREE, 300, 80, budget=0.5)),
            ("budget", ValueError, lambda: dibs.Guard(TREE, 300, 80, budget=-1)),
            ("data", TypeError, lambda: guard.receive("text", 0)),
            ("packet", TypeError, lambda: guard.packet([1, 2], 0)),
            ("now", TypeError, lambda: guard.closest(SPHERE, 0.5)),
            ("most", ValueError, lambda: guard.work(0)),
            ("tool", ValueError, lambda: guard.closest([SPHERE], 0)),
            ("tool", ValueError, lambda: guard.closest([1, 2, 3], 0)),
            ("tool", ValueError, lambda: guard.closest([0, 0, 0, -1], 0)),
            ("tool", ValueError, lambda: guard.closest([0, 0, float("nan"), 1], 0)),
            ("margin", ValueError, lambda: guard.contacts(SPHERE, -1, 0)),
            ("margin", TypeError, lambda: guard.contacts(SPHERE, None, 0)),
            ("tool", ValueError, lambda: guard.contacts([1, 2, 3], 5, 0)),
            ("now", TypeError, lambda: guard.contacts(SPHERE, 5, 0.5)),
            ("answer", TypeError, lambda: WALL.force(None)),
            ("filter", TypeError, lambda: guard.admit(None, SPHERE, dibs.RigidMotion([0, 0, 0]), 0)),
            ("command", TypeError, lambda: guard.admit(dibs.Filter(TREE, 1, 2), SPHERE, None, 0)),
            ("tool", ValueError, lambda: guard.admit(dibs.Filter(TREE, 1, 2), [1, 2], dibs.RigidMotion([0, 0, 0]), 0)),
            ("stiffness", ValueError, lambda: dibs.ForbiddenRegion(float("inf"), 0, 5, 5)),
            ("", ValueError, lambda: dibs.ForbiddenRegion(0, 0, 5, 5)),
            ("", ValueError, lambda: dibs.ForbiddenRegion(1, 0, 5, -5)),
        ]:
            with self.subTest(name), self.assertRaises(error) as raised:
                call()
            sentence = str(raised.exception)
            self.assertTrue(sentence.startswith(name + ":" if name else ""), sentence)
            self.assertNotRegex(sentence, "--|`dibs")
        self.assertIn("SAFE", repr(answer))
        self.assertFalse(any("--" in reason for reason in dibs.SIDE_REASONS))

    def test_the_example_answers_by_udp(self):
        example = pathlib.Path(__file__).parents[3] / "examples/python/udp_guard.py"
        with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            TREE.save(tree := f"{folder}/heart.dibs")
            free.bind(("127.0.0.1", 0))
            port = str(free.getsockname()[1])
            free.close()
            command = [sys.executable, str(example), tree, port, "0,0,90,0,0,150,2.5"]
            with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as loop:
                sender, is_over = dibs.Sender(TREE, f"udp:127.0.0.1:{port}"), threading.Event()

                def send():
                    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as noise:
                        while not is_over.wait(0.02):
                            with contextlib.suppress(ValueError, OSError):
                                noise.sendto(b"no packet", ("127.0.0.1", int(port)))
                                sender.send(BEAT.frames[0], age=0)
                                sender.poll()

                threading.Thread(target=send).start()
                try:
                    said = next(line for line in itertools.islice(loop.stdout, 300) if line.startswith("["))
                finally:
                    is_over.set()
                    loop.kill()
        lower, upper, separation = map(float, re.findall(r"-?\d+\.\d+", said))
        truth = TREE.query([0, 0, 90, 0, 0, 150, 2.5], surface=BEAT.frames[0])["separation"]
        self.assertTrue(lower < truth < upper < lower + 150, said)
        self.assertAlmostEqual(separation, truth, delta=0.01)

    def test_the_example_takes_a_solver_s_frames(self):
        example = pathlib.Path(__file__).parents[3] / "examples/python/solver.py"
        said = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, check=True, timeout=60).stdout
        # The least and largest separation in a beat, with a millimetre for the extrapolation.
        mesh, motion = dibs.generate("heart", 1_000)
        tree = dibs.build(mesh, stretch=1.5)
        truth = [tree.query([0, 0, 90, 0, 0, 150, 2.5], surface=frame)["separation"] for frame in motion.frames]
        self.assertTrue(min(truth) - 1 < float(said) < max(truth) + 1, f"{said} {truth}")

    def test_the_readme_has_the_loop(self):
        readme = (pathlib.Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
        block = next(block for block in re.findall(r"```python\n(.*?)```", readme, re.DOTALL) if "Guard(" in block)
        sender = dibs.Sender(TREE, heartbeat=None)
        sender.send(BEAT.frames[0], age=0)
        here = {"dibs": dibs, "tree": TREE, "packets": sender.packets(), "now": 7, "tool": SPHERE, "pressed": True}
        exec(compile(block, "README.md", "exec"), here)
        self.assertEqual(here["guard"].counters["published"], 1)
        self.assertEqual(here["force"].state, dibs.ForceState.SAFE)


if __name__ == "__main__":
    unittest.main()

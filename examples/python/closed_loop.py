"""A hand pushes an instrument against a beating heart, and a filter of commands keeps it out.

Everything is simulated: the heart, a hand that pulls the instrument to a point inside it and back, imaging with a delay
of some milliseconds, and a robot that executes the admitted motion. At the end of every tick a whole query measures the
separation from the true heart at that time. bindings/python/tests/test_filter.py runs it.
"""

from collections import Counter

import numpy as np

import dibs

TICK = 0.001  # s
TICKS = 1_500
STAND_OFF = 1.0  # mm
LATE = 4  # delay of the imaging, in ticks
ROBOT = 300.0  # mm/s
PULL = 20.0  # 1/s: the hand's stiffness, as a part of the robot's damping
HAND = 200.0  # mm/s


class Heart:
    """A beating heart, in a loop."""

    def __init__(self, triangles=1_000):
        mesh, motion = dibs.generate("heart", triangles)
        self.tree = dibs.build(mesh, stretch=1.5)
        self.frames, self.rate = motion.frames, motion.rate
        steps = np.roll(self.frames, -1, axis=0) - self.frames
        self.speed = float(np.linalg.norm(steps, axis=2).max() * self.rate)
        self.centre = mesh.vertices.mean(axis=0)

    def at(self, tick):
        """The surface at a tick."""
        place = max(tick, 0) * TICK * self.rate
        first, share = int(place), place % 1.0
        before, after = (self.frames[number % len(self.frames)] for number in (first, first + 1))
        return self.tree.surface(before + (after - before) * share)


def hand(target, tool, tick):
    """The motion that the hand commands: a pull to the target, and a rotation of the wrist."""
    pull = (target - tool[:3]) * PULL * TICK
    pull *= min(1.0, HAND * TICK / np.linalg.norm(pull))
    return dibs.RigidMotion(tool[:3], pull, [0.0, 0.0, 0.0005 * np.sin(0.01 * tick)])


def simulate(ticks=TICKS):
    """Returns the least separation with and without the filter, the reasons, and the most instructions of a tick."""
    heart = Heart()
    guard = dibs.Filter(heart.tree, STAND_OFF, ROBOT)
    inside, outside = heart.centre, heart.centre + [95.0, 3.0, 30.0]
    shaft = np.array([20.0, 60.0, 40.0])
    tool = dibs.capsules([outside], [outside + shaft], 2.5)[0]
    free = tool
    least, unfiltered, reasons, instructions = np.inf, np.inf, Counter(), 0
    for tick in range(ticks):
        target = inside if tick % 1_200 < 800 else outside
        command, unguarded = hand(target, tool, tick), hand(target, free, tick)
        known, error = heart.at(tick - LATE), heart.speed * LATE * TICK
        admitted = guard.admit(tool, command, TICK, known, tissue_speed=heart.speed, error=error)
        tool, free = admitted.motion.apply(tool), unguarded.apply(free)
        tissue = heart.at(tick + 1)
        least = min(least, heart.tree.query(tool, surface=tissue)["lower"])
        unfiltered = min(unfiltered, heart.tree.query(free, surface=tissue)["lower"])
        reasons[admitted.reason] += 1
        instructions = max(instructions, admitted.instructions)
    return least, unfiltered, reasons, instructions


if __name__ == "__main__":
    least, unfiltered, reasons, instructions = simulate()
    print(f"least separation {least:.3f} mm with a stand-off of {STAND_OFF} mm")
    print(f"a robot without a filter: {unfiltered:.3f} mm")
    print(f"reasons: {dict(reasons)}; at most {instructions} instructions a tick")

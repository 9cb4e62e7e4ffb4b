"""A solver's own frames: its thread hands them to a guard by a call, with the receiver's checks.

bindings/python/tests/test_guard.py runs it.
"""

import threading
import time

import dibs

mesh, motion = dibs.generate("heart", 1_000)
tree = dibs.build(mesh, stretch=1.5)
# No sender echoes statuses here.
guard = dibs.Guard(tree, 300, 200, automatic=True, without_transit=True)
is_over = threading.Event()


def now():
    """ms."""
    return time.monotonic_ns() // 1_000_000


def solve():
    """The solver: positions of the mesh's vertices, in the mesh's order."""
    number = 0
    while not is_over.wait(1 / motion.rate):
        guard.frame(motion.frames[number % len(motion.frames)], now())
        while guard.work() == "pending":
            pass
        number += 1


threading.Thread(target=solve).start()
for _ in range(2_000):  # the control loop, safe for its first second
    time.sleep(0.001)
    answer = guard.closest([0, 0, 90, 0, 0, 150, 2.5], now())
is_over.set()
print(answer.closest["separation"] if answer.closest is not None else answer.reason)

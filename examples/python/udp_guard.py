"""A controller's loop on a computer: the interval that holds a tool's distance from a surface that comes by UDP.

    python udp_guard.py heart.dibs 5000 0,0,90,0,0,150,2.5
    dibs bridge heart.dibs --from igtl:HOST:PORT --to udp:127.0.0.1:5000

It prints the interval, which is as wide as the tissue may have moved since the last frame, and the separation from the
surface as it is extrapolated.
"""

import contextlib
import itertools
import socket
import sys
import time

import dibs

# Tissue of at most 300 mm/s, surfaces of at most 200 ms. A robot's loop leaves `automatic` out and waits for an operator.
guard = dibs.Guard(dibs.Tree.load(sys.argv[1]), speed_mm_per_s=300, age_ms=200, automatic=True)
line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
line.bind(("127.0.0.1", int(sys.argv[2])))
line.settimeout(0.001)
tool = [float(number) for number in sys.argv[3].split(",")]
for tick in itertools.count():
    now = time.monotonic_ns() // 1_000_000 % 2**32
    # What is refused is counted by its cause, and the last good surface stays.
    with contextlib.suppress(TimeoutError, ValueError):
        packet, sender = line.recvfrom(1472)
        guard.packet(packet, now)
        if status := guard.status(now):
            line.sendto(status, sender)
    with contextlib.suppress(ValueError):
        guard.work(1_000)
    answer = guard.closest(tool, now)
    if tick % 100 == 0:
        found = answer.closest
        numbers = "[{:.3f}, {:.3f}], {:.3f}"
        print(answer.reason or numbers.format(*found["interval"], found["separation"]), flush=True)

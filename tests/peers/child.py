"""One library in a process of its own: `python child.py WHAT LIBRARY INPUT OUTPUT`.

Both files are NumPy's. The input has `triangles`, `frames` and `points`, some for each frame.
"""

from __future__ import annotations

import importlib
import os
import sys

import numpy as np


def main() -> None:
    what, name, given, found = sys.argv[1:]
    # One core, so that no library gains by threads.
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    peer = importlib.import_module(f"libraries.{name}").Peer
    task = importlib.import_module(what)
    with np.load(given) as case:
        results = task.measure(peer, case["triangles"], case["frames"], case["points"])
    np.savez(found, **results)


if __name__ == "__main__":
    main()

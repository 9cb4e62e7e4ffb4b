"""How long a library takes for a new frame and for a question."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from library import Library
from shapes import Points, Triangles

LIMIT = 15.0
"""Seconds for the questions of one case: a slow library gets fewer."""


def measure(peer: type[Library], triangles: Triangles, frames: Points, points: Points) -> dict[str, Any]:
    """Nanoseconds of each update, of each question alone, and of a question in a batch."""
    library = peer(triangles, frames)
    updates, questions, batches = [], [], []
    for positions, asked in zip(frames, points):
        updates.append(_took(library.update, positions))
        batches.append(_took(library.batch, asked) / len(asked))
        end = time.monotonic() + LIMIT / len(frames)
        for point in asked:
            questions.append(_took(library.one, point))
            if time.monotonic() > end:
                break
    return {name: np.array(each) for name, each in [("update", updates), ("one", questions), ("batch", batches)]}


def _took(call: Callable[[Points], object], points: Points) -> int:
    start = time.perf_counter_ns()
    call(points)
    return time.perf_counter_ns() - start

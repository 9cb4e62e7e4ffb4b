"""A library's answers to all points of a case."""

from __future__ import annotations

from typing import Any

import numpy as np

from library import Library
from shapes import Points, Triangles


def measure(peer: type[Library], triangles: Triangles, frames: Points, points: Points) -> dict[str, Any]:
    """Distances and sides; a frame that the library refuses has none, and its reason."""
    library = peer(triangles, frames)
    size = float(np.abs(frames).max())
    distance = np.full(points.shape[:2], np.nan)
    side = np.zeros(points.shape[:2], np.int8)
    accuracy = np.full(points.shape[:2], library.accuracy(size))
    refused = []
    for number, (positions, asked) in enumerate(zip(frames, points)):
        try:
            library.update(positions)
            found = library.batch(asked)
        except (RuntimeError, ValueError) as error:
            refused.append(f"frame {number}: {error}".splitlines()[0])
            continue
        distance[number], side[number] = found.distance, found.side
        if found.accuracy is not None:
            accuracy[number] = found.accuracy
    return {"distance": distance, "side": side, "accuracy": accuracy, "refused": np.array(refused, str)}

"""What a library keeps of a surface."""

from __future__ import annotations

import ctypes
import gc
import pathlib
from typing import Any

from library import Library
from shapes import Points, Triangles
from subjects import tetrahedron

PAGE = 4096


def measure(peer: type[Library], triangles: Triangles, frames: Points, points: Points) -> dict[str, Any]:
    """Bytes a triangle: how much larger the process is with the surface than without."""
    small = tetrahedron()
    # What the library loads when it is first used does not count.
    _used(peer, small.triangles, small.frames, points)
    before = _resident()
    library = _used(peer, triangles, frames, points)
    after = _resident()
    return {"bytes": (after - before) / len(triangles), "of": library.name}


def _used(peer: type[Library], triangles: Triangles, frames: Points, points: Points) -> Library:
    library = peer(triangles, frames)
    library.update(frames[0])
    library.batch(points[0])
    return library


def _resident() -> int:
    """Of the process, after memory that is free has been given back."""
    gc.collect()
    ctypes.CDLL(None).malloc_trim(0)
    return int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * PAGE

"""Recorded motions, and the stretch that they need."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs
from ._arrays import Floats
from ._pickle import Bound

if TYPE_CHECKING:
    from ._mesh import Mesh
    from ._tree import Tree


class Motion(NamedTuple):
    """Frames of a moving mesh."""

    frames: Floats
    """Positions in millimetres: (frames, vertices, 3)."""
    rate: float
    """Frames a second; 0 if the file does not state it."""


def frames_of(native: tuple[bytearray, int, float]) -> Motion:
    positions, count, rate = native
    return Motion(np.frombuffer(positions, "<f8").reshape(count, -1, 3), rate)


def read_motion(path: Union[str, os.PathLike[str]], mesh: Union[Mesh, Tree], *, unit: Optional[str] = None) -> Motion:
    """Reads a motion of a mesh: PC2, .npy, or a series of meshes, heart_%03d.vtp."""
    return frames_of(_dibs.read_motion(os.fspath(path), unit, mesh.origin.tolist()))


class MotionStretch(Bound):
    """The largest stretch of each triangle of a mesh in the frames of a motion."""

    stretch: Floats
    """A factor for each triangle."""
    frame: npt.NDArray[np.uint32]
    """The first frame with that stretch."""

    _instead = "send its `limits`"

    def __init__(self, mesh: Mesh, frames: npt.ArrayLike) -> None:
        points = _arrays.points("frames", frames, 3)
        if points.shape[1] != len(mesh.vertices):
            raise ValueError(
                f"frames: {points.shape[1]} positions a frame, and the mesh has {len(mesh.vertices)} vertices"
            )
        self._native = _dibs.MotionStretch(mesh._native, points.tobytes())
        self.stretch = np.frombuffer(self._native.stretch(), "<f8")
        self.frame = np.frombuffer(self._native.frame(), "<u4")

    def limits(self, margin: float = 0.1) -> npt.NDArray[np.float32]:
        """Limits for `build`: each triangle's largest stretch, `margin` (0.1: a tenth) more, and the rounding of the
        controller's check: 0.0006, and up to 0.016 for a triangle with a sharp corner."""
        margin = _arrays.number("margin", margin)
        if margin < 0:
            raise ValueError(f"margin: {margin} is below 0")
        return np.frombuffer(self._native.limits(margin), "<f4")

"""Instruments as rows of numbers: four for a sphere, seven for a capsule."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from . import _arrays
from ._arrays import Floats


def spheres(centres: npt.ArrayLike, radius: npt.ArrayLike) -> Floats:
    """Rows x, y, z, radius, from one or several centres and one radius or one for each."""
    return _rows([_point("centres", centres)], radius)


def capsules(starts: npt.ArrayLike, ends: npt.ArrayLike, radius: npt.ArrayLike) -> Floats:
    """Rows x1, y1, z1, x2, y2, z2, radius, from one or several axes and one radius or one for each."""
    return _rows([_point("starts", starts), _point("ends", ends)], radius)


def _point(name: str, value: npt.ArrayLike) -> Floats:
    array = _arrays.numbers(name, value)
    return _arrays.points(name, array[np.newaxis] if array.ndim == 1 else array)


def _rows(parts: list[Floats], radius: npt.ArrayLike) -> Floats:
    radii = _arrays.finite("radius", _arrays.numbers("radius", radius))
    if radii.ndim > 1:
        raise ValueError(f"radius: the shape is {radii.shape}; give one, or one for each tool")
    columns = [*parts, radii.reshape(-1, 1)]
    try:
        count = np.broadcast_shapes(*(part.shape[:1] for part in columns))
    except ValueError:
        lengths = ", ".join(str(len(part)) for part in columns)
        raise ValueError(f"tools: points and radii of different numbers: {lengths}") from None
    return np.concatenate([np.broadcast_to(part, (*count, part.shape[1])) for part in columns], axis=1)


class Poses(NamedTuple):
    """Checked tools: a chain for each pose."""

    rows: Floats
    """(poses, tools, numbers of a tool)."""
    is_single: bool
    """Whether one tool was given instead of an array of poses."""

    @property
    def native(self) -> tuple[bytes, int, int]:
        """The bytes, the numbers per tool, and the tools per pose."""
        _, tools, numbers = self.rows.shape
        return self.rows.tobytes(), numbers, tools


def poses(value: npt.ArrayLike) -> Poses:
    """Checks tools."""
    array = _arrays.numbers("tools", value)
    if array.ndim not in (1, 2, 3) or array.shape[-1] not in (4, 7) or (array.ndim == 3 and array.shape[1] == 0):
        raise ValueError(
            f"tools: the shape is {array.shape}; give (poses, 4) for spheres (x, y, z, radius), "
            "(poses, 7) for capsules (x1, y1, z1, x2, y2, z2, radius), or (poses, tools, 4 or 7) for chains"
        )
    array = _arrays.finite("tools", array)
    chain = array.shape[1] if array.ndim == 3 else 1
    return Poses(array.reshape(-1, chain, array.shape[-1]), array.ndim == 1)

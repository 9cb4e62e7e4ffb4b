"""Instruments as rows of numbers: four of a sphere, seven of a capsule."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _arrays
from ._arrays import Floats


def spheres(centres: npt.ArrayLike, radius: npt.ArrayLike) -> Floats:
    """Rows x, y, z, radius, of one centre or several and one radius or one for each."""
    return _rows([_point("centres", centres)], radius)


def capsules(starts: npt.ArrayLike, ends: npt.ArrayLike, radius: npt.ArrayLike) -> Floats:
    """Rows x1, y1, z1, x2, y2, z2, radius, of one axis or several and one radius or one for each."""
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


def rows(value: npt.ArrayLike) -> tuple[Floats, bool]:
    """Checked rows, and whether there was one that is no row of several."""
    array = _arrays.numbers("tools", value)
    is_single = array.ndim == 1
    if is_single:
        array = array[np.newaxis]
    if array.ndim != 2 or array.shape[1] not in (4, 7):
        raise ValueError(
            f"tools: the shape is {array.shape}; give (poses, 4) for spheres (x, y, z, radius) "
            "or (poses, 7) for capsules (x1, y1, z1, x2, y2, z2, radius)"
        )
    return _arrays.finite("tools", array), is_single

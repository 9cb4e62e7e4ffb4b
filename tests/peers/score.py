"""Counts wrong sides and wrong distances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import truth
from shapes import Points

BAND = 2.0**-22
"""Times the largest coordinate: a point nearer to the surface is in the band of single precision's rounding."""

TINY = 1e-3
"""Millimetres. A point without a side that is nearer hardly misses one."""

LARGEST = ("farthest wrong side", "largest error")
"""Of these, the largest counts, not the sum."""

Flags = npt.NDArray[np.bool_]


class Case(NamedTuple):
    """The truth of all points of a subject."""

    size: float
    """The largest coordinate."""
    distance: Points
    side: npt.NDArray[np.int64]
    on_surface: Flags

    @property
    def band(self) -> float:
        return BAND * self.size

    @property
    def is_clear(self) -> Flags:
        """Has a side, and lies outside the band."""
        return (self.side != 0) & (self.distance > self.band)

    @property
    def is_in_band(self) -> Flags:
        return (self.side != 0) & (self.distance <= self.band)


def score(case: Case, answers: Mapping[str, Any]) -> dict[str, Any]:
    """The counts of one library on one subject."""
    distance, side = answers["distance"], answers["side"]
    is_wrong = side * case.side == -1
    no_side = (side == 0) & case.is_clear
    has_distance = ~np.isnan(distance)
    off = np.where(has_distance, np.abs(distance - case.distance), 0)
    allowed = answers["accuracy"] + truth.ERROR * case.size
    wrong_sides = is_wrong & case.is_clear
    return {
        "points": int(side.size),
        "clear": int(case.is_clear.sum()),
        "on the surface": int(case.on_surface.sum()),
        "cut by itself": int(((case.side == 0) & ~case.on_surface).sum()),
        "answered": int((has_distance | (side != 0)).sum()),
        "wrong sides": int(wrong_sides.sum()),
        "farthest wrong side": float(np.where(wrong_sides, case.distance, 0).max()),
        "no side": int(no_side.sum()),
        "no side, not tiny": int((no_side & (case.distance > TINY)).sum()),
        "in band": int(case.is_in_band.sum()),
        "wrong in band": int((is_wrong & case.is_in_band).sum()),
        "distances": int(has_distance.sum()),
        "wrong distances": int((off > allowed).sum()),
        "largest error": float(off.max()),
        "refused": [str(line) for line in answers["refused"]],
    }


def added(scores: list[dict[str, Any]]) -> dict[str, Any]:
    """Of several subjects together."""
    total: dict[str, Any] = {}
    for each in scores:
        for name, value in each.items():
            if name in LARGEST:
                total[name] = max(total.get(name, 0.0), value)
            else:
                total[name] = total[name] + value if name in total else value
    return total

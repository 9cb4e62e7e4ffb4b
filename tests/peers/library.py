"""What each library is asked to do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from shapes import Points, Triangles

# Units in the last place that a library may be off by where it states no accuracy, of the largest coordinate.
UNITS = 64


class Answers(NamedTuple):
    """One for each point."""

    distance: Points
    """To the surface, in millimetres, without sign; not a number where there is none."""
    side: npt.NDArray[np.int64]
    """1 outside, -1 inside, 0 where the library gives none."""
    accuracy: Points | None = None
    """In millimetres, where the library states it for each answer."""


def signed(distance: npt.ArrayLike) -> Answers:
    """Of distances that are negative inside."""
    values = np.asarray(distance, np.float64)
    return Answers(np.abs(values), np.sign(np.nan_to_num(values)).astype(np.int64))


def unsigned(distance: npt.ArrayLike) -> Answers:
    """Of distances without a side."""
    values = np.asarray(distance, np.float64)
    return Answers(values, np.zeros(len(values), np.int64))


class Library(ABC):
    """A library with one surface. The constants are words for the page."""

    name: str
    package: str
    """Its distribution, whose version the page says."""
    stated: str = "none; 64 units in the last place, double"
    """The accuracy that its documents state, or what is taken for it."""
    update_by: str
    inside: str

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        """`frames` are those that `update` may get; the first is the rest shape."""
        self.triangles = triangles

    @abstractmethod
    def update(self, positions: Points) -> None:
        """The surface has moved."""

    @abstractmethod
    def batch(self, points: Points) -> Answers:
        """Of many points at once."""

    def one(self, point: Points) -> None:
        """Of one point, as a loop asks: to be timed."""
        self.batch(point[np.newaxis])

    def accuracy(self, size: float) -> float:
        """What `stated` comes to, in millimetres, of a surface whose largest coordinate is `size`."""
        return UNITS * 2.0**-53 * size

"""Walls: the forces that keep a tool off the surface, and the account of the energy that they give."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs
from ._filter import TrackerAnswer, _vector
from ._guard import Answer
from ._pickle import Remade


class ForceState(IntEnum):
    """Which rule a force comes from."""

    INACTIVE = 0
    """The tool is outside the margin."""
    ACTIVE = 1
    """The wall acts."""
    SATURATED = 2
    """The wall acts with its largest force."""
    SAFE = 3
    """There is no pair to act on: the force is the hold, pure damping."""


class Force(NamedTuple):
    """A force on the tool."""

    force: npt.NDArray[np.float32]
    """In N. Always finite."""
    state: ForceState
    cause: Optional[str]
    """The cause of a hold."""


class Wrench(NamedTuple):
    """A force and a torque on the tool."""

    force: npt.NDArray[np.float32]
    """In N. Always finite."""
    torque: npt.NDArray[np.float32]
    """In N mm, about the given origin. Always finite."""
    state: ForceState
    cause: Optional[str]
    """The cause of a hold."""


_NONE = (0.0, 0.0, 0.0)


def _spring(stiffness: float, damping: float, hold_damping: float, max_force: float) -> list[float]:
    names = ["stiffness", "damping", "hold_damping", "max_force"]
    return [*map(_arrays.number, names, [stiffness, damping, hold_damping, max_force])]


class ForbiddenRegion(Remade):
    """A wall: a margin around the surface, with a spring and a damper.

    `stiffness` in N/mm, `damping` and `hold_damping` (used if there is no pair to act on) in N s/mm, `max_force` in N,
    `margin` in mm. A sampled wall is passive only if the device's damping is above `stiffness * tick / 2 + damping`.
    """

    def __init__(
        self, stiffness: float, damping: float, max_force: float, margin: float, *, hold_damping: float = 0.0
    ) -> None:
        spring = _spring(stiffness, damping, hold_damping, max_force)
        self._native = _dibs.ForbiddenRegion(spring, _arrays.number("margin", margin))

    def force(self, answer: Union[Answer, TrackerAnswer], velocity: Optional[npt.ArrayLike] = None) -> Force:
        """The force on the tool, at every tick. For a tracker's answer pass the `velocity` (mm/s) of the tool's point
        of the pair relative to the surface's; a guard's answer has it."""
        if isinstance(answer, TrackerAnswer):
            flow = _vector("velocity", _NONE if velocity is None else velocity).tolist()
            force, state, cause = self._native.force_of(answer._native, flow)
        elif isinstance(answer, Answer):
            force, state, cause = self._native.force(answer._native)
        else:
            raise TypeError(f"answer: an Answer of Guard.closest is needed, not {type(answer).__name__}")
        return Force(np.array(force, dtype=np.float32), ForceState(state), cause)


class Proxy(Remade):
    """A wall that acts by all contacts: with one contact a `ForbiddenRegion`; in a corner it holds against both walls.

    A proxy is the position nearest to the tool at which no contact would be within the margin; a spring pulls the tool
    there, and each contact's force acts at its point of the tool, which gives the torque. The parameters are those of a
    `ForbiddenRegion`. In a narrow gap whose walls are both within the margin a force may step: choose a margin below
    half of the gap, less the tool's radius.
    """

    def __init__(
        self, stiffness: float, damping: float, max_force: float, margin: float, *, hold_damping: float = 0.0
    ) -> None:
        spring = _spring(stiffness, damping, hold_damping, max_force)
        self._native = _dibs.Proxy(spring, _arrays.number("margin", margin))

    def force(
        self,
        answer: Union[Answer, TrackerAnswer],
        origin: npt.ArrayLike,
        velocity: npt.ArrayLike = _NONE,
        angular: npt.ArrayLike = _NONE,
    ) -> Wrench:
        """The force on the tool at this tick, and its torque about `origin` (mm).

        `answer` is one with contacts: of `Guard.contacts`, or of `Tracker.closest` with a margin, of at least this wall's.
        `velocity` (mm/s) is the tool's at `origin`, `angular` (1/s) its angular velocity; the surface's velocity is that of
        a guard's contacts, and zero for a tracker's. Without a pair or a list to act on the force is the hold.
        """
        names = ("origin", "velocity", "angular")
        twist = [_vector(name, value).tolist() for name, value in zip(names, (origin, velocity, angular))]
        if isinstance(answer, TrackerAnswer):
            found = self._native.force_of(answer._native, twist)
        elif isinstance(answer, Answer):
            found = self._native.force(answer._native, twist)
        else:
            raise TypeError(f"answer: an Answer of Guard.contacts is needed, not {type(answer).__name__}")
        force, torque, state, cause = found
        return Wrench(np.array(force, np.float32), np.array(torque, np.float32), ForceState(state), cause)


class EnergyAccount(Remade):
    """An account of the energy that a wall's force gives to the hand, relative to the wall, with a limit on the force's steps.

    A wall that moves with its frames, the end of a hold and a saturation that yields give energy. The account sums force
    times relative velocity, and removes from the force the part along an outward motion that would give more than
    received and a `tank` (mJ). From tick to tick the force changes by at most `step` (N): where the relative velocity
    leaps outwards, the wall gives more until the force has fallen. At speeds up to `speed` (mm/s, of the tool relative to
    the wall; of a faster motion only this is counted) all this together is at most
    `speed * period * (F + step / 2)**2 / (2 * step)` for the wall's largest force `F` (`max_force`, N). An account that
    has used it up recovers by a tenth of the tank per second, up to an eighth, so that the wall keeps a force.
    `stiffness` (N/mm) is the wall's.
    """

    def __init__(
        self, tank: float, step: float, stiffness: float, max_force: float, speed: float
    ) -> None:
        names = ("tank", "step", "stiffness", "max_force", "speed")
        values = (tank, step, stiffness, max_force, speed)
        self._native = _dibs.EnergyAccount(*map(_arrays.number, names, values))

    def limit(
        self, force: npt.ArrayLike, velocity: npt.ArrayLike, period: float
    ) -> npt.NDArray[np.float32]:
        """The force (N) to apply for the next `period` (s), for the `force` of a wall.

        Call it at every tick, during a hold too. `velocity` (mm/s) is the tool's relative to the wall since the last tick.
        If a number of the two is not finite, as the velocity without a tool, the force falls to zero in steps; such a
        velocity counts as one along the force at the largest speed.
        """
        period = _arrays.number("period", period)
        if period <= 0:
            raise ValueError(f"period: {period} is not above 0")
        applied = self._native.limit(_three("force", force), _three("velocity", velocity), period)
        return np.array(applied, dtype=np.float32)

    @property
    def balance(self) -> float:
        """The energy (mJ) that may still be given; below 0 after an overdraft."""
        return self._native.balance()


def _three(name: str, value: npt.ArrayLike) -> list[float]:
    """Three numbers, finite or not."""
    array = _arrays.numbers(name, value)
    if array.shape != (3,):
        raise ValueError(f"{name}: the shape is {array.shape}; give 3 numbers")
    numbers: list[float] = array.astype(np.float64).tolist()
    return numbers

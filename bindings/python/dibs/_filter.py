"""Ticks on a moving surface: the closest pair within a budget, and commands that a filter admits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs
from ._arrays import Floats
from ._pickle import Bound, Remade
from ._tree import ANSWER, CONTACT, Contacts, Surface, Tree

Fallback = Literal["start", "surface", "jump", "full"]
"""Why a tick was a whole query."""
Reason = Literal["commanded", "nearest", "shortened", "stopped", "retreating", "no safe motion"]
"""Why a motion was admitted. All but the last are safe."""

_MOST = 0xFFFF_FFFF
_TOOLS = 8
_ROWS = 8


def contacts_of(native: tuple[bytearray, float, float]) -> Contacts:
    found, bound, accuracy = native
    single = [np.array([number], dtype=np.float32) for number in (bound, accuracy)]
    return Contacts(np.frombuffer(found, CONTACT), *single)


class TrackerAnswer(Bound):
    """The answer of a tracker's tick."""

    closest: np.void
    """The pair, a record of `ANSWER`: act on the first of its `interval`."""
    is_kept: bool
    """Whether the side is the last tick's, because this tick's search found none: its budget ended, or the side is
    undefined. The pair may then not be the closest; the interval is still valid."""
    fallback: Optional[Fallback]
    """The reason, if this tick was a whole query."""
    moved: Optional[float]
    """Upper bound (mm) on the motion of tool and surface together since the last tick; `None` if unknown."""
    contacts: Optional[Contacts]
    """All locally closest pairs within the margin, deepest first, and the bound of the list; `None` without a
    margin."""

    _instead = "send its `closest`"

    def __init__(self, native: _dibs.TrackerAnswer, contacts: Optional[tuple[bytearray, float, float]]) -> None:
        self._native = native
        self.closest = np.frombuffer(native.record(), ANSWER)[0]
        self.is_kept, self.fallback, self.moved = native.facts()
        self.contacts = None if contacts is None else contacts_of(contacts)

    def __repr__(self) -> str:
        return f"TrackerAnswer({self.closest['separation']} mm)"


class Tracker(Remade):
    """The closest pair at each tick, at the cost of what has changed: it remembers the proof of its last answer."""

    def __init__(self, tree: Tree) -> None:
        self._native = _dibs.Tracker(_tree(tree)._native)

    def closest(
        self,
        tool: npt.ArrayLike,
        surface: Union[Surface, Tree],
        *,
        instructions: Optional[int] = None,
        margin: Optional[float] = None,
    ) -> TrackerAnswer:
        """The closest pair of this tick, on the present surface.

        `tool` is x, y, z, radius of a sphere, or x1, y1, z1, x2, y2, z2, radius of a capsule. `instructions` limits the
        tick's work (pair, side, depth and contacts together) in instructions of a Cortex-M7, by a fitted cost model; a
        limit below its constant part leaves no test. If the limit ends the search, the interval is the last tick's,
        widened by the motion since, and the next tick continues. With a `margin` (mm) the contacts are listed.
        """
        numbers = tool_of(tool)
        margin = None if margin is None else _at_least("margin", margin, 0)
        budget = None if instructions is None else _whole("instructions", instructions)
        return TrackerAnswer(*self._native.tick(_surface(surface)._native, numbers, budget, margin))


class RigidMotion(NamedTuple):
    """The motion of a rigid instrument in a period: a translation of its reference point and a rotation about it."""

    about: npt.ArrayLike
    """The reference point before the motion, in mm."""
    translation: npt.ArrayLike = (0.0, 0.0, 0.0)
    """Its displacement in mm."""
    rotation: npt.ArrayLike = (0.0, 0.0, 0.0)
    """The rotation vector: the axis, times the angle in radians. A filter admits half a radian at most."""

    def apply(self, tools: npt.ArrayLike) -> Floats:
        """The tools after the motion: spheres of 4 numbers, or capsules of 7."""
        moved = _arrays.finite("tools", _arrays.numbers("tools", tools)).copy()
        if moved.shape[-1:] not in ((4,), (7,)):
            raise ValueError(f"tools: the shape is {moved.shape}; give 4 numbers of a sphere, or 7 of a capsule")
        about, translation, rotation = (_vector(name, each) for name, each in zip(self._fields, self))
        angle = float(np.linalg.norm(rotation))
        sine, cosine = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
        for place in range(0, moved.shape[-1] - 1, 3):
            arm = moved[..., place : place + 3] - about
            across = np.cross(rotation, arm)
            turned = arm + across * sine + np.cross(rotation, across) * cosine
            moved[..., place : place + 3] = about + turned + translation
        return moved


class Uncertainty(NamedTuple):
    """How far the tissue may be from the known surface: `filter.admit(..., **tissue._asdict())`.

    Tissue of at most 100 mm/s, registered to within 0.5 mm, on a frame held for 12 ms after 4 ms on the way:
    `Uncertainty(100.0, 0.5).after(12).after(4)`.
    """

    tissue_speed: float
    """Largest speed (mm/s) of any point of the tissue."""
    error: float = 0.0
    """mm, at the start of a period: the error of registration, and what `after` adds."""

    def after(self, ms: int) -> Uncertainty:
        """The same for a surface of this age: adds the speed times the age. Age and transit both count."""
        older = _dibs.after(*self._checked(), _whole("ms", ms))
        return self._replace(error=older)

    def stand_off(self, period: float) -> float:
        """The distance (mm) between tool and known surface at which a `period` (s) starts without a risk of contact: the
        uncertainty at its end. A filter keeps its stand-off in addition."""
        return _dibs.stand_off(*self._checked(), _at_least("period", period, 0))

    def _checked(self) -> tuple[float, float]:
        return _at_least("tissue_speed", self.tissue_speed, 0), _at_least("error", self.error, 0)


class AdmittedMotion(NamedTuple):
    """The motion that a filter admits."""

    motion: RigidMotion
    """The motion to execute."""
    least_separation: float
    """Lower bound (mm) on any tool's separation during the period, as long as the tissue is within its uncertainty."""
    reason: Reason
    """Why this motion was chosen."""
    queries: int
    """Number of queries."""
    instructions: int
    """Instructions of the tick on a Cortex-M7, by the fitted cost model."""


class Filter(Remade):
    """A filter of commands: the motion closest to a commanded one that keeps a rigid chain of tools out of the tissue.

    It keeps every tool `stand_off` (mm) from the tissue, and a larger distance from the triangles of the labels in
    `stand_off_of`, up to 7, say `{VESSEL: 3.0}`: each of these counts as one more tool for every tool. It is for a robot
    that moves its reference point with at most `speed` (mm/s). A rotation by one radian counts as a translation by the
    `lever` arm (mm), by default the distance from the reference point to the farthest end of a tool's axis. If `approach` (s) is not 0, a tool approaches its
    stand-off no faster than its distance from it divided by `approach`. `instructions` limits a tick, in instructions of a
    Cortex-M7 by the fitted cost model. A motion that is not verified within the limit is not admitted.
    """

    def __init__(
        self,
        tree: Tree,
        stand_off: float,
        speed: float,
        *,
        stand_off_of: Mapping[int, float] = MappingProxyType({}),
        lever: Optional[float] = None,
        approach: float = 0.0,
        instructions: int = 200_000,
    ) -> None:
        stand_off = _at_least("stand_off", stand_off, 0)
        if not isinstance(stand_off_of, Mapping):
            raise TypeError(f"stand_off_of: a mapping of labels is needed, not {type(stand_off_of).__name__}")
        of_labels = [_of_label(label, each, stand_off) for label, each in stand_off_of.items()]
        speed = _arrays.number("speed", speed)
        if speed <= 0:
            raise ValueError(f"speed: {speed} is not above 0")
        lever = None if lever is None else _at_least("lever", lever, 1)
        approach = _at_least("approach", approach, 0)
        budget = _whole("instructions", instructions)
        self._native = _dibs.Filter(_tree(tree)._native, stand_off, of_labels, speed, lever, approach, budget)

    def admit(
        self,
        tools: npt.ArrayLike,
        command: RigidMotion,
        period: float,
        surface: Union[Surface, Tree],
        *,
        tissue_speed: float = 0.0,
        error: float = 0.0,
        rows: Iterable[npt.ArrayLike] = (),
    ) -> AdmittedMotion:
        """The motion to execute in the next `period` (s).

        `tools` are the capsules of one rigid instrument as they are now, up to 8, or one of them; a sphere is a capsule whose
        ends are one. `surface` is the surface as it is known now: the tissue is within `error` (mm) of it, its speed times age
        and transit and the error of registration, and no point of it is faster than `tissue_speed` (mm/s). `rows` are up to
        8 limits of the caller's, seven numbers each: factors of the translation, of the rotation (mm), and the least sum
        allowed (mm).

        Raises `ValueError` for a number out of its range; nothing is admitted then, and the tool stays at rest. "no safe
        motion" is a reason: the stand-off is not kept, and the motion is the best one known.
        """
        array = _arrays.numbers("tools", tools)
        chain = array[np.newaxis] if array.ndim == 1 else array
        if chain.ndim != 2 or chain.shape[1] != 7 or not 1 <= len(chain) <= _TOOLS:
            raise ValueError(f"tools: the shape is {array.shape}; give (tools, 7), of 1 to {_TOOLS} capsules")
        chain = _arrays.finite("tools", chain)
        vectors = motion_of(command)
        period = _arrays.number("period", period)
        if period <= 0:
            raise ValueError(f"period: {period} is not above 0")
        tissue = (period, _at_least("tissue_speed", tissue_speed, 0), _at_least("error", error, 0))
        limits = [_row(number, row) for number, row in enumerate(rows)]
        if len(limits) > _ROWS:
            raise ValueError(f"rows: {len(limits)} rows, and {_ROWS} have a slot")
        native = self._native.admit(_surface(surface)._native, chain.tobytes(), vectors, tissue, limits)
        return admitted_of(vectors, native)


def _of_label(label: int, stand_off: float, least: float) -> tuple[int, float]:
    """A checked label and its stand-off."""
    if _whole("stand_off_of", label) > 255:
        raise ValueError(f"stand_off_of: {label} is no label from 0 to 255")
    return label, _at_least(f"stand_off_of[{label}]", stand_off, least)


def tool_of(tool: npt.ArrayLike) -> bytes:
    """The checked numbers of one tool."""
    array = _arrays.numbers("tool", tool)
    if array.shape not in ((4,), (7,)):
        raise ValueError(
            f"tool: the shape is {array.shape}; give 4 numbers of a sphere (x, y, z, radius), or 7 of a capsule "
            "(x1, y1, z1, x2, y2, z2, radius)"
        )
    return _arrays.finite("tool", array).tobytes()


def motion_of(command: Any) -> list[list[float]]:
    """The checked vectors of a command."""
    if not isinstance(command, RigidMotion):
        raise TypeError(f"command: a RigidMotion is needed, not {type(command).__name__}")
    names = ("command.about", "command.translation", "command.rotation")
    return [_vector(name, each).tolist() for name, each in zip(names, command)]


def admitted_of(
    command: list[list[float]], native: tuple[list[float], list[float], float, Reason, int, int]
) -> AdmittedMotion:
    translation, rotation, least, reason, queries, instructions = native
    motion = RigidMotion(np.array(command[0]), np.array(translation), np.array(rotation))
    return AdmittedMotion(motion, least, reason, queries, instructions)


def _tree(tree: Any) -> Tree:
    if not isinstance(tree, Tree):
        raise TypeError(f"tree: a Tree is needed, not {type(tree).__name__}")
    return tree


def _surface(surface: Any) -> Surface:
    if isinstance(surface, Tree):
        return surface.rest
    if not isinstance(surface, Surface):
        raise TypeError(f"surface: a Surface is needed, of Tree.surface, not {type(surface).__name__}")
    return surface


def _vector(name: str, value: npt.ArrayLike) -> Floats:
    array = _arrays.numbers(name, value)
    if array.shape != (3,):
        raise ValueError(f"{name}: the shape is {array.shape}; give 3 numbers")
    return _arrays.finite(name, array)


def _row(number: int, value: npt.ArrayLike) -> list[float]:
    name = f"rows: row {number}"
    array = _arrays.numbers(name, value)
    if array.shape != (7,):
        raise ValueError(f"{name}: the shape is {array.shape}; give 7 numbers")
    numbers: list[float] = _arrays.finite(name, array).tolist()
    return numbers


def _at_least(name: str, value: float, least: float) -> float:
    number = _arrays.number(name, value)
    if number < least:
        raise ValueError(f"{name}: {number} is below {least}")
    return number


def _whole(name: str, value: Any) -> int:
    return _arrays.whole(name, value, 0, _MOST)

"""The controller's side: packets in, the closest pair and its trust out."""

from __future__ import annotations

import operator
from enum import IntEnum
from typing import Any, Literal, Optional

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs
from ._filter import AdmittedMotion, Filter, RigidMotion, _at_least, admitted_of, contacts_of, motion_of, tool_of
from ._pickle import Bound, Remade
from ._tree import ANSWER, Contacts, Tree, _tests

_WRAP = 1 << 32

Progress = Literal["begun", "stored", "duplicate", "complete", "heartbeat", "hello"]
"""The outcome of a packet that was accepted."""
Advance = Literal["idle", "pending", "held", "published"]
"""The outcome of a slice of work."""


class State(IntEnum):
    """The trust in a surface."""

    NOMINAL = 0
    """Every input is within its limits."""
    DEGRADED = 1
    """The surface may be acted on, with a growing margin."""
    SAFE = 2
    """The surface must not be acted on."""


class Answer(Bound):
    """The answer of a tick: the pair that a wall may act on, and how it was found."""

    closest: Optional[np.void]
    """The pair to act on, a record of `ANSWER`: act on the lower bound of its `interval`. `None` if there is none."""
    reason: Optional[str]
    """Why there is no pair to act on."""
    velocity: npt.NDArray[np.float32]
    """Velocity (mm/s) of the tool's point of the pair relative to the surface's; zero at the first tick, and not a number
    without a tool."""
    state: State
    """The trust in the surface."""
    cause: Optional[str]
    """The cause of a state that is not nominal."""
    margin: float
    """Largest motion of the tissue (mm) in the surface's age and transit time. Part of the pair's accuracy."""
    waits_for_acknowledgement: bool
    """Whether only `Guard.acknowledge` is missing to leave the safe state."""
    epoch: Optional[int]
    """Number of the searched frame; `None` before the first."""
    age: Optional[int]
    """Its age in ms."""
    is_kept: bool
    """Whether the pair's side is the last tick's, because the budget ended or the side is undefined."""
    lag: Optional[int]
    """Time in ms by which the searched surface lags behind the present, as far as its error does not cover it."""

    _instead = "send its `closest`"

    def __init__(self, native: _dibs.Answer) -> None:
        self._native = native
        record = native.closest()
        self.closest = None if record is None else np.frombuffer(record, ANSWER)[0]
        self.reason = native.reason()
        self.velocity = np.array(native.velocity(), dtype=np.float32)
        state, self.cause, self.margin, self.waits_for_acknowledgement = native.trust()
        self.state = State(state)
        self.is_kept = native.is_kept()
        self.epoch, self.age, self.lag = native.searched() or (None, None, None)

    def __repr__(self) -> str:
        what = self.reason if self.closest is None else f"{self.closest['separation']} mm"
        return f"Answer({self.state.name}, {what})"


class Guard(Remade):
    """A controller's two ends of a moving surface: frames come in, in packets of a `Sender`, and each tick asks.

    `speed_mm_per_s` is the largest speed of the tissue; `age_ms` the largest age of a surface, about two periods of the
    source and the time on the way. From three quarters of it on the state is degraded, beyond it safe. The state is safe at
    first, and leaves that once frames come in time and `acknowledge` was called; with `automatic` by itself.
    `without_transit` is for a line on which no `status` goes back: a delayed frame is then taken for a new one.
    `ticks_a_second` is the rate of the calls of `closest`. `budget` bounds the node tests of a tick; an exact triangle
    test counts as 8.

    Times `now` are whole milliseconds of one clock, which may wrap at 2**32. Any thread may call; calls wait for each
    other: a tick for another thread's slice of `work`, whole `frame` or bytes of one `receive`. A pickled copy has no
    surface yet.
    """

    def __init__(
        self,
        tree: Tree,
        speed_mm_per_s: float,
        age_ms: int,
        *,
        ticks_a_second: int = 1_000,
        automatic: bool = False,
        without_transit: bool = False,
        budget: Optional[int] = None,
    ) -> None:
        if not isinstance(tree, Tree):
            raise TypeError(f"tree: a Tree is needed, not {type(tree).__name__}")
        speed = _arrays.number("speed_mm_per_s", speed_mm_per_s)
        age = _arrays.whole("age_ms", age_ms, 1, (1 << 31) - 1)
        ticks = _arrays.whole("ticks_a_second", ticks_a_second, 1, _WRAP - 1)
        choices = (bool(automatic), bool(without_transit))
        self._native = _dibs.Guard(tree._native, speed, age, ticks, choices, _tests(budget))

    def receive(self, data: bytes, now: int) -> None:
        """Receives bytes from a serial line or another stream. `counters` counts the outcomes by cause."""
        self._native.receive(_bytes("data", data), _now(now))

    def packet(self, packet: bytes, now: int) -> Progress:
        """Receives one whole packet from a network. Raises `ValueError` with the reason if it is refused."""
        return self._native.packet(_bytes("packet", packet), _now(now))

    def frame(
        self,
        positions: npt.ArrayLike,
        now: int,
        *,
        captured: Optional[int] = None,
        pose: Optional[tuple[npt.ArrayLike, npt.ArrayLike]] = None,
    ) -> None:
        """Receives a whole frame from this process, for example from a solver: one position (x, y, z) for each vertex
        of the mesh's file, or for each node, in that file's order. `captured` is the time of capture, by default `now`.
        `work` then checks and publishes it. Use one source at a time: an unfinished frame of packets is abandoned.
        Raises `ValueError` with the reason if it is refused (and counted); the last good surface stays.

        `pose` is the rigid pose of the whole mesh, a rotation (a quaternion x, y, z, w of length 1) and a shift (mm):
        its point `p` is at `rotation p + shift`. Tools and answers are then in world coordinates. Without a pose the
        mesh is where its file has it."""
        place_and_times = _place_and_times(pose, captured, now)
        self._native.frame(_arrays.points("positions", positions).tobytes(), *place_and_times)

    def frame_of_weights(
        self,
        weights: npt.ArrayLike,
        now: int,
        *,
        captured: Optional[int] = None,
        pose: Optional[tuple[npt.ArrayLike, npt.ArrayLike]] = None,
    ) -> None:
        """The same as `frame`, by the weight of each of the displacement modes that the tree was built with (`dibs build
        --motion MOTION --modes N`). The modes' own error is part of each answer's accuracy."""
        place_and_times = _place_and_times(pose, captured, now)
        array = _arrays.numbers("weights", weights)
        if array.ndim != 1:
            raise ValueError(f"weights: the shape is {array.shape}; give one number for each mode")
        self._native.weights(_arrays.finite("weights", array).tobytes(), *place_and_times)

    def work(self, most: int = 1_000) -> Advance:
        """Checks at most this many rows and triangles of the arriving frame, and publishes it once it is complete and
        admitted. "pending" if more work is due at once. Raises `ValueError` with the reason if a frame is refused."""
        return self._native.work(_arrays.whole("most", most, 1, _WRAP - 1))

    def status(self, now: int, *, framed: bool = False) -> Optional[bytes]:
        """The status for the sender, if one is due: a packet, or `framed` for a byte stream. One is due if there is
        news, or 100 ms have passed. The sender's next frame echoes it, which measures the transit time of frames."""
        return self._native.status(_now(now), bool(framed))

    def closest(self, tool: Optional[npt.ArrayLike], now: int) -> Answer:
        """The answer of this tick, on the surface extrapolated to now.

        `tool` is x, y, z, radius of a sphere, or x1, y1, z1, x2, y2, z2, radius of a capsule; `None` if it has no pose.
        """
        if tool is None:
            return Answer(self._native.closest(None, _now(now)))
        return Answer(self._native.closest(tool_of(tool), _now(now)))

    def contacts(self, tool: npt.ArrayLike, margin: float, now: int) -> tuple[Answer, Contacts]:
        """The answer of this tick, and all locally closest pairs within the `margin` (mm), deepest first, within one
        `budget`.

        Each has the velocity of the surface there. Act on them only if the answer has a pair to act on.
        """
        margin = _at_least("margin", margin, 0)
        answer, found = self._native.contacts(tool_of(tool), margin, _now(now))
        return Answer(answer), contacts_of(found)

    def admit(
        self, filter: Filter, tool: npt.ArrayLike, command: RigidMotion, now: int
    ) -> tuple[Answer, Optional[AdmittedMotion]]:
        """The answer of this tick, and the motion closest to `command` that keeps the tool out of the tissue until the
        next.

        Stand-off and the robot's speed are the filter's; period, tissue speed, age and transit time are the guard's.
        The motion is `None` in the safe state: the tool must rest, and the answer has the cause.
        """
        if not isinstance(filter, Filter):
            raise TypeError(f"filter: a Filter is needed, not {type(filter).__name__}")
        vectors = motion_of(command)
        answer, admitted = self._native.admit(filter._native, tool_of(tool), vectors, _now(now))
        return Answer(answer), None if admitted is None else admitted_of(vectors, admitted)

    def acknowledge(self) -> None:
        """An operator's acknowledgement, which ends the safe state once every input is good again. Raises `ValueError`
        unless the last tick waited for it."""
        self._native.acknowledge()

    def register(self) -> None:
        """Registers the surface again: the next whole frame may be far from the published one. Only an operator may
        decide this."""
        self._native.register()

    @property
    def counters(self) -> dict[str, int]:
        """The count of each event since the start, by name: published frames, and rejections by cause."""
        return dict(self._native.counters())


def _now(value: Any) -> int:
    """A reading of the clock, wrapped."""
    try:
        return operator.index(value) % _WRAP
    except TypeError:
        raise TypeError(f"now: whole milliseconds are needed, not {value!r}") from None


def _place_and_times(
    pose: Optional[tuple[npt.ArrayLike, npt.ArrayLike]], captured: Optional[int], now: int
) -> tuple[Optional[tuple[list[float], list[float]]], int, int]:
    """A frame's pose, its time of capture, by default now, and the present time."""
    now = _now(now)
    captured = now if captured is None else _arrays.whole("captured", captured, 0, _WRAP - 1)
    return None if pose is None else _arrays.pose(pose), captured, now


def _bytes(name: str, value: Any) -> bytes:
    if not isinstance(value, (bytes, bytearray, memoryview)):
        raise TypeError(f"{name}: bytes are needed, not {type(value).__name__}")
    return bytes(value)

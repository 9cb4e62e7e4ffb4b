"""The imaging side: a moving surface, sent to a controller."""

from __future__ import annotations

import time
from typing import NamedTuple, Optional

import numpy.typing as npt

from . import _arrays, _dibs
from ._pickle import Bound
from ._tree import Tree

_GLANCE = 0.002
"""Seconds between two polls while a frame is not yet due."""


class SentFrame(NamedTuple):
    """A frame that was sent."""

    epoch: int
    content: str
    """"whole" or "partial"."""
    rows: int
    packets: int
    bytes: int
    error: float
    """Largest distance of a vertex from its position at the receiver, in millimetres."""


class Totals(NamedTuple):
    """Totals since the start."""

    frames: int
    partial: int
    packets: int
    bytes: int
    statuses: int


class Sender(Bound):
    """Sends the frames of a moving surface to a controller that has its tree.

    `to` is `udp:HOST:PORT`, `tcp:HOST:PORT`, `serial:PORT@BAUD` or `unix:PATH`; without it `packets` returns the
    packets instead. `quantised` takes 6 bytes a vertex instead of 12. `partial` sends only vertices that moved by more
    than this (mm). `heartbeat` is the time between two heartbeats (s), or `None`. `mtu` is 1024, or 64 for CAN-FD.
    `unit` ("mm", "cm", "m", "in", "um") is that of the positions, by default millimetres.

    `key`, 16 bytes, adds a tag to every packet, for the receiver with the id `receiver`. Frames can then be sent once
    the receiver has reported its challenge: `wait`. For a receiver without a return channel give its `challenge`.
    """

    _instead = "make one where frames are sent from"

    def __init__(
        self,
        tree: Tree,
        to: Optional[str] = None,
        *,
        unit: Optional[str] = None,
        quantised: bool = True,
        partial: Optional[float] = None,
        whole_every: int = 250,
        heartbeat: Optional[float] = 0.1,
        mtu: int = 1024,
        session: Optional[int] = None,
        key: Optional[bytes] = None,
        receiver: int = 0,
        challenge: Optional[int] = None,
    ) -> None:
        if partial is not None:
            partial = _arrays.number("partial", partial)
            if partial < 0:
                raise ValueError(f"partial: a tolerance is a length of at least 0, not {partial}")
        choices = (quantised, partial, whole_every, heartbeat, session)
        self._tree = tree
        self._native = _dibs.Sender(tree._native, to, unit, mtu, choices, _tags(key, receiver, challenge))

    def send(
        self,
        positions: npt.ArrayLike,
        *,
        age: Optional[float] = None,
        pose: Optional[tuple[npt.ArrayLike, npt.ArrayLike]] = None,
    ) -> SentFrame:
        """Sends a frame: positions of the mesh's vertices, captured `age` seconds ago.

        Without `age` a frame counts as captured now, unless it equals the last one in every bit. `pose` is as for
        `Guard.frame`, its shift in the positions' unit; then `age` is that of the older of the two, and must be given.
        """
        points = _arrays.points("positions", positions)
        count = self._tree._vertices
        if count is not None and len(points) != count:
            raise ValueError(f"positions: {len(points)} positions, and the mesh has {count} vertices")
        placed = None if pose is None else _arrays.pose(pose)
        return SentFrame(*self._native.send(points.tobytes(), age, placed))

    def poll(self) -> None:
        """Sends a heartbeat if one is due, and receives the receiver's statuses. Does not block."""
        self._native.poll()

    @property
    def is_ready(self) -> bool:
        """Whether frames can be sent: with a key, once the receiver's challenge is known."""
        return self._native.is_ready()

    def wait(self, seconds: float = 2.0) -> None:
        """Waits until frames can be sent. Raises `ConnectionError` if no authentic status arrives in time."""
        end = time.monotonic() + _arrays.number("seconds", seconds)
        self.poll()
        while not self.is_ready:
            if time.monotonic() > end:
                raise ConnectionError(
                    f"no genuine status came within {seconds} s: is the receiver on, and has it the same key? "
                    "One that cannot report needs challenge="
                )
            time.sleep(_GLANCE)
            self.poll()

    def play(self, frames: npt.ArrayLike, rate: float) -> Totals:
        """Sends frames at `rate` a second, with heartbeats between them."""
        points = _arrays.points("frames", frames, 3)
        rate = _arrays.number("rate", rate)
        if not rate > 0:
            raise ValueError(f"rate: {rate} frames a second are none; give more than 0")
        self.wait()
        due = time.monotonic()
        for frame in points:
            while time.monotonic() < due:
                self.poll()
                time.sleep(min(_GLANCE, max(due - time.monotonic(), 0.0)))
            self.send(frame, age=0.0)
            due += 1.0 / rate
        self.poll()
        return self.totals

    def packets(self) -> list[bytes]:
        """The packets since the last call, for a sender without `to`."""
        return self._native.packets()

    @property
    def totals(self) -> Totals:
        """Totals since the start."""
        return Totals(*self._native.totals())

    @property
    def events(self) -> dict[str, int]:
        """The receiver's count of each event, by name, as its statuses report it: published frames, and rejections by cause."""
        return dict(self._native.events())

    @property
    def in_flight(self) -> int:
        """Frames that the receiver has not acknowledged."""
        return self._native.way()[0]

    @property
    def acknowledged(self) -> Optional[int]:
        """The latest frame that the receiver has reported as published."""
        return self._native.way()[1]


def _tags(key: Optional[bytes], receiver: int, challenge: Optional[int]) -> Optional[tuple[bytes, int, Optional[int]]]:
    if key is None:
        if receiver or challenge is not None:
            raise TypeError("receiver and challenge are of tags; give key, too")
        return None
    if not isinstance(key, (bytes, bytearray)):
        raise TypeError(f"key: bytes are needed, not {type(key).__name__}")
    if len(key) != 16:
        # The error does not quote the value, which may be a key.
        raise ValueError(f"key: {len(key)} bytes; give 16")
    return bytes(key), receiver, challenge

"""The imaging side: a moving surface, sent to a controller."""

from __future__ import annotations

import time
from typing import NamedTuple, Optional

import numpy.typing as npt

from . import _arrays, _dibs
from ._tree import Tree

_GLANCE = 0.002
"""Seconds between two polls while a frame is not yet due."""


class Sent(NamedTuple):
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


class Sender:
    """Sends the frames of a moving surface to a controller that has its tree.

    `to` is `udp:HOST:PORT`, `tcp:HOST:PORT`, `serial:PORT@BAUD` or `unix:PATH`; without it `packets` collects what would
    be sent. `quantised` takes 6 bytes a vertex instead of 12. `partial` sends only vertices that moved by more than that
    many millimetres. `heartbeat` are seconds between two heartbeats, or `None`. `mtu` is 1024, or 64 for CAN-FD.
    """

    def __init__(
        self,
        tree: Tree,
        to: Optional[str] = None,
        *,
        quantised: bool = True,
        partial: Optional[float] = None,
        whole_every: int = 250,
        heartbeat: Optional[float] = 0.1,
        mtu: int = 1024,
        session: Optional[int] = None,
    ) -> None:
        if partial is not None:
            partial = _arrays.number("partial", partial)
            if partial < 0:
                raise ValueError(f"partial: a tolerance is a length of at least 0, not {partial}")
        choices = (quantised, partial, whole_every, heartbeat, session)
        self._tree = tree
        self._native = _dibs.Sender(tree._native, to, mtu, choices)

    def send(self, positions: npt.ArrayLike, *, age: Optional[float] = None) -> Sent:
        """Sends a frame: positions of the mesh's vertices, captured `age` seconds ago.

        Without `age` a frame counts as captured now, unless it equals the last in every bit.
        """
        points = _arrays.points("positions", positions)
        count = self._tree._vertices
        if count is not None and len(points) != count:
            raise ValueError(f"positions: {len(points)} positions, and the mesh has {count} vertices")
        return Sent(*self._native.send(points.tobytes(), age))

    def poll(self) -> None:
        """Sends a heartbeat if one is due, and takes the receiver's statuses. Does not block."""
        self._native.poll()

    def play(self, frames: npt.ArrayLike, rate: float) -> Totals:
        """Sends frames at `rate` a second, with heartbeats between."""
        points = _arrays.points("frames", frames, 3)
        rate = _arrays.number("rate", rate)
        if not rate > 0:
            raise ValueError(f"rate: {rate} frames a second are none; give more than 0")
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
        """The packets since the last call, of a sender without `to`."""
        return self._native.packets()

    @property
    def totals(self) -> Totals:
        """Totals since the start."""
        return Totals(*self._native.totals())

    @property
    def in_flight(self) -> int:
        """Frames that the receiver has not acknowledged."""
        return self._native.way()[0]

    @property
    def acknowledged(self) -> Optional[int]:
        """The last frame that the receiver reported as published."""
        return self._native.way()[1]

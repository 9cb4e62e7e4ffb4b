"""A wrong library: DIBS, with the side of every thousandth answer turned. The page has to find it."""

from __future__ import annotations

from library import Answers
from shapes import Points

from .dibs import Peer as Dibs


class Peer(Dibs):
    name = "control: DIBS, every 1,000th side turned"

    def batch(self, points: Points) -> Answers:
        answers = super().batch(points)
        answers.side[::1_000] *= -1
        return answers

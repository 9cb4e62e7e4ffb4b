"""Trees, surfaces, and their answers."""

from __future__ import annotations

import json
import os
from enum import IntEnum
from typing import Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs, _tools
from ._arrays import Floats


def _dtype(fields: list[tuple[str, str, int]]) -> np.dtype[Any]:
    return np.dtype([(name, kind) if count == 1 else (name, kind, (count,)) for name, kind, count in fields])


ANSWER = _dtype(_dibs.ANSWER)
"""The record of an answer. Field names are those of `dibs query --json`."""
CONTACT = _dtype(_dibs.CONTACT)
"""The record of a contact; `pose` is the tool's row."""
SIDE_REASONS: tuple[str, ...] = tuple(_dibs.REASONS)
"""A sentence for each value of the field `side_reason`."""


class Side(IntEnum):
    """Values of the field `side`."""

    OUTSIDE = 0
    INSIDE = 1
    CROSSING = 2
    UNDEFINED = 3


class Contacts(NamedTuple):
    """All locally closest pairs within a margin."""

    found: npt.NDArray[Any]
    """Records of `CONTACT`, in the order of the poses, deepest first."""
    bound: npt.NDArray[np.float32]
    """For each pose: every contact with a separation below is listed. The margin, unless there were too many."""


class Surface:
    """The surface of a tree at one moment, measured once for any number of queries: `Tree.surface`."""

    def __init__(self, tree: Tree, positions: Optional[npt.ArrayLike] = None) -> None:
        given = None
        if positions is not None:
            points = _arrays.points("surface", positions)
            if tree._vertices is not None and len(points) != tree._vertices:
                raise ValueError(f"surface: {len(points)} positions, and the mesh has {tree._vertices} vertices")
            given = points.tobytes()
        self.tree = tree
        self._native = tree._native.surface(given)

    @property
    def stretch(self) -> Optional[float]:
        """The largest stretch of any triangle, against the rest shape; `None` where the tree cannot measure it."""
        return self._native.stretch()

    def query(self, tools: npt.ArrayLike) -> npt.NDArray[Any]:
        """The closest pair of each tool and the surface: an array of `ANSWER`."""
        rows, is_single = _tools.rows(tools)
        answers = np.frombuffer(self._native.query(rows.tobytes(), rows.shape[1]), ANSWER)
        return answers[0] if is_single else answers

    def contacts(self, tools: npt.ArrayLike, margin: float) -> Contacts:
        """All locally closest pairs of each tool and the surface whose separation is at most `margin`."""
        rows, _ = _tools.rows(tools)
        native = self._native.contacts(rows.tobytes(), rows.shape[1], _arrays.number("margin", margin))
        found, bound = native
        return Contacts(np.frombuffer(found, CONTACT), np.frombuffer(bound, "<f4"))


class Tree:
    """A tree of a mesh, from `build`, or from the bytes of a `.dibs` file."""

    def __init__(self, blob: bytes) -> None:
        self._native = _dibs.Tree(bytes(blob))
        self._vertices: Optional[int] = None
        self._rest: Optional[Surface] = None

    @classmethod
    def _of(cls, native: _dibs.Tree, vertices: Optional[int]) -> Tree:
        tree = cls.__new__(cls)
        tree._native, tree._vertices, tree._rest = native, vertices, None
        return tree

    @classmethod
    def load(cls, path: Union[str, os.PathLike[str]]) -> Tree:
        """Reads a tree that `save` or `dibs build` wrote."""
        with open(path, "rb") as file:
            blob = file.read()
        try:
            return cls(blob)
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}: {error}") from None

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the tree, for `dibs` and for a controller."""
        with open(path, "wb") as file:
            file.write(self.blob)

    @property
    def blob(self) -> bytes:
        """The tree's bytes."""
        return self._native.blob()

    @property
    def summary(self) -> dict[str, Any]:
        """Size and cost, as `dibs inspect --json` has them."""
        summary: dict[str, Any] = json.loads(self._native.summary())
        return summary

    @property
    def origin(self) -> Floats:
        """The point of the mesh's file that the tree's own coordinates count from. Queries subtract it."""
        return np.array(self._native.origin())

    @property
    def rest(self) -> Surface:
        """The surface at rest."""
        if self._rest is None:
            self._rest = Surface(self)
        return self._rest

    def surface(self, positions: Optional[npt.ArrayLike] = None) -> Surface:
        """The surface with these positions, one for each vertex of the mesh; without, at rest.

        Raises `ValueError` where it is stretched beyond the tree's limits: distances on it could be wrong.
        """
        return self.rest if positions is None else Surface(self, positions)

    def stretch(self, positions: npt.ArrayLike) -> Optional[float]:
        """The largest stretch of any triangle of a surface, against the rest shape."""
        return Surface(self, positions).stretch

    def query(
        self, tools: npt.ArrayLike, surface: Union[Surface, npt.ArrayLike, None] = None
    ) -> npt.NDArray[Any]:
        """The closest pair of each tool and a surface: an array of `ANSWER`.

        `tools` has a row for each pose: x, y, z, radius of a sphere, or x1, y1, z1, x2, y2, z2, radius of a capsule.
        `surface` is an array of positions, or a `Surface`, which is measured once for several calls; by default the rest
        shape. The poses are answered on all cores, without Python's lock.
        """
        return self._surface(surface).query(tools)

    def contacts(
        self,
        tools: npt.ArrayLike,
        margin: float,
        surface: Union[Surface, npt.ArrayLike, None] = None,
    ) -> Contacts:
        """All locally closest pairs of each tool and a surface whose separation is at most `margin`."""
        return self._surface(surface).contacts(tools, margin)

    def _surface(self, surface: Union[Surface, npt.ArrayLike, None]) -> Surface:
        if not isinstance(surface, Surface):
            return self.surface(surface)
        if surface.tree is not self:
            raise ValueError("surface: is of another tree")
        return surface

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.blob, self._vertices)

    def __repr__(self) -> str:
        summary = self.summary
        return f"Tree({summary['vertices']} vertices, {summary['triangles']} triangles, stretch {summary['stretch']})"


def _restored(blob: bytes, vertices: Optional[int]) -> Tree:
    return Tree._of(_dibs.Tree(blob), vertices)

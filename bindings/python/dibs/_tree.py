"""Trees, surfaces, and their answers."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Iterable
from enum import IntEnum
from typing import Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs, _tools
from ._arrays import Floats


def _dtype(fields: list[tuple[str, str, int]]) -> np.dtype[Any]:
    return np.dtype([(name, kind) if count == 1 else (name, kind, (count,)) for name, kind, count in fields])


ANSWER = _dtype(_dibs.ANSWER)
"""The record of an answer: `help(dibs.Tree.query)` says what its fields are."""
CONTACT = _dtype(_dibs.CONTACT)
"""The record of a contact. Fields with the names of an `ANSWER` have the same meaning.

`pose`: the row of the tool, or of the chain.
`separation`: the lower bound of the pair's interval.
`normal`: the unit vector that points out of the tissue at the pair.
`velocity`: of the surface there, in mm/s; zero for a surface without velocities.
`point_on_surface`, `point_on_tool`, `axis_parameter`, `triangle`, `barycentric`, `label`, `surface`, `tool`.
"""
SIDE_REASONS: tuple[str, ...] = tuple(_dibs.REASONS)
"""A sentence for each value of the field `side_reason`."""


class Side(IntEnum):
    """Values of the field `side`."""

    OUTSIDE = 0
    INSIDE = 1
    CROSSING = 2
    UNDEFINED = 3
    EITHER = 4
    """Of a tracker's kept answer: outside or not, its interval holds the separation."""


class Coverage(IntEnum):
    """Values of the field `coverage`: how it is known that no part of the surface is nearer than an answer says."""

    MEASURED = 0
    """The stretch was measured on these positions."""
    PROVEN = 1
    """A bound on the stretch follows from measured surfaces."""
    ASSUMED = 2
    """The tree cannot measure the stretch: its limit is assumed to hold."""


class Contacts(NamedTuple):
    """All locally closest pairs within a margin."""

    found: npt.NDArray[Any]
    """Records of `CONTACT`, in the order of the poses, deepest first. Their `separation` is the lower end of the pair's
    interval, as the `lower` of an answer."""
    bound: npt.NDArray[np.float32]
    """For each pose: every contact with a separation below this is listed. It is the margin, unless there were too many
    contacts, or the budget ended."""
    accuracy: npt.NDArray[np.float32]
    """For each pose: no separation is too high by more than this (mm). A guard's includes the surface's error and age."""


def _tests(budget: Optional[int]) -> int:
    """The checked number of a budget's tests."""
    if budget is None:
        return 0xFFFF_FFFF
    try:
        tests = operator.index(budget)
    except TypeError:
        raise TypeError(f"budget: give a number of tests, not {budget!r}") from None
    if tests < 0:
        raise ValueError(f"budget: {tests} tests are below 0")
    return min(tests, 0xFFFF_FFFF)


class Scene:
    """Several surfaces, of organs or of the parts of one, that are searched for the closest pair with a tool.

    `surfaces` are `Surface`s, or `Tree`s for their rest shapes. Field `surface` of a record is the index, from 0.
    """

    def __init__(self, surfaces: Iterable[Union[Surface, Tree]]) -> None:
        self.surfaces = tuple(each.rest if isinstance(each, Tree) else each for each in surfaces)
        if not self.surfaces:
            raise ValueError("surfaces: a scene has at least one")
        for number, surface in enumerate(self.surfaces):
            if not isinstance(surface, Surface):
                raise TypeError(f"surfaces: number {number} is no Surface and no Tree")
        self._natives = [surface._native for surface in self.surfaces]

    def query(
        self, tools: npt.ArrayLike, *, budget: Optional[int] = None, signed: bool = True
    ) -> npt.NDArray[Any]:
        """The closest pair of each pose and the scene: as `Tree.query`."""
        poses = _tools.poses(tools)
        answers = np.frombuffer(_dibs.query(self._natives, poses.native, _tests(budget), signed), ANSWER)
        return answers[0] if poses.is_single else answers

    def contacts(
        self, tools: npt.ArrayLike, margin: float, *, budget: Optional[int] = None, label: Optional[int] = None
    ) -> Contacts:
        """All locally closest pairs of each pose and the scene: as `Tree.contacts`."""
        margin = _arrays.number("margin", margin)
        if label is not None and not (isinstance(label, (int, np.integer)) and 0 <= label <= 255):
            raise ValueError(f"label: {label!r} is no whole number from 0 to 255")
        native = _dibs.contacts(self._natives, _tools.poses(tools).native, margin, _tests(budget), label)
        found, bound, accuracy = native
        return Contacts(np.frombuffer(found, CONTACT), np.frombuffer(bound, "<f4"), np.frombuffer(accuracy, "<f4"))

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene, (self.surfaces,)


class Surface:
    """The surface of a tree at one moment, from `Tree.surface`. It is measured once, for any number of queries."""

    def __init__(
        self,
        tree: Tree,
        positions: Optional[npt.ArrayLike] = None,
        velocities: Optional[npt.ArrayLike] = None,
    ) -> None:
        given = [_of_vertices(tree, *each) for each in [("surface", positions), ("velocities", velocities)]]
        self._take(tree, given)

    def _take(self, tree: Tree, given: list[Optional[bytes]]) -> None:
        self.tree, self._given = tree, given
        self._native = tree._native.surface(*given)

    @property
    def stretch(self) -> Optional[float]:
        """The largest stretch of any triangle, or tetrahedron of a volume, relative to the rest shape.

        `None` if the tree cannot measure it.
        """
        return self._native.stretch()

    def query(
        self, tools: npt.ArrayLike, *, budget: Optional[int] = None, signed: bool = True
    ) -> npt.NDArray[Any]:
        """The closest pair of each pose and the surface: as `Tree.query`."""
        return Scene([self]).query(tools, budget=budget, signed=signed)

    def contacts(
        self, tools: npt.ArrayLike, margin: float, *, budget: Optional[int] = None, label: Optional[int] = None
    ) -> Contacts:
        """All locally closest pairs of each pose and the surface: as `Tree.contacts`."""
        return Scene([self]).contacts(tools, margin, budget=budget, label=label)

    def __reduce__(self) -> tuple[Any, ...]:
        return _measured, (self.tree, self._given)


def _measured(tree: Tree, given: list[Optional[bytes]]) -> Surface:
    surface = Surface.__new__(Surface)
    surface._take(tree, given)
    return surface


def _of_vertices(tree: Tree, name: str, value: Optional[npt.ArrayLike]) -> Optional[bytes]:
    """The bytes of three numbers for each vertex of the mesh."""
    if value is None:
        return None
    points = _arrays.points(name, value)
    if tree._vertices is not None and len(points) != tree._vertices:
        what = "positions" if name == "surface" else name
        raise ValueError(f"{name}: {len(points)} {what}, and the mesh has {tree._vertices} vertices")
    return points.tobytes()


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
        """The point of the mesh's file that the tree's own coordinates are relative to. Queries subtract it."""
        return np.array(self._native.origin())

    @property
    def rest(self) -> Surface:
        """The surface at rest."""
        if self._rest is None:
            self._rest = Surface(self)
        return self._rest

    def surface(
        self, positions: Optional[npt.ArrayLike] = None, *, velocities: Optional[npt.ArrayLike] = None
    ) -> Surface:
        """The surface with these positions, one for each vertex of the mesh; by default at rest.

        `velocities`, in mm/s and one for each vertex, set the field `velocity` of contacts, which is zero without them.

        Raises `ValueError` if it is stretched beyond the tree's limits, because distances on it could be wrong.
        """
        return self.rest if positions is None and velocities is None else Surface(self, positions, velocities)

    def stretch(self, positions: npt.ArrayLike) -> Optional[float]:
        """The largest stretch of any triangle of a surface, or tetrahedron of its volume, relative to the rest shape."""
        return Surface(self, positions).stretch

    def query(
        self,
        tools: npt.ArrayLike,
        surface: Union[Surface, npt.ArrayLike, None] = None,
        *,
        budget: Optional[int] = None,
        signed: bool = True,
    ) -> npt.NDArray[Any]:
        """The closest pair of each pose and a surface: an array of `ANSWER`.

        `tools` has a row for each pose: x, y, z, radius of a sphere, or x1, y1, z1, x2, y2, z2, radius of a capsule.
        With three dimensions, (poses, tools, 4 or 7), each pose is a chain of tools, and field `tool` is an index in
        it: the answer is the closest pair of any tool, and its interval covers all tools. `surface` is an array of
        positions, or a `Surface`, which is measured once for several calls; by default the rest shape. `budget` limits
        the node tests of each tool, where an exact triangle test counts as 8. With `signed=False` the side is left out,
        and the separation is that of a tool outside, at the cost of the distance alone. Poses are answered on all cores,
        without Python's lock.

        The fields of an answer; act on the first of `interval`. Lengths are in mm, coordinates those of the mesh's file.

        `separation`: the distance from tool to surface; where the tool's axis crosses or is inside, less than 0 by the
            depth.
        `lower`: the search's certified lower bound; less than `separation` if a budget ended, or by a depth's
            tolerance.
        `accuracy`: largest error of either, from rounding and from the positions.
        `interval`: both bounds, including the accuracy. The first is negative infinity if the tool may be inside to any
            depth.
        `axis_distance`: from the tool's axis, a sphere's centre or a capsule's segment, to the surface; 0 where it
            crosses.
        `axis_parameter`: the pair's position along the axis, 0 at its start and 1 at its end; 0 for a sphere.
        `point_on_surface`, `point_on_tool`: the closest pair; if the axis crosses or is inside, that of its deepest
            point.
        `direction`: the unit vector that points out of the tissue, the gradient of the separation over the tool's
            position; zero if undefined.
        `triangle`: the vertices of the surface's triangle, numbered as in the mesh. Three equal ones where the budget
            ended first.
        `barycentric`: their weights at `point_on_surface`, of sum 1.
        `label`: the triangle's label, or -1.
        `surface`, `tool`: the pair's surface in a `Scene` and tool in a chain, from 0.
        `side`, `side_reason`: a `Side`; and an index of `SIDE_REASONS`, why it is undefined.
        `coverage`: a `Coverage`, how the stretch is known.
        `node_tests`, `triangle_tests`: the cost of the search.
        """
        return self._surface(surface).query(tools, budget=budget, signed=signed)

    def contacts(
        self,
        tools: npt.ArrayLike,
        margin: float,
        surface: Union[Surface, npt.ArrayLike, None] = None,
        *,
        budget: Optional[int] = None,
        label: Optional[int] = None,
    ) -> Contacts:
        """All locally closest pairs of each pose and a surface with a separation of at most `margin`: up to 64 of each
        tool. The other arguments are those of `query`. With a `label` only the contacts of its triangles, as if the
        others did not exist: a nearer part of the surface then does not hide them."""
        return self._surface(surface).contacts(tools, margin, budget=budget, label=label)

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

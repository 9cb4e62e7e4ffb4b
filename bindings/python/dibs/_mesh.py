"""Meshes and trees of them."""

from __future__ import annotations

import json
import os
import warnings
from typing import TYPE_CHECKING, Any, Optional, Protocol, TypedDict, Union

import numpy as np
import numpy.typing as npt

from . import _arrays, _dibs
from ._arrays import Floats
from ._motion import Motion, frames_of
from ._tree import Tree

if TYPE_CHECKING:
    from typing_extensions import Unpack

Path = Union[str, "os.PathLike[str]"]


class HasFaces(Protocol):
    """A mesh of another library, such as trimesh's. Its vertices are taken in its own order, which is the file's only where it
    was read without merging (trimesh: `process=False`)."""

    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...


class Reading(TypedDict, total=False):
    """How a mesh is read."""

    unit: Optional[str]
    """The unit of its lengths, which become millimetres: "mm", "cm", "m", "in", "um". Without it the one that the file states
    (glTF: metres; 3MF), else millimetres. Another unit than the stated one is refused."""
    weld: Optional[float]
    """Joins vertices that are at most so far apart; without it only triangle soup is welded."""
    strict: bool
    """Refuses degenerate and duplicate triangles instead of dropping them."""
    largest_component: bool
    """Takes the part with the most triangles alone."""
    origin: Optional[npt.ArrayLike]
    """The point that coordinates count from inside of the tree; by default near a mesh that is far from zero."""
    orient: bool
    """Turns triangles until the surface faces outwards."""


class MeshWarning(UserWarning):
    """Something unusual in a mesh, or a repair."""


class Mesh:
    """A mesh that passed the library's checks.

    `vertices` keep their numbers, even of vertices that were welded or belong to no triangle, so a motion still fits.
    """

    vertices: Floats
    """Positions in millimetres."""
    triangles: npt.NDArray[np.uint32]
    """Three vertex numbers each."""
    report: dict[str, Any]
    """Counts of what was read, welded, dropped and found."""
    warnings: list[str]
    """A sentence for each oddity and each repair."""
    labels: Optional[npt.NDArray[np.uint8]] = None
    """A label for each triangle from the file's groups, if `read` was called with `groups`. `build` uses them."""
    groups: list[dict[str, Any]]
    """`label`, `name` and number of `triangles` of each group."""

    def __init__(
        self,
        vertices: npt.ArrayLike,
        triangles: npt.ArrayLike,
        **reading: Unpack[Reading],
    ) -> None:
        _refuse_unknown("Mesh", reading)
        points = _arrays.points("vertices", vertices)
        corners = _arrays.triangles(triangles, len(points))
        self._take(_dibs.Mesh.of(points.tobytes(), corners.tobytes(), _reading(reading, False)))

    def _take(self, native: _dibs.Mesh) -> None:
        self._native = native
        self.vertices = np.frombuffer(native.positions(), "<f8").reshape(-1, 3)
        self.triangles = np.frombuffer(native.triangles(), "<u4").reshape(-1, 3)
        self.report = json.loads(native.report())
        self.warnings = native.warnings()
        self.groups = []
        groups = native.groups()
        if groups is not None:
            self.labels = np.frombuffer(groups[0], np.uint8)
            self.groups = json.loads(groups[1])

    @classmethod
    def _of(cls, native: _dibs.Mesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._take(native)
        return mesh

    @property
    def origin(self) -> Floats:
        """The point that a tree's coordinates are relative to: zero, unless the mesh is far from its file's origin."""
        return np.array(self._native.origin())

    def __reduce__(self) -> tuple[Any, ...]:
        native = self._native
        found = native.groups()
        groups = None if found is None else (bytes(found[0]), found[1])
        arrays = [bytes(each) for each in (native.positions(), native.triangles(), native.faces())]
        return _restored, (*arrays, native.report(), groups, native.turned())

    def __repr__(self) -> str:
        return f"Mesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"


def _restored(
    positions: bytes,
    triangles: bytes,
    faces: bytes,
    report: str,
    groups: Optional[tuple[bytes, str]],
    turned: Optional[int],
) -> Mesh:
    return Mesh._of(_dibs.Mesh.restored(positions, triangles, report, groups, faces, turned))


def _refuse_unknown(caller: str, reading: Reading) -> None:
    for name in reading.keys() - Reading.__annotations__.keys():
        raise TypeError(f"{caller}() got an unexpected keyword argument '{name}'")


def _reading(
    reading: Reading, groups: bool
) -> tuple[Optional[str], Optional[float], bool, bool, Optional[list[float]], bool, bool]:
    origin, weld = reading.get("origin"), reading.get("weld")
    place: Optional[list[float]] = None
    if origin is not None:
        place = _arrays.points("origin", _arrays.numbers("origin", origin)[np.newaxis])[0].tolist()
    if weld is not None:
        weld = _arrays.number("weld", weld)
    is_strict, is_largest = reading.get("strict", False), reading.get("largest_component", False)
    return reading.get("unit"), weld, is_strict, is_largest, place, reading.get("orient", False), groups


def read(path: Path, *, groups: bool = False, **reading: Unpack[Reading]) -> Mesh:
    """Reads a mesh file: OBJ, STL, PLY, OFF, VTK (.vtk, .vtp, .vtu), glTF, Gmsh or 3MF, told apart by content.

    `groups` makes labels of the file's groups: OBJ's g and usemtl, Gmsh's physical groups, VTK's cell data label, labels or
    RegionId. The other arguments are those of `Reading`: `unit`, `weld`, `strict`, `largest_component`, `origin`, `orient`.
    """
    _refuse_unknown("read", reading)
    return Mesh._of(_dibs.Mesh.read(os.fspath(path), _reading(reading, groups)))


def build(
    source: Union[Path, Mesh, HasFaces, npt.ArrayLike],
    triangles: Optional[npt.ArrayLike] = None,
    *,
    stretch: float = 1.5,
    limits: Optional[npt.ArrayLike] = None,
    labels: Optional[npt.ArrayLike] = None,
    nodes: Optional[npt.ArrayLike] = None,
    tetrahedra: Optional[npt.ArrayLike] = None,
    bind_within: float = 0.0,
    groups: bool = False,
    **reading: Unpack[Reading],
) -> Tree:
    """Builds the tree of a mesh, which is a file, a `Mesh`, arrays of vertices and triangles, or an object with
    `vertices` and `faces` (trimesh).

    `stretch` is the largest factor by which the surface may be stretched along itself; `limits` instead gives a factor
    for each triangle, or tetrahedron (`MotionStretch.limits`). `labels` are numbers from 0 to 255, one for each
    triangle, which answers then contain. `nodes` and `tetrahedra` of them are a volume that moves the surface:
    positions are then those of the nodes, and `stretch` limits each tetrahedron; vertices outside are bound to the
    nearest tetrahedron within `bind_within` (mm). The other arguments are those of `read`. `MeshWarning` reports
    unusual properties of the mesh.
    """
    _refuse_unknown("build", reading)
    if isinstance(source, Mesh):
        # An array has no truth value.
        given = groups or any(value is not None and value is not False for value in reading.values())
        if triangles is not None or given:
            raise TypeError("a Mesh has its triangles, and was read with its options")
        mesh = source
    elif (arrays := _arrays_of(source, triangles)) is not None:
        if groups:
            raise TypeError("groups are of a file; give labels")
        mesh = Mesh(*arrays, **reading)
    elif isinstance(source, (str, os.PathLike)):
        mesh = read(source, groups=groups, **reading)
    else:
        raise TypeError("build: give a file, a Mesh, vertices and triangles, or an object that has vertices and faces")
    count = len(mesh.triangles)
    each = None
    if limits is not None:
        limited = count if tetrahedra is None else len(np.asarray(tetrahedra))
        each = np.asarray(_arrays.one_each("limits", limits, limited), dtype="<f4").tobytes()
    if labels is None:
        labels = mesh.labels
    marks = None if labels is None else _labels(labels, count)
    if (nodes is None) != (tetrahedra is None):
        raise TypeError("build: nodes and tetrahedra go together")
    volume = None
    # For nodes the library checks the number itself.
    rows: Optional[int] = len(mesh.vertices)
    if nodes is not None and tetrahedra is not None:
        points = _arrays.points("nodes", nodes)
        within = _arrays.number("bind_within", bind_within)
        volume, rows = (points.tobytes(), _tetrahedra(tetrahedra, len(points)), within), None
    native = mesh._native.build(_arrays.number("stretch", stretch), each, marks, volume)
    tree = Tree._of(native, rows)
    for sentence in mesh.warnings + native.warnings():
        warnings.warn(sentence, MeshWarning, stacklevel=2)
    return tree


def _arrays_of(source: Any, triangles: Optional[npt.ArrayLike]) -> Optional[tuple[Any, Any]]:
    if triangles is not None:
        return source, triangles
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        return source.vertices, source.faces
    return None


def _tetrahedra(tetrahedra: npt.ArrayLike, nodes: int) -> bytes:
    array = np.asarray(tetrahedra)
    if array.ndim != 2 or array.shape[1] != 4 or array.dtype.kind not in "iu":
        raise ValueError(f"tetrahedra: an array of N x 4 integers is needed, not {array.shape} of {array.dtype}")
    wrong = (array < 0) | (array >= nodes)
    if wrong.any():
        row, corner = np.argwhere(wrong)[0]
        raise ValueError(f"tetrahedra: number {row} has node {array[row, corner]}, and there are {nodes}")
    return array.astype("<u4").tobytes()


def _labels(labels: npt.ArrayLike, triangles: int) -> bytes:
    array = _arrays.one_each("labels", labels, triangles)
    if array.dtype.kind == "f":
        raise TypeError(f"labels: labels are integers, not {array.dtype}")
    wrong = (array < 0) | (array > 255)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise ValueError(f"labels: {array[row]} of triangle {row} is not a label: a number from 0 to 255")
    return array.astype(np.uint8).tobytes()


def generate(kind: str, triangles: int) -> tuple[Mesh, Optional[Motion]]:
    """A procedural "heart" with the motion of one beat, or a "brain" without a motion."""
    native, motion = _dibs.generate(kind, triangles)
    mesh = Mesh._of(native)
    return mesh, None if motion is None else frames_of(motion)

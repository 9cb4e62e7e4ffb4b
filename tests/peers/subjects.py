"""The deforming meshes: a beating heart, adversarial shapes, and a real heart where it is there."""

from __future__ import annotations

import pathlib
from typing import NamedTuple

import dibs
import numpy as np

import shapes
from shapes import Points, Triangles

REAL = pathlib.Path(__file__).resolve().parents[3] / "shared/data"
FRAMES = 10


class Subject(NamedTuple):
    """A closed mesh and its frames. Each coordinate is a number in single precision, so that no library rounds it."""

    name: str
    says: str
    triangles: Triangles
    frames: Points
    """Positions in millimetres: (frames, vertices, 3). The first is the rest shape."""


def all_of_them() -> tuple[list[Subject], list[str]]:
    """The subjects, and a line for each that is not to be had here."""
    here = [heart(1_000), spikes(), sheet(), needles(), folds()]
    skipped = []
    if (REAL / "heart_10272.ply").exists():
        here.append(real())
    else:
        skipped.append("real heart: its files are not beside the repository")
    return here, skipped


def heart(triangles: int, frames: int = FRAMES) -> Subject:
    """The demo's shape, beating."""
    mesh, beat = dibs.generate("heart", triangles)
    assert beat is not None, "a heart beats"
    positions = np.concatenate([mesh.vertices[np.newaxis], _some(beat.frames, frames - 1)])
    return _subject("heart", "a generated heart beats", mesh.triangles, positions)


def real() -> Subject:
    """A human heart, of a recording."""
    mesh = dibs.read(REAL / "heart_10272.ply")
    frames = dibs.read_motion(REAL / "heart_10272.pc2", mesh).frames
    frames = np.concatenate([mesh.vertices[np.newaxis], _some(frames, 2)])
    return _subject("real heart", "a recorded human heart beats", mesh.triangles, frames)


def spikes() -> Subject:
    """Sharp tips and valleys: the closest feature is an edge or a vertex nearly everywhere."""
    ball, triangles = shapes.ball(2)
    is_tip = np.arange(len(ball)) % 4 == 0
    frames = [ball * 20 * (1 + 2 * step * is_tip)[:, np.newaxis] for step in _steps()]
    return _subject("spikes", "every fourth vertex of a ball grows to three times its radius", triangles, frames)


def sheet(thickness: float = 0.02) -> Subject:
    """A thin sheet rolls up until its ends nearly meet."""
    slab, triangles = shapes.slab(16)
    x, y, side = slab.T
    frames = []
    for step in _steps():
        angle = max(step, 1e-3) * np.pi * 0.98
        radius = 30 / angle + side * thickness / 2
        frames.append(np.stack([radius * np.sin(x * angle), y * 30, radius * np.cos(x * angle) - 30 / angle], axis=1))
    return _subject("thin sheet", f"60 by 60 mm and {thickness} mm thick; it rolls up", triangles, frames)


def needles(around: int = 300) -> Subject:
    """A rod whose wall is long thin triangles, twisted."""
    wall = shapes.tube(2, around)
    ring = np.arange(around)
    after = (ring + 1) % around
    low, high = 2 * around, 2 * around + 1
    caps = [(after, ring, np.full(around, low)), (ring + around, after + around, np.full(around, high))]
    triangles = np.concatenate([wall, *(np.stack(cap, axis=1) for cap in caps)])
    frames = []
    for step in _steps():
        turns = 2 * np.pi * ring / around
        ends = [(turns, -50), (turns + step * np.pi / 2, 50)]
        rings = [np.stack([2 * np.cos(t), 2 * np.sin(t), np.full(around, z)], axis=1) for t, z in ends]
        frames.append(np.concatenate([*rings, [[0, 0, -50], [0, 0, 50]]]))
    return _subject("needles", f"a rod of {around} strips, 100 mm by 0.04 mm, twists", triangles, frames)


def folds() -> Subject:
    """A notched block: the notch closes, and its two faces touch all over in the last frame."""
    rings = 21
    wall = shapes.tube(rings, 7)
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 6], [3, 4, 5], [3, 5, 6]])
    triangles = np.concatenate([wall, cap[:, ::-1], cap + 7 * (rings - 1)])
    frames = []
    for step in _steps():
        gap = 3 * (1 - step)
        outline = [[0, 0], [30, 0], [30, 10 - gap], [10, 10], [30, 10 + gap], [30, 20], [0, 20]]
        heights = np.linspace(0, 40, rings)
        frames.append(np.concatenate([np.column_stack([outline, np.full(7, z)]) for z in heights]))
    halved = [shapes.halved(frame, triangles) for frame in frames]
    says = "the notch of a block closes until its faces touch all over"
    return _subject("folds", says, halved[0][1], [points for points, _ in halved])


def tetrahedron() -> Subject:
    """The least closed mesh: a call on it costs little but the call."""
    corners = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]], float)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    return _subject("tetrahedron", "", triangles, [corners])


def ball(halvings: int) -> Subject:
    """A ball of many triangles, to weigh."""
    points, triangles = shapes.ball(halvings)
    return _subject("ball", "", triangles, [points * 50])


def _steps() -> Points:
    return np.linspace(0, 1, FRAMES)


def _some(frames: Points, count: int) -> Points:
    """So many frames, spread evenly."""
    return frames[np.linspace(0, len(frames) - 1, count).astype(int)]


def _subject(name: str, says: str, triangles: object, frames: object) -> Subject:
    single = np.asarray(frames, np.float32).astype(np.float64)
    return Subject(name, says, np.ascontiguousarray(triangles, dtype=np.int64), single)

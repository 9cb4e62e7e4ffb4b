"""Writes the files that all libraries are given, and the truth of them."""

from __future__ import annotations

import hashlib
import pathlib

import numpy as np

import truth
from points import points_of
from score import Case
from subjects import Subject


def write(folder: pathlib.Path, subject: Subject, count: int) -> pathlib.Path:
    """The file of a subject, with so many points a frame."""
    path = folder / f"{subject.name.replace(' ', '-')}-{len(subject.triangles)}.npz"
    np.savez(path, triangles=subject.triangles, frames=subject.frames, points=points_of(subject, count))
    return path


def judge(path: pathlib.Path) -> Case:
    """The truth of a file's points. It takes the longest of all, and is kept from run to run."""
    with np.load(path) as case:
        triangles, frames, points = case["triangles"], case["frames"], case["points"]
    digest = hashlib.sha256(b"".join(each.tobytes() for each in (triangles, frames, points))).hexdigest()
    kept = path.parent / f"truth-{digest[:16]}.npz"
    if not kept.exists():
        found = [truth.truth(asked, frame, triangles) for asked, frame in zip(points, frames)]
        distance, side = np.array([each.distance for each in found]), np.array([each.side for each in found])
        surface = np.array([each.on_surface for each in found])
        np.savez(kept, distance=distance, side=side, on_surface=surface)
    with np.load(kept) as known:
        size = float(np.abs(frames).max())
        return Case(size, known["distance"], known["side"], known["on_surface"])

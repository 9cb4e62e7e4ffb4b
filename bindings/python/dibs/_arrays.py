"""Checks of arrays: shape, type and finiteness, each with a sentence that names the argument and the element."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


def numbers(name: str, value: npt.ArrayLike) -> npt.NDArray[Any]:
    """An array of real numbers."""
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: not an array: {error}") from None
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name}: an array of numbers is needed, not of {array.dtype}")
    return array


def finite(name: str, array: npt.NDArray[Any]) -> Floats:
    """The same as f64, every number finite."""
    array = np.ascontiguousarray(array, dtype=np.float64)
    wrong = ~np.isfinite(array)
    if wrong.any():
        place = tuple(int(index) for index in np.argwhere(wrong)[0])
        raise ValueError(f"{name}: {array[place]} at {list(place)} is not a finite number")
    return array


def points(name: str, value: npt.ArrayLike, dimensions: int = 2) -> Floats:
    """Points, three numbers each: an array of them, or of frames of them."""
    array = numbers(name, value)
    if array.ndim != dimensions or array.shape[-1] != 3:
        shape = "(points, 3)" if dimensions == 2 else "(frames, points, 3)"
        raise ValueError(f"{name}: the shape is {array.shape}; give {shape}")
    return finite(name, array)


def triangles(value: npt.ArrayLike, vertices: int) -> npt.NDArray[np.uint32]:
    """Triangles of three vertex numbers."""
    array = numbers("triangles", value)
    if array.dtype.kind == "f":
        raise TypeError(f"triangles: vertex numbers are integers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"triangles: the shape is {array.shape}; give (triangles, 3)")
    wrong = (array < 0) | (array >= vertices)
    if wrong.any():
        row, column = (int(index) for index in np.argwhere(wrong)[0])
        raise ValueError(
            f"triangles: triangle {row} has vertex {array[row, column]}, and there are {vertices} vertices"
        )
    return np.ascontiguousarray(array, dtype="<u4")


def one_each(name: str, value: npt.ArrayLike, triangles: int) -> npt.NDArray[Any]:
    """A number for each triangle."""
    array = numbers(name, value)
    if array.shape != (triangles,):
        raise ValueError(
            f"{name}: the shape is {array.shape} for {triangles} triangles; give one number for each"
        )
    return array


def number(name: str, value: float) -> float:
    """A single finite number."""
    array = numbers(name, value)
    if array.ndim != 0:
        raise ValueError(f"{name}: the shape is {array.shape}; give one number")
    if not np.isfinite(array):
        raise ValueError(f"{name}: {array} is not a finite number")
    return float(array)


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A whole number of a range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: a whole number is needed, not {value!r}") from None
    if not least <= number <= most:
        raise ValueError(f"{name}: {number} is not from {least} to {most}")
    return number


def pose(value: tuple[npt.ArrayLike, npt.ArrayLike]) -> tuple[list[float], list[float]]:
    """A rotation and a shift."""
    try:
        rotation, shift = value
    except (TypeError, ValueError):
        raise ValueError("pose: give a rotation (x, y, z, w) and a shift (x, y, z), not a matrix") from None
    parts = []
    for name, given, count in (("rotation", rotation, 4), ("shift", shift, 3)):
        array = numbers(name, given)
        if array.shape != (count,):
            raise ValueError(f"{name}: the shape is {array.shape}; give {count} numbers")
        parts.append(array.tolist())
    return parts[0], parts[1]

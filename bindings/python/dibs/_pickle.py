"""How objects that hold native objects are pickled."""

from __future__ import annotations

from functools import partial
from typing import Any, Callable, TypeVar

_Made = TypeVar("_Made", bound="Remade")


class Remade:
    """An object that is pickled as its constructor call: a copy starts without state."""

    _call: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls: type[_Made], *arguments: Any, **options: Any) -> _Made:
        made = super().__new__(cls)
        made._call = (arguments, options)
        return made

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        arguments, options = self._call
        return partial(type(self), **options), arguments


class Bound:
    """An object that cannot leave its process; its error names what to send instead."""

    _instead: str

    def __reduce__(self) -> str:
        raise TypeError(f"{type(self).__name__}: it cannot be copied or pickled; {self._instead}")

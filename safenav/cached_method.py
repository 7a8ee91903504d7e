"""Methods whose results are cached by their arguments."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property, partial
from typing import Concatenate, ParamSpec, TypeVar, cast

_Self = TypeVar("_Self")
_Asked = ParamSpec("_Asked")
_Result = TypeVar("_Result")


def cached_method(
    method: Callable[Concatenate[_Self, _Asked], _Result],
) -> cached_property[Callable[_Asked, _Result]]:
    """Decorate a method that depends only on its arguments and on constant state of its object, to
    compute each result once. The object needs a ``__dict__``."""

    def of(owner: _Self) -> Callable[_Asked, _Result]:
        return cast("Callable[_Asked, _Result]", cache(partial(method, owner)))

    of.__doc__ = method.__doc__
    return cached_property(of)

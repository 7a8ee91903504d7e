"""Parts of data classes: values with bounds, which readers and schemas check, and methods with
cached results."""

from collections.abc import Callable
from functools import cache, cached_property, partial
from typing import Annotated, Concatenate, ParamSpec, TypeVar, cast

from msgspec import Meta

Region = int
Count = Annotated[int, Meta(ge=0)]
Positive = Annotated[int, Meta(ge=1)]
Seconds = Annotated[float, Meta(ge=0)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", description="a sha256 (64 digits 0-9a-f)")]
Heading = Annotated[
    str, Meta(pattern="^(north|east|south|west)$", description="north, east, south or west")
]
Place = tuple[Region, Heading | None]
"""A region and a robot's heading, if it has one."""


_Self = TypeVar("_Self")
_Asked = ParamSpec("_Asked")
_Result = TypeVar("_Result")


def cached_method(
    method: Callable[Concatenate[_Self, _Asked], _Result],
) -> cached_property[Callable[_Asked, _Result]]:
    """Decorate a method to compute each result once. It must depend only on its arguments and
    constant state of its object, which needs a ``__dict__``."""

    def of(owner: _Self) -> Callable[_Asked, _Result]:
        return cast("Callable[_Asked, _Result]", cache(partial(method, owner)))

    of.__doc__ = method.__doc__
    return cached_property(of)

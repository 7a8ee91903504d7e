"""``safenav.dataclass`` makes what the standard library's decorator makes of the same class."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import typing
from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from safenav import dataclass as ours


class Plain:
    """All that a field can be."""

    kind: ClassVar[str] = "plain"
    first: int
    second: str = "two"
    names: dict[str, int] = dataclasses.field(default_factory=dict, hash=False)
    line: int = dataclasses.field(default=0, kw_only=True, compare=False, repr=False)
    counted: int = dataclasses.field(default=7, init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "counted", self.first + 1)


class Heir(Plain):
    """Has another field, and a word of its own."""

    third: float = 0.5

    def __repr__(self) -> str:
        return "an heir"


class Lone:
    value: float


class Empty:
    """No field at all."""


class Equal:
    """Says itself what is equal."""

    value: int

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self))


Decorate = Callable[[type], Any]
WAYS = [{"frozen": True}, {}, {"eq": False}, {"frozen": True, "eq": False}]


def made(decorate: Any, way: dict[str, bool]) -> dict[str, Any]:
    """The classes above under a decorator, each a new class of its name."""
    found: dict[str, Any] = {}
    for plain in (Plain, Heir, Lone, Empty, Equal):
        bases = tuple(found[b.__name__] for b in plain.__bases__ if b is not object)
        body = {k: v for k, v in vars(plain).items() if k not in ("__dict__", "__weakref__")}
        found[plain.__name__] = decorate(**way)(type(plain.__name__, bases, body))
    return found


def observed(act: Callable[[], object]) -> object:
    """What comes of it; of an error its kind and its words."""
    try:
        return act()
    except Exception as error:
        return type(error).__name__, str(error).replace(".__init__", "").split("(")[0]


@pytest.mark.parametrize("way", WAYS, ids=str)
def test_it_behaves_as_the_standard_library_s(way: dict[str, bool]) -> None:
    def told(found: dict[str, Any]) -> list[object]:
        plain, heir, lone = found["Plain"], found["Heir"], found["Lone"]
        one, other = plain(1, names={"a": 2}, line=3), plain(1, "two", {"a": 2})
        nan = float("nan")
        return [
            observed(act)
            for act in (
                lambda: repr(one),
                lambda: repr(heir(1)),
                lambda: (repr(lone(2.0)), repr(found["Empty"]())),
                lambda: (one.counted, one.line, one.names is not plain(1).names),
                lambda: (one == other, one != plain(2), one == heir(1), lone(nan) == lone(nan)),
                lambda: (lone(nan) == lone(float("nan")), found["Empty"]() == found["Empty"]()),
                lambda: one.__eq__(1),
                lambda: hash(one) == hash(other) and way.get("eq", True) and hash(one),
                lambda: way.get("eq", True) and (hash(lone(2.0)), hash(found["Empty"]())),
                lambda: found["Equal"](1) == found["Equal"](2),
                lambda: way.get("eq", True) and hash(found["Equal"](1)),
                lambda: plain(),
                lambda: plain(1, "two", {}, 4),
                lambda: plain(1, third=2),
                lambda: setattr(one, "first", 2) or one.first,
                lambda: setattr(heir(1), "new", 2),
                lambda: delattr(one, "second"),
                lambda: dataclasses.replace(other, first=5, line=6).line,
                lambda: [f.name for f in dataclasses.fields(heir)],
                lambda: (dataclasses.asdict(heir(1)), heir.__match_args__),
                lambda: (copy.deepcopy(one).names, copy.copy(lone(1.0)).value),
                lambda: typing.get_type_hints(plain.__init__),
                lambda: str(inspect.signature(lone)),
            )
        ]

    assert told(made(ours.dataclass, way)) == told(made(dataclasses.dataclass, way))


@ours.dataclass(frozen=True)
class Packed:
    value: int
    more: tuple[int, ...] = ()


def test_it_needs_no_arguments_and_can_be_pickled() -> None:
    assert ours.dataclass(type("Bare", (), {"__module__": __name__}))() is not None
    assert pickle.loads(pickle.dumps(Packed(1, (2,)))) == Packed(1, (2,))


def test_one_that_is_unpickled_before_any_is_made() -> None:
    packed = b"\x80\x03c" + __name__.encode() + b"\nFresh\nq\x00)\x81q\x01}q\x02X\x05\x00\x00\x00"
    fresh = pickle.loads(packed + b"valueq\x03K\x05sb.")
    assert (repr(fresh), hash(fresh)) == ("Fresh(value=5)", hash((5,)))


@ours.dataclass(frozen=True)
class Fresh:
    value: int


@ours.dataclass(frozen=True)
class Waiting:
    value: int = 3


def test_all_can_be_compiled_before_any_is_made() -> None:
    ours.compile_all()
    assert str(inspect.signature(Waiting)) == "(value: 'int' = 3) -> None"
    assert Waiting() == Waiting(3) != Waiting(4)

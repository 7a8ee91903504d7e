"""An example of every record, made up from what its fields may hold."""

import random
import types
from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from msgspec import Meta, Struct
from msgspec.structs import fields

from safenav.scenario.model import Scenario
from safenav.scenario.objective import Objective
from safenav.trace.fields import convert, objective_of
from safenav.trace.records import KINDS, Record
from support.damage import GOOD

_OBJECTIVES = (
    {"patrol": [58, [27, 28]]},
    {"hold": 4},
    {"ltl": {"liveness": ["region = 3"]}},
)

ROBOTS = ("quad", "digit")


def examples(seed: int) -> Iterator[Record]:
    """One of each type; whether optional fields are there depends on the seed."""
    rng = random.Random(seed)
    for kind in KINDS.values():
        yield _example(kind, rng)


def _known(field: str, value: Any) -> Any:
    """The value, or robots that the header names in place of names of robots."""
    if field == "robot" and isinstance(value, str):
        return ROBOTS[0]
    named = field == "robots" and isinstance(value, tuple | frozenset)
    return type(value)(ROBOTS[: len(value)]) if named else value


def _example(annotation: Any, rng: random.Random) -> Any:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        bound = arguments[1]
        if not isinstance(bound, Meta):
            return _example(arguments[0], rng)
        if bound.min_length is not None:
            return _example(arguments[0], rng) or _example(annotation, rng)
        if bound.pattern is None:
            return arguments[0](bound.ge + rng.randrange(9))
        return (
            "ab" * 32
            if "64" in bound.pattern
            else rng.choice(bound.pattern.strip("^($)").split("|"))
        )
    if origin is Literal or (isinstance(annotation, type) and issubclass(annotation, StrEnum)):
        return rng.choice(arguments or list(annotation))
    if origin in (Union, types.UnionType):
        return _example(rng.choice([a for a in arguments if a is not type(None)]), rng)
    if origin is tuple and arguments[-1] is not Ellipsis:
        return tuple(_example(a, rng) for a in arguments)
    if origin in (tuple, frozenset):
        return origin(_example(arguments[0], rng) for _ in range(rng.randrange(4)))
    if origin is not None and issubclass(origin, Mapping):
        return {name: _example(arguments[1], rng) for name in ROBOTS}
    if annotation is Scenario:
        return convert(Scenario, GOOD["door"]()[0]["scenario"])
    if annotation is Objective:
        return objective_of(rng.choice(_OBJECTIVES))
    if isinstance(annotation, type) and issubclass(annotation, Struct):
        hints = get_type_hints(annotation, include_extras=True)
        given = {
            field.name: _known(field.name, _example(hints[field.name], rng))
            for field in fields(annotation)
            if field.name != "line" and (field.default is not None or rng.random() < 0.5)
        }
        return annotation(**given)
    plain = {
        str: f"name_{rng.randrange(10**9)}",
        int: 7,
        float: 1.5,
        bool: True,
        object: [1, {"deep": None}],
    }
    return plain[annotation]

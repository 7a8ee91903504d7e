"""An example of every record, made up from what its fields may hold."""

import random
import types
from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from msgspec import Meta, Struct
from msgspec.structs import fields, replace

from safenav.scenario.model import Scenario
from safenav.scenario.objective import Objective
from safenav.trace.fields import convert, objective_of
from safenav.trace.records import KINDS, VERSION, Header, Record
from support.damage import GOOD

OBJECTIVES = (
    {"patrol": [58, [27, 28]]},
    {"hold": 4},
    {"ltl": {"liveness": ["region = 3"]}},
)
ROBOTS = ("quad", "digit")


def examples(seed: int) -> list[Record]:
    """One of each type, the header first; whether optional fields are there depends on the seed."""
    rng = random.Random(seed)
    found: list[Record] = [_example(kind, rng) for kind in KINDS.values()]
    assert isinstance(found[0], Header)
    return [replace(found[0], tick=0, trace=VERSION), *found[1:]]


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
        words = bound.pattern.strip("^($)").split("|")
        return "ab" * 32 if "64" in bound.pattern else rng.choice(words)
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
        return objective_of(rng.choice(OBJECTIVES))
    if isinstance(annotation, type) and issubclass(annotation, Struct):
        return _struct(annotation, rng)
    return {
        **{str: f"name_{rng.randrange(10**9)}", int: 7, float: 1.5, bool: True},
        object: [1, {"deep": None}],
    }[annotation]


def _struct(kind: type[Struct], rng: random.Random) -> Struct:
    """An object with the robots of the header."""
    hints, given = get_type_hints(kind, include_extras=True), dict[str, Any]()
    for field in fields(kind):
        if field.name == "line" or (field.default is None and rng.random() < 0.5):
            continue
        value = _example(hints[field.name], rng)
        if field.name == "robot" and isinstance(value, str):
            value = ROBOTS[0]
        if field.name == "robots" and isinstance(value, tuple | frozenset):
            value = type(value)(ROBOTS[: len(value)])
        given[field.name] = value
    return kind(**given)

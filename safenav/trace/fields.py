"""Conversion of records to and from JSON data. msgspec checks types and names the first error."""

import re
from collections.abc import Callable, Mapping
from enum import Enum
from functools import cache, partial
from inspect import get_annotations
from operator import attrgetter
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct, field
from msgspec.structs import FieldInfo, StructConfig, fields

from safenav.scenario.objective import KINDS, Ltl, Objective
from safenav.world.map import Region

EXAMPLE = '{"visit": [3, [5, 6]]}'
"""An objective, for messages and the schema."""
_Bound = Annotated[int, Meta(ge=1 - 2**31, le=2**31 - 1)]
_Variable = Annotated[str, Meta(pattern="^[A-Za-z_][A-Za-z0-9_]{0,99}$")]
_Target = Region | Annotated[frozenset[Region], Meta(min_length=1)]
_PLACED = re.compile(r"(.*?)(?: - at `(?:key in )?\$\.?(.*)`)?", re.DOTALL)
_EXPECTED = re.compile(r"Expected (.*?)(?:, got (.*))?", re.DOTALL)
_MISSING = re.compile(r"Object missing required field `(.*)`")
_TYPES = re.compile(r"`([a-z]+(?: \| [a-z]+)*)`")
_WORDS = {
    "array": "a list",
    "bool": "true or false",
    "float": "a number",
    "int": "a whole number",
    "object": "an object",
    "str": "a string",
}


class WrongError(Exception):
    """An error in a value, described in one sentence."""


def convert(kind: Any, value: object) -> Any:
    """Return JSON data as an object of a class of records. Raises WrongError."""
    try:
        return msgspec.convert(value, kind, dec_hook=_hook)
    except msgspec.ValidationError as error:
        raise WrongError(_sentence(str(error))) from None
    except UnicodeEncodeError:
        raise WrongError("a string has half of a character (a lone surrogate)") from None


def _sentence(error: str) -> str:
    """Return an error text of msgspec as a sentence: field, expected and found."""
    match = _PLACED.fullmatch(error)
    assert match is not None, "each text matches"
    found, path = match[1], match[2] or ""
    if missing := _MISSING.fullmatch(found):
        return f"`{path}{'.' if path else ''}{missing[1]}` is missing"
    found = _TYPES.sub(_in_words, found)
    if expected := _EXPECTED.fullmatch(found):
        found = f"must be {expected[1]}" + (f", not {expected[2]}" if expected[2] else "")
    else:
        found = f"has an {found[:1].lower()}{found[1:]}"
    return f"`{path}` {found}" if path else f"the value {found}"


def _in_words(types: re.Match[str]) -> str:
    return " or ".join(_WORDS.get(word, word) for word in types[1].split(" | "))


def _hook(kind: Any, value: Any) -> Any:
    """Return the value of a field that msgspec cannot convert: an objective or a value of type
    ``object``."""
    if kind is object:
        return value
    try:
        return objective_of(value)
    except (msgspec.ValidationError, ValueError):
        raise ValueError(f"Expected an objective such as {EXAMPLE}") from None


def to_data(objective: Objective) -> dict[str, object]:
    """Return an objective as JSON data, with regions as numbers.

    A target of one region is a number; a larger one is a sorted list.
    """
    if isinstance(objective, Ltl):
        memory = {n: list(b) if b else "bool" for n, b in objective.memory.items()}
        parts = {
            "init": list(objective.init),
            "safety": list(objective.safety),
            "liveness": list(objective.liveness),
            "memory": memory,
            "inputs": list(objective.inputs),
        }
        return {"ltl": {key: value for key, value in parts.items() if value}}
    regions = [sorted(target) for target in objective.targets]
    listed = [each[0] if len(each) == 1 else each for each in regions]
    rules = {
        "form": "literal" if objective.literal else None,
        "avoid": sorted(objective.avoid),
        "always": list(objective.always),
    }
    given = {key: value for key, value in rules.items() if value}
    return {objective.kind: listed[0] if objective.one else listed, **given}


class _Rules(Struct, frozen=True):
    form: Literal["literal"] | None = None
    avoid: frozenset[Region] = frozenset()
    always: tuple[str, ...] = ()


class _Formulas(Struct, frozen=True):
    init: tuple[str, ...] = ()
    safety: tuple[str, ...] = ()
    liveness: tuple[str, ...] = ()
    memory: Mapping[_Variable, Literal["bool"] | tuple[_Bound, _Bound]] = field(
        default_factory=dict
    )
    inputs: tuple[_Variable, ...] = ()


def objective_of(data: Any) -> Objective:
    """Return the objective in JSON data of ``to_data``. Raises an error of msgspec or
    ValueError."""
    known = data if isinstance(data, Mapping) else ()
    word, *others = [key for key in known if key not in _Rules.__struct_fields__]
    rules, body, kind = msgspec.convert(data, _Rules), data[word], KINDS.get(word)
    if others or (kind is None and (word != "ltl" or rules != _Rules())):
        raise ValueError
    if kind is not None:
        listed = msgspec.convert([body] if kind.one else body, tuple[_Target, ...])
        targets = tuple(frozenset([one]) if isinstance(one, int) else one for one in listed)
        if kind.wrong(targets):
            raise ValueError
        literal = rules.form is not None and kind.strict
        return kind(targets, rules.avoid, rules.always, literal)
    found = msgspec.convert(body or {}, _Formulas)
    memory = {name: None if kind == "bool" else kind for name, kind in found.memory.items()}
    if any(bounds and bounds[0] > bounds[1] for bounds in memory.values()):
        raise ValueError
    return Ltl(found.init, found.safety, found.liveness, memory, found.inputs)


@cache
def entries(kind: Any) -> tuple[FieldInfo, ...]:
    """Return the fields of a class of records, or of parts of records, in a file's order."""
    known = {each.name: each for each in fields(kind)}
    names = dict.fromkeys(n for base in reversed(kind.__mro__) for n in get_annotations(base))
    return tuple(known[name] for name in names if name in known and name != "line")


_PLAIN = {str, int, float, bool, type(None)}


def plain(value: Any) -> Any:
    """Return a record or a part of one as JSON data."""
    kind: Any = type(value)
    return value if kind in _PLAIN else _writer(kind)(value)


@cache
def _writer(kind: Any) -> Callable[[Any], Any]:
    """Return the function that converts values of a class to JSON data."""
    if issubclass(kind, Enum):
        return attrgetter("value")
    if issubclass(kind, Objective):
        return to_data
    if issubclass(kind, Struct):
        return partial(_object, entries(kind), kind.__struct_config__)
    if issubclass(kind, Mapping):
        return lambda value: {key: plain(item) for key, item in value.items()}
    if issubclass(kind, frozenset):
        return lambda value: [plain(item) for item in sorted(value)]
    return lambda value: [item if type(item) in _PLAIN else plain(item) for item in value]


def _object(known: tuple[FieldInfo, ...], config: StructConfig, value: Struct) -> dict[str, Any]:
    data = dict[str, Any]()
    for each in known:
        item = getattr(value, each.name)
        if item is not None or each.default is not None:
            data[each.encode_name] = item if type(item) in _PLAIN else plain(item)
    if config.tag_field is not None:
        data[config.tag_field] = config.tag
    return data

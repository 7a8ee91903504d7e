"""Typed values of document nodes: each reader returns the value or reports an error.

``what`` names the item for the message ("'rounds' of until"). A reader that returns None for an
existing node has reported an error; callers continue, so that one error does not hide another.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from collections.abc import Mapping as Wanted
from functools import partial
from typing import TypeVar

from msgspec.structs import replace

from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, closest, listed, suggestion

Value = TypeVar("Value")
Found = TypeVar("Found", bound=Findings)

MOST = 2**31 - 1
"""The largest whole number unless an item sets another limit."""


def described(node: Node) -> str:
    """Return a description of a node's value, for "found ..."."""
    match node:
        case Sequence(_, items):
            return f"a list of {len(items)}" if items else "an empty list"
        case Mapping(_, entries):
            return "a mapping" if entries else "an empty mapping"
        case Scalar(value=None):
            return "nothing"
        case Scalar(value=bool(value)):
            return "true" if value else "false"
        case Scalar(value=int() | float()):
            return f"the number {clipped(node.text)}"
        case Scalar():
            return f"the text '{clipped(node.text)}'"


def wrong_type(
    node: Node | None, what: str, expected: str, findings: Findings, hint: str = ""
) -> None:
    """Report that a node is not of the expected type; do nothing if it is missing."""
    if node is None:
        return
    if isinstance(node, Scalar) and node.style in ("'", '"') and "number" in expected:
        hint = hint or "numbers are written without quotes"
    elif isinstance(node, Scalar):
        number = re.fullmatch(r"(-?\d+(?:\.\d+)?) ?([a-z/%°]+)", node.text)
        truth = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(node.text.lower())
        if number is not None and "number" in expected:
            alone = f": {number[1]}" if number[2] in _UNITS else ""
            hint = hint or f"write the number alone, without a unit{alone}"
        elif truth is not None and expected == "true or false":
            hint = hint or f"write {truth}"
    elif isinstance(node, Mapping):
        keys = (key.text for key, _ in node.entries)
        hint = hint or next((FORMER_PARTS[key] for key in keys if key in FORMER_PARTS), "")
    findings.add(node, f"{what}: found {described(node)}, expected {expected}", hint)


_UNITS = {"tick", "ticks", "round", "rounds", "s", "sec", "seconds", "m", "metres", "m/s"}
"""The units of numbers in a scenario."""


def mapping(
    node: Node | None,
    what: str,
    findings: Findings,
    known: Iterable[str] | None = None,
    required: Wanted[str, str] | None = None,
    elsewhere: Wanted[str, str] | None = None,
    example: str = "",
) -> Mapping | None:
    """Return a mapping; report keys that are not ``known`` (None: any) and missing ``required``
    ones (each with a hint). ``elsewhere``: hints for keys that belong in another mapping;
    ``example``: of such a mapping, for messages."""
    if not isinstance(node, Mapping):
        hint = f"for example {example}" if example else ""
        wrong_type(node, what, "a mapping (key: value)", findings, hint)
        return None
    meant: set[str] = set()
    if known is not None:
        node, meant = _as_meant(node, what, known, elsewhere or {}, findings)
    for key_word, hint in (required or {}).items():
        if node.get(key_word) is None and key_word not in meant:
            findings.add(node, f"{what}: the key '{key_word}' is missing", hint)
    return node


def _as_meant(
    node: Mapping, what: str, known: Iterable[str], elsewhere: Wanted[str, str], findings: Findings
) -> tuple[Mapping, set[str]]:
    """Report unknown keys. Return the mapping with the keys that were probably meant in their
    place, and the set of these: a misspelt key neither hides nor causes other errors."""
    words = set(known)
    free = words - {key.text for key, _ in node.entries}
    entries, meant = [], set()
    for key, value in node.entries:
        word = key.text
        if word not in words:
            also = [other for other in _ALSO_CALLED.get(word, ()) if other in free]
            hint = elsewhere.get(word) or suggestion(also[0] if also else word, free)
            found = f"unknown key '{clipped(word)}' in {what}"
            probable = [] if word in elsewhere else also[:1] or closest(word, free)
            run_on = re.match(r"(\w+)[: ]\s*(.+)", word)
            if run_on and run_on[1] in free and is_nothing(value):
                hint = f"write '{run_on[1]}: {clipped(run_on[2])}', with a colon and a space"
                probable = [run_on[1]]
            findings.add(key, found, hint)
            free.difference_update(probable)
            meant.update(probable)
            if probable and not is_nothing(value):
                key = replace(key, value=probable[0], text=probable[0])
        entries.append((key, value))
    return Mapping(node.place, tuple(entries)), meant


def is_nothing(node: Node) -> bool:
    """Return whether a key has no value."""
    return isinstance(node, Scalar) and node.value is None


_ALSO_CALLED = {
    word: keys
    for words, keys in (
        ("regions labels locations waypoints", ("names",)),
        ("rooms zones", ("areas",)),
        ("agents", ("robots",)),
        ("doors hazards", ("obstacles",)),
        ("timeout", ("limits",)),
        ("type", ("model",)),
        ("kind", ("type", "model")),
        ("position location cell", ("start", "region")),
        ("initial", ("start",)),
        ("facing direction orientation", ("heading",)),
        ("tick", ("at", "from")),
        ("goal goals task mission specification", ("objective",)),
        ("skills abilities", ("capabilities",)),
        ("diameter", ("size",)),
        ("max_speed velocity", ("speed",)),
    )
    for word in words.split()
}
"""Keys of other tools, and the scenario's keys that may be meant."""

REPLACED = {
    "scenario.order": "the newest request is served first, earlier due times before that",
    "scenario.deadlock": "joint plans always resolve deadlocks",
    "scenario.controllers": "every strategy is listed",
    "scenario.suspects": "the bound of a deadline needs no list of possible obstacles",
    "scenario.failures": "write it in the fleet file of 'safenav drive'; runs have fixed defaults",
    "limits.states": "limit a synthesis by 'synthesis_seconds' and 'synthesis_memory'",
    "model.carries": "each robot carries one load",
    "obstacleType.sweeps": "keep robots apart by 'never_together'",
    "obstacle.sweeps": "keep robots apart by 'never_together'",
    "input.probability": "list the ticks: at: [12, 20-30]",
    "objective.circuit": "use 'patrol', with two targets or more",
    "map.threshold": "adapt the image: darker than half is wall",
    "expect.order": "state it in 'requirements', by requested_door@47 and resolved_door@47",
    "expect.never": "state it in 'requirements', by requested_door@47 and resolved_door@47",
}
"""Former keys, by the definition of their table, and what to write instead."""

FORMER_PARTS = {
    "file": "write the name of the file alone: 'image: floor.png'; 'names' names regions",
    "kind": "write the kind alone: 'motion: disc'",
    "least": "write one number of ticks: 'timing: 2'",
    "at_least": "write the most ticks alone: 'ticks: 60'",
    "at_most": "write the most ticks alone: 'ticks: 60'",
    "probability": "write 'true' or 'false'",
}
"""Former keys of values that no longer are mappings, and what to write instead."""


def sequence(node: Node | None, what: str, findings: Findings) -> tuple[Node, ...] | None:
    """Return the items of a list."""
    if not isinstance(node, Sequence):
        shown = clipped(node.text) if isinstance(node, Scalar) else ""
        if isinstance(node, Mapping) and all(is_nothing(value) for _, value in node.entries):
            shown = clipped(", ".join(key.text for key, _ in node.entries))
        hint = f"put brackets around it: [{shown}]" if shown else "begin each item with '- '"
        if shown in ("none", "nothing", "no"):
            hint = "for none, write []"
        wrong_type(node, what, "a list [...]", findings, hint)
        return None
    return node.items


def values(
    node: Node | None,
    what: str,
    findings: Found,
    reads: Callable[[Node, str, Found], Value | None],
) -> tuple[Value, ...] | None:
    """Return the items of a list that ``reads`` returns; the others were reported."""
    items = sequence(node, what, findings)
    if items is None:
        return None
    found = (reads(item, f"an item of {what}", findings) for item in items)
    return tuple(value for value in found if value is not None)


def text(node: Node | None, what: str, findings: Findings) -> str | None:
    """Return a text that is not empty."""
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, "a text", findings)
        return None
    if not node.value.strip():
        findings.add(node, f"{what} is empty")
        return None
    return node.value


def texts(node: Node | None, what: str, findings: Findings) -> tuple[str, ...] | None:
    """Return a list of texts."""
    return values(node, what, findings, text)


def words(node: Node | None, what: str, findings: Findings) -> frozenset[str] | None:
    """Return a list of words as a set."""
    found = texts(node, what, findings)
    return None if found is None else frozenset(found)


def integer(
    node: Node | None, what: str, findings: Findings, *, least: int = 0, most: int = MOST
) -> int | None:
    """Return a whole number from ``least`` to ``most``; true and false are not numbers."""
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, int):
        wrong_type(node, what, "a whole number", findings)
        return None
    if not least <= value <= most:
        limits = f"at least {least}" if value < least else f"at most {most}"
        findings.add(node, f"{what} is {clipped(str(value))}, and must be {limits}")
        return None
    return value


def finite(
    node: Node | None, what: str, findings: Findings, expected: str = "a number"
) -> float | None:
    """Return a number other than ``.inf`` and ``.nan``."""
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        wrong_type(node, what, expected, findings)
        return None
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        wrong_type(node, what, "a finite number", findings)
        return None
    return number


def within(
    node: Node | None,
    what: str,
    findings: Findings,
    *,
    allowed: Callable[[float], bool],
    limits: str,
) -> float | None:
    """Return a finite number that is ``allowed``; ``limits`` describes the condition."""
    value = finite(node, what, findings)
    if value is None or allowed(value):
        return value
    findings.add(node, f"{what} is {value:g}, and must be {limits}")
    return None


positive = partial(within, allowed=lambda value: value > 0, limits="more than 0")
probability = partial(within, allowed=lambda value: 0 <= value <= 1, limits="from 0 to 1")


def boolean(node: Node | None, what: str, findings: Findings) -> bool | None:
    if not isinstance(node, Scalar) or not isinstance(node.value, bool):
        wrong_type(node, what, "true or false", findings)
        return None
    return node.value


def choice(
    node: Node | None, what: str, findings: Findings, known: Wanted[str, Value]
) -> Value | None:
    """Return the value of a known word."""
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, f"one of {listed(known)}", findings)
        return None
    if node.value not in known:
        hint = suggestion(node.value, known)
        findings.add(node, f"{what}: unknown word '{clipped(node.value)}'", hint)
        return None
    return known[node.value]


MOST_OF_A_NAME = 100
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,99}")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
"""The form of names that become variables of specifications."""


def well_named(key: Scalar, what: str, findings: Findings, form: re.Pattern[str] = NAME) -> bool:
    """Return whether a key can name ``what``; report it if not."""
    if form.fullmatch(key.text):
        return True
    signs = "digits, '_' and '-'" if form is NAME else "digits and '_'"
    hint = f"use letters from a to z, {signs}, beginning with a letter"
    if len(key.text) > MOST_OF_A_NAME:
        hint = f"it has {len(key.text)} characters; use at most {MOST_OF_A_NAME}"
    elif not key.text.isascii():
        hint += ": specifications are ASCII; 'name' of the scenario may be any text"
    findings.add(key, f"'{clipped(key.text)}' cannot name {what}", hint)
    return False

"""Errors of values and keys in words, with hints for what was probably meant."""

from __future__ import annotations

import re
from collections.abc import Iterable
from collections.abc import Mapping as Wanted

from msgspec.structs import replace

from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, closest, suggestion


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


def as_meant(
    node: Mapping, what: str, known: Iterable[str], elsewhere: Wanted[str, str], findings: Findings
) -> tuple[Mapping, set[str]]:
    """Report keys that are not ``known``. Return the mapping with the keys that were probably meant
    in their place, and the set of these: a misspelt key neither hides nor causes other errors.
    ``elsewhere``: hints for keys that belong in another mapping, or are former ones."""
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

FORMER_PARTS = {
    "file": "write the name of the file alone: 'image: floor.png'; 'names' names regions",
    "kind": "write the kind alone: 'motion: disc'",
    "least": "write one number of ticks: 'timing: 2'",
    "at_least": "write the most ticks alone: 'ticks: 60'",
    "at_most": "write the most ticks alone: 'ticks: 60'",
    "probability": "write 'true' or 'false'",
}
"""Former keys of values that no longer are mappings, and what to write instead."""


MOST_OF_A_NAME = 100
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,99}")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
"""The form of names that become variables of specifications."""


def well_named(key: Scalar, what: str, findings: Findings, *, identifier: bool = False) -> bool:
    """Return whether a key can name ``what``; report it if not. ``identifier``: without hyphens."""
    if (IDENTIFIER if identifier else NAME).fullmatch(key.text):
        return True
    signs = "digits and '_'" if identifier else "digits, '_' and '-'"
    hint = f"use letters from a to z, {signs}, beginning with a letter"
    if len(key.text) > MOST_OF_A_NAME:
        hint = f"it has {len(key.text)} characters; use at most {MOST_OF_A_NAME}"
    elif not key.text.isascii():
        hint += ": specifications are ASCII; 'name' of the scenario may be any text"
    findings.add(key, f"'{clipped(key.text)}' cannot name {what}", hint)
    return False

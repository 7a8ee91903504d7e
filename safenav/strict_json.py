"""JSON that every program reads alike, and the possible strings of a trace's line. This module
needs only Python's library, since bundles contain it.

Python accepts more than the standard, and takes the last of two equal keys; other programs take the
first. So a program and its checker could read a file differently. The strings of a line are checked
once when it is read: each is a word, a name, or one of a few texts for people, which only output
uses. The readers check the types of fields.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

MOST_NUMBER = 2**53 - 1
"""The maximum whole number that all programs represent exactly."""
_DIGITS = len(str(MOST_NUMBER)) + 1
_PERHAPS_LARGE = re.compile(rf"\d{{{_DIGITS - 1}}}")
_PERHAPS_HALF = re.compile(r"\\u[dD][89a-fA-F]")
_SHOWN = 40
"""Maximum characters of a key or number in a message."""


def read_json(text: str | bytes) -> Any:
    """Return the value of a JSON text in UTF-8. Raises ValueError even for a text that is JSON only
    for some programs: a repeated key, a number beyond 2**53 - 1, half a character."""
    text = text.decode("utf-8") if isinstance(text, bytes) else text
    try:
        value = (_CAREFUL if _PERHAPS_LARGE.search(text) else _FAST).decode(text)
        if _PERHAPS_HALF.search(text):
            json.dumps(value, ensure_ascii=False).encode("utf-8")
    except RecursionError:
        raise ValueError("too deeply nested") from None
    except UnicodeEncodeError:
        raise ValueError("a string has half of a character (a lone surrogate)") from None
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        counts = Counter(key for key, _ in pairs)
        twice = next(key for key, count in counts.items() if count > 1)
        raise ValueError(f"the key {twice[:_SHOWN]!r} appears twice in an object")
    return found


def _whole(digits: str) -> int:
    if len(digits) > _DIGITS or abs(number := int(digits)) > MOST_NUMBER:
        raise ValueError(f"the number {digits[:_SHOWN]} is beyond {MOST_NUMBER}")
    return number


def _fraction(digits: str) -> float:
    if abs(number := float(digits)) > MOST_NUMBER:
        raise ValueError(f"the number {digits[:_SHOWN]} is beyond {MOST_NUMBER}")
    return number


def _constant(word: str) -> float:
    raise ValueError(f"{word} is not a valid JSON number")


_FAST = json.JSONDecoder(object_pairs_hook=_object, parse_float=_fraction, parse_constant=_constant)
_CAREFUL = json.JSONDecoder(
    object_pairs_hook=_object, parse_float=_fraction, parse_constant=_constant, parse_int=_whole
)
"""The decoder of texts that may contain large whole numbers, which examines each number."""

MOST_LEVELS = 200
"""Maximum nesting of a line."""
MOST_ROBOTS = 1000
MOST_REGIONS = 512 * 512
"""Maximum number of regions of a map, walls included."""
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.@#-]{0,199}")
"""Names of robots, obstacles, regions and variables, references to these, and checksums."""
ROBOT = re.compile(r"(?!mission\b)[A-Za-z_][A-Za-z0-9_]{0,99}")
TYPE = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,99}")
"""Names of obstacle types, regions and areas."""
_TEXTS = {
    *("allows", "always", "assumptions", "because", "event", "explanation", "grid", "init"),
    *("liveness", "name", "notes", "reason", "requirements", "safenav", "safety", "source"),
}
"""Keys of texts: for people, formulas and the map."""
_WRITTEN = (str, dict, list)
"""Types of values that can have flaws, unlike numbers."""


@lru_cache(10_000)
def _named(text: str) -> bool:
    return NAME.fullmatch(text) is not None


def flaws(line: Any, kind: str) -> Iterator[str]:
    """Yield the errors in the values of a line whose fields have been read, except in the state of
    a checkpoint. ``kind``: the line's type."""
    if kind == "checkpoint":
        line = {key: value for key, value in line.items() if key != "run"}
    left: list[tuple[str, Any, int]] = [("", line, 0)]
    while left:
        key, value, level = left.pop()
        if level > MOST_LEVELS:
            yield f"`{key}` is nested more than {MOST_LEVELS} deep"
            return
        if isinstance(value, dict):
            for name, inner in value.items():
                if not _named(name) and key not in _TEXTS:  # names of requirements are arbitrary
                    yield f"{_shown(name)} is neither a field nor a name"
                if isinstance(inner, _WRITTEN):
                    left.append((key if key in _TEXTS else name, inner, level + 1))
        elif isinstance(value, list):
            left.extend((key, inner, level + 1) for inner in value if isinstance(inner, _WRITTEN))
        elif isinstance(value, str) and not (key in _TEXTS or _named(value)):
            yield f"`{key}` must be a name, not {_shown(value)}"
    if kind == "header":
        yield from _flaws_of_scenario(line["scenario"])
    elif kind == "discovered":
        yield from _flaw_of_name(TYPE, line["obstacle"]["type"]["name"], "an obstacle")


def note_flaw(line: dict[str, Any], kind: str, *, fact: bool) -> str:
    """Return the error of a line with a wrong or missing mark of notes; empty if there is none. The
    judge skips marked facts; an unmarked unknown line may be a fact of another version."""
    if fact:
        return f"`{kind}` is a fact, but marked as a note" if "note" in line else ""
    return (
        ""
        if line.get("note") is True
        else f"`{kind}` is not a known fact, and not marked as a note"
    )


def _flaws_of_scenario(scenario: dict[str, Any]) -> Iterator[str]:
    robots, rows, cols = scenario["robots"], scenario["map"]["rows"], scenario["map"]["cols"]
    if len(robots) > MOST_ROBOTS:
        yield f"{len(robots)} robots; at most {MOST_ROBOTS} can be read"
    for robot in robots:
        yield from _flaw_of_name(ROBOT, robot["name"], "a robot")
    for obstacle in scenario.get("obstacles", ()):
        yield from _flaw_of_name(TYPE, obstacle["type"]["name"], "an obstacle")
    for name in (*scenario["map"].get("names", ()), *scenario["map"].get("areas", ())):
        yield from _flaw_of_name(TYPE, name, "regions")
    if not (min(rows, cols) > 0 and rows * cols <= MOST_REGIONS):
        yield f"a map of {rows} x {cols} regions; 1 to {MOST_REGIONS} can be read"


def _flaw_of_name(form: re.Pattern[str], name: str, what: str) -> Iterator[str]:
    if not form.fullmatch(name):
        yield f"{_shown(name)} cannot name {what}"


def _shown(value: Any) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:60] + "..."

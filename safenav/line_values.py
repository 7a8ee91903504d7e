"""The names, words and numbers that a line of a trace may hold, checked once when it is read.

Everything is refused that is not listed: a string is a word of the format, a name, or one of a few
texts for people, which nothing but output reads. Bundles contain this module: it needs only
Python's library, and knows the format from docs/trace.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

MOST_LEVELS = 200
"""Deepest nesting of a line: a proof nests as deep as its choices."""
MOST_ROBOTS = 1000
MOST_REGIONS = 2**18
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.@#-]{0,199}")
"""Names of robots, obstacles, regions and variables, references to them, and checksums."""
ROBOT = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
OBSTACLE = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,99}@[A-Za-z0-9_-]{1,99}(#\d{1,9})?")
_TEXTS = {
    *("allows", "always", "assumptions", "because", "event", "explanation", "grid", "init"),
    *("liveness", "name", "reason", "requirements", "safenav", "safety"),
}
"""Keys of texts: for people, formulas, and the map."""
_TRUTHS = {
    *("active", "again", "aside", "at_once", "cached", "for_now", "inputs", "live", "lossless"),
    "note",
    *("ordered", "request", "requested", "same", "seen", "together", "traversable", "values"),
    *("verified", "wait"),
}
_NUMBERS = {
    *("assigned", "bids", "capacity", "charge", "chargers", "cols", "command"),
    *("depth", "due", "earliest", "makespan", "move", "need"),
    *("neutral", "node", "origin", "partition", "places"),
    *("proposed", "refused", "region", "regions", "resolution"),
    *("resolve_within", "round", "rounds", "rows", "seconds", "seed", "sight_closed"),
    *("spans", "stages", "states", "stay", "syntheses", "synthesis_memory"),
    *("synthesis_seconds", "t", "targets", "tick", "ticks", "to", "toward", "vision"),
    *("timing", "within"),
}
"""Keys of numbers, or of lists and objects of numbers; the only words among them are headings."""
_HEADINGS = {"north", "east", "south", "west"}
_BLOCKS = {"untraversable", "no_capable_robot", "unresolvable", "operator"}
_CHANGES = {"scenario", "world", "user", "input", "battery"}
_NEEDED = {
    *("no_capable_robot", "cyclic_requests", "unrealizable", "deadlock", "never_resolvable"),
    "out_of_service",
}
_VERDICTS = {"realizable", "unrealizable", "timeout", "out_of_memory", "interrupted"}
WORDS: dict[str, set[str]] = {
    "by": {"strategy", "backtrack", "plan", "stay"},
    "cause": _CHANGES,
    "clock": {"live"},
    "coordination": {"resynthesis", "assignable"},
    "form": {"literal", "other_memory", "alternation"},
    "heading": _HEADINGS,
    "intervention": {
        *("resolved", "permanent", "put_back", "out_of_service", "objective", "added", "give_up"),
    },
    "mobility": {"free", "heading"},
    "outcome": {
        *("completed", "operator_needed", "unrealizable", "tick_limit", "time_limit"),
        *("search_limit", "assumption_violated", "late", "interrupted", "error"),
    },
    "result": {"arrived", "elsewhere", "blocked", "failed", "lost"},
    "results": {"done", "untraversable", "failed", "nothing"},
    "verdict": _VERDICTS,
    "why": {"strategy", "held", "synthesis", "acting", "service", "operator"},
    "world": {"simulated", "external"},
}
"""The words of a key."""
_BOTH = {"by", "inputs"}
"""Keys of a word, and elsewhere of a number or a truth."""
WORDS_OF_LINES: dict[tuple[str, str], set[str]] = {
    ("synthesis", "reason"): {
        *("initial", "request", "resolved", "blocked", "gone", "objective", "service"),
    },
    ("blocked", "reason"): _BLOCKS,
    ("plan_end", "reason"): {"reached", "violation", "changed"},
    ("deadline", "verdict"): {"set", "kept", "late", "excused", "lost"},
    ("outcome", "cause"): _NEEDED,
    ("waiting", "cause"): _NEEDED,
    ("waiting", "outcome"): {
        *("operator_needed", "assumption_violated", "search_limit", "time_limit"),
    },
}
"""The words of a key that depend on the type of the line."""
_BY_NAME = {
    *("again", "areas", "beliefs", "bids", "busy", "due", "inputs"),
    *("knowledge", "memory", "names", "objectives", "refused"),
    *("requirements", "results", "robots", "rounds", "stages", "start", "unrealizable", "values"),
    *("waiting", "within"),
}
"""Keys whose object has names as its keys; each value is one of the key."""
_TWICE_BY_NAME = {"memory"}
_OBJECTIVES, _ASIDE = {"objective", "objectives", "while_waiting"}, {"always", "form", "ltl"}
"""Keys of objectives, and those in one beside its kind and its ``targets``."""
_INTERNAL = {"from_", "line", "data"}
"""Keys that no file has: the programs use them for their own."""


def flaws(line: Any, kind: str) -> Iterator[str]:
    """Yield the values of a line that no file may have. ``kind``: its type. The state in a
    checkpoint is left to the reader that continues its run."""
    if kind == "checkpoint":
        line = {key: value for key, value in line.items() if key != "run"}
    left: list[tuple[str, Any, int, bool]] = [("", line, 0, False)]
    while left:
        key, value, level, by_name = left.pop()
        if level > MOST_LEVELS:
            yield f"`{key}` is nested more than {MOST_LEVELS} deep"
            return
        if isinstance(value, dict):
            for name, inner in value.items():
                if by_name and key in _TEXTS:  # a requirement may be named by its formula
                    left.append((key, inner, level + 1, False))
                elif not NAME.fullmatch(name):
                    yield f"{_shown(name)} is neither a field nor a name"
                elif by_name:
                    left.append((key, inner, level + 1, key in _TWICE_BY_NAME))
                elif name.startswith("__") or name in _INTERNAL:
                    yield f"{_shown(name)} is not a field"
                else:
                    field = "targets" if key in _OBJECTIVES and name not in _ASIDE else name
                    left.append((field, inner, level + 1, name in _BY_NAME))
        elif isinstance(value, list):
            left.extend((key, inner, level + 1, False) for inner in value)
        elif value is not None and (expected := _expected(key, value, kind)):
            yield f"`{key}` must be {expected}, not {_shown(value)}"
    if kind == "header":
        yield from _flaws_of_scenario(line.get("scenario"))
    elif kind == "discovered" and isinstance(line.get("obstacle"), dict):
        yield from _flaw_of_name(OBSTACLE, line["obstacle"].get("name"), "an obstacle")


def note_flaw(line: dict[str, Any], kind: str, *, fact: bool) -> str:
    """Return the error in a line's mark as a note. A fact that is marked would not be judged; a
    line that is neither might be a fact of another version."""
    if fact:
        return f"`{kind}` is a fact, but marked as a note" if "note" in line else ""
    return (
        ""
        if line.get("note") is True
        else f"`{kind}` is not a known fact, and not marked as a note"
    )


def _expected(key: str, value: Any, kind: str) -> str:
    """Return what a field must be, if it is something else."""
    words = WORDS_OF_LINES.get((kind, key)) or WORDS.get(key)
    if isinstance(value, bool):
        return "" if key in _TRUTHS else "something other than true or false"
    if isinstance(value, int | float):
        number = words is None or key in _BOTH
        return "" if number else f"one of {', '.join(sorted(words or ()))}"
    if words is not None:
        return "" if value in words else f"one of {', '.join(sorted(words))}"
    if key in _TRUTHS - _BOTH:
        return "true or false"
    if key in _NUMBERS:
        return "" if value in _HEADINGS else "a number"
    return "" if key in _TEXTS or NAME.fullmatch(value) else "a name"


def _flaws_of_scenario(scenario: Any) -> Iterator[str]:
    if not isinstance(scenario, dict):
        return
    robots, obstacles = scenario.get("robots"), scenario.get("obstacles")
    if isinstance(robots, dict):
        if len(robots) > MOST_ROBOTS:
            yield f"{len(robots)} robots; at most {MOST_ROBOTS} can be read"
        for name in robots:
            yield from _flaw_of_name(ROBOT, name, "a robot")
    for obstacle in obstacles if isinstance(obstacles, list) else ():
        if isinstance(obstacle, dict):
            yield from _flaw_of_name(OBSTACLE, obstacle.get("name"), "an obstacle")
    world = scenario.get("map")
    if isinstance(world, dict):
        yield from _flaws_of_map(world)


def _flaws_of_map(world: dict[str, Any]) -> Iterator[str]:
    rows, cols, grid = world.get("rows"), world.get("cols"), world.get("grid")
    if type(rows) is not int or type(cols) is not int or not isinstance(grid, list):
        return
    if rows * cols > MOST_REGIONS:
        yield f"a map of {rows} x {cols} regions; at most {MOST_REGIONS} can be read"
    elif len(grid) != rows or any(not isinstance(r, str) or len(r) != cols for r in grid):
        yield f"the grid of the map must be {rows} rows of {cols} characters"


def _flaw_of_name(form: re.Pattern[str], name: Any, what: str) -> Iterator[str]:
    if not isinstance(name, str) or not form.fullmatch(name):
        yield f"{_shown(name)} cannot name {what}"


def _shown(value: Any) -> str:
    text = ascii(value)
    return text if len(text) <= 60 else text[:60] + "..."

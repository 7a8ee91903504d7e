"""Ways to alter the measures or the specification of a strategy. Its graph: ``oracle.automata``."""

import copy
import re
from collections.abc import Callable
from contextlib import suppress
from random import Random
from typing import Any

from proof.proving import Case, with_measures

Change = Callable[[Case, Random], Case | None]


def _measures(change: Callable[[list[Any], int, Random], object]) -> Change:
    """Other measures."""

    def alter(case: Case, source: Random) -> Case | None:
        count = len(case.document["nodes"])
        if case.counter or not case.measures["measures"] or not count:
            return None
        own = copy.deepcopy(case.measures["measures"])
        change(own, source.randrange(count), source)
        return Case(case.name, case.text, case.document, {"of": "strategy", "measures": own})

    return alter


def _number(measures: list[Any], node: int, source: Random) -> None:
    numbers = source.choice(measures)["n"]
    numbers[node] += source.choice([-2, -1, 1, 2, 50])


def _excuse(measures: list[Any], node: int, source: Random) -> None:
    source.choice(measures)["a"][node] = source.choice([None, 0, 1, 7])


def _one_fewer(measures: list[Any], _node: int, _source: Random) -> None:
    measures.pop()


def _section(lines: list[str], name: str) -> list[int]:
    """The numbers of a section's formulas."""
    inside, found = False, []
    for number, line in enumerate(lines):
        if line.startswith("["):
            inside = line == f"[{name}]"
        elif inside and line and not line.startswith("#"):
            found.append(number)
    return found


def _text(change: Callable[[list[str], Random], list[str] | None]) -> Change:
    def alter(case: Case, source: Random) -> Case | None:
        with suppress(ValueError):  # it has no such section
            if lines := change(case.text.split("\n"), source):
                return with_measures(case.name, "\n".join(lines), case.document)
        return None

    return alter


def _less(section: str) -> Callable[[list[str], Random], list[str] | None]:
    def change(lines: list[str], source: Random) -> list[str] | None:
        found = _section(lines, section)
        gone = source.choice(found) if found else None
        return None if gone is None else lines[:gone] + lines[gone + 1 :]

    return change


def _more(section: str, *formulas: str) -> Callable[[list[str], Random], list[str] | None]:
    def change(lines: list[str], source: Random) -> list[str] | None:
        at = lines.index(f"[{section}]") + 1
        return [*lines[:at], source.choice(formulas), *lines[at:]]

    return change


def _operator(lines: list[str], source: Random) -> list[str] | None:
    found = [k for k, line in enumerate(lines) if line[:1] not in ("#", "[") and "'" in line]
    at = source.choice(found)
    spots = [*re.finditer(r" (&|\||->|<->|=|!=) ", lines[at])]
    if not spots:
        return None
    spot = source.choice(spots)
    other = {"&": "|", "|": "&", "->": "<->", "<->": "->", "=": "!=", "!=": "="}[spot[1]]
    changed = f"{lines[at][: spot.start(1)]}{other}{lines[at][spot.end(1) :]}"
    return [*lines[:at], changed, *lines[at + 1 :]]


def _range(lines: list[str], source: Random) -> list[str] | None:
    found = [k for k, line in enumerate(lines) if re.fullmatch(r"\w+:\d+\.\.\.\d+", line)]
    if not found:
        return None
    at = source.choice(found)
    head, _, most = lines[at].rpartition(".")
    return [*lines[:at], f"{head}.{int(most) + source.choice([-1, 1])}", *lines[at + 1 :]]


def _separator(lines: list[str], source: Random) -> list[str] | None:
    """An assumption that an editor shows as a part of a comment."""
    at = lines.index("[ENV_TRANS]") + 1
    separator = source.choice(["\r", "\v", "\f", "\x1c", "\x85", "\u2028"])
    return [*lines[:at], f"# others{separator}FALSE", *lines[at:]]


KINDS: dict[str, Change] = {
    "a number": _measures(_number),
    "an excuse": _measures(_excuse),
    "a measure fewer": _measures(_one_fewer),
    "an assumption more": _text(_more("ENV_TRANS", "FALSE")),
    "an assumption fewer": _text(_less("ENV_TRANS")),
    "an assumption that fails": _text(_more("ENV_LIVENESS", "FALSE")),
    "a guarantee more": _text(_more("SYS_TRANS", "region' = region", "FALSE", "region' != region")),
    "a guarantee fewer": _text(_less("SYS_TRANS")),
    "a goal more": _text(_more("SYS_LIVENESS", "region' = 0", "region' = region", "TRUE")),
    "a goal fewer": _text(_less("SYS_LIVENESS")),
    "another beginning": _text(_more("SYS_INIT", "FALSE", "region = 0")),
    "no beginning": _text(_more("ENV_INIT", "FALSE")),
    "an operator": _text(_operator),
    "a range": _text(_range),
    "a separator": _text(_separator),
}

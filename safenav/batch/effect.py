"""Which of the values that a batch varies have made a difference."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence

from safenav.batch.cases.case import Result


def without_effect(results: Sequence[Result]) -> Iterator[tuple[str, str, list[str]]]:
    """File, key and values of each setting that took several values, all others being equal, and
    never changed what a run came to (in ticks, rounds, obstacles, helpers or outcome)."""
    files = dict.fromkeys(result.file for result in results if result.settings)
    for file in files:
        cases = [result for result in results if result.file == file]
        for key in dict.fromkeys(key for result in cases for key in result.settings):
            values, idle = _values(cases, key)
            if idle:
                yield file, key, values


def _values(cases: Sequence[Result], key: str) -> tuple[list[str], bool]:
    """The values that are compared with others, and whether none made a difference."""
    groups: dict[str, dict[str, str]] = {}
    for result in cases:
        if key in result.settings:
            rest = {k: v for k, v in result.settings.items() if k != key}
            group = groups.setdefault(json.dumps(rest, sort_keys=True), {})
            group[json.dumps(result.settings[key])] = _came_to(result)
    compared = [group for group in groups.values() if len(group) > 1]
    values = list(dict.fromkeys(value for group in compared for value in group))
    return values, bool(compared) and all(len(set(group.values())) == 1 for group in compared)


def _came_to(result: Result) -> str:
    told: list[object] = [result.verdict, result.reasons, result.outcome, result.explanation]
    told += [result.ticks, result.rounds, result.resolved, result.blocked, result.helpers]
    return json.dumps(told, sort_keys=True)

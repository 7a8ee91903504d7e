"""Comparisons of a batch: with an earlier one (changed behaviour, slower cases), and between the
values of its settings (which made a difference).

Two runs of the same scenario behave identically, to the tick, so every difference is reported. Time
is noisy: a case counts as slower only if its run took longer by a ratio and by more than
``NOISE_SECONDS``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct, field

from safenav.batch.cases.case import Result

RATIO = 1.5
NOISE_SECONDS = 0.1

_BEHAVIOUR = ("outcome", "cause", "ticks", "rounds", "resolved", "blocked", "helpers", "syntheses")


class Slower(Struct, frozen=True):
    name: str
    before: float
    now: float

    @property
    def ratio(self) -> float:
        return self.now / self.before if self.before else float("inf")


class Changed(Struct, frozen=True):
    """A case with changed behaviour. ``what``: one sentence per difference."""

    name: str
    what: list[str]


class BaselineComparison(Struct, frozen=True):
    """Differences from a baseline. ``new``, ``gone``: names of cases with a result only in this
    batch, or only in the baseline; ``slower``: by lost seconds, the most first."""

    changed: list[Changed] = field(default_factory=list)
    slower: list[Slower] = field(default_factory=list)
    new: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)


def compare(
    results: Iterable[Result],
    former: Mapping[str, Result],
    ratio: float = RATIO,
    not_run: Iterable[str] = (),
) -> BaselineComparison:
    """Return the differences from the baseline. ``ratio``: factor from which a case counts as
    slower; ``not_run``: names of cases of this batch without a result."""
    found = BaselineComparison()
    seen = set(not_run)
    for result in results:
        seen.add(result.name)
        before = former.get(result.name)
        if before is None:
            found.new.append(result.name)
            continue
        if what := _differences(before, result):
            found.changed.append(Changed(result.name, what))
        if before.passed and result.passed:
            lost = result.duration - before.duration
            if lost > NOISE_SECONDS and result.duration >= ratio * before.duration:
                found.slower.append(Slower(result.name, before.duration, result.duration))
    found.slower.sort(key=lambda slower: slower.before - slower.now)
    found.gone.extend(name for name in former if name not in seen)
    return found


def _differences(before: Result, now: Result) -> list[str]:
    found = []
    if before.verdict is not now.verdict:
        found.append(f"{before.verdict.value} before, {now.verdict.value} now")
    if before.outcome is None or now.outcome is None:
        return found
    for name in _BEHAVIOUR:
        was, is_now = getattr(before, name), getattr(now, name)
        if was != is_now:
            found.append(f"{name}: {_shown(was)} before, {_shown(is_now)} now")
    return found


def _shown(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {item}" for key, item in sorted(value.items())) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(str(item) for item in value) + "]"
    return "nothing" if value is None else str(value)


def without_effect(results: Sequence[Result]) -> Iterator[tuple[str, str, list[str]]]:
    """Yield file, key and values of each setting whose values, with equal other settings, never
    changed the result of a run (ticks, rounds, obstacles, helpers or outcome)."""
    files = dict.fromkeys(result.file for result in results if result.settings)
    for file in files:
        cases = [result for result in results if result.file == file]
        for key in dict.fromkeys(key for result in cases for key in result.settings):
            values, idle = _values(cases, key)
            if idle:
                yield file, key, values


def _values(cases: Sequence[Result], key: str) -> tuple[list[str], bool]:
    """Return the values that are compared with others, and whether none made a difference."""
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
    facts: list[object] = [result.verdict, result.reasons, result.outcome, result.explanation]
    facts += [result.ticks, result.rounds, result.resolved, result.blocked, result.helpers]
    return json.dumps(facts, sort_keys=True)

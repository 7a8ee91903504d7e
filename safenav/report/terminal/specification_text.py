"""Specifications and strategies in words: the faults of a strategy, the lines that make a
specification unrealizable, and vacuous wins as warnings. Also results as data for programs.

Paths show values of nodes (``region=47 heading=east``), not only numbers."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from msgspec import Struct
from msgspec.structs import asdict

from safenav.explain.explanation import LosingPlay, PlayEnd, Values
from safenav.explain.investigation import LineExplanation
from safenav.explain.play import Cause, Vacuity
from safenav.report.terminal.explanation_text import core_heading, core_notes
from safenav.scenario.model import Obstacle, Scenario
from safenav.spec.specification import Constraint
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy, in_words
from safenav.trace.words import counted
from safenav.verify.verification import Failure

_SHOWN = 24
"""Maximum number of lines of a path or play (even)."""
_LONGEST = 160
"""Maximum characters of a shown formula; the file has the rest."""


def failure_lines(failure: Failure, strategy: Strategy) -> Iterator[str]:
    """Yield the fault, the violated constraint with its origin, and a shortest path there."""
    yield from failure.lines
    if failure.path:
        yield f"shortest path, {counted(len(failure.path) - 1, 'step')}:"
        yield from _steps(failure.path, strategy)
    if failure.cycle:
        period = len(failure.cycle)
        yield f"then forever, every {'step' if period == 1 else f'{period} steps'}:"
        yield from _steps(failure.cycle, strategy)


def _steps(nodes: Sequence[int], strategy: Strategy) -> Iterator[str]:
    numbered = [f"{node}: {_values_words(strategy.values(node), strategy)}" for node in nodes]
    yield from (f"  {line}" for line in _without_the_middle(numbered))


def _without_the_middle(lines: Sequence[str]) -> Sequence[str]:
    """Return ``_SHOWN`` lines at most: the first, the number of omitted, the last ones."""
    half, more = _SHOWN // 2, len(lines) - _SHOWN
    return lines if more <= 0 else [*lines[:half], f"... {more} more", *lines[-half:]]


def _values_words(values: Values, strategy: Strategy) -> str:
    return in_words(strategy, values) or "(no variables)"


def line_explanation_lines(found: LineExplanation, file: str) -> Iterator[str]:
    """Yield the explanation of an unrealizable specification as text, without the verdict."""
    yield core_heading(found.core)
    yield from (f"  - {line_words(c, file)}" for c in found.core.constraints)
    for note in core_notes(found.core, "the environment", lambda m: _place(m.constraints[0], file)):
        yield f"  {note}"
    if found.fairness and not found.core.alone:
        yield "even under these assumptions:"
        yield from (f"  - {line_words(c, file)}" for c in found.fairness)
    play = found.play
    if play is not None and play.strategy is not None:
        yield ""
        yield "Consequence:"
        yield from (f"  {line}" for line in _play_lines(play, play.strategy, file))
    if found.assumptions:
        yield ""
        yield "Any one of these assumptions suffices (each was tried):"
        yield from (f"  - [ENV_LIVENESS] {line}" for line in found.assumptions)
    if found.undecided:
        yield f"(the time limit left {counted(len(found.undecided), 'assumption')} undecided)"


def _place(constraint: Constraint, file: str) -> str:
    return f"line {constraint.origin.item.removeprefix(f'{file}:')}"


def line_words(constraint: Constraint, file: str) -> str:
    """Return a constraint with its place in the file."""
    note = f"  # {constraint.origin.rule}" if constraint.origin.rule else ""
    words = f"{constraint.formula}{note}"
    if len(words) > _LONGEST:
        words = f"{words[:_LONGEST]} ... ({len(words)} characters)"
    return f"{_place(constraint, file)} [{constraint.section}] {words}"


def _play_lines(play: LosingPlay, strategy: Strategy, file: str) -> Iterator[str]:
    inputs = " ".join(f"{name}={value}" for name, value in play.pressure)
    yield from _moments(play.walk, strategy)
    match play.ending:
        case PlayEnd.NO_BEGINNING if inputs:
            yield f"the initial inputs {inputs} leave no output that satisfies the guarantees"
        case PlayEnd.NO_BEGINNING:
            yield "no initial output satisfies the guarantees"
        case PlayEnd.STUCK:
            happens = f"the inputs {inputs} leave" if inputs else "the environment's move leaves"
            yield f"then {happens} no reply that keeps all guarantees"
        case _:
            again = "this again" if len(play.cycle) == 1 else f"these {len(play.cycle)} again"
            yield f"then forever {again}:"
            yield from (f"  {line}" for line in _moments(play.cycle, strategy))
            if play.goal is not None:
                yield f"and never {line_words(play.goal, file)}"


def _moments(moments: Sequence[Values], strategy: Strategy) -> Iterator[str]:
    yield from _without_the_middle([_values_words(each, strategy) for each in moments])


def vacuity_lines(vacuity: Vacuity, strategy: Strategy, file: str) -> Iterator[str]:
    """Yield the lines of a warning of a system's vacuous win, the warning itself first. ``file``:
    its specification's file."""
    yield f"the system may win by making assumptions fail: {vacuity.cause.value}"
    if vacuity.cause in (Cause.UNFAIR, Cause.NO_BEGINNING):
        failing = [c for c in strategy.specification.constraints if c.origin in vacuity.origins]
        yield from (f"  assumption: {line_words(c, file)}" for c in failing[:_SHOWN])
    if vacuity.path:
        yield f"  it happens after {counted(len(vacuity.path) - 1, 'step')}:"
        moments = [strategy.values(node) for node in vacuity.path]
        yield from (f"    {line}" for line in _moments(moments, strategy))


_LEFT_OUT = (Scenario, Strategy, Task)


def data_of(value: Any) -> Any:
    """Return results as JSON data: the fields of their classes, with obstacles as names and without
    the scenario, the task and strategies."""
    if isinstance(value, Obstacle):
        return value.name
    if isinstance(value, Struct):
        fields = asdict(value).items()
        return {name: data_of(one) for name, one in fields if not isinstance(one, _LEFT_OUT)}
    if isinstance(value, Mapping):
        return {name: data_of(one) for name, one in value.items()}
    if isinstance(value, Collection) and not isinstance(value, str):
        return [*map(data_of, sorted(value) if isinstance(value, frozenset) else value)]
    return round(value, 3) if isinstance(value, float) else value

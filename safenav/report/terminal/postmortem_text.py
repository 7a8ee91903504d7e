"""Reasons why a run needed an operator, in words and as data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import click
from msgspec.structs import asdict

from safenav.outcome import Outcome
from safenav.review.postmortem import Missing, Postmortem
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Word
from safenav.solve.reasons import need_words
from safenav.trace.words import counted, listed, obstacle_words, seconds_words

_CAUSES = {
    "no_capable_robot": "too few robots have a needed action",
    "cyclic_requests": "robots wait for each other's help in a circle",
    "never_resolvable": "the robots that could help cannot reach the regions where they are needed",
    "unrealizable": "a robot has no strategy for its task",
    "no order": "no order of actions lets every robot continue",
    "out_of_service": "robots that are needed are out of service",
    "deadlock": "the robots block each other",
}


def postmortem_lines(found: Postmortem, word: Word) -> Iterator[str]:
    """Yield the reasons as text; ``word`` names regions."""
    result = found.result
    if result.outcome is Outcome.COMPLETED:
        good = click.style("realizable", fg="green")
        done = f"the run is completed after {_time(result.ticks, result.makespan)}"
        yield f"every robot is {good}, and {done}: {_late(result.lost)}"
        yield from (f"  {loss}" for loss in result.lost)
        return
    ended = click.style(result.outcome.value.replace("_", " "), fg="red", bold=True)
    if result.outcome is not Outcome.OPERATOR_NEEDED:
        yield f"every robot has a strategy; the run ended with {ended}: {result.explanation}"
        return
    live = result.makespan is not None
    at = f"after {_time(result.ticks, result.makespan)}" if live else f"at tick {result.ticks}"
    yield f"every robot is realizable, but the run ends {at}: {ended}"
    cause = result.cause or "unrealizable"
    if cause == "unrealizable" and not result.stuck:
        cause = "no order"
    yield f"  because {_CAUSES[cause]}:"
    yield from (f"  {number}. {link}" for number, link in enumerate(found.chain, 1))
    yield from _missing_lines(found.missing, word)
    yield ""
    if found.repairs:
        yield "With any one of these repairs, a run was completed:"
        for repair in found.repairs:
            change = "; ".join(f"{item}: {value}" for item, value in repair.change)
            yield f"  - {change} (after {_time(repair.ticks, repair.makespan)})"
    else:
        yield f"None of the simple repairs that were tried completes a run ({found.tried} runs)."


def _missing_lines(missing: Sequence[Missing], word: Word) -> Iterator[str]:
    """Yield the actions that the team lacks, and the models that have them."""
    if missing:
        yield "  in all, this team lacks:"
    for each in missing:
        what = listed(obstacle_words(obstacle.name, word) for obstacle in each.obstacles)
        takes = need_words("' and '".join(each.actions), each.robots, together=each.together)
        has = f", this team has {len(each.have)} ({listed(each.have)})" if each.have else ""
        models = f"models: {listed(each.models)}" if each.models else "no model has it"
        yield f"  - {takes} for {what}{has}; {models}"


def _time(ticks: int, makespan: float | None) -> str:
    return counted(ticks, "tick") if makespan is None else seconds_words(makespan)


def _late(lost: tuple[str, ...]) -> str:
    return "these deadlines could not be met:" if lost else "nothing to explain"


def postmortem_data(found: Postmortem, scenario: Scenario) -> dict[str, Any]:
    """Return the reasons as data for machines."""
    result = found.result
    return {
        "scenario": scenario.name,
        "unrealizable": [],
        "outcome": result.outcome.value,
        "cause": result.cause,
        "ticks": result.ticks,
        "chain": list(found.chain),
        "lost": list(result.lost),
        "missing": [
            asdict(each) | {"obstacles": [obstacle.name for obstacle in each.obstacles]}
            for each in found.missing
        ],
        "repairs": [
            {"kind": each.kind, "change": dict(each.change), "ticks": each.ticks}
            | {"seconds": each.makespan}
            for each in found.repairs
        ],
        "runs": found.tried,
        "seconds": round(found.seconds, 3),
    }

"""Reasons why a run needed an operator, in words and as data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

from safenav.outcome import Outcome
from safenav.runtime.analysis.postmortem import Postmortem
from safenav.scenario.model import Scenario
from safenav.trace.words import counted

_CAUSES = {
    "no_capable_robot": "too few robots have a needed action",
    "cyclic_requests": "robots wait for each other's help in a circle",
    "never_resolvable": "the robots that could help cannot reach the regions where they are needed",
    "unrealizable": "a robot has no strategy for its task",
    "deadlock": "the robots are in each other's way",
}


def postmortem_lines(found: Postmortem) -> Iterator[str]:
    """Yield the reasons as text."""
    result = found.result
    if result.outcome is Outcome.COMPLETED:
        good = click.style("realizable", fg="green")
        done = f"the run is completed after {result.ticks} ticks"
        yield f"every robot is {good}, and {done}: {_late(result.lost)}"
        yield from (f"  {said}" for said in result.lost)
        return
    ended = click.style(result.outcome.value.replace("_", " "), fg="red", bold=True)
    if result.outcome is not Outcome.OPERATOR_NEEDED:
        yield f"every robot is realizable; the run ended with {ended}: {result.explanation}"
        return
    yield f"every robot is realizable, but the run ends at tick {result.ticks}: {ended}"
    yield f"  because {_CAUSES[result.cause or 'unrealizable']}:"
    yield from (f"  {number}. {link}" for number, link in enumerate(found.chain, 1))
    yield ""
    if found.repairs:
        yield "With any one of these changes, a run was completed:"
        for repair in found.repairs:
            change = "; ".join(f"{item}: {value}" for item, value in repair.change)
            yield f"  - {change} (after {counted(repair.ticks, 'tick')})"
    else:
        yield f"None of the simple changes that were tried helps ({found.tried} runs)."


def _late(lost: tuple[str, ...]) -> str:
    return "these deadlines could not be met:" if lost else "nothing to explain"


def postmortem_data(found: Postmortem, scenario: Scenario) -> dict[str, Any]:
    """Return the same for machines."""
    return {
        "scenario": scenario.name,
        "unrealizable": [],
        "outcome": found.result.outcome.value,
        "cause": found.result.cause,
        "ticks": found.result.ticks,
        "chain": list(found.chain),
        "lost": list(found.result.lost),
        "repairs": [
            {
                "kind": repair.kind,
                "change": [{"item": item, "value": value} for item, value in repair.change],
                "ticks": repair.ticks,
            }
            for repair in found.repairs
        ],
        "runs": found.tried,
        "seconds": round(found.seconds, 3),
    }

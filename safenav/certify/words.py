"""The claims of a bundle in plain words, with the scenario's names of regions and areas."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from safenav.certify.checker.check_strategies import STRICTLY, Objective
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.trace import Trace
from safenav.trace.wording import Wording, objective_of, objective_words
from safenav.world.map import RegionMap

Claim = Mapping[str, Any]

ASSUMED = {
    "out_of_my_way": "infinitely often, no other robot is beside it",
    "off_my_targets": "infinitely often, the other robots are off its targets",
    "out_of_my_sight": "infinitely often, the other robots are out of its sight",
    "at_its_targets": "infinitely often, the other robots are at their own targets",
}


class Words:
    """Sentences about one run, with the scenario's names of regions and areas."""

    def __init__(self, trace: Trace) -> None:
        scenario = trace.header.scenario
        told = scenario.map
        self.world = RegionMap.from_grid(told.grid, told.names, told.areas)
        self.run = Wording(
            self.world.word,
            self.world.place,
            actions={o.name: [n.action for n in o.all_needs] for o in trace.obstacles.values()},
            skills={name: robot.capabilities for name, robot in scenario.robots.items()},
        )

    def objective(self, told: Any) -> str:
        """An objective as the trace spells it: ``patrol dock and ward_a``."""
        found = TracedObjective.of({k: v for k, v in told.items() if k != "form"})
        objective = objective_of(replace(found, literal=False)) if found else None
        words = objective_words(objective, self.world.word)
        return words.replace(" <-> ", " and ").replace("|", " or ")

    def claim(self, claim: Claim, lines: Sequence[Mapping[str, Any]]) -> str:
        """A claim in plain words; the exact text is the checker's."""
        text = re.sub(r"^Tick \d+: ", "", claim["text"])
        line = _line_of(claim, lines)
        if claim["kind"] == "form":
            robot, _, _ = text.partition(": ")
            own = self.objective(_objective_in_force(text, robot, lines))
            if text.endswith(f"{STRICTLY}."):
                return f"{robot}: {own}. On its way to one target it never enters the other."
            patrols = own.startswith("patrol")
            return f"{robot}: {own}." + " It may enter the other target on its way." * patrols
        if line is None or claim["kind"] in ("outcome", "moves", "motion"):
            return text.replace("_", " ")
        at = f"At tick {line['tick']}"
        if claim["kind"] == "never":
            return f"{at}: no robot can ever resolve {self.run.obstacle(line['obstacle'])}."
        robot = line["robot"]
        if claim["kind"] == "broken":
            return (
                f"{at}: an assumption of {robot} failed ({line['name']}). Its guarantees resume at "
                "its next synthesis."
            )
        task = f"{at}, {robot}, {self.objective(line['objective'])}"
        match claim["kind"]:
            case "realizes":
                return f"{task}: its strategy satisfies its specification."
            case "keeps":
                assumed = ASSUMED.get(line["fairness"])
                return f"{task}: {f'if {assumed}' if assumed else 'whatever the other robots do'}."
            case "unrealizable":
                return f"{task}: no strategy exists."
            case "weakest":
                tried = next(
                    each
                    for each in line["tried"]
                    if [f"specs/{each['spec']}.structuredslugs", None] in claim["evidence"]
                )
                strictly = ", in the stricter form," * (tried["form"] != line.get("form"))
                assumed = ASSUMED.get(tried["fairness"])
                under = f"under the assumption: {assumed}" if assumed else "without assumptions"
                return f"{task}: no strategy exists{strictly} {under}."
            case "changed":
                return f"{at}, {robot} receives another objective: {task.split(', ', 2)[2]}."
        return text


def _line_of(claim: Claim, lines: Sequence[Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """The line of the trace that a claim is about: as its evidence names it, else the synthesis
    of its specification."""
    for _, number in claim["evidence"]:
        if number is not None:
            return lines[int(number) - 1]
    files = {path for path, _ in claim["evidence"]}
    for line in lines:
        spec = f"specs/{line.get('spec')}.structuredslugs"
        if (
            line["type"] == "synthesis"
            and spec in files
            and f"strategies/{line.get('strategy')}.json" in files
        ):
            return line
    return None


def _objective_in_force(text: str, robot: str, lines: Sequence[Mapping[str, Any]]) -> Any:
    """The objective of a robot that a claim about its form names."""
    changed = (x for x in lines if x["type"] == "objective" and x["robot"] == robot)
    given = [lines[0]["scenario"]["robots"][robot]["objective"], *(x["objective"] for x in changed)]
    named = (o for o in given if text.startswith(f"{robot}: {Objective(o).words()}"))
    return next(named, given[0])

"""Checks of the parts of interventions that a program builds: obstacle types and objectives."""

from __future__ import annotations

import re
from collections.abc import Iterator

from safenav.formula.parser import Bounds, FormulaError, check, parse
from safenav.runtime.worlds.reports import checked_obstacle
from safenav.scenario.model import FAILURES, Obstacle, ObstacleType, ResolveAt, Robot, Scenario
from safenav.scenario.objective import Ltl, Objective, formulas_in
from safenav.scenario.yaml.typed import NAME
from safenav.world.moves import Mobility


def wrong_type(kind: ObstacleType, scenario: Scenario) -> str | None:
    """Return the reason why an obstacle of a type cannot be part of a scenario; None if it can."""
    try:
        checked_obstacle(Obstacle(kind, 0))
    except ValueError as error:
        return str(error).replace("the obstacle in region 0", f"the type {kind.name}")
    if not re.fullmatch(NAME, kind.name):
        return f"{kind.name!r} cannot name an obstacle type: use letters, digits, - and _"
    if kind.name.startswith(FAILURES):
        return f"the name {kind.name} is reserved"
    known = scenario.catalogue.obstacles.get(kind.name)
    if known not in (None, kind):
        return f"the scenario has another type {kind.name}: use its type, or another name"
    robots = scenario.robots
    words = {r.name for r in robots} | {r.model.name for r in robots}
    words |= {*scenario.catalogue.layers, *scenario.catalogue.robots}
    words |= {r.model.layer for r in robots}
    for word in sorted((kind.blocks or frozenset()) - words):
        return f"'blocks' of {kind.name}: '{word}' is not a layer, a robot model or a robot"
    for need in kind.needs:
        places = () if isinstance(need.at, ResolveAt) else need.at
        if places != () and not any(map(scenario.map.is_free, places)):
            return f"no region where {kind.name} can be resolved is free"
    return None


def wrong_objective(objective: Objective, robot: Robot, scenario: Scenario) -> str | None:
    """Return the reason why a robot of a scenario cannot have an objective; None if it can."""
    return next(_errors(objective, robot, scenario), None)


def _errors(objective: Objective, robot: Robot, scenario: Scenario) -> Iterator[str]:
    inputs = {each.name for each in scenario.inputs}
    if isinstance(objective, Ltl):
        yield from (f"there is no input '{name}'" for name in {*objective.inputs} - inputs)
        if not (objective.safety or objective.liveness):
            yield "the objective has no formulas"
    for target in objective.targets:
        if not target or not all(map(scenario.map.is_free, target)):
            yield f"target {sorted(target)}: expected free regions of the map"
    if not all(0 <= region < scenario.map.size for region in objective.avoid):
        yield f"'avoid' {sorted(objective.avoid)}: expected regions of the map"
    rules = formulas_in(objective)
    if rules is None:
        return
    declared: dict[str, Bounds] = {"region": (0, scenario.map.size - 1), **rules.memory}
    declared |= {} if robot.model.mobility is Mobility.FREE else {"heading": (0, 3)}
    named = declared | dict.fromkeys(inputs)
    texts = [(text, declared, False) for text in rules.init]
    texts += [(text, named, True) for text in (*rules.safety, *rules.liveness)]
    for text, known, after in texts:
        try:
            for flaw in check(parse(text), known, next_allowed=after):
                yield f"the objective has a wrong formula: {flaw.found}"
        except FormulaError as error:
            yield f"the objective has a wrong formula: {error}"

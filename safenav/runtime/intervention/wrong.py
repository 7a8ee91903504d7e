"""Checks of the parts of interventions that a program builds: obstacle types and objectives."""

from __future__ import annotations

import re
from collections.abc import Iterator

import msgspec

from safenav.formula.parser import FormulaError, parse
from safenav.runtime.worlds.reports import misfit
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.model import FAILURES, Obstacle, ObstacleType, ResolveAt, Scenario
from safenav.scenario.objective import Ltl, Objective, formulas_in
from safenav.scenario.yaml.typed import NAME


def wrong_type(kind: ObstacleType, scenario: Scenario) -> str | None:
    """Return the reason why an obstacle of a type cannot be part of a scenario; None if it can."""
    if (found := misfit(Obstacle(kind, 0))) is not None:
        return found.replace("the obstacle in region 0", f"the type {kind.name}")
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


def wrong_objective(objective: Objective, scenario: Scenario) -> str | None:
    """Return the reason why no robot of a scenario can have an objective; None if one can."""
    return next(_errors(objective, scenario), None)


def _errors(objective: Objective, scenario: Scenario) -> Iterator[str]:
    try:
        same = msgspec.convert(msgspec.to_builtins(objective), type(objective)) == objective
    except (msgspec.ValidationError, TypeError) as error:
        yield f"the objective has a wrong part: {error}"
        return
    if not same:
        yield "the objective has a list in place of a frozenset or a tuple"
        return
    if isinstance(objective, Ltl):
        for name in {*objective.inputs} - {each.name for each in scenario.inputs}:
            yield f"there is no input '{name}'"
        if not (objective.safety or objective.liveness):
            yield "the objective has no formulas"
        formulas = (*objective.init, *objective.safety, *objective.liveness)
    else:
        formulas = objective.always
        count, least, most = len(objective.targets), objective.least, objective.most
        if count < least or count > (most or count):
            yield f"{objective.kind} has {count} targets, expected {most or f'at least {least}'}"
        elif (found := objective.wrong(objective.targets)) is not None:
            yield "; ".join(found)
        for target in objective.targets:
            if not target or not all(map(scenario.map.is_free, target)):
                yield f"target {sorted(target)}: expected free regions of the map"
        if not all(0 <= region < scenario.map.size for region in objective.avoid):
            yield f"'avoid' {sorted(objective.avoid)}: expected regions of the map"
    try:
        for text in formulas:
            parse(text)
        if (rules := formulas_in(objective)) is not None:
            guarantees_of(rules)
    except (FormulaError, ValueError, KeyError) as error:
        yield f"the objective has a wrong formula: {error}"

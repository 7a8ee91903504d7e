"""Objectives and the end of a run in the words of claims."""

from __future__ import annotations

from collections.abc import Collection

from safenav.judge.lines import Line, Objective
from safenav.judge.state import State


def word(regions: Collection[int], s: State) -> str:
    """Return the name of an area or a region, or its numbers."""
    known = s.scenario.map
    names = {frozenset([region]): name for name, region in (known.names or {}).items()}
    names |= {area: name for name, area in (known.areas or {}).items()}
    each = (names.get(frozenset([region]), str(region)) for region in sorted(regions))
    return names.get(frozenset(regions)) or " or ".join(each)


def aims(own: Objective, s: State) -> str:
    """Return an objective as a sentence without its subject."""
    never = ", ".join(word([region], s) for region in sorted(own.avoid))
    rest = f"; never enter {never}" if never else ""
    return _aims(own, s) + rest + "".join(f"; always {text}" for text in own.always)


def _aims(own: Objective, s: State) -> str:
    if own.kind == "ltl":
        return "satisfy the formulas of its own objective"
    listed = [word(target, s) for target in own.targets]
    if own.single:
        return f"go to {listed[0]} and stay"
    if own.ends:
        return f"be at {', '.join(listed)} once, in this order, and stay at the last"
    if own.covers:
        return f"be at each of {', '.join(listed)} infinitely often, in any order"
    turns = " in turn" if len(listed) > 1 else ""
    how = ", without crossing a target out of turn" if own.strict else ""
    return f"be at {' and '.join(listed)}{turns}, infinitely often{how}"


def outcome(e: Line, s: State) -> str:
    """Return the claim about the end of a run, which the judge has judged."""
    what, rounds = e.outcome, s.scenario.until.rounds or 0
    if what == "completed":
        often = "once" if rounds == 1 else f"{rounds} times"
        message = f"every robot has met its objective {often} after the last resolution"
        if stay := [name for name, robot in s.robots.items() if robot.own.settles]:
            at = "is at its last target" if len(stay) == 1 else "are at their last targets"
            message += f", and {' and '.join(stay)} {at}"
        return f"The mission is completed: {message}."
    if what == "tick_limit":
        return f"The run ended at its limit of {e.ticks} ticks."
    if what == "unrealizable":
        return "The mission never began: a robot has no strategy."
    if what != "operator_needed":
        return f"The run ended early ({what.replace('_', ' ')}); no claim about its goal."
    if e.cause == "out_of_service":
        out = [name for name, robot in s.robots.items() if robot.out]
        return f"An operator is needed: {' and '.join(out)} out of service."
    if e.proof is None:
        lost = {**s.unrealizable, **(e.unrealizable or {})}
        return f"An operator is needed: there is no strategy for {' and '.join(lost)}."
    if e.proof.kind in ("joint", "room"):
        names = [name for name in s.robots if name in e.proof.robots]
        message = f"no order of moves of {' and '.join(names)} completes the mission"
        return f"An operator is needed: {message}."
    stuck = " and ".join(sorted(_stuck(e.proof))) or "in each case some robot"
    message = f"{stuck} cannot continue, whatever the robots in service with strategies do"
    return f"An operator is needed: {message}."


def _stuck(proof: Line) -> set[str]:
    """Return the robots that cannot continue in any case of a proof."""
    if proof.kind == "closure":
        return {name for name, table in proof.robots.items() if not table.live}
    cases = [_stuck(choice.proof) for choice in proof.choices]
    return set.intersection(*cases) if cases else set()

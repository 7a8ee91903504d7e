"""Trees: where irreversible choices matter, every possible choice, and a proof after each.

A choice is the present need of an obstacle and a group of robots that meets it. A choice from which
each robot of the group can return to every pose that it could reach before loses nothing, so it
stands for all others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from safenav.audit.proofs.case import Case
from safenav.audit.proofs.closure import Sets, closure_problems
from safenav.audit.team import TooManyError

MOST_NODES = 10_000
MOST_DEPTH = 60

Option = tuple[str, int, frozenset[str]]
"""An obstacle, the number of its need, and the robots that meet it."""


@dataclass
class _Budget:
    nodes: int = MOST_NODES


def tree_problems(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield why a tree does not hold. Raises TooManyError."""
    sets = {name: frozenset([pose]) for name, pose in case.at.items()}
    yield from _problems(proof, case, sets, _Budget(), 0)


def _problems(
    proof: Mapping[str, Any], case: Case, sets: Sets, budget: _Budget, depth: int
) -> Iterator[str]:
    budget.nodes -= 1
    if budget.nodes < 0 or depth > MOST_DEPTH:
        limit = f"the tree has more than {MOST_NODES} nodes or is deeper than {MOST_DEPTH}"
        raise TooManyError(limit)
    if proof["kind"] == "closure":
        yield from closure_problems(proof, case, lame=True, start=sets)
        return
    team, obstacles = case.team, case.obstacles
    closed = tuple(team.reach(name, sets[name], obstacles) for name in team.names)
    if all(team.goes_on(n, there, obstacles) for n, there in zip(team.names, closed, strict=True)):
        yield "every robot is live before any of the choices"
        return
    told: dict[Option, Mapping[str, Any]] = {}
    for choice in proof["choices"]:
        option = choice["option"]
        told[option["obstacle"], option["need"], frozenset(option["robots"])] = choice["proof"]
    steps = {
        (obstacles[k].name, obstacles[k].stage, frozenset(step.group)): step
        for step in team.options(closed, closed, obstacles, {}, every=True)
        for k in [step.obstacle]
    }
    missing = [one for one in steps if one not in told]
    chosen = [one for one in steps if one in told]
    lossless = [one for one in chosen if steps[one].lossless]
    if missing and not lossless:
        name, _, group = missing[0]
        yield f"{', '.join(sorted(group))} at {name} is not refuted"
        return
    for one in lossless[:1] if missing else chosen:
        after, then = team.after(steps[one], closed, obstacles)
        there = dict(zip(team.names, after, strict=True))
        left = tuple(obstacle for obstacle in then if obstacle.left)
        rest = replace(case, obstacles=left)
        yield from _problems(told[one], rest, there, budget, depth + 1)

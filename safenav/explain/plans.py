"""Shortest plans of a system to a goal, with an environment that cooperates.

In a losing play the system follows such a plan as far as the environment lets it: so the play shows
what it is that keeps the goal away."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec.structs import replace

from safenav.explain.explanation import Values
from safenav.explain.realizability import Questions, cooperative
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
)
from safenav.synthesis.strategy import Strategy

MOST_PLANS = 200
"""Plans that are made for one play."""


class ShortestPlans:
    """A system that pursues the first of some goals that it could meet. ``specs``: which rules
    it observes, the strictest first."""

    def __init__(
        self, specs: Sequence[Specification], goals: Sequence[Constraint], ask: Questions
    ) -> None:
        self._pairs = [(cooperative(_moves_only(spec)), goal) for spec in specs for goal in goals]
        self._ask = ask
        self._left = MOST_PLANS
        self._plan: list[Values] = []

    def next(self, now: Values, inputs: Values) -> Values | None:
        """Return the values after ``now`` on a plan, if the environment chooses ``inputs``; None if
        no goal can be met from there."""
        followed = len(self._plan) > 1 and self._plan[0] == now
        if not followed or any(self._plan[1][name] != v for name, v in inputs.items()):
            self._plan = self._planned(now, inputs)
        self._plan = self._plan[1:]
        return self._plan[0] if self._plan else None

    def continues(self, other: Values) -> bool:
        """Return whether a plan from ``other`` is as short as the one from the last values; then
        continue with it."""
        plan = self._planned(other, {})
        as_short = 0 < len(plan) <= len(self._plan)
        self._plan = plan if as_short else self._plan
        return as_short

    def _planned(self, now: Values, inputs: Values) -> list[Values]:
        """Return the states of a shortest plan. The goal that has one is pursued from then on."""
        for pair in self._pairs:
            if self._left <= 0:
                break
            self._left -= 1
            strategy = self._ask.strategy(_reaching(*pair, now, inputs))
            if strategy is not None and strategy.initial():
                self._pairs = [pair]
                return [*_path(strategy)]
        return []


def _path(strategy: Strategy) -> Iterator[Values]:
    """Yield the states of a strategy without inputs until it has reached its goal."""
    node, reached = strategy.initial()[0], False
    while not reached:
        values = strategy.values(node)
        reached = bool(values[_REACHED])
        yield {name: value for name, value in values.items() if name not in _LATCHES}
        node = strategy.transitions[node][0]


_REACHED, _BEGUN = _LATCHES = ("safenav_plan_reached", "safenav_plan_begun")
_ORIGIN = Origin("explanation", "plan")


def _moves_only(spec: Specification) -> Specification:
    """Return the rules of the moves alone."""
    kept = (Section.ENV_TRANS, Section.SYS_TRANS)
    return replace(spec, constraints=tuple(c for c in spec.constraints if c.section in kept))


def _reaching(moves: Specification, goal: Constraint, now: Values, inputs: Values) -> Specification:
    """Return a specification without inputs, whose strategy begins at ``now``, continues with
    ``inputs`` and meets the goal once; after that anything is allowed."""
    kinds = {variable.name: variable for variable in moves.variables}

    def values(of: Values, mark: str = "") -> list[str]:
        booleans = {name for name in of if kinds[name].bounds is None}
        return [
            ("" if value else "!") + name + mark if name in booleans else f"{name}{mark} = {value}"
            for name, value in of.items()
        ]

    first = " & ".join(values(inputs, "'"))
    rules = [f"{_REACHED} | ({c.formula})" for c in moves.constraints]
    rules += [f"{_REACHED}' <-> {_REACHED} | ({goal.formula})", f"{_BEGUN}'"]
    rules += [f"{_BEGUN} | ({first})"] if first else []
    texts = {
        Section.SYS_INIT: [*values(now), f"!{_REACHED}", f"!{_BEGUN}"],
        Section.SYS_TRANS: rules,
        Section.SYS_LIVENESS: [_REACHED],
    }
    latches = (Variable(name, Owner.OUTPUT) for name in _LATCHES)
    return replace(
        moves,
        variables=(*moves.variables, *latches),
        constraints=tuple(Constraint(s, text, _ORIGIN) for s in texts for text in texts[s]),
    )

"""A joint plan as a chain of legs: one robot after the other is brought to what it wants next.

On full floors one search for everybody at once loses its way; a leg for one robot, with all others
pushed aside, is a matter of some ten states. Any robot that succeeds may be the next: legs are
tried with small budgets first. A chain that ends in a state from which no leg leads on is given
up; another one, with other orders, may be luckier.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Protocol

from safenav.runtime.traffic.answers import Answer, Found, Spent
from safenav.runtime.traffic.joint import Joint
from safenav.runtime.traffic.pibt import Field

LEG_BUDGETS = (50, 200)
CHAIN_BUDGET = 3_000
"""States looked at in vain, after which a chain is given up."""
LEGS_OF_A_ROBOT = 50
"""More of them on the average lead nowhere: robots push each other from where they want to be."""


class LegSearch(Protocol):
    """What a chain needs: where it begins and ends, and a search for one leg."""

    start: Joint
    goal: Callable[[Joint], bool]

    def fields(self, state: Joint) -> Sequence[Field]:
        """For each robot the distances to what it wants in a state."""

    def with_one_wish(
        self, start: Joint, goal: Callable[[Joint], bool], budget: int, order: list[int]
    ) -> Answer:
        """A search in which the first of ``order`` has its way."""


def by_legs(search: LegSearch, rng: random.Random) -> Found | Spent:
    """One chain from the start of a search to its goal. ``rng`` draws whose turn it is."""
    states, spent, legs = [search.start], 0, 0
    while not search.goal(states[-1]):
        leg, vain = _next_leg(search, states[-1], rng)
        spent += vain
        legs += 1
        if leg is None or spent > CHAIN_BUDGET or legs > LEGS_OF_A_ROBOT * len(leg[0].poses):
            return Spent(spent + len(states))
        states += leg[1:]
    return Found(tuple(states))


def _next_leg(
    search: LegSearch, state: Joint, rng: random.Random
) -> tuple[tuple[Joint, ...] | None, int]:
    """The states until some robot has what it wants now, and how many were looked at in vain."""
    fields = search.fields(state)
    wanting = [i for i, field in enumerate(fields) if field is not None and field[state.poses[i]]]
    rng.shuffle(wanting)
    vain = 0
    for budget in LEG_BUDGETS:
        for robot in wanting:
            others = [other for other in range(len(fields)) if other != robot]
            rng.shuffle(others)
            goal = _reached(search, state, robot)
            answer = search.with_one_wish(state, goal, budget, [robot, *others])
            if isinstance(answer, Found):
                return answer.states, vain
            vain += budget
    return None, vain


def _reached(search: LegSearch, start: Joint, robot: int) -> Callable[[Joint], bool]:
    """Whether a robot has what it wants in ``start``, or something else was reached."""
    field = search.fields(start)[robot]
    assert field is not None

    def reached(state: Joint) -> bool:
        if state.stages != start.stages or state.counts[robot] != start.counts[robot]:
            return True
        return field[state.poses[robot]] == 0 or search.goal(state)

    return reached

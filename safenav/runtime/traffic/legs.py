"""A joint plan as a chain of legs: one robot after the other is brought to its next goal poses.

On full floors one search for all robots together makes no progress; a leg for one robot, with all
others pushed aside, takes some ten states. Any robot that succeeds may be the next. A chain that
ends in a state from which no leg leads further backtracks to an earlier one, and continues by other
legs.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from itertools import chain
from typing import TYPE_CHECKING

from safenav.runtime.traffic.budgets import LEG_BUDGET, LEGS_OF_A_ROBOT
from safenav.runtime.traffic.joint import Found, Joint, Spent

if TYPE_CHECKING:
    from safenav.runtime.traffic.joint_plan import Search


def by_legs(search: Search, rng: random.Random, most_vain: int) -> Found | Spent:
    """Return one chain from the start of a search to its goal. ``rng`` draws which robot is next,
    and how far to backtrack where no leg leads further; ``most_vain``: limit on states examined
    without success."""
    legs: list[tuple[Joint, ...]] = [(search.start,)]
    most = LEGS_OF_A_ROBOT * len(search.start.poses)
    spent, made = 0, 0
    while not search.goal(legs[-1][-1]):
        leg, vain = _next_leg(search, legs[-1][-1], rng)
        spent += vain
        made += 1
        over = spent > most_vain or made > most or search.work.done
        if over or (leg is None and len(legs) == 1):
            return Spent(spent + sum(map(len, legs)))
        if leg is None:
            del legs[rng.randrange(1, len(legs)) :]
        else:
            legs.append(leg)
    return Found((search.start, *chain.from_iterable(leg[1:] for leg in legs[1:])))


def _next_leg(
    search: Search, state: Joint, rng: random.Random
) -> tuple[tuple[Joint, ...] | None, int]:
    """Return the states until some robot reaches its current goal poses, and the number of states
    examined without success."""
    fields = search.fields(state)
    wanting = [i for i, field in enumerate(fields) if field is not None and field[state.poses[i]]]
    rng.shuffle(wanting)
    vain = 0
    for robot in wanting:
        others = [other for other in range(len(fields)) if other != robot]
        rng.shuffle(others)
        field = fields[robot]
        assert field is not None
        budget = LEG_BUDGET + 2 * field[state.poses[robot]]
        goal = _reached(search, state, robot)
        answer = search.with_one_wish(state, goal, budget, [robot, *others])
        if isinstance(answer, Found):
            return answer.states, vain
        vain += budget
    return None, vain


def _reached(search: Search, start: Joint, robot: int) -> Callable[[Joint], bool]:
    """Return a test whether a robot has reached its goal poses of ``start``, the stages or its
    count have changed, or the goal of the search is reached."""
    field = search.fields(start)[robot]
    assert field is not None

    def reached(state: Joint) -> bool:
        if state.stages != start.stages or state.counts[robot] != start.counts[robot]:
            return True
        return field[state.poses[robot]] == 0 or search.goal(state)

    return reached

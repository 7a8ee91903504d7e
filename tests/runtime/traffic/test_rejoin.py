"""Return to a plan: a plan for the whole mission is valid from every state from which the team can
return to it."""

import random
from itertools import pairwise

import pytest
from safenav.runtime.traffic.continuation_plans import rejoined
from safenav.runtime.traffic.joint_search.search import Search
from safenav.runtime.traffic.joint_search.states import Found, JointState

from runtime.coordination.floors import Bot, Floor
from runtime.traffic.test_joint_search import SWAP, TUBE, play, search

ROOM = ["######", "#....#", "#....#", "######"]
TEAMS = {
    "niche": Floor(SWAP, {"a": Bot("6", [8, 6]), "b": Bot("8", [6, 8])}),
    "headings": Floor(ROOM, {"a": Bot("7e", [16, 7]), "b": Bot("10w", [13, 10])}),
}


def strayed(found: Search, plan: Found, rng: random.Random) -> JointState:
    """The team after a while on the plan and some steps of its own."""
    course, state = found.course, plan.states[rng.randrange(len(plan.states) - 1)]
    for _ in range(rng.randint(1, 6)):
        options = list(course.singles(state))
        if options:
            state = course.after(state, *rng.choice(options))
    return state


@pytest.mark.parametrize("team", TEAMS)
def test_a_team_that_has_strayed_returns_to_its_plan_and_completes_its_mission(team: str) -> None:
    floor = TEAMS[team]
    found = search(floor)
    plan = found.run()
    assert isinstance(plan, Found)
    back = 0
    for seed in range(60):
        rng = random.Random(seed)
        start = strayed(found, plan, rng)
        states = rejoined(found.course, start, plan.states)
        if states is None:
            continue
        back += 1
        assert states[0] == start
        assert found.course.completed(states[-1])
        assert all(one != two for one, two in pairwise(states))
        play(floor, Found(states), rng)
    assert back >= 20


def test_a_plan_from_other_poses_is_not_a_continuation_plan() -> None:
    """In a tube nobody passes: a plan of the two in the other order cannot be returned to."""
    floor = Floor(TUBE, {"a": Bot("7", [8]), "b": Bot("10", [9])})
    plan = search(floor).run()
    assert isinstance(plan, Found)
    other = Floor(TUBE, {"a": Bot("10", [8]), "b": Bot("7", [9])})
    course = search(floor).course
    assert rejoined(course, search(other).start, plan.states) is None

"""Foresight about objectives that end: robots that can never be at their last targets together."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice

from safenav.runtime.coordination.snapshot import floor_of
from safenav.runtime.team import TeamState
from safenav.runtime.traffic.budgets import FEW_GROUPS, FEW_STATES, FORESEEN_SIZES, FORESEEN_WORK
from safenav.runtime.traffic.deadlock import alone, groups_of
from safenav.runtime.traffic.joint_search.states import Effort, Exhausted
from safenav.scenario.model import Scenario
from safenav.scenario.room import without_room
from safenav.trace.words import listed


def foreseen_ends(scenario: Scenario) -> Iterator[str]:
    """Yield a warning for each few robots of which no order of moves completes the objectives, with
    those that stay at their last targets in the end, even without the other robots and all
    obstacles. Only what a bounded search proves: large maps and groups get no warning."""
    given = {change.robot for change in scenario.changes if change.objective is not None}
    robots = scenario.robots
    among = [i for i, robot in enumerate(robots) if robot.name not in given]
    stay = {i for i in among if robots[i].objective.settles}
    if not stay:
        return
    crowded = without_room([robots[i] for i in among])  # ``lint`` warns of these
    found = [frozenset(map(robots.index, group)) for group in crowded]
    floor, work = floor_of(TeamState.initial(scenario)), Effort(FORESEEN_WORK)
    sizes = (islice(groups_of(floor, among, size), FEW_GROUPS) for size in FORESEEN_SIZES)
    for group in chain.from_iterable(sizes):
        if work.done:
            return
        if stay.isdisjoint(group) or any(each <= {*group} for each in found):
            continue
        start = [(0, 0, 0)] * len(robots)
        search = alone(floor, group, 1, start, lambda: None, work)[-1]
        if isinstance(search.run(1, FEW_STATES), Exhausted):
            found.append(frozenset(group))
            who = listed(robots[i].name for i in group)
            ends = listed(
                f"{robots[i].name} at "
                f"{' or '.join(map(scenario.map.label, sorted(robots[i].objective.targets[-1])))}"
                for i in group
                if i in stay
            )
            both = "both" if len(group) == 2 else "all"
            yield (
                f"{who} cannot {both} complete their objectives with {ends} in the end, in "
                "whatever order they move: an operator will be needed"
            )

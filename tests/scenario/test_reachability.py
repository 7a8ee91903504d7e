"""Reachability of targets, against the moves of the robots themselves."""

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from safenav.scenario.reachability import Reachability
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose, moves

grids = st.integers(1, 4).flatmap(
    lambda cols: st.lists(
        st.text(alphabet="..#", min_size=cols, max_size=cols), min_size=1, max_size=4
    )
)


def _poses_from(mobility: Mobility, start: Pose, world: RegionMap) -> set[Pose]:
    seen = {start}
    while new := {p for s in seen for p in moves(mobility, s, world)} - seen:
        seen |= new
    return seen


@given(grids, st.sampled_from(Mobility), st.sampled_from(Heading), st.data())
def test_reachability_agrees_with_the_moves(
    rows: list[str], mobility: Mobility, heading: Heading, data: st.DataObject
) -> None:
    world = RegionMap.from_grid(rows)
    if not world.free:
        return
    free = st.sampled_from(world.free)
    start = Pose(data.draw(free), heading if mobility is Mobility.HEADING else None)
    targets = data.draw(
        st.lists(st.frozensets(free, min_size=1, max_size=2), min_size=1, max_size=3)
    )
    reach = Reachability(mobility, start, world)
    near = {pose.region for pose in _poses_from(mobility, start, world)}
    assert reach.regions == near | {start.region}
    for target in targets:
        assert reach.reaches(target) == any(region in near for region in target)
    seen = _poses_from(mobility, start, world)
    successors = {pose: _poses_from(mobility, pose, world) for pose in seen}
    choices = product(*([p for p in seen if p.region in target] for target in targets))
    # Poses that can all reach each other: the robot can circle through them forever.
    recurs = any(all(b in successors[a] for a in tour for b in tour) for tour in choices)
    assert reach.recurs(targets) == recurs


def test_only_robots_that_can_turn_leave_a_dead_end() -> None:
    corridor = RegionMap.from_grid(["...."])
    ends = [frozenset({0}), frozenset({3})]
    assert Reachability(Mobility.FREE, Pose(0), corridor).recurs(ends)
    walker = Reachability(Mobility.HEADING, Pose(0, Heading.EAST), corridor)
    assert all(walker.reaches(end) for end in ends)
    assert not walker.recurs(ends)

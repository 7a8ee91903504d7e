"""How robots move: free mobility, heading mobility, shortest paths under each."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose, moves
from safenav.world.poses import plain_graph

OPEN = RegionMap.from_grid(["...", "...", "..."])
CORRIDOR = RegionMap.from_grid(["#####", "#...#", "#####"])

grids = st.integers(1, 5).flatmap(
    lambda cols: st.lists(
        st.text(alphabet=".#", min_size=cols, max_size=cols), min_size=1, max_size=5
    )
)


def test_free_mobility_stays_or_steps_to_any_neighbour() -> None:
    found = moves(Mobility.FREE, Pose(4), OPEN)
    assert [pose.region for pose in found] == [4, 1, 5, 7, 3]
    assert all(pose.heading is None for pose in found)


@pytest.mark.parametrize("heading", list(Heading))
def test_heading_mobility_never_steps_backwards(heading: Heading) -> None:
    found = moves(Mobility.HEADING, Pose(4, heading), OPEN)
    assert found[0] == Pose(4, heading)
    assert len(found) == 4
    assert OPEN.step(4, heading.opposite) not in {pose.region for pose in found}


def test_a_turn_is_a_step_in_the_new_heading() -> None:
    assert Pose(1, Heading.NORTH) in moves(Mobility.HEADING, Pose(4, Heading.EAST), OPEN)


def test_blocked_regions_stop_steps_but_not_staying() -> None:
    found = moves(Mobility.FREE, Pose(4), OPEN, blocked={4, 1, 5, 7})
    assert [pose.region for pose in found] == [4, 3]


def test_a_robot_with_heading_cannot_go_back_in_a_corridor() -> None:
    assert moves(Mobility.HEADING, Pose(7, Heading.EAST), CORRIDOR)[1:] == (Pose(8, Heading.EAST),)
    assert {pose.region for pose in moves(Mobility.FREE, Pose(7), CORRIDOR)} == {6, 7, 8}


@given(grids, st.sampled_from(Mobility), st.sampled_from(Heading), st.data())
def test_distances_are_those_of_plain_relaxation(
    rows: list[str], mobility: Mobility, heading: Heading, data: st.DataObject
) -> None:
    world = RegionMap.from_grid(rows)
    if not world.free:
        return
    start = Pose(
        data.draw(st.sampled_from(world.free)), heading if mobility is Mobility.HEADING else None
    )
    best = {start: 0}
    changed = True
    while changed:
        changed = False
        for pose, steps in list(best.items()):
            for after in moves(mobility, pose, world):
                if best.get(after, steps + 2) > steps + 1 and after != pose:
                    best[after] = steps + 1
                    changed = True
    expected: dict[int, int] = {}
    for pose, steps in best.items():
        expected[pose.region] = min(steps, expected.get(pose.region, steps))
    graph = plain_graph(world, mobility)
    found = {
        region: graph.steps_between(
            1 << graph.number(start), graph.poses_on(1 << region), graph.everywhere
        )
        for region in world.free
    }
    assert {region: steps for region, steps in found.items() if steps is not None} == expected

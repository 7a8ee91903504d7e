"""Belief lines that are missing, or that say what cannot be known."""

import pytest

from audit.good_traces import GOOD
from audit.living import living
from audit.trace_script import Line, find, text
from safenav.audit.check import check_trace


def found(lines: list[Line]) -> set[tuple[str, int]]:
    return {(finding.rule, finding.tick) for finding in check_trace(text(lines)).findings}


def test_a_belief_must_grow_by_the_steps_out_of_sight() -> None:
    lines = GOOD["beliefs"]()
    lines[0]["scenario"]["partition"] = [[7, 8, 13, 14], [9], [10], [15], [16]]
    lines[find(lines, "belief", tick=2)]["regions"] = [10, 15]
    assert find(lines, "move", tick=2, robot="flyer") == 8
    lines[8]["to"] = 10  # it stays; as far as the watcher knows, it may have reached 16 in tick 3
    lines[10].update({"from": 10, "to": 10})
    del lines[11:]
    assert found(lines) == {("missed-belief", 3)}


@pytest.mark.parametrize(
    ("live", "believed", "wrong"),
    [
        (False, [10, 15], set()),
        (True, [10, 15], {("missed-belief", 2)}),
        (True, [10, 15, 16], set()),
    ],
)
def test_in_a_live_run_a_belief_grows_by_all_ways(
    live: bool, believed: list[int], wrong: set[tuple[str, int]]
) -> None:
    """From 9 it may have gone on to 16 by tick 2, two steps away."""
    lines = GOOD["beliefs"]()
    lines[0]["scenario"]["partition"] = [[7, 8, 13, 14], [9], [10], [15], [16]]
    told = find(lines, "belief", tick=2)
    lines[told]["regions"] = believed
    del lines[told + 2 :]  # after the flyer's move
    assert found(living(lines) if live else lines) == wrong


def test_a_belief_loses_the_cells_that_are_wholly_in_sight() -> None:
    lines = GOOD["beliefs"]()
    lines[find(lines, "belief", tick=2)]["regions"] = [9, 10, 15, 16]
    assert found(lines) == {("missed-belief", 2), ("missed-belief", 3)}


def test_no_robot_is_seen_out_of_sight() -> None:
    lines = GOOD["beliefs"]()
    lines[find(lines, "belief", tick=2)].update(seen=True, regions=[10])
    assert ("missed-belief", 2) in found(lines)


@pytest.mark.parametrize("role", ["moving", "tracked"])
def test_a_robot_that_tracks_others_records_it_from_its_first_observation(role: str) -> None:
    lines = GOOD["beliefs"]()
    start = lines[find(lines, "synthesis", robot="watcher")]
    start.update({"tracking": "belief", "node": 0, role: ["flyer"]})
    assert found(lines) == set()
    del lines[find(lines, "belief", tick=1)]
    assert found(lines) == {("missed-belief", 1)}

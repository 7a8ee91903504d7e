"""A world that is no simulation: obstacles that no scenario lists, doors that fall shut again,
pushes that fail. The trace of such a run is one that the checker and the replay can read."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

from safenav import Mission
from safenav.audit.check import check_trace
from safenav.errors import InputError
from safenav.report.replay.reading import read_replay
from safenav.report.terminal.story import Story
from safenav.runtime.worlds.world import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.writing import TraceWriter
from safenav.world.moves import Pose

BUILDING = """
safenav: 1
name: building
map:
  grid: |
    ###########
    #....#....#
    #.........#
    #....#....#
    ###########
robots:
  drone: {model: quadcopter, start: [1, 1], objective: {patrol: [[1, 1], [3, 9]]}}
  walker: {model: digit, start: [3, 2], heading: east, objective: {visit: [[3, 1], [1, 4]]}}
until: {rounds: 2}
limits: {ticks: 300}
"""
DOOR = 2 * 11 + 5
SUSPECTED = "obstacles: [{type: door, region: [2, 7]}, {type: uncertainty, region: [1, 7], %s}]\n"


class Building:
    """A door that nobody has told of. It jams for ``jams`` pushes, and falls shut again after
    the walker has gone, ``closings`` times in all."""

    def __init__(self, scenario: Scenario, jams: int = 0, closings: int = 1) -> None:
        self.at = {robot.name: robot.start.region for robot in scenario.robots}
        self.jams = jams
        self.closings = closings
        self.closed = True
        self.door = Obstacle(built_in().obstacles["door"], DOOR)

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        del robot
        return self.door if self.closed and region == DOOR else None

    def move(self, robot: Robot, pose: Pose) -> None:
        if robot.name == "walker" and self.at["walker"] == DOOR != pose.region:
            self.closed = self.closed or self.closings > 0
        self.at[robot.name] = pose.region

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        if robot.name != "walker" or self.at["walker"] != DOOR or not self.closed:
            return
        if self.jams:
            self.jams -= 1
            return
        self.closed = False
        self.closings -= 1
        yield self.door, None


Play = Callable[..., tuple[Path, list[dict[str, Any]]]]


@pytest.fixture
def play(tmp_path: Path) -> Play:
    def play(text: str = BUILDING, **options: int) -> tuple[Path, list[dict[str, Any]]]:
        scenario = load_scenario_text(text)
        trace = tmp_path / "trace.jsonl"
        told: list[str] = []
        story = Story(scenario, lambda line: told.append(str(line)))
        with TraceWriter(trace) as writer:
            world = Building(scenario, **options)
            result = Mission(scenario, world=world, listeners=[writer, story]).run()
        assert result.outcome == "completed", result.explanation
        assert any("door@27" in line and "resolves" in line for line in told)
        return trace, [json.loads(line) for line in trace.read_text().splitlines()]

    return play


def of_type(records: list[dict[str, Any]], *kinds: str) -> list[dict[str, Any]]:
    return [record for record in records if record["type"] in kinds]


def test_an_obstacle_that_no_scenario_lists_is_told_of_before_it_is_named(play: Play) -> None:
    trace, records = play()
    assert records[0]["scenario"]["world"] == "external"
    (discovered,) = of_type(records, "discovered")
    assert discovered["obstacle"] == {
        "type": "door",
        "name": "door@27",
        "region": DOOR,
        "action": "push",
        "resolution_regions": [DOOR],
        "blocks": ["drone", "walker"],
        "traversable": None,
    }
    first = next(record for record in records if record.get("obstacle") == "door@27")
    assert first["type"] == "violation" and records.index(discovered) < records.index(first)
    assert check_trace(trace).ok
    (hidden,) = read_replay(trace).hidden
    assert (hidden.name, hidden.region) == ("door@27", DOOR)


def test_pushes_fail_and_the_door_falls_shut_again(play: Play) -> None:
    trace, records = play(jams=3, closings=3)
    assert len(of_type(records, "discovered")) == 1
    order = [record["type"] for record in of_type(records, "violation", "resolved")]
    assert order.count("resolved") >= 2 and order[:2] == ["violation", "resolved"]
    assert check_trace(trace).findings == ()


def test_what_is_only_suspected_may_not_be_there(play: Play) -> None:
    """The drone flies through both; the truth of the second one is anybody's guess."""
    trace, records = play(BUILDING + SUSPECTED % "traversable: {probability: 0.5}")
    listed = records[0]["scenario"]["obstacles"]
    assert [entry["traversable"] for entry in listed] == [None, None]
    assert len(of_type(records, "discovered")) == 1
    assert check_trace(trace).findings == ()


def test_the_scenarios_own_world_is_simulated(tmp_path: Path) -> None:
    """Then the audit is as strict as ever."""
    scenario = load_scenario_text(BUILDING + SUSPECTED % "traversable: false")
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        world = SimulatedWorld(scenario)
        Mission(scenario, world=world, listeners=[writer]).run()
    records = [json.loads(line) for line in trace.read_text().splitlines()]
    assert records[0]["scenario"]["world"] == "simulated"
    assert [o["traversable"] for o in records[0]["scenario"]["obstacles"]] == [None, False]


def test_a_program_that_steps_itself_can_give_up(tmp_path: Path) -> None:
    scenario = load_scenario_text(BUILDING)
    trace = tmp_path / "trace.jsonl"
    with TraceWriter(trace) as writer:
        mission = Mission(scenario, world=Building(scenario), listeners=[writer])
        mission.start()
        for _ in range(12):
            mission.step()
        result = mission.give_up("battery low")
        assert mission.give_up("again") is mission.result is result
    last = json.loads(trace.read_text().splitlines()[-1])
    assert (last["outcome"], last["explanation"]) == ("interrupted", "battery low")
    audit = check_trace(trace)
    assert audit.ok and audit.complete


def changed(trace: Path, change: Callable[[list[dict[str, Any]]], None]) -> Path:
    records = [json.loads(line) for line in trace.read_text().splitlines()]
    change(records)
    trace.write_text("".join(json.dumps(record) + "\n" for record in records))
    return trace


def test_an_obstacle_out_of_nowhere_is_found_fault_with(play: Play) -> None:
    trace, records = play()
    discovered = of_type(records, "discovered")[0]
    audit = check_trace(changed(trace, lambda lines: lines.remove(discovered)))
    assert {finding.rule for finding in audit.findings} >= {"names"}

    def late(lines: list[dict[str, Any]]) -> None:
        lines.insert(-1, discovered)

    audit = check_trace(changed(trace, late))
    assert "names" in {finding.rule for finding in audit.findings}


def test_an_obstacle_is_discovered_once_and_in_its_time(play: Play) -> None:
    trace, records = play()
    place = records.index(of_type(records, "discovered")[0])
    wrong_tick = changed(trace, lambda lines: lines[place].update(tick=7000))
    found = [str(finding) for finding in check_trace(wrong_tick).findings]
    assert len(set(found)) == 2 and all("order (tick" in finding for finding in found), found
    twice = changed(trace, lambda lines: lines.insert(place, lines[place]))
    with pytest.raises(InputError, match="door@27 is known already"):
        check_trace(twice)

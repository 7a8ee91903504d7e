"""Batteries in time: no robot sets out without charge, by the log of its world alone, and one that
is alone completes its mission if and only if its charge can suffice.

``SAFENAV_FUZZ=5000`` plays 1,000 lone robots, and 500 teams, a quarter of them with faults.
"""

import json
import os
from collections.abc import Callable
from typing import Any

import pytest
from safenav.runtime.formulas import graph_of
from safenav.runtime.stops import Stops

from campaigns.generate.build import Data
from drawn import loads
from fuzz.watch import Charges
from live.campaign import faults_of, in_time, scenario_of
from live.charged import alone, team
from live.floor import Floor
from live.judge import verdict
from live.worlds import Live
from runtime.energy.test_need import lasting
from safenav import Mission
from safenav.checked_trace import check_trace
from safenav.scenario.model import Scenario
from safenav.scenario.settings import Clock
from safenav.trace.writing import as_data
from safenav.world.poses import region_mask

LONG = "SAFENAV_FUZZ" in os.environ
FAILED = (2129, 2139, 2303, 2399, 2184, 2113, 2283, 2012)
"""Teams whose runs have failed; their files in ``cases`` say why."""

Played = tuple[str, Charges, list[dict[str, Any]]]


def play(data: Data, scenario: Scenario, seed: int, *, faults: bool = False) -> Played:
    """The outcome of a run, the charges of its robots, and its trace. That is audited, and its
    end is judged by the log of the world unless a robot ran flat."""
    floor, lines = Floor(data, seed, faults_of(seed) if faults else {}), list[str]()
    world, heard = Live(scenario, floor), lambda record: lines.append(json.dumps(as_data(record)))
    result = Mission(scenario, world=world, listeners=[heard]).run()
    starts = {robot.name: robot.start[0] for robot in floor.mission.robots}
    charges = Charges(data, starts, floor.log)
    assert charges.defects == []
    assert check_trace(lines).findings == ()
    said = {"outcome": result.outcome.value, "explanation": result.explanation}
    if said["outcome"] == "completed" or (not charges.flat and said["outcome"] != "unrealizable"):
        assert verdict(data, floor.log, said) in ("", "?")
    return said["outcome"], charges, [json.loads(line) for line in lines]


@pytest.mark.parametrize("seed", range(1000 if LONG else 8))
def test_a_lone_robot_completes_its_mission_exactly_if_its_charge_can_suffice(
    seed: int, played: Callable[[], None]
) -> None:
    data, scenario = loads(alone, seed, in_time)
    (robot,), battery = scenario.robots, scenario.robots[0].model.battery
    assert battery is not None
    graph = graph_of(robot, scenario.map)
    targets = tuple(graph.poses_on(region_mask(t)) for t in robot.objective.targets)
    chargers = graph.poses_on(region_mask(scenario.chargers))
    lasts = lasting(Stops(graph, targets, graph.everywhere, chargers, battery))[0]
    outcome, charges, _ = play(data, scenario, seed)
    can = (graph.number(robot.start), battery.start) in lasts
    assert (outcome, charges.flat) == ("completed" if can else "unrealizable", set())
    played()


@pytest.mark.parametrize("seed", (*range(500 if LONG else 4), *FAILED))
def test_no_robot_of_a_team_sets_out_without_charge(seed: int, played: Callable[[], None]) -> None:
    data, scenario = loads(team, seed, in_time)
    assert seed not in FAILED or data == team(seed)
    play(data, scenario, seed, faults=seed % 4 == 3)
    played()


def test_a_team_that_continues_after_its_rounds_breaks_a_rule() -> None:
    data = team(2303)
    *lines, outcome = play(data, scenario_of(data, Clock.LIVE), 2303)[2]
    late = outcome["tick"] + 1
    hold = {"type": "hold", "tick": late, "t": outcome["t"], "robot": "r0", "why": "strategy"}
    lines += [hold, outcome | {"tick": late, "ticks": late}]
    assert ("completed", late) in broken(lines)


def test_a_lone_robot_that_delays_its_charging_stop_breaks_the_charge_rule() -> None:
    data = team(2139)
    lines = play(data, scenario_of(data, Clock.LIVE), 2139, faults=True)[2]
    at = next(k for k, line in enumerate(lines) if line["type"] == "depart" and line["tick"] == 21)
    after = next(k for k in range(at, len(lines)) if lines[k]["type"] == "arrive")
    late = lines.pop(at) | {key: lines[after - 1][key] for key in ("tick", "t")}
    lines.insert(after - 1, late)
    passes = range(21, late["tick"])  # also those without a line
    shorter = [("outcome", lines[-1]["tick"])] * 2  # seconds with and without a command
    assert broken(lines) == [*(("charge", tick) for tick in passes), *shorter]


def broken(lines: list[dict[str, Any]]) -> list[tuple[str, int]]:
    """The rules that a trace breaks, and in which ticks."""
    return [(found.rule, found.tick) for found in check_trace(map(json.dumps, lines)).findings]

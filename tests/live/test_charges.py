"""Batteries in time: no robot sets out without charge, by the log of its world alone, and one that
is alone completes its mission if and only if its charge can suffice.

``SAFENAV_FUZZ=5000`` plays 1,000 lone robots, and 500 teams, a quarter of them with faults.
"""

import json
import os
from collections.abc import Callable
from typing import Any

import pytest

from campaigns.generate.build import Data
from drawn import loads
from fuzz.watch import Charges
from live.campaign import faults_of, in_time
from live.charged import alone, lasting, team
from live.floor import Floor
from live.judge import verdict
from live.worlds import Live
from safenav import Mission
from safenav.checked_trace import check_trace
from safenav.scenario.model import Scenario
from safenav.team.team import team_of
from safenav.trace.writing import as_data

LONG = "SAFENAV_FUZZ" in os.environ
FAILED = (2129, 2139, 2303, 2399, 2184, 2113, 2283, 2012)
"""Teams whose runs have failed; their files in ``cases`` say why."""

Played = tuple[str, Charges, list[dict[str, Any]]]


def play(data: Data, scenario: Scenario, seed: int, *, faults: bool = False) -> Played:
    """The outcome of a run, the charges of its robots, and its trace. That is checked, and its
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
    (member,) = team_of(scenario).members
    energy, start = member.energy, member.graph.number(member.robot.start)
    assert energy is not None
    outcome, charges, _ = play(data, scenario, seed)
    can = (start, energy.battery.start) in lasting(energy)
    assert (outcome, charges.flat) == ("completed" if can else "unrealizable", set())
    played()


@pytest.mark.parametrize("seed", (*range(500 if LONG else 4), *FAILED))
def test_no_robot_of_a_team_sets_out_without_charge(seed: int, played: Callable[[], None]) -> None:
    data, scenario = loads(team, seed, in_time)
    assert seed not in FAILED or data == team(seed)
    play(data, scenario, seed, faults=seed % 4 == 3)
    played()

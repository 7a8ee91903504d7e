"""Deadlines met as simulated: one that is reported to hold forever holds in a continued run."""

import json
import os
from pathlib import Path

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from runtime.deadlines.timed import timed_scenario
from runtime.played import play
from safenav.cli.check import command
from safenav.errors import InputError
from safenav.runtime.analysis.team_simulation import simulate_team
from safenav.runtime.mission import Mission, default_synthesizer
from safenav.scenario.model import Timing
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import LatePolicy, Until
from safenav.trace import records

COUNT = (int(os.environ.get("SAFENAV_FUZZ", "0")) or 45) // 5
ENDLESS = 100_000


@pytest.mark.parametrize("seed", range(COUNT))
def test_a_simulated_period_repeats_in_the_continued_run(seed: int) -> None:
    try:
        scenario = load_scenario_text(timed_scenario(seed))
    except InputError:
        return
    still = replace(
        scenario,
        obstacles=(),
        late=LatePolicy.GO_ON,
        until=Until(ENDLESS),
        robots=tuple(
            replace(
                robot, model=replace(robot.model, timing=Timing(*[robot.model.timing.most] * 2))
            )
            for robot in scenario.robots
        ),
    )
    found = simulate_team(still, default_synthesizer(still))
    if found is None or found.repeats is None:
        return
    first, again = found.repeats
    period, end = again - first, again + 3 * (again - first)
    places: dict[int, list[object]] = {}
    late: dict[str, int] = {}

    def heard(record: records.Record) -> None:
        if isinstance(record, records.Move):
            places.setdefault(record.tick, []).append((record.to, record.heading, record.toward))
        elif isinstance(record, records.Deadline) and record.verdict.value == "late":
            late.setdefault(record.of, record.tick)

    mission = Mission(still, listeners=[heard])
    mission.start()
    while mission.state.tick < end and mission.result is None:
        mission.step()
    assert all(places[t] == places[t + period] for t in range(first + 1, end - period + 1))
    assert late == found.late


SHARED = """
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [lift], timing: {least: 1, most: 2}}}
  obstacles: {parcel: {action: lift, blocks: []}}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 5], [1, 1]], within: 30}}
  b: {model: cart, start: [2, 5], objective: {visit: [[2, 1], [2, 5]]}}
until: {rounds: 3, by: 60}
"""


def test_variable_steps_on_a_shared_floor_allow_no_promise() -> None:
    scenario = load_scenario_text(SHARED)
    found = simulate_team(scenario, default_synthesizer(scenario))
    assert found is not None
    assert "a step of a takes 1 to 2 ticks, and it shares its floor" in found.why


def test_alone_the_slowest_steps_are_the_worst_case(tmp_path: Path) -> None:
    scenario = load_scenario_text(SHARED.replace("  b:", "  # b:"))
    found = simulate_team(scenario, default_synthesizer(scenario))
    assert found is not None
    assert found.slowest
    assert found.completed is not None
    for seed in range(8):
        result = Mission(replace(scenario, seed=seed)).run()
        assert result.ticks <= found.completed
    path = tmp_path / "alone.yaml"
    path.write_text(SHARED.replace("  b:", "  # b:"))
    said = CliRunner().invoke(command, [str(path)]).output
    assert f"with the slowest steps: the mission is completed in tick {found.completed}" in said


EMPTY = """
safenav: 1
map: {grid: ["#######", "#..#..#", "#.....#", "#.##..#", "##....#", "#######"]}
catalogue:
  robots:
    bat: {mobility: free, layer: ground, capabilities: [],
          battery: {capacity: 25, charge: 3, stay: 1}}
robots:
  a: {model: bat, start: 15, objective: {patrol: [8, 18]}}
  b: {model: bat, start: 11, objective: {patrol: [30, 16]}}
  c: {model: bat, start: 26, objective: {hold: 17}}
chargers: [33, 19]
"""


def test_check_warns_of_a_battery_that_runs_empty_on_a_shared_floor(tmp_path: Path) -> None:
    """Each robot alone has the charge that it needs: the verdict is realizable."""
    ended = play(EMPTY)
    assert ended.outcome["outcome"] == "operator_needed"
    (flat,) = ended.all("service", cause="battery")
    path = tmp_path / "empty.yaml"
    path.write_text(EMPTY)
    warning = f"the battery of {flat['robot']} is empty in tick {flat['tick']}, as simulated"
    assert warning in CliRunner().invoke(command, [str(path)]).output
    told = json.loads(CliRunner().invoke(command, [str(path), "--json"]).stdout)
    assert told["warnings"] == [warning]


@pytest.mark.parametrize(("work", "flat"), [(2_000, False), (20_000, True)])
def test_the_length_of_the_simulation_depends_on_counted_work_only(
    monkeypatch: pytest.MonkeyPatch, work: int, *, flat: bool
) -> None:
    monkeypatch.setattr("safenav.runtime.analysis.team_simulation.WORK", work)
    scenario = load_scenario_text(EMPTY)
    found = simulate_team(scenario, default_synthesizer(scenario))
    assert found is not None and bool(found.flat) is flat


CORRIDOR = """
safenav: 1
map: {grid: ["#########", "#.......#", "#########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground}}}
robots: {cart: {model: cart, start: [1, %d], objective: {%s}}}
until: {rounds: %d, by: %d}
"""


@pytest.mark.parametrize(
    ("start", "objective", "rounds", "ticks"),
    [
        (1, "visit: [[1, 1], [1, 5]]", 1, 4),  # it starts on its first target
        (1, "visit: [[1, 1], [1, 5]]", 3, 20),
        (3, "visit: [[1, 3]]", 2, 1),
        (2, "visit: [[1, 1], [1, 5]]", 1, 5),
        (5, "patrol: [[1, 1], [1, 5]]", 1, 4),  # it begins with the second, on which it starts
        (6, "patrol: [[1, 1], [1, 5]]", 1, 5),  # ... which it would have to cross
        (5, "patrol: [[1, 1], [1, 5]], form: literal", 2, 12),
        (3, "circuit: [[1, 3], [1, 7]]", 1, 4),
        (1, "once: [[1, 1], [1, 5]]", 1, 4),
        (3, "once: [[1, 1], [1, 5]]", 3, 8),  # each tick at the last one is a round
        (7, "hold: [1, 5]", 3, 4),
        (5, "hold: [1, 5]", 3, 2),
    ],
)
def test_by_is_refused_just_below_what_a_robot_alone_needs(
    start: int, objective: str, rounds: int, ticks: int
) -> None:
    kept = play(CORRIDOR % (start, objective, rounds, ticks))
    assert (kept.outcome["outcome"], kept.outcome["late"]) == ("completed", [])
    assert kept.outcome["tick"] == ticks
    if ticks > 1:
        refused = play(CORRIDOR % (start, objective, rounds, ticks - 1))
        assert f"cannot be completed before tick {ticks}" in refused.outcome["explanation"]


KEPT = "within 30 of a: kept, as simulated: the mission is completed in tick"
ORDERED = "}\norders: [{at: %d, type: parcel, region: [1, 3]}]\nlimits: {ticks: 99"


@pytest.mark.parametrize(
    ("until", "said"),
    [
        ("rounds: 1, by: 5", "unrealizable: the mission cannot be completed before tick 8, and is"),
        ("rounds: 1", KEPT),
        (f"rounds: 1{ORDERED % 9}", KEPT),
        (
            f"rounds: 1, by: 19{ORDERED % 20}",
            "by 19: late in tick 20, as simulated, completed in tick 2",
        ),
        ("rounds: 99999", "within 30 of a: kept forever, as simulated: tick"),
    ],
)
def test_check_reports_whether_deadlines_are_kept_as_simulated(
    until: str, said: str, tmp_path: Path
) -> None:
    text = SHARED.replace("timing: {least: 1, most: 2}", "timing: 1")
    (tmp_path / "s.yaml").write_text(text.replace("rounds: 3, by: 60", until))
    assert said in CliRunner().invoke(command, [str(tmp_path / "s.yaml")]).output

"""Swept regions: while a robot resolves an obstacle, no other is where that sweeps."""

import json
import os
from collections.abc import Sequence
from itertools import count, islice

import pytest

from live.missions import crowd
from runtime.played import Line, Run, play
from runtime.test_live import Faulty, play_faulty
from safenav import Arrived, Lost, WorldEvent
from safenav.scenario.reading.loader import load_scenario_text
from safenav.studio.editing.operations import edited

MISSIONS = 4 * max(1, int(os.environ.get("SAFENAV_FUZZ", "1")))
HALL = """\
safenav: 1
name: swept
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
catalogue:
  obstacles:
    leaf: {action: push, sweeps: neighbours}
    bar: {action: push, resolve_at: neighbours, sweeps: neighbours}
robots:
  digit: {model: digit, start: [3, 7], heading: north, objective: {visit: [[1, 5], [3, 7]]}}
  quad: {model: quadcopter, start: [2, 1], objective: {visit: [[2, 7], [2, 1]]}}
obstacles: [{type: leaf, region: [2, 4]}]
until: {rounds: 2}
"""
GATE, SWEPT = 22, {21, 23}
STAYS = HALL.replace(
    "start: [2, 1], objective: {visit: [[2, 7], [2, 1]]}",
    "start: [2, 3], objective: {hold: [2, 3]}",
)
STAYS = STAYS.replace("visit: [[1, 5], [3, 7]]", "visit: [[1, 1], [3, 7]]")


def played(text: str, clock: str) -> Run:
    return play(f"{text}clock: {clock}\n")


def meetings(lines: list[Line], gate: int, swept: set[int], by: str) -> int:
    """How often another robot was in the swept regions while ``by`` resolved what is at the gate,
    told from the moves or commands alone."""
    robots = lines[0]["scenario"]["robots"]
    at = {name: {data["start"]} for name, data in robots.items()}
    acting, over, found = False, False, 0
    for line in lines[1:]:
        match line["type"]:
            case "move" | "arrive":
                at[line["robot"]] = {line.get("to", line.get("at")), line.get("toward")} - {None}
            case "depart":
                at[line["robot"]] = {line["from"], line["to"]}
            case "act":
                acting = acting or line["robot"] == by
            case "resolved":
                acting, over = True, True
        others = set().union(*(regions for name, regions in at.items() if name != by))
        found += (acting or gate in at[by]) and bool(others & swept)
        if over:
            return found
    raise AssertionError("nothing was resolved")


@pytest.mark.parametrize("text", [HALL, STAYS], ids=["passes", "stays"])
@pytest.mark.parametrize("kind", ["leaf", "bar"])
def test_no_other_robot_is_where_a_resolution_sweeps(clock: str, text: str, kind: str) -> None:
    """Also if it holds there for itself: a joint plan moves it."""
    run = played(text.replace("type: leaf", f"type: {kind}"), clock)
    assert run.outcome["outcome"] == "completed"
    assert run.records[0]["scenario"]["obstacles"][0]["sweeps"] == sorted(SWEPT)
    assert meetings(run.records, GATE, SWEPT, "digit") == 0


@pytest.mark.parametrize("kind", ["leaf", "bar"])
def test_without_the_key_robots_enter_the_regions_and_the_audit_reports_that(
    clock: str, kind: str
) -> None:
    text = HALL.replace(", sweeps: neighbours", "").replace("type: leaf", f"type: {kind}")
    run = played(text, clock)
    assert meetings(run.records, GATE, SWEPT, "digit") > 0
    run.records[0]["scenario"]["obstacles"][0]["sweeps"] = sorted(SWEPT)
    assert "swept" in run.broken


HINGED = (seed for seed in count(1, 3) if crowd(seed, 2 + seed % 4).get("obstacles"))
"""Those of every third mission with closed doors."""


@pytest.mark.parametrize("seed", [*islice(HINGED, MISSIONS)])
def test_random_missions_with_swept_regions_end_as_those_without(seed: int, clock: str) -> None:
    data = json.dumps(crowd(seed, 2 + seed % 4) | {"limits": {"ticks": 400}, "clock": clock})
    outcome = play(data).outcome["outcome"]
    if outcome != "completed":
        without = data.replace(', "sweeps": "neighbours"', "")
        assert play(without).outcome["outcome"] == outcome


def test_the_studio_keeps_the_swept_regions_of_an_obstacle_that_it_moves() -> None:
    text = HALL.replace("region: [2, 4]}", "region: [2, 4], sweeps: [[2, 3]]}")
    moved = edited(text, {"op": "move_obstacle", "index": 0, "region": 21})
    (obstacle,) = load_scenario_text(moved, "swept.yaml").obstacles
    assert obstacle.region == 21 and obstacle.sweeps == frozenset({21})
    (before,) = load_scenario_text(text, "swept.yaml").obstacles
    assert before.swept(load_scenario_text(text, "swept.yaml").map) == {21}


def lost_beside_the_gate(world: Faulty, event: WorldEvent) -> Sequence[WorldEvent]:
    if isinstance(event, Arrived) and event.robot == "quad" and world.count["quad"] == 2:
        return [Lost(event.at, "quad", frozenset({20, 21}), command=event.command)]
    return [event]


def test_no_robot_resolves_an_obstacle_that_sweeps_where_another_may_be_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = HALL.replace("[1, 5], [3, 7]]", "[1, 1], [3, 7]]") + "clock: live\n"
    run = play_faulty(lost_beside_the_gate, text)
    assert run.outcome["cause"] == "out_of_service"
    assert not run.all("depart", to=GATE, robot="digit") and "swept" not in run.broken
    monkeypatch.setattr("safenav.runtime.sweeping.clear_of", lambda *_: True)
    careless = play_faulty(lost_beside_the_gate, text)
    assert careless.all("depart", to=GATE, robot="digit") and "swept" in careless.broken

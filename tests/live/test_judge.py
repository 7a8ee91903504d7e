"""The judge in time: logs by hand, and blocking runs on the floor, here and behind a socket."""

from contextlib import closing
from typing import Any

import pytest
import yaml

from live.floor import Floor
from live.judge import Walk, verdict
from live.missions import timed
from live.wire import Wired
from live.worlds import Serial
from safenav import Mission
from safenav.scenario.reading.loader import load_scenario_text

PAIR: dict[str, Any] = {
    "map": {"grid": ["#######", "#.....#", "#.....#", "#######"]},
    "catalogue": {"robots": {"cart": {"mobility": "free", "layer": "ground"}}},
    "robots": {
        "a": {"model": "cart", "start": 8, "objective": {"visit": [9, 10]}},
        "b": {"model": "cart", "start": 11, "objective": {"visit": [11]}},
    },
    "obstacles": [{"type": "door", "region": 16}],
    "until": {"rounds": 1},
}
Line = dict[str, Any]
COMPLETED = {"outcome": "completed"}
NEEDED = {"outcome": "operator_needed"}


def start(t: float, robot: str, origin: int, to: int, stops: str | None = None) -> Line:
    return {"log": "start", "t": t, "robot": robot, "from": origin, "to": to, "stops": stops}


def end(t: float, robot: str, at: int, how: str = "arrived", **more: Any) -> Line:
    return {"log": "end", "t": t, "robot": robot, "at": at, "how": how, **more}


def told(t: float, robot: str, event: str, **more: Any) -> Line:
    return {"log": "told", "t": t, "robot": robot, "event": event, **more}


def shown(t: float, log: str = "shown") -> Line:
    return {"log": log, "t": t, "robot": "a", "obstacle": "door@16", "there": True}


OUT = [start(0, "a", 8, 9), end(2, "a", 9)]
ON = [start(2, "a", 9, 10), end(3, "a", 10)]
BESIDE = [start(0, "b", 11, 10), end(1, "b", 10)]
LOST = [start(2, "a", 9, 16), end(4, "a", 9, "lost", within=[9, 16])]
INTO = start(3, "a", 9, 16, "door@16")
FAILING = [
    line
    for t in range(2, 5)
    for line in (start(t, "a", 9, 8), end(t + 0.5, "a", 9, "failed"), told(t, "a", "failed"))
]
FLOOR_3 = {"grid": ["#####", "#...#", "#####"]}
TRAPPED = {
    **PAIR,
    "map": FLOOR_3,
    "robots": {"a": {"model": "cart", "start": 6, "objective": {"visit": [8, 6]}}},
    "obstacles": [{"type": "door", "region": 7}],
}


@pytest.mark.parametrize(
    ("log", "said", "found"),
    [
        ([*OUT, *ON], COMPLETED, ""),
        (OUT, COMPLETED, "a has done 0 rounds of 1"),
        ([*OUT, *BESIDE, start(3, "b", 10, 9)], COMPLETED, "b and a have [9] at the same time"),
        ([start(0, "a", 8, 9), *BESIDE, start(1, "b", 10, 9)], COMPLETED, "[9] at the same time"),
        ([start(0, "a", 8, 9), end(1, "a", 10, "elsewhere"), *BESIDE], NEEDED, "[10] at the same"),
        ([*OUT, *LOST, *BESIDE, start(5, "b", 10, 9)], NEEDED, "b and a have [9] at the same"),
        ([*OUT, INTO], NEEDED, "a is sent into door@16, which is before its sensor"),
        ([*OUT, shown(3, "hidden"), INTO, end(4, "a", 9, "blocked"), *ON], COMPLETED, ""),
        ([*OUT, shown(2), shown(3, "hidden"), INTO], NEEDED, "sent into door@16, which is known"),
        ([*OUT, *ON], NEEDED, "but the mission can be completed"),
        ([*OUT, told(2, "a", "failed", fatal=True)], NEEDED, ""),
        ([*OUT, *FAILING], NEEDED, "but the mission can be completed"),
        ([{"log": "wrong", "t": 1, "robot": "a", "to": 30}], NEEDED, "no robot can do that"),
        (OUT, {"outcome": "search_limit", "explanation": "too large"}, "ends as search_limit"),
    ],
)
def test_a_log_is_judged_by_what_really_happened(log: list[Line], said: Line, found: str) -> None:
    judged = verdict(PAIR, log, said)
    assert found in judged
    assert bool(found) == bool(judged)


@pytest.mark.parametrize(
    ("log", "found"), [([], "can be completed"), ([shown(0) | {"obstacle": "door@7"}], "")]
)
def test_operator_needed_is_justified_by_what_the_robots_know(log: list[Line], found: str) -> None:
    assert found in verdict(TRAPPED, log, NEEDED)
    assert bool(found) == bool(verdict(TRAPPED, log, NEEDED))


def test_unexplained_failures_count_as_obstacles() -> None:
    tries = [(start(t, "a", 6, 7), end(t + 0.5, "a", 6, "failed")) for t in range(3)]
    log = [line for pair in tries for line in pair]
    assert verdict(TRAPPED, log[:4], NEEDED)
    assert not verdict(TRAPPED, log, NEEDED)


def test_an_obstacle_on_which_its_only_helper_has_failed_stays() -> None:
    failed = {"log": "acted", "t": 1, "robot": "a", "stages": {}, "found": {"door@7": "failed"}}
    known = shown(0) | {"obstacle": "door@7"}
    cart = {**PAIR["catalogue"]["robots"]["cart"], "capabilities": ["push"]}
    helped = {**TRAPPED, "catalogue": {"robots": {"cart": cart}}}
    assert verdict(helped, [known, failed], NEEDED)
    assert not verdict(helped, [known, failed, failed], NEEDED)


def play(seed: int, floor: Any) -> tuple[list[Line], Line]:
    data = timed(seed)
    scenario = load_scenario_text(yaml.safe_dump(data, sort_keys=False))
    result = Mission(scenario, world=Serial(scenario, floor)).run()
    said = {"outcome": result.outcome.value, "explanation": result.explanation}
    return floor.log, said


@pytest.mark.parametrize("seed", [4, 7, 8, 20])
def test_the_judge_finds_no_defect_in_blocking_runs(seed: int) -> None:
    data = timed(seed)
    log, said = play(seed, Floor(data, seed))
    assert not verdict(data, log, said)
    walk = Walk(Floor(data).mission, log)
    assert walk.over > 0
    assert walk.moves > 0


def test_a_floor_behind_a_socket_is_the_same_floor() -> None:
    data = timed(7)
    with closing(Wired(data, seed=7)) as wired:
        assert play(7, wired) == play(7, Floor(data, 7))

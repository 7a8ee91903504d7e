"""The judge of the logs of worlds: logs by hand."""

from typing import Any

import pytest

from campaigns.judge.log import Walk, verdict
from campaigns.judge.mission import read_mission

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
COMPLETED, NEEDED = "completed", "operator_needed"


def start(t: float, robot: str, origin: int, to: int, stops: str | None = None) -> Line:
    line = {"log": "start", "t": t, "robot": robot, "origin": origin, "to": to, "stops": stops}
    return line | {"busy": False, "command": 1}


def end(t: float, robot: str, at: int, how: str = "arrived", **more: Any) -> Line:
    return {"log": "end", "t": t, "robot": robot, "at": at, "how": how, "within": None, **more}


def told(t: float, robot: str, event: str, **more: Any) -> Line:
    line = {"log": "told", "t": t, "robot": robot, "event": event}
    return line | {"fatal": False, "command": 1, **more}


def shown(t: float, log: str = "shown") -> Line:
    return {"log": log, "t": t, "robot": "a", "obstacle": "door@16", "there": True}


def judged_by_log(data: dict[str, Any], log: list[Line], outcome: str) -> str:
    return verdict(data, read_mission(data), Walk(data, log), outcome)


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
        ([*OUT, start(3, "a", 9, 18)], NEEDED, "sets out from 9 to 18"),
    ],
)
def test_a_log_is_judged_by_the_actual_events(log: list[Line], said: str, found: str) -> None:
    judged = judged_by_log(PAIR, log, said)
    assert found in judged
    assert bool(found) == bool(judged)


@pytest.mark.parametrize(
    ("log", "found"), [([], "can be completed"), ([shown(0) | {"obstacle": "door@7"}], "")]
)
def test_operator_needed_is_justified_by_the_knowledge_of_the_robots(
    log: list[Line], found: str
) -> None:
    assert found in judged_by_log(TRAPPED, log, NEEDED)
    assert bool(found) == bool(judged_by_log(TRAPPED, log, NEEDED))


def test_unexplained_failures_count_as_obstacles() -> None:
    tries = [(start(t, "a", 6, 7), end(t + 0.5, "a", 6, "failed")) for t in range(3)]
    log = [line for pair in tries for line in pair]
    assert judged_by_log(TRAPPED, log[:4], NEEDED)
    assert not judged_by_log(TRAPPED, log, NEEDED)


def test_an_obstacle_on_which_its_only_helper_has_failed_stays() -> None:
    failed = {"log": "acted", "t": 1, "robot": "a", "stages": {}, "found": {"door@7": "failed"}}
    known = shown(0) | {"obstacle": "door@7"}
    cart = {**PAIR["catalogue"]["robots"]["cart"], "capabilities": ["push"]}
    helped = {**TRAPPED, "catalogue": {"robots": {"cart": cart}}}
    assert judged_by_log(helped, [known, failed], NEEDED)
    assert not judged_by_log(helped, [known, failed, failed], NEEDED)


def test_the_judge_finds_overlaps_entries_and_steps_without_charge() -> None:
    """Two robots in one region, one in a known obstacle, and one that sets out without charge."""
    model = {"mobility": "free", "layer": "ground", "battery": {"capacity": 1, "stay": 0}}
    data = {
        "map": {"grid": ["####", "....", "####"]},
        "catalogue": {"robots": {"m": model}},
        "robots": {
            "a": {"model": "m", "start": 4, "objective": {"visit": [5], "avoid": [6]}},
            "b": {"model": "m", "start": 6, "objective": {"visit": [6]}},
        },
    }
    into = start(0, "a", 4, 5, "door@5")
    log = [shown(0) | {"obstacle": "door@5"}, into, end(1, "a", 5), told(1, "a", "arrived")]
    assert [
        defect.split(": ")[1] for defect in Walk(data, [*log, start(1, "a", 5, 6)]).defects
    ] == [
        "a is sent into door@5, which is known",
        "a and b have [6] at the same time",
        "a sets out for 6, which it avoids",
        "a sets out with a charge of 0",
    ]

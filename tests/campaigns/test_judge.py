"""The judge itself: cases by hand (``judge.yaml``)."""

import json
from typing import Any

import pytest

from campaigns.judge.log import Walk, judge_log
from campaigns.judge.mission import Data, Mission, NotJudgedError
from campaigns.judge.search import Situation, at_start, can_complete
from campaigns.judge.trace import Replay, rounds_done
from once import beside, from_yaml

CASES = from_yaml(beside(__file__, "judge.yaml"))
KEYS = {
    "move": ["robot", "to", "toward"],
    "resolved": ["obstacle", "traversable"],
    "violation": ["obstacle"],
    "blocked": ["obstacle"],
    "goal": ["robot", "region"],
    "start": ["t", "robot", "origin", "to", "stops"],
    "end": ["t", "robot", "at", "how", "within"],
    "told": ["t", "robot", "event", "fatal"],
    "shown": ["t", "robot", "obstacle"],
    "hidden": ["t", "robot", "obstacle"],
    "acted": ["t", "robot", "found"],
}
OTHERS: dict[str, Any] = {"heading": None, "goal": 0, "round": 1, "there": True, "stages": {}}
OTHERS |= {"how": "arrived", "within": None, "stops": None, "fatal": False, "busy": False}
"""What lines have where a case says nothing."""


def lines(written: list[list[Any]]) -> list[dict[str, Any]]:
    numbered = enumerate(written, 1)
    return [
        {**OTHERS, "type": kind, "log": kind, "tick": k, "command": 1}
        | dict(zip(KEYS[kind], values, strict=False))
        for k, (kind, *values) in numbered
    ]


def data(case: Data) -> dict[str, Any]:
    """The scenario of a case."""
    floor, types = case["floor"], case.get("obstacles", {})
    framed = isinstance(floor, int) and ["#" * (floor + 2), f"#{'.' * floor}#", "#" * (floor + 2)]
    robots = {n: {"model": "quadcopter", **robot} for n, robot in case["robots"].items()}
    named = {name.partition("@")[0]: kind for name, kind in types.items()}
    regions = [name.split("@") for name in types]
    return {
        "map": {"grid": framed or floor, "names": {"far": 16}},
        "catalogue": {"robots": CASES["models"], "obstacles": named},
        "robots": robots,
        "obstacles": [{"type": kind, "region": int(region)} for kind, region in regions],
        "until": {"rounds": case.get("rounds", 1)},
    }


@pytest.mark.parametrize("says", CASES["search"])
def test_the_search_decides_whether_a_mission_can_be_completed(says: str) -> None:
    case = CASES["search"][says]
    mission, sealed = Mission(data(case)), frozenset(case.get("sealed", ()))
    start = at_start(mission, mission.obstacles.keys() - sealed)
    begin = Situation(start.poses, start.progress, start.stages, sealed)
    assert can_complete(mission, begin) is case["possible"]


def test_a_formula_goal_of_an_unknown_form_is_not_judged() -> None:
    robot = {"start": 7, "objective": {"ltl": {"liveness": ["region = 7 & region = 8"]}}}
    with pytest.raises(NotJudgedError, match="the goal"):
        _ = Mission(data({"floor": 4, "robots": {"a": robot}})).robots


@pytest.mark.parametrize(("objective", "visits", "rounds"), CASES["rounds"])
def test_rounds_follow_from_visits(objective: Data, visits: list[int], rounds: int) -> None:
    robots = {"a": {"start": 8, "objective": objective}}
    found = Mission(data({"floor": 4, "robots": robots}))
    assert rounds_done(found.robots["a"], visits) == rounds


@pytest.mark.parametrize("says", CASES["traces"])
def test_a_trace_ends_where_its_moves_lead(says: str) -> None:
    case = CASES["traces"][says]
    ending = Replay(Mission(data(case)), lines(case["lines"]))
    found = vars(ending.situation) | {"problems": ending.problems, "visits": ending.visits}
    found["away"] = ending.away
    for what, expected in case["finds"].items():
        assert json.loads(json.dumps(found[what], default=list)) == expected


@pytest.mark.parametrize(("kind", "models", "steps", "ticks"), CASES["entries"])
def test_entering_an_open_obstacle_is_noticed(
    kind: Data, models: dict[str, str], steps: list[list[Any]], ticks: list[int]
) -> None:
    objective = {"visit": [12, 15]}
    robots = {
        name: {"model": model, "start": 12, "avoids": [], "objective": objective}
        for name, model in models.items()
    }
    found = Mission(data({"floor": 7, "robots": robots, "obstacles": {"it@13": kind}}))
    trace = lines([step if step[0] in KEYS else ["move", *step] for step in steps])
    told = [problem.split() for problem in Replay(found, trace).problems if " is in " in problem]
    assert [int(words[1].rstrip(":")) for words in told] == ticks


@pytest.mark.parametrize("says", CASES["logs"])
def test_a_log_that_contradicts_the_actual_events_is_refused(says: str) -> None:
    case = CASES["logs"][says]
    walk = Walk(data(case["mission"]), lines(case["log"]))
    found, expected = judge_log(walk, case["said"]), case.get("finds", "")
    assert expected in found
    assert bool(found) == bool(expected)

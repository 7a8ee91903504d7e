"""The judge itself: cases by hand."""

from dataclasses import replace
from typing import Any

import pytest

from campaigns.judge import joint
from campaigns.judge.log import Walk, verdict
from campaigns.judge.mission import (
    FIRST,
    Answer,
    Mission,
    NotJudgedError,
    Situation,
    at_start,
    read_mission,
)
from campaigns.judge.replay import Replay, rounds_done


def all_known(mission: Mission) -> Situation:
    """The start, with all obstacles known."""
    start = at_start(mission)
    return Situation(start.poses, start.progress, dict.fromkeys(mission.obstacles, FIRST))


def corridor(length: int, robots: dict[str, Any], **more: Any) -> Mission:
    grid = ["#" * (length + 2), "#" + "." * length + "#", "#" * (length + 2)]
    data = {"map": {"grid": grid}, "robots": robots, "until": {"rounds": 1}, **more}
    return read_mission(data)


def flyer(start: int, **objective: Any) -> dict[str, Any]:
    return {"model": "quadcopter", "start": start, "objective": objective}


def walker(start: int, heading: str, **objective: Any) -> dict[str, Any]:
    return {"model": "digit", "start": start, "heading": heading, "objective": objective}


PUSH, LIFT = {"action": "push"}, {"action": "lift", "robots": 2, "together": True}
MODELS = {
    "cart": {"mobility": "free", "layer": "ground"},
    "presser": {"mobility": "free", "layer": "ground", "capabilities": ["press"]},
    "opener": {"mobility": "free", "layer": "ground", "capabilities": ["push"]},
    "lifter": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
    "bulldozer": {"mobility": "heading", "layer": "ground", "capabilities": ["push", "lift"]},
}


def holder(model: str, start: int, **more: Any) -> dict[str, Any]:
    return {"model": model, "start": start, "objective": {"hold": start}, **more}


def behind(robots: dict[str, Any], **types: Any) -> Mission:
    """A corridor 8, 9, ... 12 in which ``a`` flies to its end, and obstacles by their regions."""
    kinds = {name.partition("_")[0]: kind for name, kind in types.items()}
    places = [name.partition("_") for name in types]
    return corridor(
        5,
        {"a": flyer(8, visit=[12]), **robots},
        obstacles=[{"type": kind, "region": int(region)} for kind, _, region in places],
        catalogue={"robots": MODELS, "obstacles": kinds},
    )


def lifters(robots: int) -> Mission:
    both = {name: holder("lifter", at, avoids=[]) for name, at in (("b", 9), ("c", 12))}
    return behind(both, beam_10={"needs": [LIFT | {"robots": robots, "at": "neighbours"}]})


def lift_at_9(region: int, *, together: bool, **avoids: Any) -> Mission:
    need = LIFT | {"at": [9], "together": together}
    both = {name: holder("lifter", at, **avoids) for name, at in (("b", 9), ("c", 8))}
    return behind(both, **{f"beam_{region}": {"needs": [need]}})


def lift_and_leave(*, together: bool) -> Mission:
    """Only a robot that lifts in passing, and cannot turn round, opens the door to the other."""
    need = LIFT | {"at": [9], "together": together}
    first = {"model": "bulldozer", "start": 8, "heading": "east", "objective": {"hold": 11}}
    robots = {"b": first | {"avoids": []}, "c": holder("lifter", 12, avoids=[])}
    return behind(robots, door_11=PUSH, beam_12={"needs": [need], "blocks": ["a"]})


def ring(rounds: int, **objective: Any) -> Mission:
    """One that cannot turn round on a ring 6, 10, 9, 5, beside one that always stays at 6."""
    stays = [f"region = 6 -> region' != {k}" for k in (5, 10)]
    robots = {
        "a": walker(10, "south", **objective),
        "b": flyer(6, ltl={"liveness": ["region = 6"], "safety": stays}) | {"avoids": ["a"]},
    }
    grid = ["####", "#..#", "#..#", "####"]
    return read_mission({"map": {"grid": grid}, "robots": robots, "until": {"rounds": rounds}})


@pytest.mark.parametrize(
    ("found", "answer"),
    [
        (corridor(4, {"a": flyer(7, visit=[10]), "b": flyer(10, visit=[7])}), "no"),
        (corridor(4, {"a": flyer(7, visit=[8, 10]), "b": flyer(10, hold=10)}), "no"),
        (
            corridor(4, {"a": flyer(7, visit=[8, 7]), "b": flyer(10, visit=[9, 10])}),
            "yes",
        ),
        (corridor(4, {"a": walker(7, "east", visit=[10, 8])}), "no"),
        (corridor(4, {"a": walker(7, "east", hold=10)}), "yes"),
        (behind({"b": holder("opener", 11)}, door_10=PUSH), "yes"),
        (behind({"b": holder("opener", 11)}, door_10={"action": "clear"}), "no"),
        *[(lifters(k), answer) for k, answer in ((1, "yes"), (2, "yes"), (3, "no"))],
        (lift_at_9(10, together=True), "no"),
        (lift_at_9(12, together=False), "yes"),
        (lift_at_9(10, together=True, avoids=[]), "yes"),
        (lift_and_leave(together=True), "no"),
        (lift_and_leave(together=False), "yes"),
        (corridor(4, {"a": flyer(7, hold=9), "b": flyer(10, hold=9)}), "no"),
        (corridor(4, {"a": flyer(7, hold=9), "b": flyer(10, visit=[9])}), "yes"),
        (corridor(4, {"a": flyer(7, once=[9, 8]), "b": flyer(10, once=[8, 9])}), "yes"),
        (corridor(4, {"a": flyer(7, once=[8, 9]), "b": flyer(10, once=[9, 8])}), "no"),
        (ring(1, visit=[5, 9]), "no"),
        (ring(1, patrol=[5, 9]), "yes"),
        (ring(1, cover=[5, 9]), "yes"),
        (ring(2, cover=[5, 9]), "no"),
    ],
)
def test_the_search_knows_what_is_possible(found: Mission, answer: str) -> None:
    assert joint.can_complete(found, all_known(found)).value == answer


def test_an_untraversable_obstacle_stays_closed_to_robots_it_blocks() -> None:
    here = holder("opener", 8) | {"objective": {"visit": [12]}}
    truth = {**PUSH, "has_truth": True, "blocks": ["ground"]}
    for robots, answer in ({}, Answer.YES), ({"b": here}, Answer.NO):
        found = behind(robots, gap_10=truth)
        begin = replace(at_start(found), sealed=frozenset({"gap@10"}))
        assert joint.can_complete(found, begin) is answer


def test_formulas_of_other_shapes_are_not_judged() -> None:
    with pytest.raises(NotJudgedError, match="the goal"):
        corridor(4, {"a": flyer(7, ltl={"liveness": ["region = 7 & region = 8"]})})


def moves(*steps: tuple[str, int]) -> list[dict[str, Any]]:
    return [
        {"type": "move", "tick": k, "robot": robot, "to": to, "heading": None}
        for k, (robot, to) in enumerate(steps, 1)
    ]


def test_a_trace_ends_where_its_moves_lead() -> None:
    found = corridor(
        5,
        {"a": flyer(8, visit=[12, 8]), "b": flyer(12, hold=12) | {"avoids": []}},
        obstacles=[{"type": "uncertainty", "region": 10}, {"type": "door", "region": 11}],
    )
    trace = [
        *moves(("a", 8), ("b", 12), ("a", 9)),
        {"type": "resolved", "obstacle": "uncertainty@10", "robot": "a", "traversable": False},
        {"type": "violation", "robot": "b", "obstacle": "door@11"},
        *moves(("b", 12)),
    ]
    for one, toward in ((trace[0], 9), (trace[-1], 11)):
        one["toward"] = toward
    ending = Replay(found, trace)
    assert ending.problems == ["tick 1: b is in door@11"]
    assert ending.situation.poses == {"a": (9, -1), "b": (11, -1)}
    assert ending.situation.stages == {"door@11": FIRST}
    assert ending.situation.sealed == {"uncertainty@10"}
    assert ending.visits == {"a": [9], "b": [12, 12]}


@pytest.mark.parametrize(
    ("steps", "toward", "away"), [([9], None, []), ([9, 8], None, ["a"]), ([9], 8, ["a"])]
)
def test_a_robot_that_stays_is_at_its_last_target_or_away(
    steps: list[int], toward: int | None, away: list[str]
) -> None:
    found = corridor(5, {"a": flyer(8, hold=9)})
    trace = moves(*(("a", step) for step in steps))
    trace[-1]["toward"] = toward
    assert Replay(found, trace).away == away


def test_an_obstacle_that_is_resolved_too_early_is_noticed() -> None:
    found = corridor(5, {"a": flyer(8, hold=8)}, obstacles=[{"type": "uncertainty", "region": 11}])
    trace = [*moves(("a", 9)), {"type": "resolved", "obstacle": "uncertainty@11", "robot": "a"}]
    assert "before that is done" in Replay(found, trace).problems[0]


def test_a_goal_reached_elsewhere_while_waiting_does_not_count() -> None:
    found = corridor(5, {"a": flyer(8, visit=[12])})
    goal = {"type": "goal", "robot": "a", "goal": 0, "round": 1}
    met = [Replay(found, [*moves(("a", 8)), goal | {"region": r}]) for r in (8, 12)]
    assert [one.situation.progress["a"] for one in met] == [(0, 0), (0, 1)]


@pytest.mark.parametrize(
    ("objective", "visits", "rounds"),
    [
        ({"visit": [7, 9]}, [8, 7, 8, 9, 8, 7], 1),
        ({"visit": [7, 9]}, [7, 8, 9, 8, 7, 8, 9], 2),
        ({"cover": [7, 9]}, [9, 8, 7, 8, 9], 1),
        ({"patrol": [7, 9]}, [8, 9], 1),
        ({"hold": 9}, [8, 9, 9], 2),
    ],
)
def test_rounds_follow_from_the_regions(
    objective: dict[str, Any], visits: list[int], rounds: int
) -> None:
    found = corridor(4, {"a": flyer(8, **objective)})
    assert rounds_done(found.robots[0], visits) == rounds


PRESS, TWO = {"action": "press"}, {"action": "lift", "robots": 2}


def lab(kind: dict[str, Any], **models: str) -> dict[str, Any]:
    """A corridor 10, 11, ... 16 with an obstacle at 13; robots by name, each from 12."""
    return {
        "map": {"grid": ["#########", "#.......#", "#########"], "names": {"far": 16}},
        "catalogue": {"robots": MODELS, "obstacles": {"it": kind}},
        "robots": {
            name: {"model": model, "start": 12, "avoids": [], "objective": {"visit": [12, 15]}}
            for name, model in models.items()
        },
        "obstacles": [{"type": "it", "region": [1, 4]}],
        "until": {"rounds": 1},
    }


def entries_of(data: dict[str, Any], lines: list[dict[str, Any]]) -> list[str]:
    return [told for told in Replay(read_mission(data), lines).problems if " is in " in told]


@pytest.mark.parametrize(
    ("kind", "models", "steps", "entries"),
    [
        (PRESS, {"p": "presser"}, [("p", 13)], []),
        (PRESS, {"c": "cart"}, [("c", 13)], [1]),
        (PRESS | {"blocks": ["air"]}, {"c": "cart"}, [("c", 13)], []),
        (PRESS | {"blocks": []}, {"c": "cart"}, [("c", 13)], []),
        (PRESS | {"blocks": ["c"]}, {"c": "cart", "d": "cart"}, [("d", 13), ("c", 13)], [2]),
        (PRESS | {"resolve_at": ["far"]}, {"p": "presser"}, [("p", 13)], [1]),
        (PRESS | {"resolve_at": [11]}, {"p": "presser"}, [("p", 11), ("p", 12), ("p", 13)], []),
        ({"needs": [TWO]}, {"l": "lifter", "m": "lifter"}, [("l", 13)], [1]),
        (
            {"needs": [TWO | {"at": "neighbours", "together": True}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 12), ("c", 13)],
            [],
        ),
        (
            {"needs": [TWO | {"at": [11], "together": True}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 11), ("l", 12), ("m", 11), ("c", 13)],
            [4],
        ),
        (
            {"needs": [TWO | {"at": [11]}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 11), ("l", 12), ("m", 11), ("c", 13)],
            [],
        ),
        ({"needs": [PRESS, PRESS]}, {"p": "presser"}, [("p", 13)], [1]),
        ({"needs": [PRESS | {"at": [11]}, PRESS]}, {"p": "presser"}, [("p", 11), ("p", 13)], []),
    ],
)
def test_entries_of_standing_obstacles_are_noticed(
    kind: dict[str, Any], models: dict[str, str], steps: Any, entries: list[int]
) -> None:
    told = entries_of(lab(kind, **models), moves(*steps))
    assert [int(entry.split()[1].rstrip(":")) for entry in told] == entries


def test_entering_an_untraversable_or_permanent_obstacle_is_noticed() -> None:
    data = lab(PRESS | {"resolve_at": [11]}, p="presser")
    found = {"type": "resolved", "tick": 1, "obstacle": "it@13", "traversable": False}
    lines = [*moves(("p", 11)), found, {"type": "blocked", "tick": 1, "obstacle": "it@13"}]
    assert entries_of(data, lines) == []
    assert entries_of(data, [*lines, *moves(("p", 13))]) == ["tick 1: p is in it@13"]


# The judge of the logs of worlds: logs by hand.


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

"""The judge itself: cases by hand, and two searches that must agree where both apply."""

from typing import Any

import pytest

from campaigns.generate.families import FAMILIES, maps_folder, mission
from campaigns.judge import independent, joint
from campaigns.judge.mission import Mission, NotJudgedError, read_mission
from campaigns.judge.poses import Poses
from campaigns.judge.replay import replay, rounds_done
from campaigns.judge.situation import FIRST, Answer, Situation, at_start

SMALL = ("apart", "apart_needs", "traps", "tight", "tight_hidden", "tight_needs")


def told(mission: Mission) -> Situation:
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


def test_two_flyers_cannot_pass_each_other_in_a_corridor() -> None:
    found = corridor(4, {"a": flyer(7, visit=[10]), "b": flyer(10, visit=[7])})
    assert joint.can_complete(found, at_start(found)) is Answer.NO
    found = corridor(4, {"a": flyer(7, visit=[8, 10]), "b": flyer(10, hold=10)})
    assert joint.can_complete(found, at_start(found)) is Answer.NO


def test_two_flyers_that_need_not_pass_complete() -> None:
    found = corridor(4, {"a": flyer(7, visit=[8, 7]), "b": flyer(10, visit=[9, 10])})
    assert joint.can_complete(found, at_start(found)) is Answer.YES


def test_a_robot_that_cannot_turn_round_does_not_live_in_a_dead_end() -> None:
    found = corridor(4, {"a": walker(7, "east", visit=[10, 8])})
    graph = Poses(found, found.robots[0])
    assert graph.live(frozenset()) == 0
    assert independent.can_complete(found, at_start(found)) is Answer.NO


def test_one_who_holds_need_not_come_back() -> None:
    found = corridor(4, {"a": walker(7, "east", hold=10)})
    assert independent.can_complete(found, at_start(found)) is Answer.YES


@pytest.mark.parametrize(("capabilities", "answer"), [(["push"], "yes"), (["clear"], "no")])
def test_a_door_is_opened_by_whoever_can(capabilities: list[str], answer: str) -> None:
    opener = {"model": "opener", "start": 11, "objective": {"hold": 11}}
    found = corridor(
        5,
        {"a": flyer(8, visit=[12]), "b": opener},
        obstacles=[{"type": "door", "region": 10}],
        catalogue={
            "robots": {
                "opener": {"mobility": "free", "layer": "ground", "capabilities": capabilities}
            }
        },
    )
    assert independent.can_complete(found, told(found)).value == answer
    assert independent.can_complete(found, at_start(found)) is Answer.YES


@pytest.mark.parametrize(("robots", "answer"), [(1, "yes"), (2, "yes"), (3, "no")])
def test_a_beam_needs_as_many_robots_as_it_says(robots: int, answer: str) -> None:
    lifter = {"mobility": "free", "layer": "ground", "capabilities": ["lift"]}
    need = {"action": "lift", "robots": robots, "at": "neighbours", "together": True}
    found = corridor(
        5,
        {
            "a": flyer(8, visit=[12]),
            "b": {"model": "lifter", "start": 9, "avoids": [], "objective": {"hold": 9}},
            "c": {"model": "lifter", "start": 12, "avoids": [], "objective": {"hold": 12}},
        },
        obstacles=[{"type": "beam", "region": 10}],
        catalogue={"robots": {"lifter": lifter}, "obstacles": {"beam": {"needs": [need]}}},
    )
    assert independent.can_complete(found, told(found)).value == answer
    assert joint.can_complete(found, told(found)).value == answer


def test_robots_that_lift_together_need_a_region_each() -> None:
    lifter = {"mobility": "free", "layer": "ground", "capabilities": ["lift"]}
    need = {"action": "lift", "robots": 2, "at": [9], "together": True}
    robots = {
        "a": flyer(8, visit=[12]),
        "b": {"model": "lifter", "start": 9, "objective": {"hold": 9}},
        "c": {"model": "lifter", "start": 8, "objective": {"hold": 8}},
    }
    more = {
        "obstacles": [{"type": "beam", "region": 10}],
        "catalogue": {"robots": {"lifter": lifter}, "obstacles": {"beam": {"needs": [need]}}},
    }
    found = corridor(5, robots, **more)
    assert joint.can_complete(found, told(found)) is Answer.NO
    del need["together"]  # one after the other
    found = corridor(5, robots, **more | {"obstacles": [{"type": "beam", "region": 12}]})
    assert joint.can_complete(found, told(found)) is Answer.YES
    need["together"] = True
    for name in ("b", "c"):
        robots[name]["avoids"] = []
    found = corridor(5, robots, **more)
    assert joint.can_complete(found, told(found)) is Answer.YES


def test_rounds_restart_with_a_resolution() -> None:
    opener = {"model": "digit", "start": 9, "heading": "east", "objective": {"hold": 9}}
    robots = {"a": flyer(8, visit=[8, 9]), "b": opener}
    found = corridor(5, robots, obstacles=[{"type": "door", "region": 10}])
    game = joint.Joint(found, told(found))
    (begun,) = game.starts()
    assert begun[1] == ((1, 1), (0, 1))
    (opened,) = (state for state in game.successors(begun) if not state[2])
    assert opened[1] == ((1, 0), (0, 0))


def test_a_spent_budget_is_no_answer() -> None:
    found = read_mission(mission("crowd", 3))
    assert joint.can_complete(found, at_start(found), budget=10) is Answer.OVER_BUDGET


@pytest.mark.parametrize("family", ["apart", "apart_needs", "traps"])
def test_both_searches_agree_where_nobody_collides(family: str) -> None:
    """One reasons with sets of poses, the other tries every single move."""
    answers = []
    for seed in range(80):
        found = read_mission(mission(family, seed))
        if len(found.robots) > 3 or len(found.free) > 24:
            continue
        tried = joint.can_complete(found, told(found), budget=40_000)
        if tried is not Answer.OVER_BUDGET:
            assert independent.can_complete(found, told(found)) is tried, seed
            answers.append(tried)
    assert answers.count(Answer.YES) > 15
    assert answers.count(Answer.NO) > 3


@pytest.mark.parametrize("family", [name for name in FAMILIES if name != "big"])
def test_a_seed_gives_the_same_mission_for_ever(family: str) -> None:
    missions = [mission(family, seed) for seed in range(2, 14)]
    assert missions == [mission(family, seed) for seed in range(2, 14)]
    assert len({str(one) for one in missions}) == len(missions)


@pytest.mark.parametrize("family", SMALL)
def test_missions_that_can_and_that_cannot_be_completed_both_occur(family: str) -> None:
    answers = set()
    for seed in range(60):
        found = read_mission(mission(family, seed))
        search = joint if found.crowded else independent
        answers.add(search.can_complete(found, told(found), 20_000))
    assert {Answer.YES, Answer.NO} <= answers


@pytest.mark.skipif(maps_folder() is None, reason="the MovingAI maps are not on this machine")
def test_the_big_map_has_twenty_two_robots_and_five_doors() -> None:
    found = mission("big", 0)
    assert (len(found["robots"]), len(found["obstacles"])) == (22, 5)
    assert sum("heading" in robot for robot in found["robots"].values()) == 10


def test_formulas_of_other_shapes_are_not_judged() -> None:
    with pytest.raises(NotJudgedError, match="the goal"):
        corridor(4, {"a": flyer(7, ltl={"liveness": ["region = 7 & region = 8"]})})


def line(robot: str, to: int, **more: Any) -> dict[str, Any]:
    return {"type": "move", "tick": 0, "robot": robot, "to": to, "heading": None, **more}


def test_a_trace_ends_where_its_moves_lead() -> None:
    found = corridor(
        5,
        {"a": flyer(8, visit=[12, 8]), "b": flyer(12, hold=12) | {"avoids": []}},
        obstacles=[{"type": "uncertainty", "region": 10}, {"type": "door", "region": 11}],
    )
    trace = [
        line("a", 8, toward=9),
        line("b", 12),
        line("a", 9),
        {"type": "resolved", "obstacle": "uncertainty@10", "robot": "a", "traversable": False},
        {"type": "violation", "robot": "b", "obstacle": "door@11"},
        line("b", 12, toward=11),
    ]
    ending = replay(found, trace)
    assert ending.problems == ["tick 0: b is in door@11"]
    assert ending.situation.poses == {"a": (9, -1), "b": (11, -1)}
    assert ending.situation.stages == {"door@11": FIRST}
    assert ending.situation.sealed == {"uncertainty@10"}
    assert ending.visits == {"a": [9], "b": [12, 12]}


def test_an_obstacle_that_is_resolved_too_early_is_noticed() -> None:
    found = corridor(5, {"a": flyer(8, hold=8)}, obstacles=[{"type": "uncertainty", "region": 11}])
    trace = [line("a", 9), {"type": "resolved", "obstacle": "uncertainty@11", "robot": "a"}]
    assert "before that is done" in replay(found, trace).problems[0]


def test_a_goal_that_is_met_while_waiting_is_no_part_of_a_round() -> None:
    found = corridor(5, {"a": flyer(8, visit=[8, 9])})
    goals = [{"type": "goal", "robot": "a", "goal": 0, "region": 8, "round": k} for k in (0, 1)]
    assert replay(found, [line("a", 8), *goals]).situation.progress == {"a": (1, 0)}


def test_a_goal_of_waiting_elsewhere_is_none_of_its_own() -> None:
    found = corridor(5, {"a": flyer(8, visit=[12])})
    goal = {"type": "goal", "robot": "a", "goal": 0, "round": 1}
    met = [replay(found, [line("a", 8), goal | {"region": r}]) for r in (8, 12)]
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


ROBOTS = {
    "presser": {"mobility": "free", "layer": "ground", "capabilities": ["press"]},
    "lifter": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
    "cart": {"mobility": "free", "layer": "ground"},
}
PRESS, LIFT = {"action": "press"}, {"action": "lift", "robots": 2}


def lab(kind: dict[str, Any], **models: str) -> dict[str, Any]:
    """A corridor 10, 11, ... 16 with an obstacle at 13; robots by name, each from 12."""
    return {
        "map": {"grid": ["#########", "#.......#", "#########"], "names": {"far": 16}},
        "catalogue": {"robots": ROBOTS, "obstacles": {"it": kind}},
        "robots": {
            name: {"model": model, "start": 12, "avoids": [], "objective": {"visit": [12, 15]}}
            for name, model in models.items()
        },
        "obstacles": [{"type": "it", "region": [1, 4]}],
        "until": {"rounds": 1},
    }


def moves(*steps: tuple[str, int]) -> list[dict[str, Any]]:
    return [
        {"type": "move", "tick": k, "robot": robot, "to": to, "heading": None}
        for k, (robot, to) in enumerate(steps, 1)
    ]


def entries_of(data: dict[str, Any], lines: list[dict[str, Any]]) -> list[str]:
    return [told for told in replay(read_mission(data), lines).problems if " is in " in told]


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
        ({"needs": [LIFT]}, {"l": "lifter", "m": "lifter"}, [("l", 13)], [1]),
        (
            {"needs": [LIFT | {"at": "neighbours", "together": True}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 12), ("c", 13)],
            [],
        ),
        (
            {"needs": [LIFT | {"at": [11], "together": True}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 11), ("l", 12), ("m", 11), ("c", 13)],
            [4],
        ),
        (
            {"needs": [LIFT | {"at": [11]}]},
            {"l": "lifter", "m": "lifter", "c": "cart"},
            [("l", 11), ("l", 12), ("m", 11), ("c", 13)],
            [],
        ),
        ({"needs": [PRESS, PRESS]}, {"p": "presser"}, [("p", 13)], [1]),
        ({"needs": [PRESS | {"at": [11]}, PRESS]}, {"p": "presser"}, [("p", 11), ("p", 13)], []),
    ],
)
def test_who_may_enter(
    kind: dict[str, Any], models: dict[str, str], steps: Any, entries: list[int]
) -> None:
    told = entries_of(lab(kind, **models), moves(*steps))
    assert [int(entry.split()[1].rstrip(":")) for entry in told] == entries


def test_a_robot_in_transit_is_there() -> None:
    line = {"type": "move", "tick": 1, "robot": "c", "to": 12, "toward": 13, "heading": None}
    assert entries_of(lab(PRESS, c="cart"), [line]) == ["tick 1: c is in it@13"]


def test_none_enters_what_was_found_untraversable_or_given_up() -> None:
    data = lab(PRESS | {"resolve_at": [11]}, p="presser")
    found = {"type": "resolved", "tick": 1, "obstacle": "it@13", "traversable": False}
    lines = [*moves(("p", 11)), found, {"type": "blocked", "tick": 1, "obstacle": "it@13"}]
    assert entries_of(data, lines) == []
    assert entries_of(data, [*lines, *moves(("p", 13))]) == ["tick 1: p is in it@13"]

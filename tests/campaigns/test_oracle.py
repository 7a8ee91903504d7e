"""The oracle: cases by hand, and its search against both searches of the other judge."""

from __future__ import annotations

from typing import Any

import pytest

from campaigns.generate.families import mission
from campaigns.judge import independent, joint
from campaigns.judge.mission import read_mission
from campaigns.judge.situation import FIRST, Answer, Situation, at_start
from campaigns.oracle import Search, Walk

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
    walk = Walk(lab(kind, **models), moves(*steps))
    told = [entry for entry in walk.entries if " is in " in entry]
    assert [int(entry.split()[1].rstrip(":")) for entry in told] == entries


def test_a_robot_in_transit_is_there() -> None:
    line = {"type": "move", "tick": 1, "robot": "c", "to": 12, "toward": 13, "heading": None}
    assert Walk(lab(PRESS, c="cart"), [line]).entries == ["tick 1: c is in it@13"]


def test_none_enters_what_was_found_untraversable_or_given_up() -> None:
    data = lab(PRESS | {"resolve_at": [11]}, p="presser")
    found = {"type": "resolved", "tick": 1, "obstacle": "it@13", "traversable": False}
    lines = [*moves(("p", 11)), found, {"type": "blocked", "tick": 1, "obstacle": "it@13"}]
    assert Walk(data, lines).entries == []
    assert Walk(data, [*lines, *moves(("p", 13))]).entries == ["tick 1: p is in it@13"]


def test_a_line_alone_resolves_nothing() -> None:
    data = lab(PRESS | {"resolve_at": ["far"]}, p="presser")
    line = {"type": "resolved", "tick": 1, "obstacle": "it@13"}
    assert Walk(data, [line]).entries == ["tick 1: only a line resolves it@13"]


@pytest.mark.parametrize("family", ["labs", "traps", "tight", "tight_hidden", "tight_needs"])
def test_all_searches_agree(family: str) -> None:
    """On small maps, with all obstacles known from the start."""
    said = {Answer.YES: True, Answer.NO: False, Answer.OVER_BUDGET: None}
    answers = []
    for seed in range(40):
        data = mission(family, seed)
        found = read_mission(data)
        if len(found.free) > 14:
            continue
        begin = at_start(found)
        known = Situation(begin.poses, begin.progress, dict.fromkeys(found.obstacles, FIRST))
        search = joint if found.crowded else independent
        theirs = said[search.can_complete(found, known, 60_000)]
        walk = Walk(data, [])
        walk.standing = dict.fromkeys(walk.lab.obstacles, FIRST)
        walk.met = set(walk.standing)
        ours = Search(data, walk).can_complete(60_000)
        if None not in (ours, theirs):
            assert ours is theirs, seed
            answers.append(ours)
    assert answers.count(True) > 5
    assert answers.count(False) > 1

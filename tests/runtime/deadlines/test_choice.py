"""Who acts where next, where requests are due: chosen by the search in time, told by lines
``acts``, and judged by the audit."""

from collections.abc import Callable
from typing import Any

import pytest

from runtime.played import Line, Run, play
from safenav.runtime.deadlines import schedule

PARCELS = """
map:
  grid: ["##############", "#............#", "##############"]
catalogue:
  robots:
    quick: {mobility: free, layer: air, capabilities: [fetch]}
    slow: {mobility: free, layer: ground, capabilities: [fetch], timing: 3}
  obstacles:
    parcel: {action: fetch, blocks: []}
robots:
  a: {model: quick, start: [1, 6], objective: {hold: [1, 6]}}
  b: {model: slow, start: [1, 1], objective: {hold: [1, 1]}}
orders:
  - {at: 1, type: parcel, region: [1, 3], resolve_within: 7}
  - {at: 1, type: parcel, region: [1, 9], resolve_within: 7}
until: {rounds: 1}
"""


def test_a_slower_robot_helps_where_the_nearest_would_be_late() -> None:
    played = play(PARCELS)
    assert played.outcome["late"] == []
    done = {line["obstacle"]: (line["tick"], line["robot"]) for line in played.all("resolved")}
    assert done == {"parcel@23": (3, "a"), "parcel@17": (6, "b")}
    planned = {line["of"]: line["planned"] for line in played.all("deadline", verdict="set")}
    assert planned == {"parcel@23": 3, "parcel@17": 6}


FREE = PARCELS.replace(", resolve_within: 7", "")


@pytest.mark.parametrize(
    ("text", "beyond", "last"),
    [
        (FREE, None, 24),  # the nearest helps
        (FREE.replace("1}\n", "1, by: 20}\n"), [], 6),
        (PARCELS.replace("within: 7", "within: 3"), ["parcel@17"], 6),
    ],
    ids=["nothing is due", "the mission is due", "what cannot be in time"],
)
def test_resolutions_come_as_early_as_what_is_due(
    text: str, beyond: list[str] | None, last: int
) -> None:
    played = play(text)
    assert [line["beyond"] for line in played.all("acts")[-1:]] == (
        [] if beyond is None else [beyond]
    )
    assert played.outcome.get("late", []) == (beyond or [])
    assert max(line["tick"] for line in played.all("resolved")) == last


def test_a_spent_search_leaves_the_choice_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schedule, "BUDGET", 0)
    played = play(PARCELS)
    assert all(line["spent"] for line in played.all("acts"))
    assert played.outcome["late"] == ["parcel@23"]


def test_a_search_that_is_spent_keeps_what_is_most_urgent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(schedule, "BUDGET", 1)  # enough for one parcel, not for two
    played = play(PARCELS)
    both = played.all("acts")[1]
    assert (both["spent"], both["beyond"]) == (True, ["parcel@17"])
    assert [act["obstacle"] for act in both["acts"]] == ["parcel@23"]
    assert played.outcome["late"] == []


LOADS = """
map:
  grid: ["##############", "#............#", "##############"]
catalogue:
  robots:
    flyer: {mobility: free, layer: air, capabilities: [fetch, haul]}
    walker: {mobility: free, layer: ground, capabilities: [fetch]}
    hopper: {mobility: free, layer: hover, capabilities: [fetch]}
  obstacles:
    near: NEAR
    far: FAR
robots:
  a: {model: flyer, start: [1, 3], objective: {hold: [1, 3]}}
  b: {model: walker, start: [1, BC], objective: {hold: [1, BC]}}
  c: {model: hopper, start: [1, BC], objective: {hold: [1, BC]}}
orders:
  - {at: 1, type: near, region: [1, 4], resolve_within: 7}
  - {at: 1, type: far, region: [1, 10], resolve_within: DUE}
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("takes", "far", "start", "due"),
    [
        ("action: fetch", "{action: haul, blocks: []}", 1, 7),
        ("action: fetch, robots: 2", "{action: haul, blocks: []}", 1, 7),
        (
            "action: fetch, robots: 2, together: true",
            "{needs: [{action: haul}, {action: haul, at: [[1, 12]], same: true}], blocks: []}",
            3,
            9,
        ),
    ],
    ids=["one takes it", "one after the other take it", "a third could join those that take it"],
)
def test_a_load_is_left_to_the_robots_that_the_acts_name(
    takes: str, far: str, start: int, due: int
) -> None:
    near = "{needs: [{TAKES, at: [[1, 4]]}, {TAKES, at: [[1, 2]], same: true}], blocks: []}"
    text = LOADS.replace("NEAR", near).replace("TAKES", takes).replace("FAR", far)
    played = play(text.replace("BC", str(start)).replace("DUE", str(due)))
    assert played.outcome["late"] == []
    taken = played.one("met", obstacle="near@18", need=0)
    assert "a" not in {taken["robot"], *taken.get("robots", ())}
    passed = [line for line in played.all("move", robot="a") if line["to"] == 18]
    assert passed[0]["tick"] <= taken["tick"]


def test_a_robot_does_not_stay_to_act_where_it_is_due_elsewhere() -> None:
    text = PARCELS.replace(
        "{at: 1, type: parcel, region: [1, 3]", "{at: 1, type: parcel, region: [1, 1]"
    )
    text = text.replace(
        "start: [1, 1], objective: {hold: [1, 1]}", "start: [1, 2], objective: {hold: [1, 2]}"
    )
    text = text.replace("orders:\n", "orders:\n  - {at: 1, type: parcel, region: [1, 6]}\n")
    text = text.replace("resolve_within: 7}\nuntil", "resolve_within: 2}\nuntil")
    played = play(text)
    assert played.outcome["late"] == []
    assert played.one("resolved", obstacle="parcel@23")["tick"] == 3


def last(**fields: Any) -> Callable[[Line], object]:
    """Other fields of the last act."""
    return lambda line: line["acts"][-1].update(fields)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (last(at=9), "parcel@17 is planned for 9, not 6"),
        (last(at=5), "b cannot act on parcel@17 from 17 in tick 5"),
        (last(robots={"b": [18, None]}), "b cannot act on parcel@17 from 18"),
        (last(robots={"a": [17, None]}), "a cannot act on parcel@17 from 17 in tick 6"),
        (lambda line: line["acts"].reverse(), "is not reached in tick 3 and in this order"),
        (lambda line: line.update(acts=line["acts"][:1]), "parcel@17 is planned for"),
        (lambda line: line["acts"][0].update(need=1), "need 1 of parcel@23 is not the next one"),
        (lambda line: line["acts"][0].update(obstacle="crate@9"), "is not in the scenario"),
    ],
)
def test_the_audit_judges_the_acts(damage: Callable[[Line], object], said: str) -> None:
    run = play(PARCELS)
    damage(run.all("acts")[1])
    assert said in run.findings


def test_no_act_is_later_than_what_is_due() -> None:
    run = play(PARCELS)
    run.all("acts")[-1]["acts"][-1]["at"] += 3
    assert "is due at 8, before the act in tick 9" in run.findings


SUSPECT = """
map:
  grid: ["###########", "#.........#", "#.#######.#", "#.........#", "###########"]
catalogue:
  robots:
    walker: {mobility: free, layer: ground, capabilities: [fetch]}
    pusher: {mobility: free, layer: air, capabilities: [push]}
  obstacles:
    parcel: {action: fetch, blocks: []}
    gate: {action: push, blocks: [ground]}
robots:
  a: {model: walker, start: [1, 3], objective: {hold: [1, 3]}}
  p: {model: pusher, start: [3, 1], objective: {hold: [3, 1]}}
obstacles: [{type: gate, region: [1, 7]}]
suspects: [{type: gate, region: [1, 7]}]
orders:
  - {at: 1, type: parcel, region: [3, 9], resolve_within: 12}
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("was", "now", "around"),
    [
        ("", "", {"a": [18]}),
        ("suspects: [{type: gate, region: [1, 7]}]\n", "", None),
        ("within: 12", "within: 9", None),
    ],
    ids=["in time", "no suspect", "nothing else is in time than to hope"],
)
def test_a_suspect_is_avoided_where_that_is_in_time(
    was: str, now: str, around: dict[str, list[int]] | None
) -> None:
    """Else the way leads to what turns up."""
    played = play(SUSPECT.replace(was, now))
    assert played.all("acts")[0].get("around") == around
    assert played.outcome["late"] == ([] if around else ["parcel@42"])
    assert not around or played.one("resolved", obstacle="parcel@42")["tick"] == 12


def around(**regions: list[int]) -> Callable[[Run], object]:
    """Other regions that robots keep out of."""
    return lambda run: run.all("acts")[0].update(around=regions)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (around(a=[18, 23]), "cannot act on parcel@42"),
        (around(a=[38]), "which it must avoid"),
        (around(z=[18]), "'z' is not in the scenario"),
        (lambda run: run.records[0]["scenario"].pop("suspects"), "the scenario has no suspects"),
    ],
)
def test_the_audit_judges_careful_plans(damage: Callable[[Run], object], said: str) -> None:
    run = play(SUSPECT)
    damage(run)
    assert said in run.findings


NEEDS = """
map:
  grid: ["############", "#..........#", "############"]
catalogue:
  robots:
    lifter: {mobility: free, layer: ground, capabilities: [lift]}
    crawler: {mobility: free, layer: LAYER, capabilities: [sense]}
  obstacles:
    crate: {needs: [{action: lift, at: [[1, 4]]}, {action: sense, at: [[1, 6]]}], blocks: []}
robots:
  a: {model: lifter, start: [1, 1], objective: {visit: [[1, 1], [1, 2]]}}
  b: {model: crawler, start: [1, 10], objective: {visit: [[1, 10], [1, 9]]}}
orders:
  - {at: 1, type: crate, region: [1, 5], resolve_within: 7}
until: {rounds: 1}
"""


@pytest.mark.parametrize("layer", ["air", "ground"])
def test_the_robot_of_a_later_need_sets_out_with_the_request(layer: str) -> None:
    played = play(NEEDS.replace("LAYER", layer))
    assert [line["planned"] for line in played.all("deadline", verdict="set")] == [4]
    assert played.one("resolved")["tick"] == 4
    assert [line["helper"] for line in played.all("request")] == ["a", "b"]


@pytest.mark.parametrize(
    "text",
    [NEEDS.replace("[1, 4]", "[1, 7]"), NEEDS.replace(", resolve_within: 7", "")],
    ids=["it would stand in the way", "nothing is due"],
)
def test_it_waits_for_its_need_elsewhere(text: str) -> None:
    played = play(text.replace("LAYER", "ground"))
    at = played.all("met", need=0)[0]["tick"]
    assert not [line for line in played.all("synthesis", robot="b") if 0 < line["tick"] < at]


def test_the_audit_judges_the_robots_that_depart() -> None:
    run = play(NEEDS.replace("LAYER", "air"))
    (push,), (synthesis,) = run.all("push"), run.all("synthesis", robot="b", tick=1)
    push["objectives"]["b"] = synthesis["objective"] = {"visit": [22, 21]}
    assert "b must serve crate@17 from 18, but gets" in run.findings

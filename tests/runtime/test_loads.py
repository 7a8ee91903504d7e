"""Loads: how many a robot carries at one time; and orders, drawn at random. Judged by a walk over
the trace of this file's own."""

import os
from collections import Counter
from collections.abc import Sequence
from random import Random
from typing import Any

import pytest
import yaml
from msgspec.structs import replace

from campaigns.judge.mission import read_mission
from campaigns.judge.poses import Poses
from certify.making import certified
from runtime.played import Run, completed, play
from runtime.worlds import Clocked
from safenav.errors import InputError
from safenav.runtime.worlds.protocol import Acted, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.trace.vocabulary import ActResult

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 12
ROWS, COLS = 3, 5
BUNDLED = 5

HALL = """\
safenav: 1
map:
  grid: ["##########", "#........#", "#........#", "##########"]
  names: {shelf: [1, 6], dock: [1, 1], rack: [2, 8]}
catalogue:
  robots:
    truck: {mobility: free, layer: ground, capabilities: [lift, drop], carries: 1}
  obstacles:
    pallet:
      needs: [{action: lift, at: [shelf]}, {action: drop, at: [dock], same: true}]
      blocks: []
robots:
  a: {model: truck, start: [2, 3], objective: {visit: [[2, 2], [2, 5]]}}
orders: [{at: 1, type: pallet, region: shelf}, {at: 1, type: pallet, region: shelf}]
until: {rounds: 1}
"""


def played(text: str, clock: Clock = Clock.LOCKSTEP) -> Run:
    """A run in which no robot carries more than it can."""
    scenario = load_scenario_text(text + f"clock: {clock.value}\n", "scenario.yaml")
    run = play(scenario)
    most = {robot.name: robot.model.carries for robot in scenario.robots}
    assert all(carried[name] <= most[name] for carried in hands(run) for name in most), text
    return run


def hands(run: Run) -> list[Counter[str]]:
    """The loads in each robot's hands after each line that changes them: whoever met a need before
    one of the ``same`` robots, until the last of those is met."""
    needs = {}
    for line in run.records[:1]:
        for one in line["scenario"]["obstacles"]:
            needs[one["name"]] = one.get("needs") or []
    held: dict[str, set[str]] = {}
    found = []
    for line in run.records:
        if line["type"] == "met":
            later = needs[line["obstacle"]][line["need"] + 1 :]
            group = {*(line.get("robots") or [line["robot"]])}
            held[line["obstacle"]] = group if later and later[0].get("same") else set()
        elif line["type"] in ("resolved", "gone"):
            held.pop(line["obstacle"], None)
        found.append(Counter(robot for group in held.values() for robot in group))
    return found


def test_a_robot_carries_one_load_after_the_other(clock: Clock) -> None:
    run = played(HALL, clock)
    met = [(line["obstacle"][-2:], line["need"]) for line in run.all("met")]
    assert run.outcome["outcome"] == "completed"
    assert met == [("#2", 0), ("#2", 1), ("16", 0), ("16", 1)]  # the newest request first


def test_a_request_says_that_the_only_robot_for_it_carries_another_load() -> None:
    later = HALL.replace("shelf}, {at: 1", "shelf}, {at: 3").replace("start: [2, 3]", "start: 16")
    requests = played(later).all("request", obstacle="pallet@16#2")
    assert requests[0]["helper"] is None and requests[0]["because"] == "a carries pallet@shelf"
    assert requests[-1]["helper"] == "a"


def test_a_robot_takes_the_load_that_is_due_first() -> None:
    """Of three at one place: what it is sent for, not the first of the list."""
    text = HALL.replace("orders: [", "orders: [{at: 1, type: pallet, region: shelf}, ").replace(
        "region: shelf}]", "region: shelf, resolve_within: 16}]"
    )
    run = played(text)
    assert next(line["obstacle"] for line in run.all("met", need=0)) == "pallet@16#3"
    assert run.one("deadline", verdict="kept")["of"] == "pallet@16#3"


def test_a_robot_that_is_sent_for_a_load_leaves_others() -> None:
    """It passes the rack on its way to the shelf, where something is due."""
    text = HALL.replace("start: [2, 3]", "start: [1, 8]").replace("rack: [2, 8]", "rack: [1, 7]")
    text = text.replace("orders: [{at: 1, type: pallet, region: shelf}", ORDERS).replace(
        "  obstacles:\n",
        "  obstacles:\n    box: {needs: [{action: lift, at: [rack]}, "
        "{action: drop, at: [dock], same: true}], blocks: []}\n",
    )
    run = played(text)
    assert run.all("met")[0]["obstacle"].startswith("pallet")
    assert run.one("deadline", verdict="kept")


ORDERS = (
    "orders: [{at: 1, type: box, region: rack}, "
    "{at: 1, type: pallet, region: shelf, resolve_within: 12}"
)


def test_a_robot_for_two_takes_both(clock: Clock) -> None:
    run = played(HALL.replace("carries: 1", "carries: 2"), clock)
    assert [line["need"] for line in run.all("met")] == [0, 0, 1, 1]


def test_one_load_is_the_default() -> None:
    run = played(HALL.replace(", carries: 1", ""))
    assert [line["need"] for line in run.all("met")] == [0, 1, 0, 1]
    assert run.records[0]["scenario"]["robots"]["a"]["carries"] == 1


SHUT = """\
safenav: 1
map: {grid: ["########", "#......#", "#.######", "########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: [lift]}
    van: {mobility: free, layer: ground, capabilities: []}
  obstacles:
    crate: {needs: [{action: lift, at: [12]}, {action: lift, at: [14], same: true}], blocks: []}
    parcel: {needs: [{action: lift, at: [10]}, {action: lift, at: [17], same: true}], blocks: []}
robots:
  cart: {model: cart, start: 11, objective: {visit: [11]}}
  van: {model: van, start: 14, objective: {visit: [13, 14]}}
orders: [{at: 1, type: crate, region: 12}, {at: 6, type: parcel, region: 10}]
changes: [{at: 1, robot: van, service: out}]
until: {rounds: 1}
limits: {ticks: 60, seconds: 60}
"""
ANOTHER = SHUT.replace(
    "  van: {model", "  other: {model: cart, start: 17, objective: {hold: 17}}\n  van: {model"
)


@pytest.mark.parametrize(("text", "helper"), [(SHUT, None), (ANOTHER, "other")])
def test_a_load_that_cannot_be_put_down_keeps_its_robot_from_others(
    text: str, helper: str | None, clock: Clock
) -> None:
    """The van stands out of service where the crate is due."""
    run = played(text, clock)
    assert run.outcome["cause"] == "out_of_service"
    assert {line["helper"] for line in run.all("request", obstacle="parcel@10")} == {helper}
    assert bool(run.all("resolved", obstacle="parcel@10")) is bool(helper)


def test_the_audit_refuses_a_helper_with_another_load() -> None:
    run = played(SHUT)
    asked = run.one("request", obstacle="parcel@10", aside=True)
    asked.update(helper="cart")
    del asked["aside"]
    assert "cart helps with parcel@10, but the rules choose no robot" in run.findings


def test_robots_with_loads_open_doors() -> None:
    """Only other loads have to wait."""
    text = HALL.replace("[lift, drop]", "[lift, drop, push]").replace(
        '"#........#", "#........#"', '"#...#....#", "#........#"'
    )
    text += "obstacles: [{type: door, region: [2, 4]}]\n"
    run = played(text.replace("start: [2, 3]", "start: [2, 6]").replace("[2, 2]", "[2, 7]"))
    first, then, *_ = run.order("met", "resolved")
    assert (first[0], first[1][:9], then) == ("met", "pallet@16", ("resolved", "door@24"))


@pytest.mark.parametrize("need", [0, 1])
def test_the_audit_refuses_a_second_load(need: int) -> None:
    """One order's lines are told of the other."""
    run = played(HALL)
    run.all("met", need=need)[0]["obstacle"] = "pallet@16"
    assert "need" in run.broken


def test_the_checkers_refuse_two_loads_in_two_hands() -> None:
    """The run of a robot that carries two, told of one that carries one."""
    run = played(HALL.replace("carries: 1", "carries: 2"))
    run.records[0]["scenario"]["robots"]["a"]["carries"] = 1
    assert "a carries pallet@16, and takes pallet@16#2 as well" in run.findings


def test_a_checker_of_bundles_follows_it() -> None:
    certified(HALL)


@pytest.mark.parametrize("carries", ["0", "-1", "two", "1000000"])
def test_what_cannot_be_carried_is_refused(carries: str) -> None:
    with pytest.raises(InputError, match="carries"):
        load_scenario_text(HALL.replace("carries: 1", f"carries: {carries}"))


def drawn(seed: int) -> dict[str, Any]:
    """Robots that never collide, each in a layer of its own, or some that share a floor; loads
    that some of them can deliver."""
    random = Random(f"loads {seed}")
    walls = {r for r in range(ROWS * COLS) if random.random() < 0.2}
    free = [r for r in range(ROWS * COLS) if r not in walls]
    apart = random.random() < 0.6
    models: dict[str, Any] = {}
    robots: dict[str, Any] = {}
    for k, start in enumerate(random.sample(free, random.randint(1, min(3, len(free))))):
        models[f"m{k}"] = {
            "mobility": "free",
            "layer": f"l{k}" if apart else "ground",
            "capabilities": random.choice([["lift", "drop"], ["lift", "drop"], ["lift"], []]),
            "carries": random.choice([1, 1, 2]),
        }
        objective: dict[str, Any] = {"visit": random.sample(free, min(2, len(free)))}
        shut = random.choice([[], [], [random.choice(free)]])
        if shut and start not in shut and not {*shut} & {*objective["visit"]}:
            objective["avoid"] = shut
        robots[f"r{k}"] = {"model": f"m{k}", "start": start, "objective": objective}
    types, orders = {}, []
    for k in range(random.randint(1, 2)):
        size = random.choice([1, 1, 1, 2])
        both = size > 1
        first = {"action": "lift", "robots": size, "at": random.sample(free, 2), "together": both}
        then = {"action": "drop", "at": random.sample(free, 2), "together": both, "same": True}
        needs = random.choice([[first, then], [first, then], [first]])
        types[f"t{k}"] = {"needs": needs, "blocks": []}
        for _ in range(random.randint(1, 2)):
            orders.append(
                {"at": random.randint(1, 12), "type": f"t{k}", "region": random.choice(free)}
            )
        if random.random() < 0.3:  # the same work once more
            orders.append(orders[-1] | {"at": random.randint(1, 25)})
    cells = ["#" if r in walls else "." for r in range(ROWS * COLS)]
    return {
        "safenav": 1,
        "map": {"grid": ["".join(cells[k : k + COLS]) for k in range(0, ROWS * COLS, COLS)]},
        "catalogue": {"robots": models, "obstacles": types},
        "robots": robots,
        "orders": sorted(orders, key=lambda order: order["at"]),
        "until": {"rounds": 1},
        "limits": {"ticks": 400},
        "seed": seed,
    }


def named(data: dict[str, Any]) -> dict[str, int]:
    """The orders by name, and when each is due to come."""
    found: dict[str, int] = {}
    for order in data["orders"]:
        name = first = f"{order['type']}@{order['region']}"
        while name in found:
            name = f"{first}#{int(name.partition('#')[2] or 1) + 1}"
        found[name] = order["at"]
    return found


def possible(data: dict[str, Any], kind: str) -> bool:
    """Whether enough robots get from where they are to where each need is met."""
    needs = data["catalogue"]["obstacles"][kind]["needs"]
    aims = {name: dict(robot["objective"]) for name, robot in data["robots"].items()}
    closed = {name: frozenset(aim.pop("avoid", ())) for name, aim in aims.items()}
    robots = {name: robot | {"objective": aims[name]} for name, robot in data["robots"].items()}
    mission = read_mission(data | {"robots": robots})
    count = 0
    for robot in mission.robots:
        graph, shut = Poses(mission, robot), closed[robot.name]
        reached = graph.closure(graph.at([robot.start[0]]), shut)
        able = {need["action"] for need in needs} <= robot.capabilities
        count += able and all(reached & graph.at(need["at"]) for need in needs)
    return count >= needs[0]["robots"]


@pytest.mark.parametrize("seed", range(COUNT))
def test_what_can_be_done_is_and_nothing_else(seed: int, clock: Clock) -> None:
    data = drawn(seed)
    text = yaml.safe_dump(data)
    try:
        load_scenario_text(text)
    except InputError:
        return
    run = played(text, clock)
    if run.outcome["outcome"] == "unrealizable":
        return
    came = {line["obstacle"]: line.get("t", line["tick"]) for line in run.all("order")}
    resolved = {line["obstacle"] for line in run.all("resolved")}
    due, kinds = named(data), {name: name.partition("@")[0] for name in named(data)}
    assert {line["obstacle"] for line in run.all("request")} <= came.keys()
    assert all(due[name] <= at for name, at in came.items())
    assert all(possible(data, kinds[name]) for name in resolved)
    layers = [model["layer"] for model in data["catalogue"]["robots"].values()]
    if len({*layers}) == len(layers):
        assert run.outcome["outcome"] == "completed"
        assert resolved == {name for name in due if possible(data, kinds[name])}
    if run.outcome["outcome"] == "completed":
        left = {*run.still_open}
        assert resolved | left == came.keys() == due.keys() and not resolved & left
    if seed % BUNDLED == 0:
        certified(text)


class Hasty(Clocked):
    """A world outside that reports each action on a load as done, taking it as well."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.asked: dict[str, Sequence[Obstacle]] = {}

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.asked[robot.name] = obstacles
        return self.simulation.act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        return [
            replace(event, found=[(load, ActResult.DONE) for load in self.asked[event.robot]])
            if isinstance(event, Acted)
            else event
            for event in self.simulation.wait(timeout)
        ]


def test_a_load_is_not_delivered_where_it_is_taken() -> None:
    """The run said that all was done when a robot had taken the load."""
    run = completed(HALL + "clock: live\n", world=Hasty)
    assert [line["at"] for line in run.all("resolved")] == [11, 11]
    late = [line["reason"] for line in run.all("late")]
    assert {*late} == {f"other needs are still open (pallet@16{n}: done)" for n in ("", "#2")}

"""Orders: requests that no robot has made. Judged by a walk over the trace of this file's own."""

from __future__ import annotations

import json
import os
import random
from pathlib import Path
from typing import Any

import pytest

from safenav.audit.check import check_trace
from safenav.certify.checker.check import check
from safenav.certify.record import bundle_of_run
from safenav.errors import UsageError
from safenav.runtime.interventions import PlaceOrder
from safenav.runtime.mission import Mission
from safenav.runtime.world import SimulatedWorld
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.writing import TraceWriter

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
ROWS, COLS = 3, 5
BUNDLED = 5
CATALOGUE = {
    "robots": {
        "cart": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
        "eye": {"mobility": "free", "layer": "air", "capabilities": ["look"]},
    },
    "obstacles": {
        "parcel": {"action": "lift", "blocks": []},
        "photo": {"action": "look", "blocks": []},
        "heavy": {
            "needs": [{"action": "lift", "robots": 2, "at": "neighbours", "together": True}],
            "blocks": [],
        },
    },
}
ACTIONS = {"parcel": ("lift", 1), "photo": ("look", 1), "heavy": ("lift", 2)}


def drawn(seed: int) -> dict[str, Any]:
    """Some robots on a floor with walls, and orders; no other obstacles."""
    rng = random.Random(f"orders {seed}")
    walls = {r for r in range(ROWS * COLS) if rng.random() < 0.25}
    free = [r for r in range(ROWS * COLS) if r not in walls]
    starts = rng.sample(free, rng.randint(1, min(3, len(free))))
    robots = {}
    for k, start in enumerate(starts):
        model = rng.choice(["cart", "eye"])
        near = sorted(reached(start, {*free}))
        robots[f"r{k}"] = {
            "model": model,
            "start": start,
            "objective": {"visit": rng.sample(near, min(len(near), 2))},
        }
    orders = [
        {
            "at": rng.randint(1, 25),
            "type": rng.choice([*ACTIONS]),
            "region": rng.choice(free),
        }
        for _ in range(rng.randint(1, 3))
    ]
    orders = [*{(order["type"], order["region"]): order for order in orders}.values()]
    cells = ["#" if r in walls else "." for r in range(ROWS * COLS)]
    return {
        "safenav": 1,
        "clock": "lockstep",
        "map": {"grid": ["".join(cells[k : k + COLS]) for k in range(0, ROWS * COLS, COLS)]},
        "catalogue": CATALOGUE,
        "robots": robots,
        "orders": orders,
        "coordination": rng.choice(["resynthesis", "resynthesis", "assignable"]),
        "until": {"rounds": 1},
        "limits": {"ticks": 300},
    }


def beside(region: int) -> set[int]:
    row, col = divmod(region, COLS)
    ways = ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1))
    return {r * COLS + c for r, c in ways if 0 <= r < ROWS and 0 <= c < COLS}


def reached(start: int, free: set[int]) -> set[int]:
    found, queue = {start}, [start]
    while queue:
        for after in beside(queue.pop()) & free - found:
            found.add(after)
            queue.append(after)
    return found


def lines_of(document: dict[str, Any], path: Path) -> list[dict[str, Any]]:
    with TraceWriter(path) as trace:
        Mission(load_scenario_text(json.dumps(document)), listeners=[trace]).run()
    assert check_trace(path).findings == ()
    return [json.loads(line) for line in path.read_text().splitlines()]


@pytest.mark.parametrize("seed", range(WANTED))
def test_an_order_is_done_by_robots_that_can(seed: int, tmp_path: Path) -> None:
    document = drawn(seed)
    lines = lines_of(document, tmp_path / "run.jsonl")
    at = {name: robot["start"] for name, robot in document["robots"].items()}
    skills = {n: CATALOGUE["robots"][r["model"]] for n, r in document["robots"].items()}
    told, done, given_up = dict[str, int](), dict[str, int](), set[str]()
    for line in lines:
        match line["type"]:
            case "move":
                at[line["robot"]] = line["to"]
            case "order":
                told[line["obstacle"]] = line["tick"]
            case "request":
                assert line["requester"] is None
                assert line["obstacle"] in told
            case "resolved":
                kind, _, region = line["obstacle"].partition("@")
                action, count = ACTIONS[kind]
                where = beside(int(region)) if kind == "heavy" else {int(region)}
                there = [n for n in at if action in skills[n]["capabilities"] and at[n] in where]
                assert line["obstacle"] in told
                assert len(there) >= count, line
                done[line["obstacle"]] = line["tick"]
            case "blocked":
                given_up.add(line["obstacle"])
    wanted = {f"{o['type']}@{o['region']}": o["at"] for o in document["orders"]}
    if lines[-1]["outcome"] != "completed":
        return
    assert {*told} == {*wanted} == {*done} | given_up
    assert all(wanted[name] <= told[name] <= done.get(name, 10**6) for name in wanted)
    free = {r for r, cell in enumerate("".join(document["map"]["grid"])) if cell == "."}
    for name in wanted:  # who can, does, wherever it stands between its moves
        kind, _, region = name.partition("@")
        action, count = ACTIONS[kind]
        where = (beside(int(region)) if kind == "heavy" else {int(region)}) & free
        able = [
            n
            for n, robot in document["robots"].items()
            if action in skills[n]["capabilities"] and reached(robot["start"], free) & where
        ]
        if kind != "heavy" or len(where) < 2:
            assert (name in done) == (len(able) >= count and len(where) >= count), (seed, name)
    if seed % BUNDLED == 0:
        (tmp_path / "plan.yaml").write_text(json.dumps(document))
        bundle_of_run(tmp_path / "plan.yaml", tmp_path / "bundle")
        verdict, reason, _ = check(tmp_path / "bundle")
        assert verdict == "accepted", reason


PLAN = {
    "safenav": 1,
    "clock": "lockstep",
    "map": {"grid": [".....", "....."]},
    "catalogue": CATALOGUE,
    "robots": {
        "ann": {"model": "cart", "start": 0, "objective": {"visit": [0, 5]}},
        "bob": {"model": "eye", "start": 4, "objective": {"hold": 4}},
    },
    "orders": [{"at": 3, "type": "parcel", "region": 9}],
    "until": {"rounds": 1},
}


@pytest.mark.parametrize("broken", ["unordered", "unasked", "another", "early"])
def test_damaged_traces_are_refused(broken: str, tmp_path: Path) -> None:
    lines = lines_of(PLAN, tmp_path / "run.jsonl")
    assert check_trace(json.dumps(line) for line in lines).ok
    if broken == "unordered":
        lines = [line for line in lines if line["type"] != "order"]
    elif broken == "unasked":
        lines = [line for line in lines if line["type"] != "request"]
    elif broken == "another":
        next(line for line in lines if line["type"] == "request")["requester"] = "bob"
    else:
        for line in lines:
            if line["type"] in ("appeared", "order"):
                line["tick"] -= 1
    assert check_trace(json.dumps(line) for line in lines).findings


def test_a_program_orders_during_a_run(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    with TraceWriter(path) as trace:
        mission = Mission(load_scenario_text(json.dumps(PLAN)), listeners=[trace])
        mission.start()
        mission.step()
        kinds = mission.scenario.catalogue.obstacles
        for kind, region, said in (
            ("door", 9, "a door stops robots"),
            ("parcel", 10, "region 10 is a wall"),
        ):
            with pytest.raises((UsageError, IndexError), match=said):
                mission.intervene(PlaceOrder(kinds[kind], region))
        mission.intervene(PlaceOrder(kinds["photo"], 0))
        while mission.result is None:
            mission.step()
    assert check_trace(path).findings == ()
    done = [json.loads(x) for x in path.read_text().splitlines() if '"resolved"' in x]
    assert [(x["obstacle"], x["robot"]) for x in done if x["type"] == "resolved"] == [
        ("photo@0", "bob"),
        ("parcel@9", "ann"),
    ] or {x["obstacle"] for x in done if x["type"] == "resolved"} == {"photo@0", "parcel@9"}


class Outside:
    """A world of a user: no simulation, it does what it is told."""

    def __init__(self, truth: SimulatedWorld) -> None:
        self.truth = truth

    def sense(self, robot: Any, region: int) -> Any:
        return self.truth.sense(robot, region)

    def move(self, robot: Any, pose: Any) -> Any:
        return self.truth.move(robot, pose)

    def act(self, robot: Any) -> Any:
        self.truth.changes(10**6, ())  # what is ordered is there
        return self.truth.act(robot)


def test_orders_reach_the_team_in_another_world(tmp_path: Path) -> None:
    scenario = load_scenario_text(json.dumps(PLAN))
    path = tmp_path / "run.jsonl"
    with TraceWriter(path) as trace:
        world = Outside(SimulatedWorld(scenario))
        result = Mission(scenario, world=world, listeners=[trace]).run()
    assert result.outcome.value == "completed"
    assert check_trace(path).findings == ()
    assert '"order"' in path.read_text()

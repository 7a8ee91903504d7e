"""Random loads and orders, judged by this file's own walk over the trace; ``cases/loads``."""

import os
from collections import Counter
from collections.abc import Callable, Sequence
from random import Random
from typing import Any

import pytest
import yaml
from msgspec.structs import replace

from campaigns.judge.mission import read_mission
from campaigns.judge.poses import Poses
from certify.making import certified
from drawn import loads
from runtime.facts import case
from runtime.played import Run, completed, play
from runtime.worlds import Clocked
from safenav.runtime.worlds.protocol import Acted, WorldEvent
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.settings import Clock
from safenav.trace.vocabulary import ActResult

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) or 12
ROWS, COLS = 3, 5
BUNDLED = 5


def judged(text: str, clock: Clock = Clock.LOCKSTEP) -> Run:
    """A run in which no robot carries more than one load."""
    scenario = load_scenario_text(text + f"clock: {clock.value}\n", "scenario.yaml")
    run = play(scenario)
    assert all(carried[r.name] <= 1 for carried in hands(run) for r in scenario.robots), text
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
def test_random_orders_are_resolved_exactly_where_robots_can(
    seed: int, clock: Clock, played: Callable[[], None]
) -> None:
    data, _ = loads(drawn, seed)
    text = yaml.safe_dump(data)
    run = judged(text, clock)
    if run.outcome["outcome"] == "unrealizable":
        return
    played()
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


def test_a_world_that_reports_more_than_was_commanded_delivers_no_load() -> None:
    """The run said that all was done when a robot had taken the load."""
    run = completed(case("loads/one_after_the_other") + "clock: live\n", world=Hasty)
    assert [line["at"] for line in run.all("resolved")] == [11, 11]
    late = [line["reason"] for line in run.all("late")]
    assert {*late} == {f"other needs are still open (pallet@16{n}: done)" for n in ("", "#2")}

"""Traces of runs with charges and orders, damaged: the audit refuses each.

``SAFENAV_FUZZ=500`` damages the traces of 500 runs of each kind. Deadlines: ``deadlines``.
"""

import json
import os
from copy import deepcopy
from random import Random
from typing import Any

import pytest

from runtime.energy.test_battery_runs import CUT_OFF, stop
from runtime.played import play
from runtime.test_orders import ACTIONS, drawn
from safenav.audit.check import check_trace
from safenav.errors import InputError
from safenav.scenario.reading.loader import load_scenario_text

COUNT = (int(os.environ.get("SAFENAV_FUZZ", "0")) or 9) // 3
Lines = list[dict[str, Any]]
FLOOR = ("violation", "blocked", "gone", "appeared", "operator", "objective", "service", "resolved")


def flat(seed: int) -> str:
    """A cart with little charge, and a drone that can bring a battery; or a cart that an obstacle
    cuts off from its charger."""
    random = Random(f"flat {seed}")
    if seed % 8 == 0:
        return CUT_OFF.replace("start: 16", f"start: {random.randint(8, 20)}")
    n = random.randint(9, 15)
    near = "{action: bring, at: neighbours}"
    fetched = "{action: bring, at: [[1, 2]]}, {action: bring, at: neighbours, same: true}"
    chargers = random.choice(("[]", "[[1, 3]]"))
    return f"""
safenav: 1
map: {{grid: ["{"#" * (n + 2)}", "#{"." * n}#", "#{"." * n}#", "{"#" * (n + 2)}"]}}
catalogue:
  robots:
    cart: {{mobility: free, layer: ground, capabilities: [],
           battery: {{capacity: {random.randint(20, 60)}, move: {random.choice((1, 1, 2))},
                     stay: {random.choice((0, 0, 1))}, charge: 3, start: {random.randint(1, 6)}}}}}
    drone: {{mobility: free, layer: air, capabilities: [bring]}}
  obstacles:
    empty: {{needs: [{random.choice((near, fetched))}], blocks: []}}
robots:
  cart: {{model: cart, start: [1, 1], objective: {{visit: [[1, {n}], [2, 1]]}}}}
  drone: {{model: drone, start: [1, 6], objective: {{visit: [[1, 6], [2, {n}]]}}}}
chargers: {chargers}
{"flat: empty" if chargers == "[]" or random.random() < 0.7 else ""}
until: {{rounds: 2}}
limits: {{ticks: 120}}
"""


def runs_short(lines: Lines) -> bool:
    """Whether a robot steps without the charge for it, or is said to be flat with it."""
    scenario = lines[0]["scenario"]
    chargers = scenario.get("chargers") or []
    batteries = {n: r["battery"] for n, r in scenario["robots"].items() if r.get("battery")}
    charge = {name: battery["start"] for name, battery in batteries.items()}
    for line in lines[1:]:
        name = line.get("robot")
        if name not in batteries:
            continue
        battery = batteries[name]
        if line["type"] == "move" and line["to"] != line["from"]:
            charge[name] -= battery["move"]
            if charge[name] < 0:
                return True
        elif line["type"] == "move" and line.get("toward") is None:
            there = line["to"] in chargers
            more = battery["charge"] if there else -battery["stay"]
            charge[name] = min(battery["capacity"], max(0, charge[name] + more))
        elif line["type"] == "service" and line.get("cause") == "battery":
            if line["active"]:
                charge[name] = battery["capacity"]
            elif charge[name] >= battery["move"]:
                return True
    return False


def charges(lines: Lines, random: Random) -> Lines | None:
    """The trace with another battery or charger that contradicts its moves, or with another line
    on charges; None if that changes nothing that can be seen."""
    scenario, end = lines[0]["scenario"], lines[-1]
    caused = [
        line
        for line in lines
        if line.get("cause") == "battery" and line["type"] in ("service", "appeared", "deadline")
    ]
    match random.randrange(5):
        case 0:
            names = [n for n, robot in scenario["robots"].items() if robot.get("battery")]
            battery = scenario["robots"][random.choice(names)]["battery"]
            key = random.choice(("start", "capacity", "move", "charge", "stay"))
            battery[key] = max(0, battery[key] + random.choice((-3, -2, -1, 1, 2)))
            return lines if runs_short(lines) else None
        case 1 if scenario.get("chargers"):
            scenario["chargers"].remove(random.choice(scenario["chargers"]))
            return lines if runs_short(lines) else None
        case 2 if end.get("refused"):
            name, least = random.choice([*end["refused"].items()])
            end["refused"][name] = 4 if least is None else random.choice((least - 1, None))
            return lines
        case 3 if caused:
            line = random.choice(caused)
            match random.randrange(4):
                case 0:
                    lines.remove(line)
                case 1:
                    lines.insert(lines.index(line), dict(line))
                case 2 if line["type"] == "service":
                    line["active"] = not line["active"]
                case 2 if line["type"] == "appeared":
                    line["obstacle"] += "1"
                case _:
                    line["cause"] = None if line["type"] == "deadline" else "scenario"
            return lines
        case 4:
            return _another_stop(lines, random)
    return None


def _another_stop(lines: Lines, random: Random) -> Lines | None:
    """A stop for another reason, or elsewhere than the robot goes before it has the next one."""
    told = [k for k, x in enumerate(lines) if x["type"] == "synthesis" and x["reason"] == "charge"]
    if len(told) < 2:
        return None
    place = random.randrange(len(told) - 1)
    first, then = lines[told[place]], lines[told[place + 1]]
    if random.random() < 0.5:
        first["reason"] = random.choice(("request", "resolved"))
        return lines
    between = lines[told[place] + 1 : told[place + 1]]
    same = first["robot"] == then["robot"] and "hold" in first["objective"]
    if not same or any(x["type"] in (*FLOOR, "synthesis") for x in between):
        return None
    first["objective"]["hold"] += random.choice((-1, 1))
    return lines


def orders(lines: Lines, random: Random) -> Lines | None:
    """The trace with a line on an order changed, left out or told twice."""
    names = {line["obstacle"] for line in lines if line["type"] == "order"}
    kinds = ("order", "appeared", "request", "resolved", "met")
    about = [x for x in lines if x["type"] in kinds and x.get("obstacle") in names]
    if not about:
        return None
    line = random.choice(about)
    kind, _, region = line["obstacle"].partition("@")
    match random.randrange(6):
        case 0:
            lines.remove(line)
        case 1:
            lines.insert(lines.index(line), dict(line))
        case 2:
            line["obstacle"] = f"{kind}@{int(region) + random.choice((-1, 1))}"
        case 3:
            line["obstacle"] = f"{random.choice([k for k in ACTIONS if k != kind])}@{region}"
        case 4:
            line["tick"] += random.choice((-1, 1))
        case _ if line["type"] == "request":
            line["requester"] = random.choice([*lines[0]["scenario"]["robots"]])
        case _:
            others = {*lines[0]["scenario"]["robots"]} - {line.get("robot")}
            if line["type"] not in ("resolved", "met") or not others:
                return None
            line["robot"] = random.choice(sorted(others))
    return lines


def refused(lines: Lines) -> bool:
    try:
        return bool(check_trace(json.dumps(line) for line in lines).findings)
    except InputError:
        return True


@pytest.mark.parametrize("seed", range(1, COUNT + 1))
@pytest.mark.parametrize(
    ("made", "damaged"),
    [(stop, charges), (flat, charges), (lambda seed: json.dumps(drawn(seed)), orders)],
    ids=["charges", "flat", "orders"],
)
def test_none_is_accepted(made: Any, damaged: Any, seed: int) -> None:
    try:
        load_scenario_text(made(seed))
    except InputError:
        return
    lines, random = play(made(seed)).records, Random(seed)
    for _ in range(6):
        broken = damaged(deepcopy(lines), random)
        assert broken is None or broken == lines or refused(broken)

"""No forgery of an honest trace is accepted unless it is harmless, as a plain oracle sees it. Each
kind changes the lines so that they may be untrue.

``JUDGE_FORGERIES``: how many of each kind (default 6)."""

import copy
import os
import random
from collections.abc import Callable
from typing import Any

import pytest

from judge.oracle import Facts
from support.damage import GOOD, Line, live, team, text
from support.judged import believed

MANY = int(os.environ.get("JUDGE_FORGERIES", "6"))
NEGATIVE = {"a negative", "completed"}

Forge = Callable[..., Any]
"""Changes lines, by chance; with a number of a line if it needs one. It does not apply if it
changes nothing, or returns False."""
FORGERIES: dict[str, Callable[[list[Line], random.Random], bool]] = {}


def kind(*types: str, name: str = "") -> Callable[[Forge], Forge]:
    """Add a forgery. With ``types`` of lines it gets the number of one of them (``step``: a move to
    another region), and applies if there is one."""

    def add(forge: Forge) -> Forge:
        def forged(lines: list[Line], chance: random.Random) -> bool:
            if not types:
                return forge(lines, chance) is not False
            found = steps(lines) if "step" in types else at(lines, *types)
            return bool(found) and forge(lines, chance.choice(found), chance) is not False

        FORGERIES[name or forge.__name__.replace("_", " ")] = forged
        return forge

    return add


def at(lines: list[Line], *types: str) -> list[int]:
    return [k for k, one in enumerate(lines) if one["type"] in types]


def steps(lines: list[Line]) -> list[int]:
    return [k for k in at(lines, "move") if lines[k]["from"] != lines[k]["to"]]


def beside(lines: list[Line], k: int) -> list[int]:
    cols = lines[0]["scenario"]["map"]["cols"]
    return [lines[k]["from"] + d for d in (-cols, -1, 1, cols)]


def free(lines: list[Line]) -> list[int]:
    found = lines[0]["scenario"]["map"]
    return [r for r in range(found["rows"] * found["cols"]) if r not in found["walls"]]


def goes(lines: list[Line], k: int, to: int) -> None:
    """Let a move lead elsewhere, and the next one begin there."""
    name = lines[k]["robot"]
    lines[k]["to"] = to
    for line in lines[k + 1 :]:
        if line["type"] == "move" and line["robot"] == name:
            line["from"] = to
            break


@kind("move")
def teleport(lines: list[Line], k: int, chance: random.Random) -> None:
    goes(lines, k, chance.choice(free(lines)))


@kind("move")
def through_a_wall(lines: list[Line], k: int, chance: random.Random) -> None:
    walls = {*beside(lines, k)} & {*lines[0]["scenario"]["map"]["walls"]}
    if walls:
        goes(lines, k, chance.choice(sorted(walls)))


@kind("move")
def a_step_aside(lines: list[Line], k: int, chance: random.Random) -> None:
    goes(lines, k, chance.choice(beside(lines, k)))


@kind()
def rivals(lines: list[Line], _: random.Random) -> bool:
    """Robots that were never in conflict are."""
    robots = team(lines[0])
    for name, robot in robots.items():
        robot["avoids"] = sorted({*robots} - {name})
    return len(robots) > 1


@kind("move")
def a_zone(lines: list[Line], _: int, chance: random.Random) -> bool:
    robots = [*team(lines[0])]
    where = sorted({lines[k]["to"] for k in at(lines, "move")})
    regions = chance.sample(where, min(len(where), 3))
    lines[0]["scenario"]["never_together"] = [{"robots": robots, "regions": regions}]
    return len(robots) > 1


@kind("step")
def a_door_in_the_way(lines: list[Line], k: int, _: random.Random) -> None:
    """The scenario has an obstacle where a robot went."""
    need = {"action": "crush", "robots": 1, "at": "self", "together": False, "same": False}
    rock = {"name": "rock", "needs": [need]}
    about = {"type": rock, "region": lines[k]["to"], "ordered": False, "number": 1}
    lines[0]["scenario"]["obstacles"].append(about)


@kind("resolved")
def a_later_resolution(lines: list[Line], k: int, chance: random.Random) -> None:
    line = lines.pop(k)
    later = min(len(lines) - 1, k + chance.randint(1, 9))
    lines.insert(later, line | {"tick": lines[later - 1].get("tick", 0)})


@kind("resolved", "part")
def another_robot_resolves(lines: list[Line], k: int, chance: random.Random) -> None:
    lines[k]["robot"] = chance.choice([*team(lines[0])])


@kind("resolved")
def without_the_capability(lines: list[Line], *_: object) -> None:
    for robot in team(lines[0]).values():
        robot["model"]["capabilities"] = []


@kind("resolved")
def a_further_need(lines: list[Line], *_: object) -> None:
    for one in lines[0]["scenario"]["obstacles"]:
        first = one["type"]["needs"][0]
        one["type"]["needs"] = [first, first | {"action": "crush"}]


@kind("resolved")
def another_truth(lines: list[Line], k: int, _: random.Random) -> None:
    lines[k]["traversable"] = {None: True, True: None, False: True}[lines[k]["traversable"]]


@kind("goal")
def a_goal_out_of_thin_air(lines: list[Line], goal: int, chance: random.Random) -> None:
    line, k = copy.deepcopy(lines[goal]), chance.choice(at(lines, "move") or [1])
    line |= {"tick": lines[k]["tick"], "round": line["round"] + chance.randint(0, 1)}
    lines.insert(k + 1, line)


@kind()
def one_round_more(lines: list[Line], _: random.Random) -> None:
    rounds = lines[0]["scenario"]["until"]["rounds"] + 1
    lines[0]["scenario"]["until"]["rounds"] = rounds
    for name in lines[-1].get("rounds", {}):
        lines[-1]["rounds"][name] = rounds


@kind()
def an_earlier_end(lines: list[Line], chance: random.Random) -> bool:
    moves = at(lines, "move")
    if len(moves) < 4:
        return False
    k = chance.choice(moves[1:-1])
    tick = lines[k - 1].get("tick", 0)
    lines[k:-1] = []
    lines[-1] |= {"tick": tick, "ticks": tick}
    return True


@kind()
def completed(lines: list[Line], chance: random.Random) -> bool:
    wanted = lines[0]["scenario"]["until"]["rounds"]
    rounds = dict.fromkeys(team(lines[0]), wanted)
    before = lines[-1]["outcome"]
    lines[-1] |= {"outcome": "completed", "rounds": rounds}
    for key in ("cause", "proof"):
        lines[-1].pop(key, None)
    return before != "completed" or bool(an_earlier_end(lines, chance))


@kind()
def before_its_time(lines: list[Line], chance: random.Random) -> None:
    for one in lines[0]["scenario"]["obstacles"]:
        for key in [key for key in ("appears", "goes") if one.get(key)][:1]:
            one[key] += chance.randint(1, 3)


@kind("appeared", "objective", "service")
def it_never_comes(lines: list[Line], k: int, _: random.Random) -> bool:
    gone, name = lines[k], lines[k].get("obstacle")
    kept = [one for one in lines if name is None or one.get("obstacle") != name]
    lines[:] = [one for one in kept if one is not gone]
    return bool(gone["cause"] == "scenario")


@kind()
def opened_by_the_world(lines: list[Line], chance: random.Random) -> None:
    found = lines[0]["scenario"]["obstacles"]
    if found:
        one = chance.choice(found)
        name = f"{one['type']['name']}@{one['region']}"
        lines.insert(2, {"type": "gone", "tick": 0, "obstacle": name, "cause": "world"})


@kind()
def late(lines: list[Line], chance: random.Random) -> bool:
    """The mission had a deadline, which no line mentions."""
    by = max(1, lines[-1]["tick"] - chance.randint(-2, 3))
    lines[0]["scenario"]["until"]["by"] = by
    lines[-1].setdefault("late", [])
    return bool(lines[-1]["outcome"] == "completed")


@kind("step")
def a_slow_robot(lines: list[Line], _: int, chance: random.Random) -> None:
    robot = chance.choice([*team(lines[0]).values()])
    robot["model"]["timing"] = 2


@kind("step")
def an_empty_battery(lines: list[Line], step: int, chance: random.Random) -> None:
    name = lines[step]["robot"]
    many = sum(lines[k]["robot"] == name for k in steps(lines))
    battery = {"capacity": 99, "start": chance.randint(0, many + 1), "move": 1, "stay": 0}
    team(lines[0])[name]["model"]["battery"] = battery | {"charge": 1}


@kind("step")
def an_avoided_region(lines: list[Line], k: int, chance: random.Random) -> None:
    robot = chance.choice([*team(lines[0]).values()])
    robot["objective"]["avoid"] = [lines[k]["to"]]


@kind("step")
def a_forbidden_step(lines: list[Line], k: int, _: random.Random) -> None:
    own = team(lines[0])[lines[k]["robot"]]["objective"]
    own["always"] = [f"region = {lines[k]['from']} -> region' != {lines[k]['to']}"]


@kind()
def a_negative(lines: list[Line], chance: random.Random) -> bool:
    """The run ends immediately, perhaps by a deadlock: the mission was completed."""
    honest = lines[-1]["outcome"] == "completed"
    ends = honest and bool(an_earlier_end(lines, chance))
    names = [*team(lines[0])]
    cause = chance.choice(["deadlock", "unrealizable", "never_resolvable", "out_of_service"])
    lines[-1] |= {"outcome": "operator_needed", "cause": cause}
    if cause == "deadlock":
        lines[-1]["proof"] = {"robots": chance.choice([names, names[:1], []])}
    return ends


@kind("step")
def out_of_service(lines: list[Line], _: int, chance: random.Random) -> None:
    name = chance.choice([*team(lines[0])])
    lines[0]["scenario"]["changes"] = [{"at": 1, "robot": name, "active": False}]
    service = {"type": "service", "robot": name, "active": False, "cause": "scenario"}
    first = at(lines, "move")[0]
    if chance.random() < 0.5:
        lines.insert(first, service | {"tick": lines[first]["tick"]})


@kind()
def an_unknown_word(lines: list[Line], chance: random.Random) -> None:
    line = chance.choice(lines)
    key = chance.choice([*line])
    line[key] = chance.choice(["perfect", "x: 0", -1, None, True, [], {}, 1e300])


@kind()
def another_order(lines: list[Line], chance: random.Random) -> None:
    a, b = (chance.randrange(1, len(lines) - 1) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]


@kind()
def another_line_twice(lines: list[Line], chance: random.Random) -> None:
    k = chance.randrange(1, len(lines))
    lines.insert(k, copy.deepcopy(lines[k]))


@kind()
def a_line_left_out(lines: list[Line], chance: random.Random) -> None:
    del lines[chance.randrange(1, len(lines) - 1)]


@kind("resolved", "part", name="a door that nobody opens")
@kind("goal")
def a_goal_left_out(lines: list[Line], k: int, _: random.Random) -> None:
    del lines[k]


def harm(lines: list[Line], *, negative: bool) -> str:
    found = [one for one in Facts(lines).harms() if negative or "can be completed" not in one]
    return found[0] if found else ""


HONEST = {name: read() for name, read in GOOD.items()}
HONEST = {
    name: lines
    for name, lines in HONEST.items()
    if len(lines) > 9 and not live(lines) and believed(text(lines))
}


@pytest.mark.parametrize("name", HONEST)
def test_the_oracle_accepts_an_honest_trace(name: str) -> None:
    assert harm(HONEST[name], negative=False) == ""


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forgery_that_is_accepted_is_harmless(kind: str) -> None:
    chance, refused, made = random.Random(kind), 0, 0
    for _ in range(40 * MANY):
        if made == MANY:
            break
        name = chance.choice([*HONEST])
        lines = copy.deepcopy(HONEST[name])
        if not FORGERIES[kind](lines, chance) or lines == HONEST[name]:
            continue
        made += 1
        refused += not (accepted := believed(text(lines)))
        if accepted:
            seen = harm(lines, negative=kind in NEGATIVE)
            assert seen == "", f"{name}: {seen}"
    assert made == MANY
    assert refused, "no forgery of this kind is refused"

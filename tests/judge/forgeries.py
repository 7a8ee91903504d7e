"""Forgeries of honest traces, by kind: each changes the lines so that they may be untrue."""

import copy
import random
from collections.abc import Callable

from support.damage import Line, team

Forge = Callable[[list[Line], random.Random], bool]
FORGERIES: dict[str, Forge] = {}
"""Each returns whether it applies to the trace."""


def kind(forge: Forge) -> Forge:
    FORGERIES[forge.__name__.replace("_", " ")] = forge
    return forge


def at(lines: list[Line], kind: str, **fields: object) -> list[int]:
    every = enumerate(lines)
    return [k for k, one in every if one["type"] == kind and fields.items() <= one.items()]


def steps(lines: list[Line]) -> list[int]:
    return [k for k in at(lines, "move") if lines[k]["from"] != lines[k]["to"]]


def world(lines: list[Line]) -> tuple[str, int]:
    """The regions of the map as characters, and the number of its columns."""
    found = lines[0]["scenario"]["map"]
    every = range(found["rows"] * found["cols"])
    return "".join("#" if r in found["walls"] else "." for r in every), found["cols"]


def goes(lines: list[Line], k: int, to: int) -> bool:
    """Let a move lead elsewhere, and the next one begin there."""
    name = lines[k]["robot"]
    lines[k]["to"] = to
    for line in lines[k + 1 :]:
        if line["type"] == "move" and line["robot"] == name:
            line["from"] = to
            break
    return True


@kind
def teleport(lines: list[Line], chance: random.Random) -> bool:
    grid, _ = world(lines)
    free = [r for r, cell in enumerate(grid) if cell != "#"]
    return bool(at(lines, "move")) and goes(
        lines, chance.choice(at(lines, "move")), chance.choice(free)
    )


@kind
def through_a_wall(lines: list[Line], chance: random.Random) -> bool:
    grid, cols = world(lines)
    k = chance.choice(at(lines, "move") or [0])
    beside = [lines[k].get("from", 0) + d for d in (-cols, -1, 1, cols)]
    walls = [r for r in beside if 0 <= r < len(grid) and grid[r] == "#"]
    return bool(walls) and goes(lines, k, chance.choice(walls))


@kind
def a_step_aside(lines: list[Line], chance: random.Random) -> bool:
    _, cols = world(lines)
    k = chance.choice(at(lines, "move") or [0])
    return k > 0 and goes(lines, k, lines[k]["from"] + chance.choice((-cols, -1, 1, cols)))


@kind
def rivals(lines: list[Line], _: random.Random) -> bool:
    """Robots that were never in conflict are."""
    robots = team(lines[0])
    for name, robot in robots.items():
        robot["avoids"] = sorted({*robots} - {name})
    return len(robots) > 1


@kind
def a_zone(lines: list[Line], chance: random.Random) -> bool:
    robots = [*team(lines[0])]
    where = sorted({lines[k]["to"] for k in at(lines, "move")})
    regions = chance.sample(where, min(len(where), 3))
    lines[0]["scenario"]["never_together"] = [{"robots": robots, "regions": regions}]
    return len(robots) > 1 and bool(where)


@kind
def a_door_that_nobody_opens(lines: list[Line], chance: random.Random) -> bool:
    found = at(lines, "resolved") + at(lines, "met")
    if found:
        del lines[chance.choice(found)]
    return bool(found)


@kind
def a_door_in_the_way(lines: list[Line], chance: random.Random) -> bool:
    """The scenario has an obstacle where a robot went."""
    if not steps(lines):
        return False
    region = lines[chance.choice(steps(lines))]["to"]
    rock = {"name": "rock", "action": "crush", "resolve_at": "self", "listed": []}
    about = {"type": rock, "region": region, "ordered": False, "number": 1}
    lines[0]["scenario"]["obstacles"].append(about)
    return True


@kind
def a_later_resolution(lines: list[Line], chance: random.Random) -> bool:
    found = at(lines, "resolved")
    if not found:
        return False
    k = chance.choice(found)
    line = lines.pop(k)
    later = min(len(lines) - 1, k + chance.randint(1, 9))
    lines.insert(later, line | {"tick": lines[later - 1].get("tick", 0)})
    return True


@kind
def another_robot_resolves(lines: list[Line], chance: random.Random) -> bool:
    found, robots = at(lines, "resolved") + at(lines, "met"), [*team(lines[0])]
    if found:
        lines[chance.choice(found)]["robot"] = chance.choice(robots)
    return bool(found)


@kind
def without_the_capability(lines: list[Line], _: random.Random) -> bool:
    for robot in team(lines[0]).values():
        robot["model"]["capabilities"] = []
    return bool(at(lines, "resolved"))


@kind
def a_further_need(lines: list[Line], _: random.Random) -> bool:
    found = lines[0]["scenario"]["obstacles"]
    for one in found:
        kind, many = one["type"], {"robots": 1, "together": False, "same": False}
        alone = many | {"action": kind["action"], "at": kind["resolve_at"]}
        first = (kind["listed"] or [alone])[0]
        kind["listed"] = [first, first | {"action": "crush"}]
    return bool(found) and bool(at(lines, "resolved"))


@kind
def another_truth(lines: list[Line], _: random.Random) -> bool:
    found = at(lines, "resolved")
    for k in found:
        lines[k]["traversable"] = {None: True, True: None, False: True}[lines[k]["traversable"]]
    return bool(found)


@kind
def a_goal_out_of_thin_air(lines: list[Line], chance: random.Random) -> bool:
    found = at(lines, "goal")
    if found:
        line = copy.deepcopy(lines[chance.choice(found)])
        k = chance.choice(at(lines, "move") or [1])
        line |= {"tick": lines[k]["tick"], "round": line["round"] + chance.randint(0, 1)}
        lines.insert(k + 1, line)
    return bool(found)


@kind
def a_goal_left_out(lines: list[Line], chance: random.Random) -> bool:
    found = at(lines, "goal")
    if found:
        del lines[chance.choice(found)]
    return bool(found)


@kind
def one_round_more(lines: list[Line], _: random.Random) -> bool:
    rounds = lines[0]["scenario"]["until"]["rounds"] + 1
    lines[0]["scenario"]["until"]["rounds"] = rounds
    for name in lines[-1].get("rounds", {}):
        lines[-1]["rounds"][name] = rounds
    return True


@kind
def an_earlier_end(lines: list[Line], chance: random.Random) -> bool:
    moves = at(lines, "move")
    if len(moves) < 4:
        return False
    k = chance.choice(moves[1:-1])
    tick = lines[k - 1].get("tick", 0)
    lines[k:-1] = []
    lines[-1] |= {"tick": tick, "ticks": tick}
    return True


@kind
def completed(lines: list[Line], chance: random.Random) -> bool:
    wanted = lines[0]["scenario"]["until"]["rounds"]
    rounds = dict.fromkeys(team(lines[0]), wanted)
    before = lines[-1]["outcome"]
    lines[-1] |= {"outcome": "completed", "rounds": rounds}
    for key in ("cause", "proof"):
        lines[-1].pop(key, None)
    return before != "completed" or an_earlier_end(lines, chance)


@kind
def before_its_time(lines: list[Line], chance: random.Random) -> bool:
    found = [
        one for one in lines[0]["scenario"]["obstacles"] if one.get("appears") or one.get("goes")
    ]
    for one in found:
        key = "appears" if one.get("appears") else "goes"
        one[key] += chance.randint(1, 3)
    return bool(found)


@kind
def it_never_comes(lines: list[Line], chance: random.Random) -> bool:
    found = [k for kind in ("appeared", "objective", "service") for k in at(lines, kind)]
    found = [k for k in found if lines[k]["cause"] == "scenario"]
    if found:
        k = chance.choice(found)
        name = lines[k].get("obstacle")
        lines[:] = [one for one in lines if one is not lines[k] and
                    (name is None or one.get("obstacle") != name)]  # fmt: skip
    return bool(found)


@kind
def opened_by_the_world(lines: list[Line], chance: random.Random) -> bool:
    found = lines[0]["scenario"]["obstacles"]
    if found:
        one = chance.choice(found)
        name = f"{one['type']['name']}@{one['region']}"
        lines.insert(2, {"type": "gone", "tick": 0, "obstacle": name, "cause": "world"})
    return bool(found)


@kind
def late(lines: list[Line], chance: random.Random) -> bool:
    """The mission had a deadline, which no line mentions."""
    by = max(1, lines[-1]["tick"] - chance.randint(-2, 3))
    lines[0]["scenario"]["until"]["by"] = by
    lines[-1].setdefault("late", [])
    return lines[-1]["outcome"] == "completed"


@kind
def a_slow_robot(lines: list[Line], chance: random.Random) -> bool:
    robot = chance.choice([*team(lines[0]).values()])
    robot["model"]["timing"] = 2
    return bool(steps(lines))


@kind
def an_empty_battery(lines: list[Line], chance: random.Random) -> bool:
    name = chance.choice([*team(lines[0])])
    many = sum(lines[k]["robot"] == name for k in steps(lines))
    battery = {"capacity": 99, "start": chance.randint(0, many + 1), "move": 1, "stay": 0}
    team(lines[0])[name]["model"]["battery"] = battery | {"charge": 1}
    return many > 0


@kind
def an_avoided_region(lines: list[Line], chance: random.Random) -> bool:
    robots = team(lines[0])
    name = chance.choice([*robots])
    where = [lines[k]["to"] for k in steps(lines)]
    if where:
        robots[name]["objective"]["avoid"] = [chance.choice(where)]
    return bool(where)


@kind
def a_forbidden_step(lines: list[Line], chance: random.Random) -> bool:
    if not steps(lines):
        return False
    one = lines[chance.choice(steps(lines))]
    own = team(lines[0])[one["robot"]]["objective"]
    own["always"] = [f"region = {one['from']} -> region' != {one['to']}"]
    return True


@kind
def a_negative(lines: list[Line], chance: random.Random) -> bool:
    """The run ends immediately, perhaps by a deadlock: the mission was completed."""
    honest = lines[-1]["outcome"] == "completed"
    ends = honest and an_earlier_end(lines, chance)
    names = [*team(lines[0])]
    cause = chance.choice(["deadlock", "unrealizable", "never_resolvable", "out_of_service"])
    lines[-1] |= {"outcome": "operator_needed", "cause": cause}
    if cause == "deadlock":
        lines[-1]["proof"] = {"robots": chance.choice([names, names[:1], []])}
    return ends


@kind
def out_of_service(lines: list[Line], chance: random.Random) -> bool:
    name = chance.choice([*team(lines[0])])
    lines[0]["scenario"]["changes"] = [{"at": 1, "robot": name, "active": False}]
    service = {"type": "service", "robot": name, "active": False, "cause": "scenario"}
    first = at(lines, "move") or [len(lines) - 1]
    if chance.random() < 0.5:
        lines.insert(first[0], service | {"tick": lines[first[0]]["tick"]})
    return bool(steps(lines))


@kind
def an_unknown_word(lines: list[Line], chance: random.Random) -> bool:
    line = chance.choice(lines)
    key = chance.choice([*line])
    line[key] = chance.choice(["perfect", "x: 0", -1, None, True, [], {}, 1e300])
    return True


@kind
def another_order(lines: list[Line], chance: random.Random) -> bool:
    a, b = (chance.randrange(1, len(lines) - 1) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]
    return a != b


@kind
def another_line_twice(lines: list[Line], chance: random.Random) -> bool:
    k = chance.randrange(1, len(lines))
    lines.insert(k, copy.deepcopy(lines[k]))
    return True


@kind
def a_line_left_out(lines: list[Line], chance: random.Random) -> bool:
    del lines[chance.randrange(1, len(lines) - 1)]
    return True

"""Lies: untrue runs that a forger makes of honest ones, with all checksums right.

A page that lies is not among them: it is no part of the proof, and says so.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from certify.making import Files, bundle_at, files_of, shipped
from certify.mutants import lines_of, with_lines
from lies.forging import Line, ends, first, objectives_of, retold

TRACE, BUNDLE = "check", "check of a bundle"
BOTH = (TRACE, BUNDLE)
UNTIL = "until: {rounds: 2}\nlimits: {ticks: 40}\n"
CORRIDOR = f"""name: a corridor
robots: {{q: {{model: quadcopter, start: 7, objective: {{visit: [7, 10]}}}}}}
map: {{grid: ["######", "#....#", "######"]}}
{UNTIL}"""
DOOR = f"""name: a door
robots: {{q: {{model: quadcopter, start: 9, objective: {{visit: [9, 14]}}}}}}
obstacles: [{{type: door, region: 11}}]
map: {{grid: ["########", "#......#", "#......#", "########"]}}
{UNTIL}"""
LIVE = f"""name: in seconds
robots: {{q: {{model: quadcopter, start: 9, objective: {{visit: [9, 14]}}}}}}
map: {{grid: ["########", "#......#", "########"]}}
clock: live
{UNTIL.replace("2}", "1}")}"""
FORMULAS = f"""name: formulas
robots:
  q: {{model: quadcopter, start: 7, objective: {{
    ltl: {{memory: {{m: bool}}, liveness: [region = 7, region = 10]}}}}}}
map: {{grid: ["######", "#....#", "######"]}}
{UNTIL.replace("2}", "1}")}"""
DEADLOCK = f"""name: a deadlock
robots:
  a: {{model: quadcopter, start: 7, objective: {{
    ltl: {{memory: {{m: bool}}, liveness: [region = 10, region = 7]}}}}}}
  b: {{model: quadcopter, start: 10, objective: {{visit: [10, 7]}}}}
map: {{grid: ["######", "#....#", "######"]}}
{UNTIL.replace("2}", "1}")}"""
SERVICE = f"""name: out of service
robots:
  a: {{model: quadcopter, start: 9, objective: {{visit: [9, 14]}}}}
  b: {{model: quadcopter, start: 17, objective: {{visit: [17, 22]}}}}
map: {{grid: ["########", "#......#", "#......#", "########"]}}
changes: [{{at: 3, robot: b, service: out}}]
{UNTIL.replace("2}", "1}")}"""
ALONE = f"""name: alone
robots:
  NAME: {{model: quadcopter, start: START, objective: {{visit: [START, GOAL], avoid: [OTHER]}}}}
map: {{grid: ["########", "#......#", "#......#", "########"]}}
{UNTIL}"""


@dataclass(frozen=True)
class Lie:
    """``source``: the honest bundle; ``forge``: its files, made untrue; ``refused_by``: who
    refuses it."""

    says: str
    source: Callable[[], Path]
    forge: Callable[[Files], Files]
    refused_by: tuple[str, ...] = BOTH


def resumed(lines: list[Line]) -> None:
    lines[0]["scenario"]["begun"] = {"robots": {"q": {"rounds": 2}}}
    del lines[first(lines, "goal")]
    ends(lines, first(lines, "move"), "completed", rounds={"q": 2})


def either(lines: list[Line]) -> None:
    for line in lines:
        if line["type"] == "move":
            line["by"] = "either"


CODE = "m: 0, open({!r}, 'w').close(), lambda y"


def code(canary: Path) -> Callable[[list[Line]], None]:
    """The name of a variable is a text that opens a file, were it ever evaluated."""
    name = CODE.format(str(canary))

    def forge(lines: list[Line]) -> None:
        for objective in objectives_of(lines):
            if "ltl" in objective:
                objective["ltl"] |= {"memory": {name: "bool"}, "inputs": [name]}

    return forge


def through_the_door(lines: list[Line]) -> None:
    """In a world outside of safenav, the robot enters the region in which it met a door."""
    lines[0]["scenario"]["world"] = "external"
    entering = lines[first(lines, "move", tick=3)] | {"tick": 2, "to": 11}
    lines[first(lines, "violation") + 1 : -1] = [entering]
    ends(lines, len(lines) - 1, "interrupted")


def together(lines: list[Line]) -> None:
    """In a world outside of safenav, b enters the region beside it in which a is."""
    lines[0]["scenario"]["world"] = "external"
    moves = [k for k, line in enumerate(lines) if line["type"] == "move"]
    at = next(
        k
        for before, k in pairwise(moves)
        if lines[k]["robot"] == "b" and abs(lines[before]["to"] - lines[k]["from"]) == 1
    )
    lines[at]["to"] = lines[at - 1]["to"]
    ends(lines, at + 1, "interrupted")


def slow(lines: list[Line]) -> None:
    lines[0]["scenario"]["robots"]["q"]["timing"] = 3


def on_its_way(lines: list[Line]) -> None:
    at = first(lines, "service")
    tick = lines[at]["tick"]
    about = {"cause": "out_of_service", "tick": tick, "ticks": tick - 1}
    ends(lines, at + 1, "operator_needed", explanation="b is out of service", **about)


def one_goal_short(lines: list[Line]) -> None:
    for tick, number in ((19, 1), (28, 1), (37, 2)):
        lines[first(lines, "goal", robot="quad", tick=tick)]["round"] = number
    ends(lines, first(lines, "goal", robot="digit", tick=43) + 1, "completed")


def out_of_thin_air(lines: list[Line]) -> None:
    for line in lines:
        if line["type"] == "move":
            line |= {"from": 7, "to": 7}
        if line["type"] == "goal":
            line["region"] = 7


def nonsense(lines: list[Line]) -> None:
    """No order of moves is shown to fail, but the memory has a hundred values."""
    for objective in objectives_of(lines):
        if "ltl" in objective:
            objective["ltl"]["memory"] = {"m": [0, 99]}
    lines[-1]["proof"] |= {"states": 1, "sha256": "0" * 64}
    del lines[-1]["proof"]["memory"]


def another_source(files: Files) -> Files:
    (name,) = (name for name in files if name.startswith("source/"))
    text = files[name].replace(b"rounds: 2", b"rounds: 9").replace(b"[7, 10]", b"[8, 9]")
    return {**files, name: text}


def leaps(lines: list[Line]) -> None:
    one, other = (
        k for k, line in enumerate(lines) if line["type"] == "arrive" and line["tick"] < 7
    )
    lines[one] |= {"at": 12, "result": "elsewhere"}
    lines[other - 1] |= {"from": 12, "to": 13}
    lines[other] |= {"at": 14, "result": "elsewhere"}
    now = {key: lines[other][key] for key in ("tick", "t")}
    lines[other + 1 : -1] = [lines[first(lines, "goal", goal=1)] | now]
    last = {"t": now["t"], "makespan": now["t"], "busy": {"q": now["t"]}}
    ends(lines, len(lines) - 1, "completed", **last)


def opened_by_nobody(lines: list[Line]) -> None:
    for obstacle in lines[0]["scenario"]["obstacles"]:
        obstacle.pop("until", None)
    lines[first(lines, "gone")]["cause"] = "world"


def alone(name: str, start: int, goal: int, other: int) -> Path:
    text = ALONE.replace("NAME", name).replace("START", str(start)).replace("GOAL", str(goal))
    return bundle_at(f"alone_{name}", text.replace("OTHER", str(other)))


def one_alone() -> Path:
    return alone("a", 9, 11, 22)


def without_the_other(files: Files) -> Files:
    """Each of two robots in one lab has a strategy for a lab in which the other stands still."""
    others = files_of(alone("b", 22, 20, 9))
    mine, theirs = lines_of(files), lines_of(others)
    header = mine[0]
    header["scenario"]["robots"] |= theirs[0]["scenario"]["robots"]
    merged: list[Line] = [header]
    for tick in range(5):
        for lines, other, region in ((mine, "b", 22), (theirs, "a", 9)):
            for line in lines[1:]:
                if line["tick"] != tick or line["type"] == "outcome":
                    continue
                if line["type"] == "synthesis":
                    line["closed"] = [[region, f"robots.{other}"]]
                merged.append(line)
    merged += [mine[-1]]
    for objective in objectives_of(merged):
        objective.pop("avoid", None)
    merged.sort(key=lambda line: (line.get("tick", -1), line["type"] == "outcome"))
    ends(merged, len(merged) - 1, "interrupted")
    proofs = {
        name: data for name, data in others.items() if name.startswith(("spec", "strat", "mea"))
    }
    return with_lines(files | proofs, merged)


def perfect(lines: list[Line]) -> None:
    lines[-1]["outcome"] = "perfect"


def unseen(lines: list[Line]) -> None:
    """The goals are marked as notes, which no one judges."""
    for line in lines:
        if line["type"] == "goal":
            line["note"] = True


def unknown(lines: list[Line]) -> None:
    lines.insert(-1, {"type": "teleport", "tick": lines[-1]["tick"], "robot": "q", "to": 9})


def waits(outcome: str, **fields: str) -> Callable[[list[Line]], None]:
    """A run that is completed in the end waits in its middle, with an outcome that is untrue."""

    def forge(lines: list[Line]) -> None:
        at = first(lines, "move")
        about = {"tick": lines[at]["tick"], "outcome": outcome, "explanation": "it is so"}
        lines.insert(at + 1, {"type": "waiting", **about, **fields})

    return forge


def corridor() -> Path:
    return bundle_at("corridor", CORRIDOR)


def gate() -> Path:
    text = (shipped_text("case_study_1")).split("expect:")[0]
    return bundle_at("gate", text.replace("type: door,", "type: door, until: 13,"))


def shipped_text(name: str) -> str:
    return (Path(__file__).parents[2] / "scenarios" / f"{name}.yaml").read_text()


LIES: dict[str, Lie] = {
    "1": Lie(
        "the run before has done it all",
        corridor,
        retold(resumed),
    ),
    "2": Lie("moves are decided by an internal word", corridor, retold(either)),
    "4": Lie(
        "a robot enters a region in which it met a door",
        lambda: bundle_at("door", DOOR),
        retold(through_the_door),
    ),
    "5": Lie(
        "no collision, with two rivals in one region",
        lambda: shipped("corridor_swap"),
        retold(together),
    ),
    "6": Lie(
        "a step takes three ticks, and each took one",
        corridor,
        retold(slow),
    ),
    "7": Lie(
        "an operator is needed, while a robot is on its way",
        lambda: bundle_at("service", SERVICE),
        retold(on_its_way),
    ),
    "9": Lie(
        "completed, one goal short",
        lambda: shipped("case_study_1"),
        retold(one_goal_short),
    ),
    "10": Lie(
        "goals of formulas, met by staying at the start",
        lambda: bundle_at("formulas", FORMULAS),
        retold(out_of_thin_air),
    ),
    "11": Lie(
        "a deadlock by a proof of nothing",
        lambda: bundle_at("deadlock_by_formulas", DEADLOCK),
        retold(nonsense),
    ),
    "12": Lie(
        "the source is of another mission",
        corridor,
        another_source,
        (BUNDLE,),
    ),
    "14": Lie(
        "two steps lead over five regions",
        lambda: bundle_at("in_seconds", LIVE),
        retold(leaps),
        (TRACE,),
    ),
    "15": Lie(
        "a simulated world opens a door",
        gate,
        retold(opened_by_nobody),
    ),
    "16": Lie("a robot that drives is a wall", one_alone, without_the_other, (BUNDLE,)),
    "17": Lie("a word of the forger's own", corridor, retold(perfect)),
    "18": Lie("facts that are marked as notes", corridor, retold(unseen)),
    "19": Lie("a fact that no rule knows", corridor, retold(unknown)),
    "20": Lie("completed, and not yet", corridor, retold(waits("completed"))),
    "21": Lie("others broke an assumption", corridor, retold(waits("assumption_violated"))),
    "22": Lie(
        "robots wait for an operator, and need none",
        corridor,
        retold(waits("operator_needed", cause="deadlock")),
    ),
}

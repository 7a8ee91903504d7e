"""Good traces broken on purpose: rule, change, and tick and robot of the finding."""

from typing import Any

from judge.trace_script import (
    Line,
    Mutation,
    both,
    drop,
    edit,
    find,
    insert_after,
    obstacle,
    scenario,
)

REST, FIRST = {"tick": 8, "robot": "digit"}, {"tick": 1, "robot": "quad"}
RESOLVED: Line = {"type": "resolved", "requested": False, "traversable": None}
OPENED: Line = {**RESOLVED, "obstacle": "door@9", "robot": "digit", "at": 8}
KEPT: Line = {"type": "deadline", "tick": 1, "of": "mission", "due": 5, "verdict": "kept"}
CHARGED: Line = {**FIRST, "type": "service", "active": True, "cause": "battery"}
DEBRIS = obstacle("debris", 14, "clear", [14], ["one"])


def late_moves(kind: str, tick: int) -> Mutation:
    """Let all lines from a tick on be one tick later."""

    def mutate(lines: list[Line]) -> None:
        for line in lines[find(lines, kind, tick=tick) :]:
            line["tick"] += 1
            if line["type"] == "outcome":
                line["ticks"] += 1

    return mutate


def cut_after(kind: str, **where: Any) -> Mutation:
    """Interrupt the run after a line; correct the outcome's counts."""

    def mutate(lines: list[Line]) -> None:
        index = find(lines, kind, **where)
        outcome = lines[-1]
        del lines[index + 1 :]
        tick = lines[-1]["tick"]
        syntheses = sum(line["type"] == "synthesis" for line in lines)
        rounds = {line["robot"]: line["round"] for line in lines if line["type"] == "goal"}
        outcome["rounds"].update(dict.fromkeys(outcome["rounds"], 0) | rounds)
        outcome.update(outcome="interrupted", tick=tick, ticks=tick, syntheses=syntheses)
        lines.append(outcome)

    return mutate


def retell(name: str, *moves: tuple[int, int, int]) -> Mutation:
    """Change moves of a robot: (tick, from, to) for each changed move."""
    edits = [
        edit("move", {"tick": tick, "robot": name}, origin=origin, to=to)
        for tick, origin, to in moves
    ]
    return both(*edits)


Case = tuple[str, *tuple[Mutation, ...]]
"""The broken rule (``no-trace``: it cannot be read), the trace, and tick and robot (``-``: none) of
the first finding; then the changes of the trace."""

CASES: list[Case] = [
    ("no-trace unrequested 0 -", insert_after("resolved", {}, obstacle="gate@9")),
    ("no-trace unrequested 0 -", insert_after("resolved", {}, obstacle="quad")),
    ("header unrealizable 0 -", scenario("robots", "rover", "start", to=7)),
    ("header unrealizable 0 -", scenario("robots", "rover", "start", to=-4)),
    ("header unrealizable 0 -", scenario("robots", "rover", "mobility", to="heading")),
    ("no-trace operator 0 -", scenario("obstacles", 0, "blocks", to=["rover", "ghost"])),
    ("pace nested 4 drone", drop("move", tick=3, robot="drone")),
    ("pace door 3 quad", insert_after("move", {"tick": 3, "robot": "quad"})),
    ("pace untraversable 5 digit", late_moves("move", 4)),
    ("time door 5 digit", edit("goal", {"robot": "digit"}, tick=5)),
    (
        "resolution door 8 digit",
        insert_after("outcome", {}, **OPENED),
    ),
    ("continuity unrequested 2 quad", retell("quad", (2, 8, 8))),
    ("continuity shared_floor 4 two", edit("move", {"tick": 4, "robot": "two"}, origin=8, to=8)),
    ("mobility shared_floor 4 one", retell("one", (4, 15, 21))),
    ("mobility shared_floor 4 one", retell("one", (4, 15, 10))),
    ("mobility door 6 digit", edit("move", {"tick": 6, "robot": "digit"}, result="elsewhere")),
    ("mobility door 6 digit", edit("move", {"tick": 6, "robot": "digit"}, heading="north")),
    ("collision shared_floor 3 one", retell("one", (3, 14, 8), (4, 8, 9))),
    (
        "never-together shared_floor 1 two",
        scenario("never_together", to=[{"robots": ["one", "two"], "regions": [8, 9]}]),
    ),
    ("collision slow_steps 3 flyer", retell("flyer", (3, 9, 8), (4, 8, 8))),
    ("mobility slow_steps 2 slow", edit("move", {"tick": 2, "robot": "slow"}, toward=13)),
    ("unresolved-obstacle shared_floor 2 one", scenario("obstacles", to=[DEBRIS])),
    ("unresolved-obstacle pressed 3 pia", retell("pia", (3, 21, 22)), cut_after("move", tick=3)),
    (
        "unresolved-obstacle lifted 2 left",
        retell("left", (2, 9, 10)),
        cut_after("move", tick=2, robot="left"),
    ),
    ("unresolved-obstacle detour 10 rover", retell("rover", (10, 14, 8), (11, 8, 7))),
    ("own-rules avoiding 3 rover", retell("rover", (2, 13, 14), (3, 14, 8), (4, 8, 9), (5, 9, 10))),
    ("own-rules avoiding 6 rover", retell("rover", (6, 10, 9), (7, 9, 15))),
    (
        "due-changes avoiding 10 rover",
        scenario("inputs", to=[{"name": "alarm", "spans": [[10, 10]]}]),
    ),
    ("resolution unrequested 2 digit", edit("resolved", {}, traversable=True)),
    ("resolution unrequested 2 digit", edit("resolved", {}, at=8)),
    ("resolution unrequested 2 digit", insert_after("resolved", {})),
    ("permanence untraversable 2 -", edit("blocked", {}, robots=["digit", "quad"])),
    ("permanence cycle 1 -", edit("blocked", {}, reason="no_capable_robot")),
    ("permanence detour 1 -", edit("blocked", {}, reason="untraversable")),
    ("permanence untraversable 2 -", edit("blocked", {}, reason="operator")),
    ("end shared_floor 4 -", edit("outcome", {}, rounds={"one": 0, "two": 4})),
    ("goal door 5 quad", edit("goal", {"robot": "quad", "tick": 5}, region=9)),
    (
        "end second_bidder 3 -",
        retell("near", (3, 14, 14)),
        edit("goal", {"tick": 3}, goal=1, region=14),
    ),
    (
        "end unrequested 6 -",
        drop("goal", tick=6),
        edit("outcome", {}, rounds={"digit": 1, "quad": 1}),
    ),
    (
        "end door 4 -",
        drop("pop"),
        drop("synthesis", tick=3),
        drop("synthesis", tick=3),
        retell("quad", (4, 8, 8)),
        cut_after("move", tick=4, robot="quad"),
    ),
    ("end door 8 -", edit("outcome", {}, outcome="unrealizable")),
    ("end door 8 -", edit("outcome", {}, rounds={"quad": 1, "digit": 3})),
    ("end unrealizable 0 -", edit("synthesis", {}, verdict="timeout")),
    ("end door 8 -", edit("outcome", {}, outcome="assumption_violated")),
    ("goal unrequested 6 quad", edit("goal", {"tick": 6}, round=3)),
    ("end shared_floor 4 -", scenario("limits", "ticks", to=9)),
    ("end shared_floor 4 -", scenario("limits", "ticks", to=3)),
    ("negative operator 2 -", edit("outcome", {}, cause="cyclic_requests")),
    ("negative cycle 1 -", edit("outcome", {}, cause="deadlock")),
    ("negative cycle 1 -", edit("outcome", {}, cause="unrealizable")),
    ("negative cycle 1 -", edit("outcome", {}, cause=None)),
    ("mobility door 8 quad", edit("move", {"tick": 8, "robot": "quad"}, heading="west")),
    ("end door 8 -", scenario("until", "rounds", to=None)),
    ("end door 8 -", scenario("until", "rounds", to=2)),
    ("end nested 11 -", scenario("until", "rounds", to=2)),
    ("end door 8 -", edit("outcome", {}, rounds={"digit": 1})),
    ("deadlines door 8 -", edit("outcome", {}, late=["mission"])),
    ("deadlines door 8 -", edit("outcome", {}, outcome="late")),
    ("deadline door 1 -", insert_after("move", FIRST, **KEPT)),
    ("charge door 1 quad", insert_after("move", FIRST, **CHARGED)),
]

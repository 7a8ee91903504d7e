"""Good traces broken on purpose: rule, change, and tick and robot of the finding."""

from typing import Any

from audit.trace_script import (
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
STRANGER: Line = {"type": "late", "robot": "ghost", "event": "sensed", "reason": "it is unknown"}
KEPT: Line = {"type": "deadline", "tick": 1, "of": "mission", "due": 5, "verdict": "kept"}
CHARGED: Line = {**FIRST, "type": "service", "active": True, "cause": "battery"}
DEBRIS = obstacle("debris", 14, "clear", [14], ["one"])


def swap_turns(lines: list[Line]) -> None:
    """Exchange the two turns of tick 1."""
    one, two = find(lines, "move", tick=1), find(lines, "move", tick=1, nth=1)
    lines[one], lines[two] = lines[two], lines[one]


def objectives(kind: str, nth: int, **changed: Line) -> Mutation:
    """Let a push or a pop give other objectives."""

    def mutate(lines: list[Line]) -> None:
        lines[find(lines, kind, nth)]["objectives"].update(changed)

    return mutate


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
"""The broken rule, the trace, tick and robot (``-``: none) of the first finding, and how many there
are if not one; then the changes of the trace."""

CASES: list[Case] = [
    ("names door 8 -", insert_after("move", REST, **STRANGER)),
    ("names unrequested 2 -", insert_after("resolved", {}, obstacle="gate@9")),
    ("names unrequested 2 -", insert_after("resolved", {}, obstacle="quad")),
    ("header unrealizable 0 rover", scenario("robots", "rover", "start", to=7)),
    ("header unrealizable 0 rover", scenario("robots", "rover", "start", to=-4)),
    ("header unrealizable 0 rover", scenario("robots", "rover", "mobility", to="heading")),
    ("header operator 0 ghost", scenario("obstacles", 0, "blocks", to=["rover", "ghost"])),
    ("order shared_floor 1 one 3", swap_turns),
    ("order nested 3 drone", drop("move", tick=3, robot="drone")),
    ("order door 3 quad", insert_after("move", {"tick": 3, "robot": "quad"})),
    ("order untraversable 5 digit", late_moves("move", 4)),
    ("order door 5 digit", edit("goal", {"robot": "digit"}, tick=5)),
    (
        "order door 8 -",
        insert_after("outcome", {}, **OPENED),
    ),
    ("continuity unrequested 2 quad", retell("quad", (2, 8, 8))),
    ("continuity shared_floor 4 two", edit("move", {"tick": 4, "robot": "two"}, origin=8, to=8)),
    ("map shared_floor 4 one", retell("one", (4, 15, 21))),
    ("mobility shared_floor 4 one", retell("one", (4, 15, 10))),
    ("mobility door 6 digit", edit("move", {"tick": 6, "robot": "digit"}, result="elsewhere")),
    ("mobility door 6 digit", edit("move", {"tick": 6, "robot": "digit"}, heading="north")),
    ("collision shared_floor 3 one", retell("one", (3, 14, 8), (4, 8, 9))),
    (
        "never-together shared_floor 1 two",
        scenario("never_together", to=[{"robots": ["one", "two"], "regions": [8, 9]}]),
    ),
    ("collision slow_steps 3 flyer 3", retell("flyer", (3, 9, 8), (4, 8, 8))),
    ("transit slow_steps 2 slow 2", edit("move", {"tick": 2, "robot": "slow"}, toward=13)),
    ("unresolved-obstacle shared_floor 2 one", scenario("obstacles", to=[DEBRIS])),
    ("unresolved-obstacle pressed 3 pia", retell("pia", (3, 21, 22)), cut_after("move", tick=3)),
    (
        "unresolved-obstacle lifted 2 left",
        retell("left", (2, 9, 10)),
        cut_after("move", tick=2, robot="left"),
    ),
    ("helper pressed 2 pia", edit("request", {}, helper=None)),
    ("known-obstacle detour 10 rover", retell("rover", (10, 14, 8), (11, 8, 7))),
    ("always avoiding 3 rover", retell("rover", (2, 13, 14), (3, 14, 8), (4, 8, 9), (5, 9, 10))),
    ("always avoiding 6 rover", retell("rover", (6, 10, 9), (7, 9, 15))),
    (
        "inputs avoiding 10 -",
        scenario("inputs", to=[{"name": "alarm", "spans": [[10, 10]]}]),
    ),
    ("violation operator 2 rover 2", edit("violation", {}, at=8, proposed=10)),
    ("violation operator 2 rover", edit("violation", {}, action="push")),
    ("violation door 2 quad", scenario("obstacles", 0, "blocks", to=[])),
    ("violation door 2 quad", edit("violation", {}, proposed=14)),
    ("backtrack door 2 quad", drop("backtrack")),
    ("backtrack door 2 quad", edit("backtrack", {}, to=7)),
    (
        "backtrack shared_floor 2 one",
        lambda lines: lines.insert(
            find(lines, "move", tick=2), {"type": "backtrack", "tick": 2, "robot": "one", "to": 14}
        ),
    ),
    ("resolution unrequested 2 digit", edit("resolved", {}, requested=True)),
    ("resolution unrequested 2 digit", edit("resolved", {}, traversable=True)),
    ("resolution unrequested 2 digit 2", edit("resolved", {}, at=8)),
    ("resolution unrequested 2 digit", insert_after("resolved", {})),
    (
        "missed-resolution unrequested 2 digit",
        drop("resolved"),
        cut_after("move", tick=2, robot="quad"),
    ),
    ("blocked untraversable 2 quad", drop("blocked")),
    ("blocked untraversable 2 quad", edit("blocked", {}, robots=["digit", "quad"])),
    ("blocked detour 1 rover", edit("blocked", {}, reason="unresolvable")),
    ("blocked cycle 1 quad", edit("blocked", {}, reason="no_capable_robot")),
    ("blocked detour 1 rover", edit("blocked", {}, reason="untraversable")),
    ("blocked untraversable 2 quad", edit("blocked", {}, reason="operator")),
    ("request door 2 quad", edit("request", {}, regions=[9, 10])),
    (
        "request detour 1 rover",
        drop("request"),
        drop("blocked"),
        drop("synthesis", reason="blocked"),
        edit("outcome", {}, syntheses=1),
    ),
    ("request door 2 quad", insert_after("request", {})),
    ("request refused_again 1 cart", edit("request", {}, requester="cart")),
    ("push door 2 quad", *(edit(to, {}, helper="quad") for to in ("push", "pop"))),
    ("request door 2 quad", edit("request", {}, helper="quad", helpers=["digit"])),
    ("request operator 2 rover", drop("request")),
    ("proof operator 2 -", drop("blocked")),
    ("helper detour 1 rover", edit("request", {}, helper="rover")),
    ("order door 7 digit", edit("goal", {"robot": "digit", "tick": 6}, tick=7)),
    ("rounds shared_floor 4 two", edit("outcome", {}, rounds={"one": 0, "two": 4})),
    (
        "synthesis door 2 digit",
        edit("synthesis", {"robot": "digit", "tick": 2}, node=0, objective={"visit": [9, 14]}),
    ),
    ("bids door 2 digit", edit("request", {}, bids={"digit": 1})),
    ("bids door 2 quad", edit("request", {}, bids={"digit": 2, "quad": 3})),
    ("bids second_bidder 1 far", edit("request", {}, bids={"near": 1, "far": 5})),
    (
        "helper second_bidder 1 near",
        drop("synthesis", tick=1, robot="near"),
        edit("outcome", {}, syntheses=5),
    ),
    (
        "pop refused_again 3 cart",
        drop("request", tick=3),
        drop("synthesis", tick=3, verdict="unrealizable"),
        edit("outcome", {}, syntheses=5),
    ),
    ("push door 2 quad", edit("push", {}, depth=2)),
    ("pop door 3 digit", edit("pop", {}, depth=1)),
    ("pop nested 4 scout", edit("pop", {"depth": 1}, requester="drone")),
    (
        "pop door 3 digit",
        objectives("pop", 0, digit={"visit": [9, 13]}),
        edit("synthesis", {"tick": 3, "robot": "digit"}, objective={"visit": [9, 13]}),
        cut_after("move", tick=4, robot="quad"),
        edit("outcome", {}, rounds={"quad": 0, "digit": 0}),
    ),
    ("goal door 5 quad", edit("goal", {"robot": "quad", "tick": 5}, region=9)),
    (
        "goal-order second_bidder 3 near",
        retell("near", (3, 14, 14)),
        edit("goal", {"tick": 3}, goal=1, region=14),
    ),
    (
        "goal-order unrequested 6 quad",
        retell("quad", (6, 14, 14)),
        edit("goal", {"tick": 6}, goal=0, region=14),
    ),
    (
        "out-of-turn door 6 quad",
        retell("quad", (6, 10, 10), (7, 10, 9), (8, 9, 8)),
        drop("goal", tick=8, robot="quad"),
        scenario("limits", "ticks", to=8),
        edit("outcome", {}, outcome="tick_limit", rounds={"quad": 0, "digit": 1}),
    ),
    (
        "missed-goal unrequested 6 quad",
        drop("goal", tick=6),
        edit("outcome", {}, rounds={"digit": 1, "quad": 1}),
    ),
    (
        "missed-goal detour 11 rover",
        drop("goal", tick=11),
        scenario("limits", "ticks", to=11),
        edit("outcome", {}, outcome="tick_limit", rounds={"rover": 0}),
    ),
    ("hold nested 3 drone", retell("drone", (3, 15, 16), (4, 16, 16), (5, 16, 15))),
    (
        "missed-pop door 3 digit",
        drop("pop"),
        drop("synthesis", tick=3),
        drop("synthesis", tick=3),
        retell("quad", (4, 8, 8)),
        cut_after("move", tick=4, robot="quad"),
    ),
    (
        "push door 2 quad",
        edit("push", {}, objectives={"quad": {"visit": [8]}, "digit": {"visit": [9, 13]}}),
        edit("synthesis", {"tick": 2, "robot": "quad"}, objective={"visit": [8]}),
    ),
    (
        "synthesis unrequested 1 quad",
        drop("synthesis", robot="quad"),
        scenario("coordination", to="assignable"),
        edit("outcome", {}, syntheses=1),
    ),
    (
        "synthesis door 3 quad",
        drop("synthesis", reason="resolved", robot="quad"),
        edit("outcome", {}, syntheses=5),
    ),
    ("completed shared_floor 2 - 2", scenario("until", "rounds", to=0)),
    ("outcome door 8 - 2", edit("outcome", {}, outcome="unrealizable")),
    ("rounds door 8 digit", edit("outcome", {}, rounds={"quad": 1, "digit": 3})),
    ("outcome unrealizable 0 -", edit("synthesis", {}, verdict="timeout")),
    ("outcome door 8 -", edit("outcome", {}, outcome="assumption_violated")),
    ("outcome door 8 -", edit("outcome", {}, syntheses=0)),
    ("rounds unrequested 6 quad 2", edit("goal", {"tick": 6}, round=3)),
    (
        "verdicts second_bidder 1 near",
        lambda lines: lines[find(lines, "synthesis", robot="near")].update(
            spec=lines[find(lines, "synthesis", verdict="unrealizable")]["spec"]
        ),
    ),
    ("outcome door 8 -", edit("outcome", {}, ticks=9)),
    ("outcome door 8 -", edit("outcome", {}, syntheses=3)),
    ("outcome shared_floor 4 -", scenario("limits", "ticks", to=9)),
    ("outcome shared_floor 4 one 2", scenario("limits", "ticks", to=3)),
    ("outcome operator 2 -", edit("outcome", {}, cause="cyclic_requests")),
    ("outcome cycle 1 -", edit("outcome", {}, cause="deadlock")),
    ("outcome cycle 1 -", edit("outcome", {}, cause="unrealizable")),
    ("outcome cycle 1 -", edit("outcome", {}, cause=None)),
    ("outcome door 9 -", edit("outcome", {}, tick=9)),
    ("order door 2 quad", insert_after("backtrack", {})),
    ("request detour 1 rover", drop("blocked"), drop("synthesis", reason="blocked")),
    ("request door 2 digit", edit("request", {}, requester="digit")),
    ("goal-order unrequested 3 digit", insert_after("goal", {"robot": "digit"})),
    ("mobility door 8 quad", edit("move", {"tick": 8, "robot": "quad"}, heading="west")),
    ("synthesis door 3 quad", edit("synthesis", {"tick": 3, "robot": "quad"}, reason="request")),
    ("synthesis detour 1 rover", edit("synthesis", {"reason": "blocked"}, reason="resolved")),
    ("inputs door 8 -", insert_after("move", REST, type="inputs", values={})),
    ("completed door 8 -", scenario("until", "rounds", to=None)),
    ("completed door 8 quad 2", scenario("until", "rounds", to=2)),
    ("completed nested 11 rover 3", scenario("until", "rounds", to=2)),
    ("strategy door 4 quad 5", edit("synthesis", {"tick": 3, "robot": "quad"}, verified=False)),
    (
        "strategy shared_floor 1 two 4",
        edit("synthesis", {"robot": "two"}, verdict="timeout", strategy=None),
    ),
    ("synthesis door 0 digit", edit("synthesis", {"robot": "digit"}, strategy=None)),
    ("synthesis door 3 digit", edit("synthesis", {"robot": "digit", "tick": 3}, reason="initial")),
    ("completed door 8 quad", edit("outcome", {}, rounds={"digit": 1})),
    ("deadline door 8 -", edit("outcome", {}, late=["mission"])),
    ("deadline door 8 -", edit("outcome", {}, outcome="late")),
    ("deadline door 1 -", insert_after("move", FIRST, **KEPT)),
    ("charge door 1 quad", insert_after("move", FIRST, **CHARGED)),
]

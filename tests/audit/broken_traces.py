"""Good traces broken on purpose: which rule, by what change, found in which tick, of whom."""

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

REST = {"tick": 8, "robot": "digit"}
DEBRIS = obstacle("debris", 14, "clear", [14], ["one"])


def cached(lines: list[Line]) -> None:
    """Let all strategies come from the cache."""
    for line in lines:
        if line["type"] == "synthesis":
            line["cached"] = True


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
    """Let everything from a tick on be told one tick later."""

    def mutate(lines: list[Line]) -> None:
        for line in lines[find(lines, kind, tick=tick) :]:
            line["tick"] += 1
            if line["type"] == "outcome":
                line["ticks"] += 1

    return mutate


def cut_after(kind: str, **where: Any) -> Mutation:
    """Interrupt the run behind a line; the outcome's counts are put right."""

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
    """Let a robot move otherwise: (tick, from, to) for each of its moves that changes."""
    edits = [
        edit("move", {"tick": tick, "robot": name}, origin=origin, to=to)
        for tick, origin, to in moves
    ]
    return both(*edits)


Case = tuple[str, str, Mutation, int, str | None] | tuple[str, str, Mutation, int, str | None, int]

CASES: list[Case] = [
    # rule, trace, mutation, tick, robot, and how many findings, if not one
    ("names", "door", insert_after("move", REST, robot="ghost"), 8, None),
    ("names", "unrequested", insert_after("resolved", {}, obstacle="gate@9"), 2, None),
    ("names", "unrequested", insert_after("resolved", {}, obstacle="quad"), 2, None),
    ("header", "unrealizable", scenario("robots", "rover", "start", to=7), 0, "rover"),
    ("header", "unrealizable", scenario("robots", "rover", "start", to=-4), 0, "rover"),
    ("header", "unrealizable", scenario("robots", "rover", "mobility", to="sideways"), 0, "rover"),
    ("header", "unrealizable", scenario("robots", "rover", "mobility", to="heading"), 0, "rover"),
    ("header", "unrealizable", scenario("map", "rows", to=4), 0, None),
    ("header", "operator", scenario("obstacles", 0, "blocks", to=["rover", "ghost"]), 0, "ghost"),
    ("order", "shared_floor", swap_turns, 1, "one", 3),
    ("order", "nested", drop("move", tick=3, robot="drone"), 3, "drone"),
    ("order", "door", insert_after("move", {"tick": 3, "robot": "quad"}), 3, "quad"),
    ("order", "untraversable", late_moves("move", 4), 5, "digit"),
    ("order", "door", edit("goal", {"robot": "digit"}, tick=5), 5, "digit"),
    (
        "order",
        "door",
        insert_after(
            "outcome",
            {},
            type="resolved",
            obstacle="door@9",
            robot="digit",
            at=8,
            requested=False,
            traversable=None,
        ),
        8,
        None,
    ),
    ("continuity", "unrequested", retell("quad", (2, 8, 8)), 2, "quad"),
    (
        "continuity",
        "shared_floor",
        edit("move", {"tick": 4, "robot": "two"}, origin=8, to=8),
        4,
        "two",
    ),
    ("map", "shared_floor", retell("one", (4, 15, 21)), 4, "one"),
    ("mobility", "shared_floor", retell("one", (4, 15, 10)), 4, "one"),
    ("mobility", "door", edit("move", {"tick": 6, "robot": "digit"}, heading="north"), 6, "digit"),
    ("collision", "shared_floor", retell("one", (3, 14, 8), (4, 8, 9)), 3, "one"),
    (
        "never-together",
        "shared_floor",
        scenario("never_together", to=[{"robots": ["one", "two"], "regions": [8, 9]}]),
        1,
        "two",
    ),
    ("swept", "door", scenario("obstacles", 0, "sweeps", to=[8]), 3, "digit", 2),
    ("collision", "slow_steps", retell("flyer", (3, 9, 8), (4, 8, 8)), 3, "flyer", 3),
    ("transit", "slow_steps", edit("move", {"tick": 2, "robot": "slow"}, toward=13), 2, "slow", 2),
    ("belief", "beliefs", edit("belief", {"tick": 2}, regions=[9]), 2, "watcher", 2),
    ("belief", "beliefs", edit("belief", {"tick": 1}, regions=[9, 10]), 1, "watcher"),
    ("belief", "beliefs", edit("belief", {"tick": 2}, regions=[10, 15, 16, 17]), 2, "watcher"),
    ("belief", "beliefs", edit("belief", {"tick": 2}, regions=[10, 15]), 2, "watcher", 2),
    ("belief", "beliefs", drop("belief", tick=2), 2, "watcher", 2),
    ("missed-belief", "beliefs", drop("belief", tick=4), 4, "watcher"),
    ("unresolved-obstacle", "shared_floor", scenario("obstacles", to=[DEBRIS]), 2, "one"),
    (
        "unresolved-obstacle",
        "pressed",
        both(retell("pia", (3, 21, 22)), cut_after("move", tick=3)),
        3,
        "pia",
    ),
    (
        "unresolved-obstacle",
        "lifted",
        both(retell("left", (2, 9, 10)), cut_after("move", tick=2, robot="left")),
        2,
        "left",
    ),
    ("helper", "pressed", edit("request", {}, helper=None), 2, "pia"),
    ("known-obstacle", "detour", retell("rover", (10, 14, 8), (11, 8, 7)), 10, "rover"),
    (
        "always",
        "avoiding",
        retell("rover", (2, 13, 14), (3, 14, 8), (4, 8, 9), (5, 9, 10)),
        3,
        "rover",
    ),
    ("always", "avoiding", retell("rover", (6, 10, 9), (7, 9, 15)), 6, "rover"),
    (
        "inputs",
        "avoiding",
        scenario("inputs", to=[{"name": "alarm", "spans": [[10, 10]], "probability": 0}]),
        10,
        None,
    ),
    ("violation", "operator", edit("violation", {}, at=8, proposed=10), 2, "rover", 2),
    ("violation", "operator", edit("violation", {}, action="push"), 2, "rover"),
    ("violation", "door", scenario("obstacles", 0, "blocks", to=[]), 2, "quad"),
    ("backtrack", "door", drop("backtrack"), 2, "quad"),
    ("backtrack", "door", edit("backtrack", {}, to=7), 2, "quad"),
    (
        "backtrack",
        "shared_floor",
        lambda lines: lines.insert(
            find(lines, "move", tick=2), {"type": "backtrack", "tick": 2, "robot": "one", "to": 14}
        ),
        2,
        "one",
    ),
    ("resolution", "unrequested", edit("resolved", {}, requested=True), 2, "digit"),
    ("resolution", "unrequested", edit("resolved", {}, traversable=True), 2, "digit"),
    ("resolution", "unrequested", edit("resolved", {}, at=8), 2, "digit", 2),
    ("resolution", "unrequested", insert_after("resolved", {}), 2, "digit"),
    (
        "missed-resolution",
        "unrequested",
        both(drop("resolved"), cut_after("move", tick=2, robot="quad")),
        2,
        "digit",
    ),
    ("blocked", "untraversable", drop("blocked"), 2, "quad"),
    ("blocked", "untraversable", edit("blocked", {}, robots=["digit", "quad"]), 2, "quad"),
    ("blocked", "detour", edit("blocked", {}, reason="unresolvable"), 1, "rover"),
    ("blocked", "cycle", edit("blocked", {}, reason="no_capable_robot"), 1, "quad"),
    ("blocked", "detour", edit("blocked", {}, reason="untraversable"), 1, "rover"),
    ("request", "door", edit("request", {}, regions=[9, 10]), 2, "quad"),
    (
        "request",
        "detour",
        both(
            drop("request"),
            drop("blocked"),
            drop("synthesis", reason="blocked"),
            edit("outcome", {}, syntheses=1),
        ),
        1,
        "rover",
    ),
    ("request", "door", insert_after("request", {}), 2, "quad"),
    ("push", "door", both(*(edit(to, {}, helper="quad") for to in ("push", "pop"))), 2, "quad"),
    ("request", "door", edit("request", {}, helper="quad", helpers=["digit"]), 2, "quad"),
    ("request", "operator", drop("request"), 2, "rover"),
    ("proof", "operator", drop("blocked"), 2, None),
    ("helper", "detour", edit("request", {}, helper="rover"), 1, "rover"),
    ("belief", "beliefs", insert_after("belief", {"tick": 2}), 2, "watcher"),
    (
        "missed-belief",
        "beliefs",
        both(
            scenario("robots", "flyer", "objective", to={"visit": [9]}),
            edit("synthesis", {"robot": "flyer"}, objective={"visit": [9]}),
            edit("belief", {"tick": 4}, seen=False),
        ),
        4,
        "watcher",
    ),
    ("order", "door", edit("goal", {"robot": "digit", "tick": 6}, tick=7), 7, "digit"),
    ("rounds", "shared_floor", edit("outcome", {}, rounds={"one": 0, "two": 4}), 4, "two"),
    (
        "synthesis",
        "door",
        edit("synthesis", {"robot": "digit", "tick": 2}, node=0, objective={"visit": [9, 14]}),
        2,
        "digit",
    ),
    ("bids", "door", edit("request", {}, bids={"digit": 1}), 2, "digit"),
    ("bids", "door", edit("request", {}, bids={"digit": 2, "quad": 3}), 2, "quad"),
    ("bids", "nested", edit("request", {}, bids={"drone": 3}), 1, "scout"),
    (
        "helper",
        "second_bidder",
        both(drop("synthesis", tick=1, robot="near"), edit("outcome", {}, syntheses=5)),
        1,
        "near",
    ),
    ("push", "door", edit("push", {}, depth=2), 2, "quad"),
    ("pop", "door", edit("pop", {}, depth=1), 3, "digit"),
    ("pop", "nested", edit("pop", {"depth": 1}, requester="drone"), 4, "scout"),
    (
        "pop",
        "door",
        both(
            objectives("pop", 0, digit={"visit": [9, 13]}),
            edit("synthesis", {"tick": 3, "robot": "digit"}, objective={"visit": [9, 13]}),
            cut_after("move", tick=4, robot="quad"),
            edit("outcome", {}, rounds={"quad": 0, "digit": 0}),
        ),
        3,
        "digit",
    ),
    ("goal", "door", edit("goal", {"robot": "quad", "tick": 5}, region=9), 5, "quad"),
    (
        "goal-order",
        "second_bidder",
        both(retell("near", (3, 14, 14)), edit("goal", {"tick": 3}, goal=1, region=14)),
        3,
        "near",
    ),
    (
        "goal-order",
        "unrequested",
        both(retell("quad", (6, 14, 14)), edit("goal", {"tick": 6}, goal=0, region=14)),
        6,
        "quad",
    ),
    (
        "out-of-turn",
        "door",
        both(
            retell("quad", (6, 10, 10), (7, 10, 9), (8, 9, 8)),
            drop("goal", tick=8, robot="quad"),
            scenario("limits", "ticks", to=8),
            edit("outcome", {}, outcome="tick_limit", rounds={"quad": 0, "digit": 1}),
        ),
        6,
        "quad",
    ),
    (
        "missed-goal",
        "unrequested",
        both(drop("goal", tick=6), edit("outcome", {}, rounds={"digit": 1, "quad": 1})),
        6,
        "quad",
    ),
    (
        "missed-goal",
        "detour",
        both(
            drop("goal", tick=11),
            scenario("limits", "ticks", to=11),
            edit("outcome", {}, outcome="tick_limit", rounds={"rover": 0}),
        ),
        11,
        "rover",
    ),
    ("hold", "nested", retell("drone", (3, 15, 16), (4, 16, 16), (5, 16, 16)), 3, "drone"),
    (
        "missed-pop",
        "door",
        both(
            drop("pop"),
            drop("synthesis", tick=3),
            drop("synthesis", tick=3),
            retell("quad", (4, 8, 8)),
            cut_after("move", tick=4, robot="quad"),
        ),
        3,
        "digit",
    ),
    (
        "push",
        "door",
        both(
            edit("push", {}, objectives={"quad": {"visit": [8]}, "digit": {"visit": [9, 13]}}),
            edit("synthesis", {"tick": 2, "robot": "quad"}, objective={"visit": [8]}),
        ),
        2,
        "quad",
    ),
    (
        "synthesis",
        "unrequested",
        both(
            drop("synthesis", robot="quad"),
            scenario("coordination", to="assignable"),
            edit("outcome", {}, syntheses=1),
        ),
        1,
        "quad",
    ),
    (
        "synthesis",
        "door",
        both(drop("synthesis", reason="resolved", robot="quad"), edit("outcome", {}, syntheses=5)),
        3,
        "quad",
    ),
    ("completed", "shared_floor", scenario("until", "rounds", to=0), 2, None, 2),
    ("outcome", "door", edit("outcome", {}, outcome="unrealizable"), 8, None, 2),
    ("rounds", "door", edit("outcome", {}, rounds={"quad": 1, "digit": 3}), 8, "digit"),
    ("outcome", "unrealizable", edit("synthesis", {}, verdict="timeout"), 0, None),
    ("outcome", "door", edit("outcome", {}, outcome="assumption_violated"), 8, None),
    ("outcome", "door", edit("outcome", {}, syntheses=0), 8, None),
    ("outcome", "door", both(cached, edit("outcome", {}, syntheses=0)), 8, None),
    ("rounds", "unrequested", edit("goal", {"tick": 6}, round=3), 6, "quad", 2),
    (
        "verdicts",
        "second_bidder",
        lambda lines: lines[find(lines, "synthesis", robot="near")].update(
            spec=lines[find(lines, "synthesis", verdict="unrealizable")]["spec"]
        ),
        1,
        "near",
    ),
    ("outcome", "door", edit("outcome", {}, ticks=9), 8, None),
    ("outcome", "door", edit("outcome", {}, syntheses=3), 8, None),
    ("outcome", "shared_floor", scenario("limits", "ticks", to=9), 4, None),
    ("outcome", "shared_floor", scenario("limits", "ticks", to=3), 4, "one", 2),
    ("outcome", "operator", edit("outcome", {}, cause="cyclic_requests"), 2, None),
    ("outcome", "cycle", edit("outcome", {}, cause="deadlock"), 1, None),
    ("outcome", "cycle", edit("outcome", {}, cause="unrealizable"), 1, None),
    ("outcome", "cycle", edit("outcome", {}, cause=None), 1, None),
    ("outcome", "door", edit("outcome", {}, tick=9), 9, None),
    ("order", "door", insert_after("backtrack", {}), 2, "quad"),
    ("request", "detour", both(drop("blocked"), drop("synthesis", reason="blocked")), 1, "rover"),
    ("request", "door", edit("request", {}, requester="digit"), 2, "digit"),
    ("goal-order", "unrequested", insert_after("goal", {"robot": "digit"}), 3, "digit"),
    ("mobility", "door", edit("move", {"tick": 8, "robot": "quad"}, heading="west"), 8, "quad"),
    (
        "synthesis",
        "door",
        edit("synthesis", {"tick": 3, "robot": "quad"}, reason="request"),
        3,
        "quad",
    ),
    (
        "synthesis",
        "detour",
        edit("synthesis", {"reason": "blocked"}, reason="resolved"),
        1,
        "rover",
    ),
    ("completed", "door", scenario("until", "rounds", to=2), 8, "quad", 2),
    ("completed", "nested", scenario("until", "rounds", to=2), 11, "rover", 3),
    (
        "strategy",
        "door",
        edit("synthesis", {"tick": 3, "robot": "quad"}, verified=False),
        4,
        "quad",
        5,
    ),
    (
        "strategy",
        "shared_floor",
        edit("synthesis", {"robot": "two"}, verdict="timeout", strategy=None),
        1,
        "two",
        4,
    ),
    ("synthesis", "door", edit("synthesis", {"robot": "digit"}, strategy=None), 0, "digit"),
    (
        "synthesis",
        "door",
        edit("synthesis", {"robot": "digit", "tick": 3}, reason="initial"),
        3,
        "digit",
    ),
    (
        "deadline",
        "door",
        insert_after(
            "move",
            {"tick": 1, "robot": "quad"},
            type="deadline",
            tick=1,
            of="mission",
            due=5,
            verdict="kept",
        ),
        1,
        None,
    ),
    (
        "charge",
        "door",
        insert_after(
            "move",
            {"tick": 1, "robot": "quad"},
            type="service",
            tick=1,
            robot="quad",
            active=True,
            cause="battery",
        ),
        1,
        "quad",
    ),
]

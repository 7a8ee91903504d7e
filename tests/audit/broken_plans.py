"""The traces of ``good_plans`` broken on purpose, as in ``broken_traces``."""

import copy
from typing import Any

from audit.broken_traces import RESOLVED, Case, cut_after
from audit.trace_script import Line, Mutation, both, drop, edit, find, insert_after, scenario


def in_plan(robot: str, index: int, *place: Any) -> Mutation:
    """Change one place of a robot in the first plan."""

    def mutate(lines: list[Line]) -> None:
        lines[find(lines, "plan")]["robots"][robot][index] = list(place)

    return mutate


def before_any_step(*mutations: Mutation) -> Mutation:
    """Break a plan, and interrupt the run before a robot follows it."""

    def mutate(lines: list[Line]) -> None:
        both(*mutations)(lines)
        outcome = lines[-1]
        del lines[find(lines, "plan") + 1 :]
        tick = lines[-1]["tick"]
        syntheses = sum(line["type"] == "synthesis" for line in lines)
        rounds = dict.fromkeys(outcome["rounds"], 0)
        outcome.update(
            outcome="interrupted", tick=tick, ticks=tick - 1, syntheses=syntheses, rounds=rounds
        )
        lines.append(outcome)

    return mutate


def fall_on_the_cart(lines: list[Line]) -> None:
    """Let the debris appear before the cart has left."""
    line = lines.pop(find(lines, "appeared"))
    lines.insert(find(lines, "move", tick=3), line)


def list_twice(lines: list[Line]) -> None:
    """Let the debris reappear, and then block no robot."""
    obstacles = lines[0]["scenario"]["obstacles"]
    obstacles.append(obstacles[0] | {"blocks": []})


def in_proof(*path: Any, to: Any) -> Mutation:
    """Change something in the proof of the outcome."""

    def mutate(lines: list[Line]) -> None:
        inner: Any = lines[-1]["proof"]
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = copy.deepcopy(to)

    return mutate


def told(robot: str, objective: Any) -> Mutation:
    """Assign another objective to a robot after the first need is fulfilled."""
    return insert_after("met", {"need": 0}, type="told", robot=robot, objective=objective)


def end_before_it_is_back(lines: list[Line]) -> None:
    """Complete the run while a robot that holds is off its target."""
    outcome = lines.pop()
    del lines[find(lines, "move", tick=4) :]
    lines.append(outcome | {"tick": 3, "ticks": 3, "rounds": {"one": 1, "two": 1}})


BY_SIGNALS = scenario("coordination", to="assignable")
BACK = told("right", {"visit": [12]})

NOT_OUT = scenario("changes", 1, "active", to=True)
EARLY = insert_after("met", {"need": 0}, **RESOLVED, obstacle="beam@10", robot="cart", at=9)

CASES_OF_PLANS: list[Case] = [
    ("plan planned 2 two", edit("plan", {}, orders=[["two", 1, "one", 3]])),
    ("plan planned 2 two", before_any_step(edit("plan", {}, orders=[["two", 9, "one", 3]]))),
    (
        "plan planned 2 -",
        before_any_step(edit("plan", {}, orders=[["two", 1, "one", 1], ["one", 1, "two", 1]])),
    ),
    ("plan planned 2 one 2", before_any_step(in_plan("one", 2, 15, None))),
    ("plan planned 2 one", before_any_step(in_plan("one", 3, 3, None))),
    ("plan met_on_the_way 1 two", before_any_step(in_plan("two", 0, 15, None))),
    ("follows-plan planned 2 -", insert_after("plan", {})),
    ("follows-plan planned 7 -", edit("plan_end", {}, reason="violation")),
    ("follows-plan planned 7 -", drop("plan_end")),
    ("follows-plan met_on_the_way 2 one", edit("plan_end", {}, reason="reached")),
    ("follows-plan planned 2 one 12", drop("plan")),
    (
        "follows-plan planned 2 one",
        edit("plan", {}, orders=[["two", 1, "one", 1], ["one", 1, "two", 5]]),
    ),
    ("header come_and_gone 0 -", list_twice),
    ("appeared come_and_gone 3 -", scenario("obstacles", 0, "from", to=4)),
    ("appeared come_and_gone 3 cart", fall_on_the_cart),
    ("appeared come_and_gone 4 -", both(drop("appeared"), drop("gone"))),
    ("gone come_and_gone 5 -", drop("gone")),
    ("ordered come_and_gone 3 -", scenario("obstacles", 0, "ordered", to=True), fall_on_the_cart),
    ("gone come_and_gone 5 -", scenario("obstacles", 0, "until", to=9)),
    ("gone come_and_gone 5 -", insert_after("gone", {})),
    ("gone come_and_gone 5 -", scenario("obstacles", 0, "until", to=None)),
    ("changes told 2 cart 2", scenario("changes", 0, "objective", to={"visit": [9]})),
    ("changes told 4 cart 2", scenario("changes", 2, "at", to=4)),
    ("changes told 2 cart", edit("objective", {}, cause="user")),
    ("service told 5 cart 2", drop("service", active=True), scenario("changes", 2, "at", to=9)),
    ("changes told 2 cart", insert_after("objective", {})),
    ("service told 3 cart 2", edit("service", {}, active=True), NOT_OUT),
    ("resolution lifted 1 cart 2", EARLY, cut_after("resolved")),
    (
        "missed-resolution lifted 2 right",
        drop("met", need=1),
        drop("resolved"),
        cut_after("move", tick=3, robot="cart"),
    ),
    ("told lifted 1 cart", told("cart", {"visit": [8]})),
    ("told lifted 1 right", BY_SIGNALS, BACK, told("right", {"visit": [9]})),
    ("order lifted 2 cart 2", edit("met", {"need": 0}, tick=2)),
    ("need lifted 1 cart", drop("met", need=0)),
    ("need lifted 1 cart 2", edit("met", {"need": 0}, need=1)),
    ("need lifted 1 cart", edit("met", {"need": 0}, action="lift")),
    ("need lifted 1 cart", edit("met", {"need": 0}, at=8)),
    ("need lifted 2 right", edit("met", {"need": 1}, robots=["right", "cart"])),
    ("need lifted 2 right", insert_after("met", {"need": 1})),
    ("proof given_up 2 -", edit("outcome", {}, proof=None)),
    ("proof given_up 2 -", in_proof("robots", "digit", "live", to=False)),
    ("proof given_up 2 -", in_proof("robots", "drone", "poses", to=[[9, None]])),
    ("completed parked 3 one", end_before_it_is_back),
    ("proof no_room 1 -", in_proof("robots", to=["one"])),
    ("proof no_room 1 -", in_proof("robots", to=[])),
    ("proof no_room 1 -", in_proof("robots", to=["one", "three"])),
    ("proof stuck 1 -", in_proof("states", to=9)),
    ("proof stuck 1 -", in_proof("start", "two", to=[12, None])),
    ("proof stuck 1 -", in_proof("robots", to=["one"]), in_proof("states", to=5)),
]

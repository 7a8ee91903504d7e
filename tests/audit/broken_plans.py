"""The traces of ``good_plans`` broken on purpose, as in ``broken_traces``."""

import copy
from typing import Any

from audit.broken_traces import Case, cut_after
from audit.trace_script import Line, Mutation, both, drop, edit, find, insert_after, scenario


def in_plan(robot: str, index: int, *place: Any) -> Mutation:
    """Change one place of a robot in the first plan."""

    def mutate(lines: list[Line]) -> None:
        lines[find(lines, "plan")]["robots"][robot][index] = list(place)

    return mutate


def before_any_step(*mutations: Mutation) -> Mutation:
    """Break a plan, and interrupt the run before anybody follows it."""

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
    """Let the debris appear a tick earlier, on the cart."""
    lines[0]["scenario"]["obstacles"][0]["from"] = 2
    line = lines.pop(find(lines, "appeared"))
    lines.insert(find(lines, "move", tick=2) + 1, line | {"tick": 2})


def list_twice(lines: list[Line]) -> None:
    """Let the debris reappear, and block nobody then."""
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
    """Let a robot be told something else after the first need is met."""
    return insert_after("met", {"need": 0}, type="told", robot=robot, objective=objective)


BY_SIGNALS = scenario("coordination", to="assignable")
BACK = told("right", {"visit": [12]})

NOT_OUT = scenario("changes", 1, "active", to=True)
EARLY = insert_after(
    "met",
    {"need": 0},
    type="resolved",
    obstacle="beam@10",
    robot="cart",
    at=9,
    requested=False,
    traversable=None,
)

CASES_OF_PLANS: list[Case] = [
    ("plan", "planned", edit("plan", {}, orders=[["two", 1, "one", 3]]), 2, "two"),
    ("plan", "planned", before_any_step(edit("plan", {}, orders=[["two", 9, "one", 3]])), 2, "two"),
    (
        "plan",
        "planned",
        before_any_step(edit("plan", {}, orders=[["two", 1, "one", 1], ["one", 1, "two", 1]])),
        2,
        None,
    ),
    ("plan", "planned", before_any_step(in_plan("one", 2, 15, None)), 2, "one", 2),
    ("plan", "planned", before_any_step(in_plan("one", 3, 3, None)), 2, "one"),
    ("plan", "met_on_the_way", before_any_step(in_plan("two", 0, 15, None)), 1, "two"),
    ("follows-plan", "planned", insert_after("plan", {}), 2, None),
    ("follows-plan", "planned", edit("plan_end", {}, reason="violation"), 7, None),
    ("follows-plan", "met_on_the_way", edit("plan_end", {}, reason="reached"), 2, "one"),
    ("follows-plan", "planned", drop("plan"), 2, "one", 12),
    (
        "follows-plan",
        "planned",
        edit("plan", {}, orders=[["two", 1, "one", 1], ["one", 1, "two", 5]]),
        2,
        "one",
    ),
    ("header", "come_and_gone", list_twice, 0, None),
    ("appeared", "come_and_gone", scenario("obstacles", 0, "from", to=4), 3, None),
    ("appeared", "come_and_gone", fall_on_the_cart, 2, "cart"),
    ("ordered", "come_and_gone", scenario("obstacles", 0, "ordered", to=True), 3, None),
    ("gone", "come_and_gone", scenario("obstacles", 0, "until", to=9), 5, None),
    ("gone", "come_and_gone", insert_after("gone", {}), 5, None),
    ("changes", "told", scenario("changes", 0, "objective", to={"visit": [9]}), 2, "cart", 2),
    ("changes", "told", scenario("changes", 2, "at", to=4), 5, "cart"),
    ("changes", "told", edit("objective", {}, cause="user"), 2, "cart"),
    ("service", "told", drop("service", active=True), 5, "cart", 2),
    ("service", "told", both(edit("service", {}, active=True), NOT_OUT), 3, "cart", 2),
    ("resolution", "lifted", both(EARLY, cut_after("resolved")), 1, "cart", 2),
    (
        "missed-resolution",
        "lifted",
        both(drop("met", need=1), drop("resolved"), cut_after("move", tick=3, robot="cart")),
        2,
        "right",
    ),
    ("told", "lifted", told("cart", {"visit": [8]}), 1, "cart"),
    ("told", "lifted", both(BY_SIGNALS, BACK, told("right", {"visit": [9]})), 1, "right"),
    ("order", "lifted", edit("met", {"need": 0}, tick=2), 2, "cart", 2),
    ("need", "lifted", drop("met", need=0), 1, "cart"),
    ("need", "lifted", edit("met", {"need": 0}, need=1), 1, "cart", 2),
    ("need", "lifted", edit("met", {"need": 0}, action="lift"), 1, "cart"),
    ("need", "lifted", edit("met", {"need": 0}, at=8), 1, "cart"),
    ("need", "lifted", edit("met", {"need": 1}, robots=["right", "cart"]), 2, "right"),
    ("need", "lifted", insert_after("met", {"need": 1}), 2, "right"),
    ("proof", "given_up", edit("outcome", {}, proof=None), 2, None),
    ("proof", "given_up", in_proof("robots", "digit", "live", to=False), 2, None),
    ("proof", "given_up", in_proof("robots", "drone", "poses", to=[[9, None]]), 2, None),
    ("proof", "stuck", in_proof("states", to=9), 1, None),
    ("proof", "stuck", in_proof("start", "two", to=[12, None]), 1, None),
    ("proof", "stuck", both(in_proof("robots", to=["one"]), in_proof("states", to=5)), 1, None),
]

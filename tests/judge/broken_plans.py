"""The traces of ``good_plans`` broken on purpose, as in ``broken_traces``."""

import copy
from typing import Any

from judge.broken_traces import RESOLVED, Case, cut_after
from judge.trace_script import Line, Mutation, both, drop, edit, find, insert_after, scenario


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


def end_before_it_is_back(lines: list[Line]) -> None:
    """Complete the run while a robot that holds is off its target."""
    outcome = lines.pop()
    del lines[find(lines, "move", tick=4) :]
    lines.append(outcome | {"tick": 3, "ticks": 3, "rounds": {"one": 1, "two": 1}})


EARLY = insert_after("met", {"need": 0}, **RESOLVED, obstacle="beam@10", robot="cart", at=9)

CASES_OF_PLANS: list[Case] = [
    ("header come_and_gone 0 -", list_twice),
    ("timetable come_and_gone 3 -", scenario("obstacles", 0, "from", to=4)),
    ("timetable come_and_gone 3 -", fall_on_the_cart),
    ("due-changes come_and_gone 4 cart", both(drop("appeared"), drop("gone"))),
    (
        "unresolved-obstacle come_and_gone 3 cart",
        scenario("obstacles", 0, "ordered", to=True),
        fall_on_the_cart,
    ),
    ("timetable come_and_gone 5 -", scenario("obstacles", 0, "until", to=9)),
    ("timetable come_and_gone 5 -", insert_after("gone", {})),
    ("timetable come_and_gone 5 -", scenario("obstacles", 0, "until", to=None)),
    ("changes told 2 cart", scenario("changes", 0, "objective", to={"visit": [9]})),
    ("due-changes told 4 cart", scenario("changes", 2, "at", to=4)),
    ("due-changes told 2 cart", edit("objective", {}, cause="user")),
    ("service told 5 cart", drop("service", active=True), scenario("changes", 2, "at", to=9)),
    ("changes told 2 cart", insert_after("objective", {})),
    ("resolution lifted 1 cart", EARLY, cut_after("resolved")),
    ("time lifted 1 left", edit("met", {"need": 0}, tick=2)),
    ("resolution lifted 2 right", drop("met", need=0)),
    ("resolution lifted 1 cart", edit("met", {"need": 0}, need=1)),
    ("resolution lifted 1 cart", edit("met", {"need": 0}, action="lift")),
    ("resolution lifted 1 cart", edit("met", {"need": 0}, at=8)),
    ("resolution lifted 2 right", edit("met", {"need": 1}, robots=["right", "cart"])),
    ("resolution lifted 2 right", insert_after("met", {"need": 1})),
    ("negative given_up 2 -", edit("outcome", {}, proof=None)),
    ("negative given_up 2 -", in_proof("robots", "digit", "live", to=False)),
    ("negative given_up 2 -", in_proof("robots", "drone", "poses", to=[[9, None]])),
    ("end parked 3 -", end_before_it_is_back),
    ("negative no_room 1 -", in_proof("robots", to=["one"])),
    ("negative no_room 1 -", in_proof("robots", to=[])),
    ("negative no_room 1 -", in_proof("robots", to=["one", "three"])),
    ("negative stuck 1 -", in_proof("states", to=9)),
    ("negative stuck 1 -", in_proof("start", "two", to=[12, None])),
    ("negative stuck 1 -", in_proof("robots", to=["one"]), in_proof("states", to=5)),
]

"""Traces of runs in time, broken on purpose."""

from judge.broken_traces import Case, cut_after
from judge.trace_script import Line, drop, edit, find


def second_resolution(lines: list[Line]) -> None:
    """The door is opened twice."""
    at = find(lines, "resolved")
    lines[at + 1 : at + 1] = [{**lines[at], "requested": False}]


def all_earlier(lines: list[Line]) -> None:
    """The second robot enters a region of the lost one."""
    b = {"robot": "b", "command": 2}
    edit("depart", b, to=9)(lines)
    edit("arrive", {"robot": "a", "result": "lost"}, regions=[7, 8, 9])(lines)


def resolved_later(lines: list[Line]) -> None:
    """The robot has departed a second before the action ends."""
    at = find(lines, "acted")
    for line in lines[at:]:
        line["tick"] += 1
        line["t"] += 1.0
    lines[-1]["ticks"] += 1


ACTING = ("act", "acted", "resolved")
CASES_OF_LIVE: list[Case] = [
    ("time delayed 4 a", edit("arrive", {"robot": "a", "command": 1}, t=0.5)),
    ("time delayed 6 b", edit("goal", {"robot": "b", "goal": 1}, t=None)),
    ("collision lost 2 b", all_earlier),
    ("mobility lost 2 a", edit("arrive", {"result": "lost"}, regions=[])),
    ("continuity delayed 9 a", drop("arrive", nth=3)),
    ("continuity delayed 5 a", edit("depart", {"robot": "a", "command": 4}, **{"from": 7})),
    ("continuity opened 11 quad", edit("act", {}, robots=["quad"]), drop("hold", why="acting")),
    ("in-time entered 3 b", resolved_later),
    (
        "unresolved-obstacle resolved_before_pop 19 digit",
        edit("depart", {"robot": "digit", "command": 10}, to=10),
        cut_after("depart", command=10),
    ),
    ("negative waits 2 -", edit("waiting", {}, cause="deadlock")),
    ("negative waits 2 -", edit("waiting", {}, proof=None)),
    ("unresolved-obstacle simulated 5 a", *map(drop, ACTING), drop("synthesis", reason="resolved")),
    # it did not fail
    ("resolution opened 8 digit", second_resolution),
]

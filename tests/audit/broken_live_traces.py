"""Traces of runs in time, broken on purpose."""

from audit.broken_traces import Case, cut_after
from audit.trace_script import Line, drop, edit, find, insert_after


def second_resolution(lines: list[Line]) -> None:
    """The door is opened twice."""
    at = find(lines, "resolved")
    lines[at + 1 : at + 1] = [{**lines[at], "requested": False}]


def all_earlier(lines: list[Line]) -> None:
    """The second robot enters a region of the lost one."""
    b = {"robot": "b", "command": 2}
    edit("depart", b, to=9)(lines)
    edit("arrive", {"robot": "a", "result": "lost"}, regions=[7, 8, 9])(lines)


def passes_again(lines: list[Line]) -> None:
    """The other robot has a region ahead that is entered."""
    lines[find(lines, "plan")]["robots"]["b"] += [[15, None], [14, None]]
    edit("plan_end", {}, reason="changed")(lines)


def resolved_later(lines: list[Line]) -> None:
    """The robot has departed a second before the action ends."""
    at = find(lines, "acted")
    for line in lines[at:]:
        line["tick"] += 1
        line["t"] += 1.0
    lines[-1]["ticks"] += 1


ACTING = ("act", "acted", "resolved")
ACTS: Line = {"type": "act", "robot": "a", "command": 9, "robots": ["a"], "obstacles": [], "t": 4.0}
A_BACKS_UP: Line = {"type": "backtrack", "robot": "a", "to": 7}
A_HOLDS: Line = {"type": "hold", "robot": "a", "why": "strategy", "t": 0.0}
B_HOLDS: Line = {"robot": "b", "why": "strategy"}
CASES_OF_LIVE: list[Case] = [
    ("clock delayed 4 -", edit("arrive", {"robot": "a", "command": 1}, t=0.5)),
    ("clock delayed 6 -", edit("goal", {"robot": "b", "goal": 1}, t=None)),
    ("collision lost 2 b 5", all_earlier),
    ("command delayed 2 b", edit("arrive", {"robot": "b"}, command=9)),
    ("command lost 2 a", edit("arrive", {"result": "lost"}, regions=[])),
    ("command delayed 9 a", drop("arrive", nth=3)),
    ("command delayed 5 a 2", edit("depart", {"robot": "a", "command": 4}, command=1)),
    ("command opened 8 digit", edit("acted", {"command": 4}, results={})),
    ("command opened 8 digit", edit("acted", {"command": 4}, barred=["door@9"])),
    ("command delayed 5 a", edit("depart", {"robot": "a", "command": 4}, **{"from": 7})),
    ("command opened 8 digit", edit("acted", {"command": 4}, command=9)),
    ("act opened 5 digit", edit("act", {}, obstacles=["gate@1"])),
    ("holds delayed 1 a", insert_after("depart", {"command": 1}, **A_HOLDS)),
    ("command delayed 10 a", edit("arrive", {"result": "elsewhere"}, result="blocked")),
    ("act opened 5 digit 2", edit("act", {}, robots=["quad"]), drop("hold", why="acting")),
    ("holds delayed 7 b", insert_after("hold", B_HOLDS)),
    ("holds delayed 7 b", edit("hold", B_HOLDS, why="operator")),
    ("holds lost 2 a", edit("hold", {"robot": "a"}, why="acting")),
    ("backtrack lost_around 2 a", drop("backtrack")),
    ("order lost_around 2 a 2", insert_after("backtrack", A_BACKS_UP)),
    ("unresolved-obstacle entered 2 a", resolved_later),
    (
        "way-back resolved_before_pop 19 digit",
        edit("depart", {"robot": "digit", "command": 10}, to=10),
        cut_after("depart", command=10),
    ),
    ("late opened 10 -", edit("late", {}, at=4.5)),
    ("late opened 10 -", edit("late", {}, reason="")),
    ("waiting lost 4 -", edit("waiting", {}, outcome="completed")),
    ("waiting lost 4 -", edit("waiting", {}, outcome="time_limit")),
    ("waiting lost 7 -", drop("operator", intervention="put_back")),
    ("waiting waits 3 -", drop("operator")),
    ("waiting waits 2 -", insert_after("waiting", {})),
    ("outcome waits 2 -", edit("waiting", {}, cause="deadlock")),
    ("outcome simulated 6 -", edit("outcome", {}, ticks=7)),
    ("outcome simulated 6 -", edit("outcome", {}, makespan=99.0)),
    ("outcome simulated 6 -", edit("outcome", {}, busy={"a": 99.0})),
    ("outcome simulated 6 -", edit("outcome", {}, waiting={"a": 99.0})),
    ("proof waits 2 -", edit("waiting", {}, proof=None)),
    ("outcome simulated 6 -", insert_after("goal", {}, **ACTS)),
    ("missed-resolution simulated 5 a", *map(drop, ACTING), drop("synthesis", reason="resolved")),
    ("command simulated 4 a", edit("acted", {}, reason="it jams")),  # it did not fail
    ("resolution opened 8 digit", second_resolution),
    ("follows-plan released 3 a", passes_again),
]

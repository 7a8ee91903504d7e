"""Each trace that is unsafe, untrue, or claims a negative without proof, is refused by its rule."""

import pytest

from judge.broken_live_traces import CASES_OF_LIVE
from judge.broken_plans import CASES_OF_PLANS
from judge.broken_traces import CASES as CASES_OF_RUNS
from judge.broken_traces import Case
from judge.good_live_traces import GOOD_LIVE
from judge.good_traces import GOOD as GOOD_IN_TICKS
from judge.living import living
from judge.trace_script import CORRIDOR, Line, Script, both, robot, text
from safenav.judge.engine import judge
from safenav.judge.lines import NotATraceError

CASES: list[Case] = [*CASES_OF_RUNS, *CASES_OF_PLANS, *CASES_OF_LIVE]
GOOD = GOOD_IN_TICKS | GOOD_LIVE
HOLD: Line = {"ltl": {}}


def told_of(lines: list[Line]) -> list[tuple[str, int, str | None]]:
    """The rules that are broken, each with its tick and robot."""
    return [(found.rule, found.tick, found.robot) for found in judge(text(lines)).findings]


def broken(case: Case) -> list[Line]:
    told, *mutations = case
    lines = GOOD[told.split()[1]]()
    both(*mutations)(lines)
    return lines


@pytest.mark.parametrize("name", GOOD)
def test_a_good_trace_is_accepted(name: str) -> None:
    found = judge(text(GOOD[name]()))
    assert found.ok and found.outcome


@pytest.mark.parametrize("name", GOOD_IN_TICKS)
def test_a_good_trace_in_seconds_is_accepted(name: str) -> None:
    assert judge(text(living(GOOD_IN_TICKS[name]()))).findings == []


@pytest.mark.parametrize("case", CASES, ids=[f"{k} {told}" for k, (told, *_) in enumerate(CASES)])
def test_a_broken_rule_is_named_with_tick_and_robot(case: Case) -> None:
    rule, _, tick, who = case[0].split()
    try:
        first, *_ = told_of(broken(case))
    except NotATraceError:
        first = ("no-trace", 0, None)
    assert first == (rule, int(tick), None if who == "-" else who)


def test_robots_that_change_places_collide() -> None:
    robots = {name: robot("ground", [], at, HOLD) for name, at in (("a", 5), ("b", 6))}
    s = Script("####\n#..#\n####", robots, [])
    s.next_tick().move("a", 6).move("b", 5)
    assert told_of(s.end("interrupted", {"a": 0, "b": 0})) == [("collision", 1, "a")]


@pytest.mark.parametrize(
    ("start", "bound", "other"), [(2, 3, 1), (1, 0, 2)], ids=["region 3", "region 0"]
)
def test_a_robot_in_transit_occupies_the_region_that_it_enters_even_region_0(
    start: int, bound: int, other: int
) -> None:
    """The two traces mirror each other; the quick one jumps to where the slow one is bound for."""
    robots = {"slow": robot("ground", [], start, HOLD), "quick": robot("ground", [], other, HOLD)}
    s = Script("....\n####", robots, [])
    s.next_tick().set_out("slow", bound).move("quick", start)
    s.lines[-1]["to"] = bound
    rules = {rule for rule, *_ in told_of(s.end("interrupted", {"slow": 0, "quick": 0}))}
    assert rules == {"mobility", "collision"}


@pytest.mark.parametrize(("conflicts", "rules"), [([], []), (None, ["header"])])
def test_only_robots_that_avoid_each_other_need_starts_of_their_own(
    conflicts: list[str] | None, rules: list[str]
) -> None:
    robots = {n: robot("ground", [], 5, HOLD) for n in ("a", "b")}
    for entry in robots.values():
        entry["conflicts"] = conflicts
    s = Script("####\n#..#\n####", robots, [])
    s.next_tick().move("a", 6).move("b")
    assert [rule for rule, *_ in told_of(s.end("interrupted", {"a": 0, "b": 0}))][:1] == rules


@pytest.mark.parametrize(
    ("heading", "to", "faced", "ok"),
    [
        ("east", 12, "east", True),
        ("east", 13, "east", True),
        ("east", 7, "north", True),
        ("east", 17, "south", True),
        ("east", 11, "west", False),
        ("east", 12, "north", False),
        ("east", 7, "east", False),
        ("west", 13, "east", False),
        ("north", 17, "south", False),
    ],
)
def test_heading_mobility_is_straight_on_or_a_right_angle(
    heading: str, to: int, faced: str, ok: bool
) -> None:
    grid = "#####\n#...#\n#...#\n#...#\n#####"
    s = Script(grid, {"digit": robot("ground", [], 12, {"visit": [11, 14]}, heading=heading)}, [])
    s.next_tick().move("digit", to)
    s.lines[-1]["heading"] = faced
    found = told_of(s.end("interrupted", {"digit": 0}))
    assert found == ([] if ok else [("mobility", 1, "digit")])


def test_a_robot_that_leaves_a_target_does_not_meet_it_again() -> None:
    """Both targets are one region: staying there for a tick would meet the second."""
    s = Script("....\n####", {"slow": robot("ground", [], 0, {"visit": [1, 1]})}, [])
    s.next_tick().move("slow", 1).goal("slow", 0, 0)
    s.next_tick().set_out("slow", 2)
    s.next_tick().move("slow", 2)
    assert told_of(s.end("interrupted", {"slow": 0})) == []


def test_a_step_that_the_formulas_of_its_robot_forbid_is_refused() -> None:
    memory = {f"m{k}": "bool" for k in range(9)}
    for more in ({}, {"memory": memory}):  # few values of the memory, or many
        own = {"ltl": {"safety": ["region' != 10"], "liveness": ["region' = 9"], **more}}
        s = Script(CORRIDOR, {"rover": robot("ground", [], 8, own)}, [])
        for to in (9, 10):
            s.next_tick().move("rover", to)
        assert told_of(s.end("interrupted", {"rover": 0})) == [("own-rules", 2, "rover")]


@pytest.mark.parametrize("name", ["door", "beliefs", "cycle", "lifted", "opened", "lost"])
def test_a_line_of_other_values_is_refused_or_judged(name: str) -> None:
    lines = GOOD[name]()
    for number, line in enumerate(lines):
        for key in line:
            for value in (None, -1, 2**60, "ghost", []):
                changed = [*lines[:number], {**line, key: value}, *lines[number + 1 :]]
                try:
                    judge(text(changed))
                except NotATraceError:
                    continue

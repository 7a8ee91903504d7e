"""Each rule is broken on purpose in an otherwise good trace, and only that rule is reported."""

import pytest

from audit.broken_live_traces import CASES_OF_LIVE
from audit.broken_plans import CASES_OF_PLANS
from audit.broken_traces import CASES as CASES_OF_RUNS
from audit.broken_traces import Case
from audit.good_live_traces import GOOD_LIVE
from audit.good_traces import GOOD as GOOD_IN_TICKS
from audit.living import living
from audit.trace_script import CORRIDOR, Line, Script, both, obstacle, robot, text
from safenav.audit.check import check_trace
from safenav.audit.judging import NAMES_RULE, RULES
from safenav.audit.lines import read_line
from safenav.audit.run.situation import Situation

CASES: list[Case] = [*CASES_OF_RUNS, *CASES_OF_PLANS, *CASES_OF_LIVE]
GOOD = GOOD_IN_TICKS | GOOD_LIVE
HOLD: Line = {"ltl": {}}


def test_robots_that_change_places_collide() -> None:
    s = Script(
        "####\n#..#\n####", {n: robot("ground", [], r, HOLD) for n, r in (("a", 5), ("b", 6))}, []
    )
    s.next_tick().move("a", 6).move("b", 5)
    audit = check_trace(text(s.end("interrupted", {"a": 0, "b": 0})))
    assert [(f.rule, f.robot) for f in audit.findings] == [("collision", "a")]


@pytest.mark.parametrize(
    ("start", "bound", "other"), [(2, 3, 1), (1, 0, 2)], ids=["region 3", "region 0"]
)
def test_a_robot_in_transit_occupies_the_region_that_it_enters_even_region_0(
    start: int, bound: int, other: int
) -> None:
    """The two traces mirror each other."""
    robots = {"slow": robot("ground", [], start, HOLD), "quick": robot("ground", [], other, HOLD)}
    s = Script("....\n####", robots, [])
    s.next_tick().move("slow")
    s.lines[-1]["toward"] = bound
    s.move("quick", start).move("slow", bound)
    s.lines[-2].update(to=bound)  # it jumps over the slow one, to where that is bound for
    del s.lines[-1]
    audit = check_trace(text(s.end("interrupted", {"slow": 0, "quick": 0})))
    assert [f.rule for f in audit.findings] == ["mobility", "collision"]


@pytest.mark.parametrize(("conflicts", "rules"), [([], []), (None, ["header"])])
def test_only_robots_that_avoid_each_other_need_starts_of_their_own(
    conflicts: list[str] | None, rules: list[str]
) -> None:
    robots = {n: robot("ground", [], 5, HOLD) for n in ("a", "b")}
    for entry in robots.values():
        entry["conflicts"] = conflicts
    s = Script("####\n#..#\n####", robots, [])
    s.next_tick().move("a", 6).move("b")
    audit = check_trace(text(s.end("interrupted", {"a": 0, "b": 0})))
    assert [f.rule for f in audit.findings] == rules


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
    s = Script(grid, {"digit": robot("ground", [], 12, {"visit": [11]}, heading=heading)}, [])
    s.next_tick().move("digit", to)
    s.lines[-1]["heading"] = faced
    audit = check_trace(text(s.end("interrupted", {"digit": 0})))
    assert [f.rule for f in audit.findings] == ([] if ok else ["mobility"])


def test_every_rule_is_there_once_and_has_a_broken_trace() -> None:
    names = [rule.name for rule in RULES]
    assert len(set(names)) == len(names)
    told = [told.split() for told, *_ in CASES]
    assert {rule for rule, *_ in told} == {*names, NAMES_RULE}
    assert {trace for _, trace, *_ in told} <= GOOD.keys()


def test_every_rule_states_its_requirement() -> None:
    for rule in RULES:
        assert rule.__doc__ and "(" in rule.__doc__, rule.name


@pytest.mark.parametrize("name", GOOD)
def test_a_good_trace_breaks_no_rule(name: str) -> None:
    audit = check_trace(text(GOOD[name]()))
    assert audit.findings == ()
    assert audit.ok
    assert audit.complete


@pytest.mark.parametrize("name", GOOD_IN_TICKS)
def test_a_run_in_ticks_rewritten_in_seconds_breaks_no_rule(name: str) -> None:
    assert check_trace(text(living(GOOD_IN_TICKS[name]()))).findings == ()


@pytest.mark.parametrize("case", CASES, ids=[told for told, *_ in CASES])
def test_a_broken_rule_is_named_with_tick_and_robot(case: Case) -> None:
    told, *mutations = case
    rule, name, tick, robot_name, *several = told.split()
    lines = GOOD[name]()
    both(*mutations)(lines)
    found = check_trace(text(lines)).findings
    assert [finding.rule for finding in found] == [rule] * int((several or ["1"])[0])
    assert (found[0].tick, found[0].robot or "-") == (int(tick), robot_name)


def test_a_robot_that_leaves_a_target_does_not_meet_it_again() -> None:
    """Both targets are one region: staying there for a tick would meet the second."""
    s = Script("....\n####", {"slow": robot("ground", [], 0, {"visit": [1, 1]})}, [])
    s.next_tick().move("slow", 1).goal("slow", 0, 0)
    s.next_tick().set_out("slow", 2)
    s.next_tick().move("slow", 2)
    assert not check_trace(text(s.end("interrupted", {"slow": 0}))).findings


@pytest.mark.parametrize(("by", "rules"), [("plan", []), ("strategy", ["missed-goal"])])
def test_a_plan_may_cross_the_target_whose_turn_it_is_not(by: str, rules: list[str]) -> None:
    """The strategy of a patrol never does, so it would have met it."""
    s = Script("....\n####", {"a": robot("air", [], 0, {"patrol": [3, 1]})}, [])
    s.next_tick().move("a", 1)
    s.lines[-1]["by"] = by
    s.next_tick().move("a", 2)
    audit = check_trace(text(s.end("interrupted", {"a": 0})))
    assert [f.rule for f in audit.findings if f.rule == "missed-goal"] == rules


@pytest.mark.parametrize(("assigned", "rules"), [(1, []), (0, ["hold"])])
def test_a_robot_that_holds_leaves_only_by_command_inputs(assigned: int, rules: list[str]) -> None:
    s = Script("....\n####", {"a": robot("ground", [], 0, {"hold": 0})}, [], rounds=9)
    s.next_tick().move("a").goal("a", 0, 1)
    s.next_tick().move("a", 1)
    s.lines[-1]["signal"] = {"request": True, "assigned": assigned, "wait": False}
    audit = check_trace(text(s.end("interrupted", {"a": 1})))
    assert [f.rule for f in audit.findings] == rules


def test_the_signal_of_a_robot_that_stays_to_act_takes_effect() -> None:
    s = Script("....\n####", {"a": robot("ground", [], 0, {"hold": 0})}, [])
    now = Situation(read_line({"tick": 0, **s.lines[0], "clock": "live"}, 1), [])
    signal = {"request": True, "assigned": 1, "wait": False}
    hold = {"type": "hold", "tick": 1, "t": 1.0, "robot": "a", "why": "acting", "signal": signal}
    now.apply(read_line(hold, 2))
    assert now.signals["a"].assigned == 1


@pytest.mark.parametrize(
    ("coordination", "rules"), [("assignable", []), ("resynthesis", ["rounds"])]
)
def test_by_command_inputs_a_count_may_restart_with_each_need(
    coordination: str, rules: list[str]
) -> None:
    """What a robot is to do for the next need has no line of its own there."""
    vault = obstacle("vault", 3, "sense", [1], []) | {
        "needs": [{"action": "sense", "regions": [1]}, {"action": "push", "regions": [3]}]
    }
    robots = {
        "a": robot("ground", [], 2, {"ltl": {"liveness": ["region = 2"]}}),
        "b": robot("air", ["sense"], 0, {"hold": 0}),
    }
    s = Script("....\n####", robots, [vault])
    s.lines[0]["scenario"]["coordination"] = coordination
    s.next_tick().move("a").goal("a", 0, 1).move("b").goal("b", 0, 1)
    s.next_tick().move("a").goal("a", 0, 2).move("b", 1)
    s.lines[-1]["by"] = "stay"
    s.add("met", obstacle="vault@3", need=0, action="sense", robot="b", at=1)
    s.next_tick().move("a").goal("a", 0, 1).move("b")
    audit = check_trace(text(s.end("interrupted", {"a": 1, "b": 1})))
    assert [f.rule for f in audit.findings] == rules


def test_a_step_that_the_formulas_of_its_robot_forbid_is_refused() -> None:
    memory = {f"m{k}": "bool" for k in range(9)}
    for more in ({}, {"memory": memory}):  # few values of the memory, or many
        own = {"ltl": {"safety": "region' != 10", "liveness": "region' = 9", **more}}
        s = Script(CORRIDOR, {"rover": robot("ground", [], 8, own)}, [])
        for to in (9, 10):
            s.next_tick().move("rover", to)
        found = check_trace(text(s.end("interrupted", {"rover": 0}))).findings
        assert [(one.rule, one.tick) for one in found] == [("always", 2)]


@pytest.mark.parametrize("met", [True, False])
def test_a_robot_that_begins_on_its_target_has_met_it(met: bool) -> None:
    s = Script("....\n####", {"a": robot("air", [], 0, {"visit": [0, 1]})}, [])
    s.lines[-1]["node"] = 0
    s.goal("a", 0, 0) if met else s
    s.next_tick().move("a")
    found = check_trace(text(s.end("interrupted", {"a": 0}))).findings
    assert [(one.rule, one.tick) for one in found] == [("missed-goal", 0)] * (not met)

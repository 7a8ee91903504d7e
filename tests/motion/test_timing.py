"""The times of motion: in lockstep, with a clock, and as the pace of a robot predicts them."""

import json
import os
import random
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import SHIPPED, live_trace, motion, played, trace_of
from once import beside
from safenav.errors import InputError
from safenav.motion.check.examination import Finding
from safenav.motion.check.order import disorder
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import columns_at
from safenav.motion.file import Action, Moving
from safenav.motion.making import motion_of
from safenav.motion.timing import dated, in_time, ordered, paces_of
from safenav.pace.robot import Pace
from safenav.trace import records
from safenav.trace.file import Trace, read_bytes
from safenav.trace.records import Service

SLOWED = int(os.environ.get("SAFENAV_MOTION_SLOWED", "10"))


def apart() -> Trace:
    """Two robots that must not be together in a zone."""
    return read_bytes(played(beside(__file__, "scenarios/apart.yaml")))


class Stroller(Pace):
    """Takes one to three seconds for a step, by chance, and sometimes one to halt."""

    chance: random.Random

    def step(self, now: float, origin: int, to: int, slower: float = 1.0) -> float:
        return super().step(now, origin, to, slower) - 1.0 + self.chance.uniform(1, 3)

    def _halting(self) -> float:
        return self.chance.choice([0.0, 1.0])


def disordered(trace: Trace, seed: int) -> list[Finding]:
    """What the checker finds in the order of a run by robots of any pace."""
    paces = {}
    for name in trace.robots:
        paces[name] = Stroller(trace.header.scenario.map.cols, 2.7, None)
        paces[name].chance = random.Random(f"{seed} {name}")
    serial = dated(trace, paces)
    moves = [r for r in trace.records if isinstance(r, records.Move) and r.to != r.from_]
    assert len([r for r in serial if isinstance(r, records.Arrive)]) == len(moves)
    return [*disorder(ordered(trace, serial), serial)]


@pytest.mark.parametrize("name", [*SHIPPED, "apart"])
def test_slow_robots_never_overlap_never_enter_a_door_early_and_all_end(name: str) -> None:
    """Nor are they together in a forbidden zone."""
    trace = apart() if name == "apart" else trace_of(name)
    for seed in range(SLOWED):
        assert disordered(trace, seed) == []


def test_a_robot_without_charge_stands_until_its_battery_is_replaced() -> None:
    lines = motion("battery_delivery").lines
    replaced = max(line.t1 for line in lines if isinstance(line, Action))
    moved = [m for m in lines if isinstance(m, Moving) and m.robot == "digit" and m.origin != m.to]
    flat = max(move.t1 for move in moved if move.t0 < replaced)
    assert flat < replaced <= min(move.t0 for move in moved if move.t0 >= flat)
    told = in_time(trace_of("battery_delivery"), motion("battery_delivery")).records
    served = [(record.active, record.t) for record in told if isinstance(record, Service)]
    assert served == [(False, pytest.approx(flat)), (True, pytest.approx(replaced))]
    trace, decisions = trace_of("battery_delivery"), records.Synthesis | records.Plan
    kept = tuple(record for record in trace.records if not isinstance(record, decisions))
    undecided = replace(trace, records=kept)  # a decision after it would hide that it waits
    assert check_motion(motion_of(undecided), undecided) == []


def test_all_robots_of_a_joint_action_act_at_the_same_time() -> None:
    acts = motion("beam").of(Action)
    assert len(acts) == 2 * len({(act.t0, act.t1) for act in acts})
    assert len({act.robot for act in acts}) == 2


def test_times_that_ignore_conflicts_or_exclusions_are_refused() -> None:
    """As those of robots that heed less than the trace does."""
    for trace, rule in (
        (apart(), "never-together"),
        (trace_of("two_digits"), "overlap"),
    ):
        scenario = trace.header.scenario
        robots = tuple(replace(each, avoids=frozenset()) for each in scenario.robots)
        scenario = replace(scenario, robots=robots, never_together=())
        heedless = replace(trace, header=replace(trace.header, scenario=scenario))
        made = motion_of(heedless)
        serial = dated(heedless, paces_of(heedless, made.header))
        assert {found.rule for found in disorder(ordered(trace, serial), serial)} == {rule}
        assert "clock" in {found.rule for found in check_motion(made, trace)}
        assert check_motion(motion_of(trace), trace) == []


@pytest.mark.parametrize(
    ("name", "decision"), [("case_study_1", records.Synthesis), ("two_digits", records.Plan)]
)
def test_a_step_before_the_decision_that_it_follows_is_refused(name: str, decision: type) -> None:
    trace = trace_of(name)
    serial = [*dated(trace, paces_of(trace, motion(name).header))]
    timed = ordered(trace, serial)
    at = max(i for i, r in enumerate(serial) if isinstance(r, decision) and (r.t or 0.0) > 0)
    step = next(i for i, r in enumerate(serial) if i > at and isinstance(r, records.Depart))
    serial[step] = replace(serial[step], t=(serial[at].t or 0.0) - 0.1)
    (found,) = disorder(timed, serial)
    assert (found.rule, found.found[:14]) == ("order", "begins 0.100 s")


def test_a_robot_that_opens_a_door_by_entering_acts_in_front_of_it() -> None:
    """Its body is in the first half of the region, 5 cm behind the border."""
    moved = motion_of(read_bytes(played(beside(__file__, "scenarios/pushing.yaml"))))
    (act,) = moved.of(Action)
    (x, _) = columns_at(moved, "cart", np.array([act.t0, act.t1])).place
    assert x == pytest.approx([2 * 2.7 + 0.25 + 0.05] * 2)


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("kind", ["disc", "rover"])
def test_a_robot_acts_on_one_thing_after_the_other(kind: str, clock: str) -> None:
    """On two in front of the centre of its region, then from there on one beside it. With a clock
    it did all in front of it, and had no time for its next step: the run was refused."""
    text = beside(__file__, "scenarios/tidying.yaml").replace("speed:", f"motion: {kind}, speed:")
    trace = read_bytes(played(f"{text}clock: {clock}\n"))
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    acts = made.of(Action)
    assert [act.obstacle for act in acts] == ["door@7", "parcel@7", "rubble@8"]
    x, _ = columns_at(made, "cart", np.array([(act.t0 + act.t1) / 2 for act in acts]), False).place
    assert x == pytest.approx([5.7, 5.7, 6.75])
    assert [act.t1 - act.t0 for act in acts] == pytest.approx([2.0] * 3)


CLOSING = """\
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots:
  quad: {model: quadcopter, start: 10, objective: {patrol: [10, 12]}}
  digit: {model: digit, start: 28, heading: east, objective: {visit: [28, 30]}}
obstacles: [{type: door, region: 22, from: 5, until: 12}]
until: {rounds: 5}
"""


def test_an_obstacle_appears_and_disappears_at_the_instants_of_its_ticks() -> None:
    """In 3D a door of tick 5 was there, and gone, from the beginning."""
    trace = read_bytes(played(CLOSING), "t.jsonl")
    moved = motion_of(trace)
    steps = [line for line in moved.of(Moving) if line.origin != line.to]
    ends = {tick: max(line.t1 for line in steps if line.tick < tick) for tick in (5, 12)}
    told = {type(r): r.t for r in in_time(trace, moved).records}
    assert told[records.Appeared] == pytest.approx(ends[5])
    assert told[records.Gone] == pytest.approx(ends[12])


@pytest.mark.parametrize(
    ("name", "delayed"),
    [("beam", 0.4), ("case_study_2", 0.0), ("parked_robot", 0.4), ("case_study_1", 0.4)],
)
def test_motion_starts_at_departures_and_ends_at_arrivals(name: str, delayed: float) -> None:
    trace = read_bytes(live_trace(name, delayed))
    assert check_motion(motion_of(trace), trace) == []


def changed(change: Callable[[list[dict[str, Any]]], None]) -> Trace:
    """A live trace of case study 2 with other lines."""
    lines = [json.loads(line) for line in live_trace("case_study_2").splitlines()]
    change(lines)
    return read_bytes("".join(json.dumps(line) + "\n" for line in lines).encode())


def first(lines: list[dict[str, Any]], **wanted: object) -> dict[str, Any]:
    return next(line for line in lines if wanted.items() <= line.items())


def test_a_step_that_failed_stays_where_it_began() -> None:
    def fail(lines: list[dict[str, Any]]) -> None:
        """The first step of the quadcopter fails, and is tried again."""
        arrive = first(lines, type="arrive", robot="quad")
        for line in lines[1:]:
            if line["t"] >= arrive["t"] and line is not arrive:
                line["t"] += 20.0
        depart = first(lines, type="depart", robot="quad")
        again = {**arrive, "t": arrive["t"] + 10.0, "command": 901, "tick": depart["tick"]}
        lines[lines.index(arrive)] = {**arrive, "at": depart["from"], "result": "failed"}
        place = next(i for i, line in enumerate(lines) if i and line["t"] > again["t"])
        new = {**depart, "t": arrive["t"] + 1.0, "command": 901}
        lines[place:place] = [new, again]

    trace = changed(fail)
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    steps = made.of(Moving, "quad")
    assert steps[0].origin == steps[0].to and steps[0].t1 > 5.0


@pytest.mark.parametrize(
    ("robot", "late", "at", "found"),
    [("digit", -2.0, None, "digit takes 3.54 s"), ("quad", 0.0, 54, "no motion shows how")],
)
def test_a_live_trace_that_no_motion_can_follow_is_refused(
    robot: str, late: float, at: int | None, found: str
) -> None:
    def change(lines: list[dict[str, Any]]) -> None:
        line = first(lines, type="arrive", robot=robot)
        line |= {"t": line["t"] + late, "at": at or line["at"]}

    with pytest.raises(InputError, match=found):
        motion_of(changed(change))


def test_the_runtime_gets_durations_without_numpy() -> None:
    code = "import sys, safenav.runtime.worlds.simulation; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)

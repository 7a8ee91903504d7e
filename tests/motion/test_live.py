"""The motion of a live run shows the run at the seconds of its trace."""

import json
from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from motion.runs import live_trace
from safenav.errors import InputError
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import Action, Motion, Moving, Release, Reserve
from safenav.motion.making import motion_of
from safenav.trace import records
from safenav.trace.reading import Trace, read_bytes

RUNS = [("beam", 0.4), ("case_study_2", 0.0), ("parked_robot", 0.4), ("case_study_1", 0.4)]


def moved(content: bytes) -> tuple[Trace, Motion, list[str]]:
    """A trace, its motion, and what the checker finds."""
    trace = read_bytes(content)
    motion = motion_of(trace)
    return trace, motion, [str(found) for found in check_motion(motion, trace)]


@pytest.mark.parametrize(("name", "delayed"), RUNS)
def test_motion_starts_at_departures_and_ends_at_arrivals(name: str, delayed: float) -> None:
    trace, motion, findings = moved(live_trace(name, delayed))
    assert findings == []
    steps = [p for p in motion.lines if isinstance(p, Moving) and p.origin != p.to]
    ends = {(r.robot, r.command): r.t for r in trace.records if isinstance(r, records.Arrive)}
    for depart in (r for r in trace.records if isinstance(r, records.Depart)):
        (step,) = (p for p in steps if (p.robot, p.tick) == (depart.robot, depart.tick))
        assert step.t0 >= (depart.t or 0.0) - 1e-6
        end = ends.pop((depart.robot, depart.command), None)
        if end is None:  # under way when the run ends: shown at the robot's own pace
            assert step.t1 <= (depart.t or 0.0) + (depart.seconds or 0.0) + 1e-3
        else:
            assert step.t1 == pytest.approx(end, abs=1e-3)
    assert ends == {}


def changed(name: str, change: Callable[[list[dict[str, Any]]], None]) -> bytes:
    lines = [json.loads(line) for line in live_trace(name).splitlines()]
    change(lines)
    return "".join(json.dumps(line) + "\n" for line in lines).encode()


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

    _, motion, findings = moved(changed("case_study_2", fail))
    assert findings == []
    steps = [p for p in motion.lines if isinstance(p, Moving) and p.robot == "quad"]
    assert steps[0].origin == steps[0].to and steps[0].t1 > 5.0


@pytest.mark.parametrize(
    ("wanted", "found"),
    [
        ({"type": "arrive", "robot": "digit", "t": -2.0}, "digit takes 3.54 s"),
        ({"type": "arrive", "robot": "quad", "at": 54}, "no motion shows how"),
    ],
)
def test_a_live_trace_that_no_motion_can_follow_is_refused(
    wanted: dict[str, Any], found: str
) -> None:
    def change(lines: list[dict[str, Any]]) -> None:
        line = first(lines, type=wanted["type"], robot=wanted["robot"])
        line |= {"t": line["t"] + wanted.get("t", 0.0), "at": wanted.get("at", line["at"])}

    with pytest.raises(InputError, match=found):
        moved(changed("case_study_2", change))


def test_another_clock_than_the_trace_s_is_found() -> None:
    content = live_trace("case_study_2")
    trace, motion, _ = moved(content)
    for kind, field in ((Reserve, "t"), (Release, "t"), (Action, "t1")):
        lines = list(motion.lines)
        index = next(i for i, line in enumerate(lines) if isinstance(line, kind) and i > 20)
        lines[index] = replace(lines[index], **{field: getattr(lines[index], field) + 0.5})
        wrong = replace(motion, lines=tuple(lines))
        found = check_motion(wrong, trace)
        assert "clock" in {finding.rule for finding in found}, kind

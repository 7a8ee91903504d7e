"""The checker accepts correct motions, and refuses each kind of damage with its reason."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from motion.runs import SHIPPED, motion, played, trace_of
from once import beside
from safenav.errors import UsageError
from safenav.motion.check.examination import Finding
from safenav.motion.check.mismatch import read_motion_of
from safenav.motion.check.verdict import check_motion
from safenav.motion.file.reading import text_of
from safenav.motion.file.records import (
    Action,
    Flight,
    Line,
    Motion,
    Moving,
    Release,
    Reserve,
    Segment,
)
from safenav.motion.making import motion_of
from safenav.trace.reading import read_bytes
from safenav.trace.records import Service

DOOR = "case_study_1"


def judged(found: Motion, name: str = DOOR) -> list[Finding]:
    return check_motion(found, trace_of(name))


def changed(found: Motion, pick: Callable[[Line], bool], change: Callable[[Line], Line]) -> Motion:
    """The motion with the first line that is picked changed."""
    lines = list(found.lines)
    index = next(index for index, line in enumerate(lines) if pick(line))
    lines[index] = change(lines[index])
    return replace(found, lines=tuple(lines))


def walks(line: Line) -> bool:
    return isinstance(line, Segment) and line.primitive == "walk straight"


@pytest.mark.parametrize("name", SHIPPED)
def test_motion_of_a_shipped_scenario_is_accepted(name: str) -> None:
    assert judged(motion(name), name) == []


def moved(parts: Sequence[Any]) -> tuple[Any, ...]:
    """With the third one moved by 5 cm."""
    return (*parts[:2], replace(parts[2], x=parts[2].x + 0.05), *parts[3:])


def longer(line: Any) -> Any:
    (curve,) = line.parts
    return replace(line, t1=line.t1 + 0.01, parts=(replace(curve, seconds=curve.seconds + 0.01),))


def jumping(line: Any) -> Any:
    first, *others = line.parts
    x = (first.x[0] + 0.02, *first.x[1:])
    return replace(line, parts=(replace(first, x=x), *others))


DAMAGES: dict[str, tuple[type[Line], Callable[[Any], Any], str, str]] = {
    "a foot": (
        Segment,
        lambda line: replace(line, feet=moved(line.feet)),
        *("feet", "0.050 m from its foothold"),
    ),
    "a foot and the centre of pressure: they do not carry the mass from start to goal": (
        Segment,
        lambda line: replace(line, phases=moved(line.phases), feet=moved(line.feet)),
        *("dynamics", "misses the"),
    ),
    "pieces of one robot that overlap by 10 ms": (
        *(Flight, longer),
        *("continuity", "overlap by 0.010 s"),
    ),
    "an action before its time": (
        Action,
        lambda line: replace(line, t0=line.t0 - 3, t1=line.t1 - 3),
        *("action", "before it has arrived"),
    ),
    "a door entered before it is open": (
        Action,
        lambda line: replace(line, t1=line.t1 + 0.5),
        *("obstacle", "0.500 s before door@47 is resolved"),
    ),
    "a wall reserved": (Reserve, lambda line: replace(line, region=0), "wall", ""),
    "a jump between pieces": (Flight, jumping, "continuity", "jumps by 0.02"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_line_is_refused(damage: str) -> None:
    kind, change, rule, words = DAMAGES[damage]

    def picked(line: Line) -> bool:
        early = isinstance(line, Reserve) and line.t == 0
        return isinstance(line, kind) and not early and (kind is not Segment or walks(line))

    found = judged(changed(motion(DOOR), picked, change), DOOR)
    assert any(finding.rule == rule and words in finding.found for finding in found)


LOW = {"omega": (9.81 / 0.9) ** 0.5, "height": 0.9}


@pytest.mark.parametrize(
    ("robot", "limits", "rule", "words"),
    [
        ("digit", {"omega": (9.0 / 0.8) ** 0.5}, "gravity", "9.0000 m/s^2, not 9.81"),
        ("digit", LOW, "dynamics", ""),
        ("quad", {"speed": 0.7}, "speed", "m/s, more than 0.7"),
    ],
    ids=["gravity", "height", "speed"],
)
def test_motion_beyond_the_limits_of_a_robot_is_refused(
    robot: str, limits: dict[str, Any], rule: str, words: str
) -> None:
    header, trace = motion(DOOR).header, trace_of(DOOR)
    robots = header.robots | {robot: header.robots[robot] | limits}
    told = dict(trace.header.scenario.robots)
    told[robot] = replace(told[robot], motion={**(told[robot].motion or {}), **limits})
    scenario = replace(trace.header.scenario, robots=told)
    changed_trace = replace(trace, header=replace(trace.header, scenario=scenario))
    limited = replace(motion(DOOR), header=replace(header, robots=robots))
    found = check_motion(limited, changed_trace)
    assert found[0].rule == rule and words in found[0].found


def test_moves_that_overlap_by_10_ms_are_refused() -> None:
    name = "two_digits"
    entering = [
        line
        for line in motion(name).lines
        if isinstance(line, Reserve) and line.robot == "right" and line.t > 0
    ]
    left = {line.region for line in motion(name).lines if isinstance(line, Release)}
    target = next(line for line in entering if line.region in left and _tight(line))
    early = changed(motion(name), lambda line: line is target, _sooner)
    found = judged(early, name)
    assert any(f.rule == "overlap" and "for 0.010 s" in f.found for f in found)


def _tight(line: Reserve) -> bool:
    """Return whether another robot releases the region at exactly this time."""
    return any(
        isinstance(other, Release)
        and other.region == line.region
        and other.robot != line.robot
        and abs(other.t - line.t) < 1e-9
        for other in motion("two_digits").lines
    )


def _sooner(line: Line) -> Line:
    assert isinstance(line, Reserve)
    return replace(line, t=line.t - 0.01)


def test_body_pushed_into_a_wall_by_5_cm_is_refused() -> None:
    """A flight along the northern wall, shifted towards it."""
    found, trace = motion(DOOR), trace_of(DOOR)
    into = found.header.side / 2 - 0.25 + 0.05

    def along(line: Line) -> bool:
        if not isinstance(line, Flight) or abs(line.to - line.origin) != 1:
            return False
        row, col = divmod(line.to, trace.header.scenario.map.cols)
        return trace.header.scenario.map.grid[row - 1][col] == "#"

    def pushed(line: Line) -> Line:
        assert isinstance(line, Flight)
        curve = line.parts[0]
        return replace(line, parts=(replace(curve, y=(curve.y[0] + into, *curve.y[1:])),))

    refused = judged(changed(found, along, pushed))
    assert any(f.rule == "room" and "reaches 0.050 m into region" in f.found for f in refused)


def test_missing_move_with_a_longer_rest_is_refused() -> None:
    """The last flight replaced by hovering where the quadcopter was: continuous, but not there."""
    lines = list(motion(DOOR).lines)
    last = [line for line in lines if isinstance(line, Flight)][-1]
    while lines[lines.index(last)].origin == last.to:
        lines.remove(last)
        last = [line for line in lines if isinstance(line, Flight)][-1]
    lines.remove(last)
    found = judged(replace(motion(DOOR), lines=tuple(lines)))
    assert any("is missing" in f.found for f in found)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"kind":"walker",', "", "'kind' is missing"),
        ('"clearance":', '"low":', "'clearance' is missing"),
        ('"type":"reserve","robot":"digit"', '"type":"reserve","robot":"d"', "d is not a robot"),
        ('"phases":[[', '"phases":[],"more":[[', "a piece of motion without parts"),
        ('"side":2.7', '"side":1e-9', "regions; expected less than 1000"),
        ('"swings":[[', '"swings":[[1,0,1e9,0,1,STILL,STILL],[', "a piece of 1,000,000"),
        ('"makespan":', '"makespan":1e12,"m":', "a makespan of 1e[+]12 s"),
    ],
    ids=[
        *("kind", "clearance", "stranger", "no phases", "tiny regions", "a foot in the air"),
        "an eternity",
    ],
)
def test_a_contradictory_motion_file_is_refused(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    """Pages and tables raised KeyError, ValueError, IndexError; the check filled the memory."""
    text = text_of(motion(DOOR)).replace(old, new.replace("STILL", "[0,0,0,0,0,0,0,0,0]"), 1)
    (path := tmp_path / "motion.jsonl").write_text(text)
    with pytest.raises(UsageError, match=said):
        check_motion(read_motion_of(path, trace_of(DOOR), path), trace_of(DOOR))


def test_shorter_makespan_is_refused() -> None:
    outcome = replace(motion(DOOR).outcome, makespan=motion(DOOR).outcome.makespan - 1)
    found = judged(replace(motion(DOOR), outcome=outcome))
    assert any(f.rule == "makespan" for f in found)


def test_findings_are_sorted_by_time() -> None:
    lines = [line for line in motion(DOOR).lines if not (isinstance(line, Moving) and line.t0 > 50)]
    found = judged(replace(motion(DOOR), lines=tuple(lines)))
    assert [f.t for f in found] == sorted(f.t for f in found)


FLAT = beside(__file__, "scenarios/flat.yaml")


def test_a_robot_without_charge_that_moves_is_refused() -> None:
    """It rolls by 0.3 m and back beside the drone that brings its battery."""
    told = played(FLAT)
    trace = read_bytes(told)
    good = motion_of(trace)
    assert check_motion(good, trace) == []
    flat = next(r.tick for r in trace.records if isinstance(r, Service))

    def rests(line: Line) -> bool:
        rest = isinstance(line, Flight) and line.primitive == "rest"
        return rest and line.robot == "cart" and line.tick == flat + 1

    def rolls(line: Line) -> Line:
        assert isinstance(line, Flight)
        (curve,) = line.parts
        d, bump = curve.seconds, 0.3 / (curve.seconds / 2) ** 4
        x = (curve.x[0], 0.0, bump * d * d, -2 * bump * d, bump, 0.0)
        return replace(line, parts=(replace(curve, x=x),))

    (found,) = check_motion(changed(good, rests, rolls), trace)
    assert found.rule == "charge"
    assert "cart: moves by 0.300 m without charge" in str(found)

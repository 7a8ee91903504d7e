"""Motions that were changed so that they endanger robots, while each line alone is plausible."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from msgspec.structs import replace

from motion.runs import motion, trace_of
from safenav.motion.check.verdict import check_motion
from safenav.motion.file.records import (
    Action,
    Curve,
    Flight,
    FlownTrack,
    Line,
    Motion,
    Release,
    Reserve,
    Reset,
    Segment,
)
from safenav.motion.making import Disturbances, motion_of

DOOR = "case_study_1"


def with_limits(robot: str, limits: dict[str, object]) -> Motion:
    """The motion of case study 1, with other values in its header."""
    header = motion(DOOR).header
    robots = header.robots | {robot: header.robots[robot] | limits}
    return replace(motion(DOOR), header=replace(header, robots=robots))


@pytest.mark.parametrize(
    ("robot", "limits"),
    [
        ("digit", {"size": 0.01}),
        ("digit", {"size": float("nan")}),
        ("digit", {"friction": 5.0}),
        ("digit", {"aside": 0.01}),
        ("quad", {"kind": "disc"}),
        ("quad", {"speed": 20.0}),
        ("quad", {"driven": "goals", "tolerance": 0.3, "gap": 1e9}),
    ],
    ids=lambda value: str(value),
)
def test_limits_that_the_robot_does_not_have_are_refused(
    robot: str, limits: dict[str, object]
) -> None:
    (found,) = check_motion(with_limits(robot, limits), trace_of(DOOR))
    assert found.rule == "header" and robot in found.found


def test_another_origin_than_that_of_the_trace_is_refused() -> None:
    header = replace(motion(DOOR).header, origin=(1.0, 0.0, 0.0))
    (found,) = check_motion(replace(motion(DOOR), header=header), trace_of(DOOR))
    assert found.rule == "header" and "origin" in found.found


def there_and_back(seconds: float, metres: float) -> tuple[float, ...]:
    """A polynomial from rest to rest, ``metres`` away half-way."""
    k = metres / (seconds / 2) ** 4
    return (0.0, 0.0, k * seconds**2, -2 * k * seconds, k)


def added(path: tuple[float, ...], more: tuple[float, ...]) -> tuple[float, ...]:
    return (path[0] + more[0], *more[1:])


def into_the_door(line: Any) -> list[Line]:
    """While it hovers beside the closed door, the flyer enters its region, which it reserves."""
    (curve,) = line.parts
    east = added(curve.x, there_and_back(curve.seconds, 2.7))
    return [
        Reserve(line.robot, line.tick, 47, line.t0),
        replace(line, parts=(replace(curve, x=east),)),
        Release(line.robot, line.tick, 47, line.t1),
    ]


def higher(line: Any) -> list[Line]:
    (curve,) = line.parts
    up = added(curve.z, there_and_back(curve.seconds, -2.0))
    return [replace(line, parts=(replace(curve, z=up),))]


def facing_another_way(line: Any) -> list[Line]:
    (curve,) = line.parts
    return [replace(line, parts=(replace(curve, yaw=(curve.yaw[0] + 3, *curve.yaw[1:])),))]


def jump_by_reset(line: Any) -> list[Line]:
    (curve,) = line.parts
    resets = [Reset(line.robot, line.tick, t, 0, 0, 0, "") for t in (line.t0, line.t1)]
    away = replace(curve, x=(curve.x[0] + 0.5, *curve.x[1:]))
    return [*resets, replace(line, parts=(away,))]


def body_turned(line: Any) -> list[Line]:
    before, after, *times = line.turning
    return [replace(line, turning=(before + 1, after + 1, *times))]


def swing_changed(line: Any, **values: float) -> list[Line]:
    """A swing in the middle of a step, which ends in the air: no foothold is where it ends."""
    first, second, *rest = line.swings
    goal = (second.goal[0] + 0.3, *second.goal[1:])
    return [replace(line, swings=(first, replace(second, goal=goal, **values), *rest))]


def sliding(line: Any) -> list[Line]:
    first, *rest = line.swings
    goal = (*first.goal[:3], 0.3, *first.goal[4:])
    return [replace(line, swings=(replace(first, goal=goal), *rest))]


FORGERIES: dict[str, tuple[Callable[[Any], bool], Callable[[Any], list[Line]], str]] = {
    "into a closed door": (
        lambda line: isinstance(line, Flight) and line.primitive == "hover" and line.to == 46,
        *(into_the_door, "room"),
    ),
    "a dive": (lambda line: isinstance(line, Flight) and line.tick == 5, higher, "altitude"),
    "a flyer that faces another way at once": (
        lambda line: isinstance(line, Flight) and line.tick == 5,
        *(facing_another_way, "continuity"),
    ),
    "a jump that a reset explains": (
        lambda line: isinstance(line, Flight) and line.tick == 5,
        *(jump_by_reset, "continuity"),
    ),
    "a body that turns at once": (
        lambda line: isinstance(line, Segment) and line.primitive == "walk straight",
        *(body_turned, "continuity"),
    ),
    "a foot that ends in the air": (
        lambda line: isinstance(line, Segment) and line.primitive == "walk straight",
        *(partial(swing_changed, u1=0.9), "feet"),
    ),
    "a foot that slides as it lands": (
        lambda line: isinstance(line, Segment) and line.primitive == "walk straight",
        *(sliding, "feet"),
    ),
    "a move in another tick": (
        lambda line: isinstance(line, Segment) and line.primitive == "walk straight",
        *(lambda line: [replace(line, tick=line.tick + 1)], "order"),
    ),
    "a door in another region": (
        lambda line: isinstance(line, Action),
        *(lambda line: [replace(line, region=48)], "action"),
    ),
    "a push of a door for 10 ms": (
        lambda line: isinstance(line, Action),
        *(lambda line: [replace(line, t1=line.t0 + 0.01)], "action"),
    ),
}


@pytest.mark.parametrize("name", FORGERIES)
def test_a_forgery_is_refused(name: str) -> None:
    pick, forge, rule = FORGERIES[name]
    lines = list(motion(DOOR).lines)
    index = next(index for index, line in enumerate(lines) if pick(line))
    forged: Line = lines[index]
    lines[index : index + 1] = forge(forged)
    found = check_motion(replace(motion(DOOR), lines=tuple(lines)), trace_of(DOOR))
    assert rule in {finding.rule for finding in found}


def test_a_flight_in_wind_is_recorded_without_gaps() -> None:
    windy = motion_of(trace_of(DOOR), against=Disturbances(seed=1, gust=2.0))
    assert check_motion(windy, trace_of(DOOR)) == []
    tracks = [line for line in windy.lines if isinstance(line, FlownTrack)]
    single = replace(
        tracks[0],
        step=windy.outcome.makespan,
        rows=tracks[0].rows[:1],
        errors=tracks[0].errors[:1],
    )
    others = [line for line in windy.lines if not isinstance(line, FlownTrack)]
    (found,) = check_motion(replace(windy, lines=(single, *others)), trace_of(DOOR))
    assert found.rule == "track" and "at most 0.05 s apart" in found.found


@pytest.mark.parametrize(
    ("curves", "rule", "words"),
    [
        ((Curve(1.0, (), (), (0.0,), (0.0, 0.0, 0.0, 80.0, -60.0)),), "turning", "rad/s"),
        (
            (
                Curve(1.0, (), (), (0.0,), (0.0, 0.0, 0.4)),
                Curve(1.0, (0.0, 0.8), (), (0.0,), (0.4,)),
            ),
            *("continuity", "jumps by"),
        ),
        ((Curve(1.0, (0.0, 0.0, 0.1), (), (0.0,), (1.5,)),), "slip", "sideways at 0.199 m/s"),
    ],
    ids=["a spin", "from turning to driving at once", "sideways"],
)
def test_a_rover_neither_spins_nor_starts_at_once_nor_slips(
    curves: tuple[Curve, ...], rule: str, words: str
) -> None:
    found = motion("warehouse")
    rovers = {n for n, own in found.header.robots.items() if own["kind"] == "rover"}
    drive = next(
        line
        for line in found.lines
        if isinstance(line, Flight) and line.robot in rovers and line.tick > 3
    )
    x, y = drive.parts[0].x[0], drive.parts[0].y[0]
    forged = replace(
        drive,
        parts=tuple(replace(curve, x=(x, *curve.x[1:]), y=(y,)) for curve in curves),
        t1=drive.t0 + sum(curve.seconds for curve in curves),
    )
    lines = tuple(forged if line is drive else line for line in found.lines)
    judged = check_motion(replace(found, lines=lines), trace_of("warehouse"))
    mine = [f for f in judged if drive.t0 <= f.t <= forged.t1 and f.robot == drive.robot]
    assert any(f.rule == rule and words in f.found for f in mine)

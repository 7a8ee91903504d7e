"""The checker accepts correct motions, and refuses each kind of damage with its reason: of lines
that are wrong, and of lines that are plausible each alone but endanger robots."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import SHIPPED, motion, played, trace_of
from once import beside
from safenav.errors import UsageError
from safenav.motion.check.examination import Finding
from safenav.motion.check.verdict import check_motion, read_motion_of
from safenav.motion.file import (
    Action,
    Curve,
    Flight,
    Line,
    Motion,
    Moving,
    Release,
    Reserve,
    Reset,
    Segment,
    text_of,
)
from safenav.motion.making import motion_of
from safenav.motion.walker import advanced
from safenav.trace.reading import read_bytes
from safenav.trace.records import Service

DOOR = "case_study_1"


def damaged(found: Motion, pick: Callable[[Any], bool], forge: Callable[[Any], Any]) -> Motion:
    """The motion with other lines in place of the first that is picked."""
    lines: list[Line] = list(found.lines)
    index = next(index for index, line in enumerate(lines) if pick(line))
    made = forge(lines[index])
    lines[index : index + 1] = made if isinstance(made, list) else [made]
    return replace(found, lines=tuple(lines))


def judged(found: Motion, name: str = DOOR) -> list[Finding]:
    return check_motion(found, trace_of(name))


@pytest.mark.parametrize("name", SHIPPED)
def test_motion_of_a_shipped_scenario_is_accepted(name: str) -> None:
    assert judged(motion(name), name) == []


# Picks.


def walks(line: Line) -> bool:
    return isinstance(line, Segment) and line.primitive == "walk straight"


def stops(line: Line) -> bool:
    return isinstance(line, Segment) and line.primitive == "stop"


def flies(line: Line) -> bool:
    return isinstance(line, Flight) and line.tick == 5


def of(kind: type[Line]) -> Callable[[Line], bool]:
    return lambda line: isinstance(line, kind)


def later(kind: type[Line]) -> Callable[[Any], bool]:
    return lambda line: isinstance(line, kind) and line.t > 0


# Damages.


def curve(**changes: Callable[[tuple[float, ...], float], tuple[float, ...]]) -> Any:
    """Change the polynomials of a flight of one curve, given its seconds."""

    def change(line: Any) -> Any:
        (only,) = line.parts
        new = {axis: how(getattr(only, axis), only.seconds) for axis, how in changes.items()}
        return replace(line, parts=(replace(only, **new),))

    return change


def by(metres: float) -> Callable[[tuple[float, ...], float], tuple[float, ...]]:
    return lambda path, _: (path[0] + metres, *path[1:])


def there_and_back(metres: float) -> Callable[[tuple[float, ...], float], tuple[float, ...]]:
    """Rest where it is, but ``metres`` away half-way."""

    def bump(path: tuple[float, ...], seconds: float) -> tuple[float, ...]:
        k = metres / (seconds / 2) ** 4
        return (path[0], 0.0, k * seconds**2, -2 * k * seconds, k)

    return bump


def into_the_door(line: Any) -> list[Line]:
    """While it hovers beside the closed door, the flyer enters its region, which it reserves."""
    return [
        Reserve(line.robot, 47, line.t0),
        curve(x=there_and_back(2.7))(line),
        Release(line.robot, 47, line.t1),
    ]


def jump_by_reset(line: Any) -> list[Line]:
    resets = [Reset(line.robot, t, 0, 0, 0, "") for t in (line.t0, line.t1)]
    return [*resets, curve(x=by(0.5))(line)]


def longer(line: Any) -> Any:
    (only,) = line.parts
    return replace(line, t1=line.t1 + 0.01, parts=(replace(only, seconds=only.seconds + 0.01),))


def part(field: str, index: int, **changes: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Change one of the rows of a segment."""

    def change(line: Any) -> Any:
        rows = [*getattr(line, field)]
        new = {name: how(getattr(rows[index], name)) for name, how in changes.items()}
        rows[index] = replace(rows[index], **new)
        return replace(line, **{field: tuple(rows)})

    return change


def plus(more: float) -> Callable[[float], float]:
    return lambda value: value + more


def at(index: int, value: float) -> Callable[[tuple[float, ...]], tuple[float, ...]]:
    return lambda state: (*state[:index], value, *state[index + 1 :])


def foot_and_pressure(line: Any) -> Any:
    """The whole third step lands 5 cm ahead, so it does not carry the mass from start to goal."""
    for index, ends in ((3, ("to_x",)), (4, ("x", "to_x")), (5, ("x",))):
        line = part("phases", index, **dict.fromkeys(ends, plus(0.05)))(line)
    return part("feet", 2, x=plus(0.05))(line)


def carried(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Change a segment, and let its mass end where that leads it."""

    def changed(line: Any) -> Any:
        line = change(line)
        state = np.array(line.start)
        omega = motion(DOOR).header.robots[line.robot]["omega"]
        for phase in line.phases:
            ends = np.array([phase.x, phase.y]), np.array([phase.to_x, phase.to_y])
            state = advanced(state, *ends, phase.seconds, omega)
        return replace(line, goal=tuple(state.tolist()))

    return changed


def hasty(line: Any) -> Any:
    """Each foot leaves the ground as the other lands: the centre of pressure would have to jump."""
    feet = [*line.feet]
    for index, (one, other) in enumerate(pairwise(line.feet)):
        feet[index] = replace(feet[index], up=(one.up + other.down) / 2)
        feet[index + 1] = replace(other, down=(one.up + other.down) / 2)
    return replace(line, feet=tuple(feet))


DAMAGES: dict[str, tuple[Callable[[Any], bool], Callable[[Any], Any], str, str]] = {
    "a foot": (walks, part("feet", 2, x=plus(0.05)), "feet", "0.050 m from its foothold"),
    "a foot and its pressure": (walks, foot_and_pressure, "dynamics", "misses the"),
    "no double support": (walks, hasty, "support", "no foot is on the ground"),
    "a jump of the pressure": (
        *(walks, carried(part("phases", 2, x=plus(0.01)))),
        *("support", "the centre of pressure jumps"),
    ),
    "a jump of the pressure between moves": (
        *(stops, carried(part("phases", -1, to_x=plus(0.02)))),
        *("continuity", "its centre of pressure jumps by 0.0200 m"),
    ),
    "pressure beyond the sole": (
        *(stops, carried(part("phases", -1, to_x=plus(0.1), to_y=plus(0.1)))),
        *("support", "outside the feet on the ground"),
    ),
    "a phase that takes no time": (
        *(walks, part("phases", 1, seconds=lambda _: 0.0)),
        *("time", "a phase or a swing that takes no time"),
    ),
    "a foot that ends in the air": (
        walks,
        part("swings", 1, u1=lambda _: 0.9, goal=lambda goal: (goal[0] + 0.3, *goal[1:])),
        *("feet", "in the air where its step begins or ends"),
    ),
    "a foot that slides as it lands": (
        *(walks, part("swings", 0, goal=at(3, 0.3))),
        *("feet", "as it moves"),
    ),
    "a body that turns at once": (
        walks,
        lambda line: replace(line, turning=(line.turning[0] + 1, line.turning[1] + 1, 0, 0)),
        *("continuity", "its body jumps"),
    ),
    "a move in another tick": (
        *(walks, lambda line: replace(line, tick=line.tick + 1)),
        *("order", "the trace moves"),
    ),
    "pieces of one robot that overlap by 10 ms": (
        *(of(Flight), longer, "continuity", "overlap by 0.010 s"),
    ),
    "a jump between pieces": (of(Flight), curve(x=by(0.02)), "continuity", "jumps by 0.02"),
    "a jump that a reset explains": (flies, jump_by_reset, "continuity", "jumps by 0.5"),
    "a dive": (flies, curve(z=there_and_back(-2.0)), "altitude", "2.000 m off"),
    "a flyer that faces another way at once": (
        *(flies, curve(yaw=by(3.0)), "continuity", "jumps by"),
    ),
    "into a closed door": (
        lambda line: isinstance(line, Flight) and line.primitive == "hover" and line.to == 46,
        *(into_the_door, "room", "into region 47"),
    ),
    "a wall reserved": (
        *(later(Reserve), lambda line: replace(line, region=0)),
        *("clock", "region 0 at"),
    ),
    "a wall reserved after the run": (
        *(later(Reserve), lambda line: [line, replace(line, region=0, t=line.t + 1e6)]),
        *("clock", "region 0 at"),
    ),
    "a door in another region": (
        *(of(Action), lambda line: replace(line, region=48), "action", "in region 48, not 47"),
    ),
    "a push of a door for 10 ms": (
        *(of(Action), lambda line: replace(line, t1=line.t0 + 0.01), "action", "for 0.010 s"),
    ),
    "an action before its time": (
        *(of(Action), lambda line: replace(line, t0=line.t0 - 3, t1=line.t1 - 3)),
        *("action", "while it acts on door@47"),
    ),
    "an action half a second too long": (
        *(of(Action), lambda line: replace(line, t1=line.t1 + 0.5)),
        *("clock", "acts on door@47 until"),
    ),
    "a region released 10 ms early": (
        *(of(Release), lambda line: replace(line, t=line.t - 0.01), "clock", "never releases"),
    ),
    "a rest in place of an action": (
        *(of(Action), lambda _: [], "action", "never acts on door@47"),
    ),
    "an action of another robot": (
        *(of(Action), lambda line: replace(line, robot="quad")),
        *("action", "never acts on door@47"),
    ),
    "a move that the trace does not have": (
        lambda line: isinstance(line, Flight) and line.primitive == "hover" and line.to == 46,
        *(lambda line: replace(line, to=45), "order", "moves"),
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_line_is_refused(damage: str) -> None:
    pick, forge, rule, words = DAMAGES[damage]
    found = judged(damaged(motion(DOOR), pick, forge))
    assert any(f.rule == rule and words in f.found for f in found), found[:3]


@pytest.mark.parametrize(
    ("robot", "limits", "rule", "words"),
    [
        ("digit", {"step": 0.5}, "step", "more than 0.5"),
        ("digit", {"aside": 0.34}, "feet", "less than 0.34"),
        ("digit", {"friction": 0.2}, "friction", "more than 0.2"),
        ("digit", {"swing": 2.0}, "swing", "more than 2"),
        ("digit", {"stance": 0.3}, "stance", "more than 0.3"),
        ("digit", {"most_double": 0.19}, "double support", "to 0.19"),
        ("digit", {"least_double": 0.195}, "double support", "not 0.195"),
        ("digit", {"sole_length": 0.01}, "support", "outside the feet"),
        ("digit", {"omega": (9.0 / 0.8) ** 0.5}, "gravity", "9.0000 m/s^2, not 9.81"),
        ("digit", {"omega": (9.81 / 0.9) ** 0.5, "height": 0.9}, "dynamics", "misses"),
        ("quad", {"speed": 0.7}, "speed", "m/s, more than 0.7"),
        ("quad", {"tilt": 0.3}, "tilt", "m/s^2, more than 0.3"),
        ("digit", {"size": 0.01}, "header", "digit: 'size' is 0.01, in the trace 0.6"),
        ("digit", {"friction": 5.0}, "header", "digit: 'friction' is 5; the limit"),
        ("digit", {"least_double": 0.1}, "header", "digit: 'least_double' is 0.1; the limit"),
        ("quad", {"kind": "disc"}, "header", "quad: 'kind' is 'disc'"),
        ("quad", {"driven": "goals", "tolerance": 0.3, "gap": 9}, "header", "quad: it is driven"),
    ],
    ids=str,
)
def test_limits_are_those_of_the_trace_and_are_kept(
    robot: str, limits: dict[str, Any], rule: str, words: str
) -> None:
    """Stricter limits of the trace and the header; limits of the header alone that a robot does not
    have."""
    header, trace = motion(DOOR).header, trace_of(DOOR)
    robots = header.robots | {robot: header.robots[robot] | limits}
    told = dict(trace.header.scenario.robots)
    if rule != "header":
        told[robot] = replace(told[robot], motion={**(told[robot].motion or {}), **limits})
    scenario = replace(trace.header.scenario, robots=told)
    changed = replace(trace, header=replace(trace.header, scenario=scenario))
    found = check_motion(replace(motion(DOOR), header=replace(header, robots=robots)), changed)
    assert any(f.rule == rule and words in f.found for f in found), found[:3]


def test_another_origin_than_that_of_the_trace_is_refused() -> None:
    header = replace(motion(DOOR).header, origin=(1.0, 0.0, 0.0))
    (found,) = judged(replace(motion(DOOR), header=header))
    assert found.rule == "header" and "origin" in found.found


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"kind":"walker",', "", "'kind' is missing"),
        ('"clearance":', '"low":', "'clearance' is missing"),
        ('"stance":', '"low":', "'stance' is missing"),
        ('"type":"reserve","robot":"digit"', '"type":"reserve","robot":"d"', "d is not a robot"),
        ('"phases":[[', '"phases":[],"more":[[', "a piece of motion without parts"),
        ('"side":2.7', '"side":1e-9', "regions; expected less than 1000"),
        ('"swings":[[', '"swings":[[1,0,1e9,0,1,STILL,STILL],[', "a piece of 1,000,000"),
        ('"makespan":', '"makespan":1e12,"m":', "a makespan of 1e[+]12 s"),
    ],
    ids=[
        *("kind", "clearance", "stance", "stranger", "no phases", "tiny regions"),
        *("a foot in the air", "an eternity"),
    ],
)
def test_a_contradictory_motion_file_is_refused(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    """Pages and tables raised KeyError, ValueError, IndexError; the check filled the memory."""
    text = text_of(motion(DOOR)).replace(old, new.replace("STILL", "[0,0,0,0,0,0,0,0,0]"), 1)
    (path := tmp_path / "motion.jsonl").write_text(text)
    with pytest.raises(UsageError, match=said):
        judged(read_motion_of(path, trace_of(DOOR), path))


def test_body_pushed_into_a_wall_by_5_cm_is_refused() -> None:
    """A flight along the northern wall, shifted towards it."""
    found, world = motion(DOOR), trace_of(DOOR).header.scenario.map
    into = found.header.side / 2 - 0.25 + 0.05

    def along(line: Line) -> bool:
        if not isinstance(line, Flight) or abs(line.to - line.origin) != 1:
            return False
        row, col = divmod(line.to, world.cols)
        (only,) = line.parts
        return world.grid[row - 1][col] == "#" and not np.any(only.y[1:])

    refused = judged(damaged(found, along, curve(y=by(into))))
    assert any(f.rule == "room" and "reaches 0.050 m into region" in f.found for f in refused)


def test_a_missing_end_is_found_and_findings_are_sorted_by_time() -> None:
    lines = [line for line in motion(DOOR).lines if not (isinstance(line, Moving) and line.t0 > 50)]
    found = judged(replace(motion(DOOR), lines=tuple(lines)))
    assert any("the trace has" in f.found for f in found)
    assert [f.t for f in found] == sorted(f.t for f in found)


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
def test_a_rover_neither_spins_nor_starts_instantly_nor_slips(
    curves: tuple[Curve, ...], rule: str, words: str
) -> None:
    rovers = {n for n, own in motion("warehouse").header.robots.items() if own["kind"] == "rover"}

    def drives(line: Line) -> bool:
        return isinstance(line, Flight) and line.robot in rovers and line.tick > 3

    def forged(line: Flight) -> Flight:
        x, y = line.parts[0].x[0], line.parts[0].y[0]
        parts = tuple(replace(each, x=(x, *each.x[1:]), y=(y,)) for each in curves)
        return replace(line, parts=parts, t1=line.t0 + sum(each.seconds for each in curves))

    found = judged(damaged(motion("warehouse"), drives, forged), "warehouse")
    assert any(f.rule == rule and words in f.found for f in found)


def test_a_robot_without_charge_that_moves_is_refused() -> None:
    """It rolls by 0.3 m and back beside the drone that brings its battery."""
    trace = read_bytes(played(beside(__file__, "scenarios/flat.yaml")))
    good = motion_of(trace)
    assert check_motion(good, trace) == []
    flat = next(r.tick for r in trace.records if isinstance(r, Service))

    def rests(line: Line) -> bool:
        rest = isinstance(line, Flight) and line.primitive == "rest"
        return rest and line.robot == "cart" and line.tick == flat + 1

    (found,) = check_motion(damaged(good, rests, curve(x=there_and_back(0.3))), trace)
    assert found.rule == "charge"
    assert "cart: moves by 0.300 m without charge" in str(found)

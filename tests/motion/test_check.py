"""The checker accepts correct motions, and refuses each kind of damage (damages.yaml) with its
reason: lines that are wrong, and lines that are plausible each alone but endanger robots."""

import json
import os
import random
from collections.abc import Callable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from fleet.lab import driven
from motion.runs import SHIPPED, motion, trace_bytes
from motion.runs import played as traced
from once import beside, from_yaml
from safenav import InputError, Trace, UsageError, check_motion, motion_of
from safenav.motion.check.execution import trackings
from safenav.motion.check.verdict import read_motion_of
from safenav.motion.columns import report_of
from safenav.motion.file import parsed, text_of
from safenav.scenario.model import RobotModel
from safenav.trace.file import read_bytes
from support.missions import mission

DAMAGES = from_yaml(beside(__file__, "damages.yaml"))
OWN = sorted(path.stem for path in (Path(__file__).parent / "scenarios").glob("*.yaml"))
"""Scenarios of which a motion was once refused, or that show a rule."""
RUNS = int(os.environ.get("SAFENAV_FUZZ", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_SEED", "0"))
FAMILIES = ("apart_needs", "crowd_hidden", "apart", "tight_needs")
TICKS = 60
"""Runs are cut here: what is moved need not have come to an end."""


def accepted(trace: Trace) -> None:
    """The motion of a trace, as a reader of its file has it, breaks no rule."""
    assert check_motion(parsed(text_of(motion_of(trace)).encode(), "made"), trace) == []


@pytest.mark.parametrize("name", [*SHIPPED, *OWN])
def test_the_motion_of_a_scenario_is_accepted(name: str) -> None:
    made, trace, _ = good(name)
    assert check_motion(parsed(made.encode(), name), trace) == []


def missions(seed: int) -> Iterator[dict[str, Any]]:
    """Missions of two robots or more, whose models move as walkers, flyers, rovers and discs."""
    while True:
        data, chance = mission(FAMILIES[seed % len(FAMILIES)], seed), random.Random(seed)
        for model in data.get("catalogue", {}).get("robots", {}).values():
            free = "flyer" if model["layer"] == "air" else chance.choice(("rover", "disc", "flyer"))
            walks = model["mobility"] == "heading"
            model["motion"] = "walker" if walks else free
            model["size"] = chance.choice((0.4, 0.5, 0.6))
            model["speed"] = 0.45 if walks else chance.choice((0.5, 1.0))
        if len(data["robots"]) > 1:
            yield data | {"limits": {"ticks": TICKS}}
        seed += 1


@pytest.mark.parametrize("data", [*islice(missions(FIRST), RUNS)], ids=lambda data: data["name"])
def test_a_random_mission_is_moved(data: dict[str, Any], played: Callable[[], None]) -> None:
    accepted(read_bytes(traced(json.dumps(data))))
    played()


@pytest.mark.parametrize("seed", range(FIRST, FIRST + RUNS))
def test_a_random_run_with_many_keys_is_moved(seed: int, played: Callable[[], None]) -> None:
    data = mission("metric", seed)
    data["limits"] |= {"ticks": TICKS} | ({"seconds": 300} if data.get("clock") == "live" else {})
    accepted(read_bytes(traced(json.dumps(data))))
    played()


@cache
def good(name: str) -> tuple[str, Trace, str]:
    """A motion without damage, and its trace: of a scenario, of the same with simulated flights
    (``tracked``), or of a drive of three robots that track references, and one that finds its own
    way to goals."""
    if name in SHIPPED:
        content, made = trace_bytes(name), motion(name)
    elif name == "drive":
        pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
        drive = driven(goals=("spot",))
        content, made = "".join(f"{line}\n" for line in drive.lines).encode(), drive.motion
    elif name == "tracked":
        content = trace_bytes("case_study_1")
        made = motion_of(read_bytes(content), track=True)
    else:
        content = traced(beside(__file__, f"scenarios/{name}.yaml"))
        made = motion_of(read_bytes(content))
    return text_of(made), read_bytes(content), content.decode()


def at(line: Any, path: str) -> tuple[Any, Any]:
    """What holds the value at a path, and its key there."""
    *steps, last = [int(s) if s.lstrip("-").isdigit() else s for s in path.split(".")]
    for step in steps:
        line = line[step]
    return line, last


def carried(state: Any, phase: list[float], omega: float) -> Any:
    """The state of a mass after a phase."""
    seconds, before, after = phase[0], np.array(phase[1:3]), np.array(phase[3:])
    rate, (place, speed) = (after - before) / (omega * seconds), np.split(state, 2)
    grow = np.exp(omega * seconds)
    xi = after + rate + (place + speed / omega - before - rate) * grow
    eta = after - rate + (place - speed / omega - before + rate) / grow
    return np.concatenate([(xi + eta) / 2, omega * (xi - eta) / 2])


def changed(lines: list[Any], rows: dict[str, Any]) -> None:
    """Change the rows of a robot, measured or of its simulated flight: numbers at places of them,
    or all but ``every`` so many, or ``without`` those of some seconds."""
    begin, end = rows.get("seconds", (-1.0, 1e9))
    for line in lines:
        if line.get("robot") != rows["robot"] or "rows" not in line:
            continue
        kept = []
        for number, row in enumerate(line["rows"]):
            now = line["t0"] + number * line["step"] if line["type"] == "track" else row[0]
            inside = begin < now < end
            for index, value in rows.get("set", {}).items():
                row[index] = value if inside else row[index]
            for index, more in rows.get("add", {}).items():
                row[index] += more * inside
            for index, factor in rows.get("times", {}).items():
                row[index] *= factor if inside else 1
            if number % rows.get("every", 1) == 0 and not (inside and rows.get("without")):
                kept.append(row)
        line["rows"] = kept
    lines[:] = [line for line in lines if line.get("rows") != []]


def damaged(text: str, damage: dict[str, Any]) -> str:
    lines = [json.loads(line) for line in text.splitlines()]
    if "rows" in damage:
        changed(lines, damage["rows"])
    wanted = damage.get("line", {"type": "header"}).items()
    chosen = [index for index, line in enumerate(lines) if wanted <= line.items()]
    index = chosen[damage.get("number", 1) - 1]
    line = lines[index]
    for path, value in damage.get("set", {}).items():
        held, key = at(line, path)
        held[key] = value
    for path, more in damage.get("add", {}).items():
        held, key = at(line, path)
        held[key] += more
    for path in damage.get("without", ()):
        held, key = at(line, path)
        del held[key]
    for path, value in damage.get("insert", {}).items():
        held, key = at(line, path)
        held.insert(key, value)
    for axis, metres in damage.get("bump", {}).items():
        ((seconds, *axes),) = line["curves"]
        k, path = metres / (seconds / 2) ** 4, axes["xyz".index(axis)]
        path[:] = [path[0], 0.0, k * seconds**2, -2 * k * seconds, k]
    if damage.get("carried"):
        state, omega = np.array(line["start"]), lines[0]["robots"][line["robot"]]["omega"]
        for phase in line["phases"]:
            state = carried(state, phase, omega)
        line["goal"] = state.tolist()
    also = [
        {k: line.get(v, v) if k == "t" else v for k, v in more.items()}
        for more in damage.get("also", ())
    ]
    lines[index : index + 1] = [*([] if damage.get("gone") else [line]), *also]
    if damage.get("gone") == "all":
        lines = [line for line in lines if not wanted <= line.items()]
    return "".join(json.dumps(line) + "\n" for line in lines)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage["name"])
def test_a_damaged_motion_is_refused(
    damage: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, trace, content = good(damage.get("scenario", "case_study_1"))
    if "trace" in damage:
        told = read_bytes(damaged(content, damage["trace"]).encode())
        trace = replace(told, digest=trace.digest)
    if "limits" in damage:
        made = parsed(whole.encode(), "motion")
        ((robot, limits),) = damage["limits"].items()
        robots = made.header.robots | {robot: made.header.robots[robot] | limits}
        whole = text_of(replace(made, header=replace(made.header, robots=robots)))
        kept = {one.model.name: one.model.figures or {} for one in trace.robots.values()}
        kept[trace.robots[robot].model.name] |= limits
        monkeypatch.setattr(RobotModel, "figures", property(lambda of: kept[of.name]))
    text = damage["file"] if "file" in damage else damaged(whole, damage)
    (path := tmp_path / "motion.jsonl").write_text(text)
    if "refused" in damage:
        with pytest.raises((InputError, UsageError), match=damage["refused"]):
            check_motion(read_motion_of(path, trace, path), trace)
        return
    made = parsed(text.encode(), "motion")
    found = check_motion(made, trace)
    assert [f.t for f in found] == sorted(f.t for f in found)
    assert {type(f.t) for f in found} <= {float}  # as JSON needs it
    for rule, words in damage["finds"].items():
        assert any(f.rule == rule and words in str(f) for f in found), found[:4]
    if damage.get("alone", damage["finds"] == {}):
        assert {f.rule for f in found} == {*damage["finds"]}, found[:4]
    if "header" in damage["finds"]:
        with pytest.raises(UsageError, match="recompute it: safenav export"):
            read_motion_of(path, trace, path)
    for robot, words in damage.get("tracked", {}).items():
        (tracked,) = [str(one) for one in trackings(made, trace) if one.robot == robot]
        assert all(word in tracked for word in words), tracked


def test_a_walker_that_goes_backwards_is_refused() -> None:
    whole, trace, _ = good("case_study_1")
    lines = [json.loads(line) for line in whole.splitlines()]
    for line in lines:
        turning = line.get("turning", [])
        turning[:2] = [yaw + np.pi for yaw in turning[:2]]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    found = check_motion(parsed(text.encode(), "motion"), trace)
    assert {finding.rule for finding in found} == {"turning"}


def test_feet_that_point_apart_are_refused() -> None:
    whole, trace, _ = good("case_study_1")
    lines = [json.loads(line) for line in whole.splitlines()]
    for line in lines:
        for foot in line.get("feet", ()):
            foot[2] += foot[3] * np.pi / 2
        for side, *_, start, goal in line.get("swings", ()):
            start[2], goal[2] = (state[2] + side * np.pi / 2 for state in (start, goal))
    text = "".join(json.dumps(line) + "\n" for line in lines)
    found = check_motion(parsed(text.encode(), "motion"), trace)
    assert {finding.rule for finding in found} == {"feet"}


def test_the_errors_of_simulated_flights_are_reported() -> None:
    tracked = parsed(good("tracked")[0].encode(), "tracked")
    assert "simulated flight of quad: at most 0.00" in report_of(tracked)

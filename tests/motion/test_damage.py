"""The checker accepts correct motions, and refuses each kind of damage (damages.yaml) with its
reason: lines that are wrong, and lines that are plausible each alone but endanger robots."""

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import SHIPPED, motion, played, trace_of
from once import beside, from_yaml
from safenav.errors import InputError, UsageError
from safenav.motion.check.verdict import check_motion, read_motion_of
from safenav.motion.file import Motion, parsed, text_of
from safenav.motion.making import motion_of
from safenav.scenario.model import RobotModel
from safenav.trace.file import Trace, read_bytes

DAMAGES = from_yaml(beside(__file__, "damages.yaml"))


@pytest.mark.parametrize("name", SHIPPED)
def test_motion_of_a_shipped_scenario_is_accepted(name: str) -> None:
    assert check_motion(motion(name), trace_of(name)) == []


@cache
def good(name: str) -> tuple[Motion, Trace]:
    """A motion without damage, and its trace."""
    if name in SHIPPED:
        return motion(name), trace_of(name)
    trace = read_bytes(played(beside(__file__, f"scenarios/{name}.yaml")))
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    return made, trace


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


def damaged(text: str, damage: dict[str, Any]) -> str:
    lines = [json.loads(line) for line in text.splitlines()]
    wanted = damage["line"].items()
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
    return "".join(json.dumps(line) + "\n" for line in lines)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage["name"])
def test_a_damaged_motion_is_refused(
    damage: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, trace = good(damage.get("scenario", "case_study_1"))
    for robot, limits in damage.get("limits", {}).items():
        robots = whole.header.robots | {robot: whole.header.robots[robot] | limits}
        whole = replace(whole, header=replace(whole.header, robots=robots))
        figures = {**(trace.robots[robot].model.figures or {}), **limits}
        kept = {name: each.model.figures for name, each in trace.robots.items()} | {robot: figures}
        by_model = {trace.robots[name].model.name: each for name, each in kept.items()}
        monkeypatch.setattr(RobotModel, "figures", property(lambda of: by_model[of.name]))  # noqa: B023
    text = damaged(text_of(whole), damage) if "line" in damage else text_of(whole)
    (path := tmp_path / "motion.jsonl").write_text(text)
    if "refused" in damage:
        with pytest.raises((InputError, UsageError), match=damage["refused"]):
            check_motion(read_motion_of(path, trace, path), trace)
        return
    found = check_motion(parsed(text.encode(), "motion"), trace)
    assert [f.t for f in found] == sorted(f.t for f in found)
    for rule, words in damage["finds"].items():
        assert any(f.rule == rule and words in str(f) for f in found), found[:4]
    if "header" in damage["finds"]:
        with pytest.raises(UsageError, match="recompute it: safenav export"):
            read_motion_of(path, trace, path)

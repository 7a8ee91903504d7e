"""The checker accepts correct motions, and refuses each kind of damage (damages.yaml) with its
reason: lines that are wrong, and lines that are plausible each alone but endanger robots."""

import hashlib
import json
import os
import random
import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from fleet.drives import lines_of
from motion.runs import SHIPPED, findings, motion, moved, written
from motion.runs import played as traced
from once import SCENARIOS, beside, from_yaml, made_once, trace_of_shipped
from safenav import check_motion, motion_of, read_trace
from support.missions import mission
from warm import safenav

DAMAGES, REFUSALS = (
    from_yaml(beside(__file__, f"{name}.yaml")) for name in ("damages", "refusals")
)
LIMITS = [damage for damage in DAMAGES if "limits" in damage]
OWN = sorted(path.stem for path in (Path(__file__).parent / "scenarios").glob("*.yaml"))
"""Scenarios of which a motion was once refused, or that show a rule."""
RUNS = int(os.environ.get("SAFENAV_FUZZ", "12"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_SEED", "0"))
FAMILIES = ("apart_needs", "crowd_hidden", "apart", "tight_needs")
TICKS = 60
"""Runs are cut here: what is moved need not have come to an end."""


def accepted(trace: Path) -> None:
    """The motion of a trace breaks no rule."""
    run = read_trace(trace)
    assert check_motion(motion_of(run), run) == []


@cache
def trace_of(name: str) -> Path:
    """The trace of a shipped scenario, or of one of this folder."""
    if name in SHIPPED:
        return trace_of_shipped(name)

    def make(folder: Path) -> None:
        content = traced(beside(__file__, f"scenarios/{name}.yaml"))
        (folder / "own.jsonl").write_bytes(content)

    return made_once(f"run of motion {name}", make) / "own.jsonl"


@pytest.mark.parametrize("name", [*SHIPPED, *OWN])
def test_the_motion_of_a_scenario_is_accepted(name: str) -> None:
    accepted(trace_of(name))


def test_the_motion_of_a_resumed_run_is_accepted(tmp_path: Path) -> None:
    """A walker's first step then takes as long as from where it stands and faces."""
    trace, rest = tmp_path / "t.jsonl", tmp_path / "rest.jsonl"
    safenav("run", SCENARIOS / "case_study_1.yaml", "--clock", "live", "--trace", trace)
    lines = trace.read_bytes().splitlines(keepends=True)
    trace.write_bytes(b"".join(lines[: len(lines) // 2]))
    assert safenav("resume", trace, "--trace", rest).returncode == 0
    accepted(rest)


def missions(seed: int) -> Iterator[dict[str, Any]]:
    """Missions of two robots or more, whose models move as walkers, flyers, rovers and discs."""
    while True:
        data, chance = mission(FAMILIES[seed % len(FAMILIES)], seed), random.Random(seed)
        for model in data.get("catalogue", {}).get("robots", {}).values():
            free = "flyer" if model["layer"] == "air" else chance.choice(("rover", "disc", "flyer"))
            walks = model["mobility"] == "heading"
            model["motion"] = "walker" if walks else free
            model["size"] = chance.choice((0.4, 0.5, 0.6))
            model["speed"] = chance.choice((0.4, 0.45, 1.0) if walks else (0.5, 1.0))
        if len(data["robots"]) > 1:
            yield data | {"limits": {"ticks": TICKS}}
        seed += 1


@cache
def drawn() -> list[dict[str, Any]]:
    return [*islice(missions(FIRST), RUNS)]


@pytest.mark.parametrize("number", range(RUNS))
def test_the_motion_of_a_random_mission_is_accepted(
    number: int, played: Callable[[], None], tmp_path: Path
) -> None:
    (trace := tmp_path / "t.jsonl").write_bytes(traced(json.dumps(drawn()[number])))
    accepted(trace)
    played()


@pytest.mark.parametrize("seed", range(FIRST, FIRST + RUNS))
def test_the_motion_of_a_random_run_with_many_scenario_keys_is_accepted(
    seed: int, played: Callable[[], None], tmp_path: Path
) -> None:
    data = mission("metric", seed)
    data["limits"] |= {"ticks": TICKS} | ({"seconds": 300} if data.get("clock") == "live" else {})
    (trace := tmp_path / "t.jsonl").write_bytes(traced(json.dumps(data)))
    accepted(trace)
    played()


@cache
def good(name: str) -> tuple[Path, Path]:
    """A trace and its motion without damage: of a scenario, or of the same with simulated flights
    (``tracked``)."""
    if name in SHIPPED:
        return trace_of_shipped(name), motion(name)
    trace = trace_of("case_study_1" if name == "tracked" else name)
    more = ["--track"] if name == "tracked" else []
    folder = made_once(f"motion of {name}", lambda at: moved(trace, at, *more))
    return trace, folder / f"{trace.stem}.motion.jsonl"


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
    """Change the rows of a robot's simulated flight: numbers at places of them, or all but
    ``every`` so many, or ``without`` those of some seconds."""
    begin, end = rows.get("seconds", (-1.0, 1e9))
    for line in lines:
        if line.get("robot") != rows["robot"] or "rows" not in line:
            continue
        kept = []
        for number, row in enumerate(line["rows"]):
            inside = begin < line["t0"] + number * line["step"] < end
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


def damaged(file: Path, damage: dict[str, Any]) -> list[Any]:
    """The lines of a file after a damage."""
    lines: list[Any] = lines_of(file)
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
    return lines


@cache
def judged(name: str) -> dict[str, Any]:
    """What the check says of the damaged motions of a trace, by the damage."""
    trace, whole = good(name)
    mine = [one for one in DAMAGES if one.get("scenario", "case_study_1") == name]
    mine = [one for one in mine if not one.keys() & {"trace", "limits", "file"}]

    def make(folder: Path) -> None:
        files = [folder / f"{number}.jsonl" for number in range(len(mine))]
        for file, damage in zip(files, mine, strict=True):
            written(damaged(whole, damage), file)
        (folder / "found.json").write_text(json.dumps(findings(trace, *files)))

    found = json.loads((made_once(f"damaged {name}", make) / "found.json").read_text())
    return {damage["name"]: said for damage, said in zip(mine, found, strict=True)}


def of_another_trace(damage: dict[str, Any], folder: Path) -> tuple[Path, Path]:
    """A damaged trace, and a damaged motion that names it as its own."""
    trace, whole = good(damage["scenario"])
    told = written(damaged(trace, damage["trace"]), folder / "told.jsonl")
    header, *lines = damaged(whole, damage)
    digest = hashlib.sha256(told.read_bytes()).hexdigest()
    return told, written([header | {"trace": digest}, *lines], folder / "motion.jsonl")


@pytest.mark.parametrize(
    "damage",
    [one for one in DAMAGES if not one.keys() & {"limits", "file"}],
    ids=lambda damage: damage["name"],
)
def test_a_damaged_motion_is_refused(damage: dict[str, Any], tmp_path: Path) -> None:
    name = damage.get("scenario", "case_study_1")
    if "trace" in damage:
        (said,) = findings(*of_another_trace(damage, tmp_path))
    else:
        said = judged(name)[damage["name"]]
    if "refused" in damage:
        assert re.search(damage["refused"], said["error"])
        return
    found = said["findings"]
    assert [f["t"] for f in found] == sorted(f["t"] for f in found)
    for rule, words in damage["finds"].items():
        assert any(f["rule"] == rule and words in told(f) for f in found), found[:4]
    if damage.get("alone", damage["finds"] == {}):
        assert {f["rule"] for f in found} == {*damage["finds"]}, found[:4]


def told(finding: dict[str, Any]) -> str:
    return f"t = {finding['t']:.3f} s: {finding['robot']}: {finding['found']}"


@pytest.mark.parametrize("row", REFUSALS, ids=lambda row: row["name"])
def test_a_trace_without_a_possible_motion_is_refused_with_the_reason(
    row: dict[str, Any], tmp_path: Path
) -> None:
    lines = damaged(trace_of(row.get("scenario", "hello")), row.get("trace", {}))
    trace, file = written(lines, tmp_path / "t.jsonl"), tmp_path / "m.jsonl"
    done = safenav("export", trace, "--motion", file, *row.get("options", ()))
    assert done.returncode == 2 and re.search(row["says"], done.stderr)


@pytest.mark.parametrize("damage", LIMITS, ids=lambda damage: damage["name"])
def test_a_motion_must_keep_the_limits_of_its_trace(
    damage: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each of them is in the header and in the trace."""
    trace = read_trace(trace_of("case_study_1"))
    made = motion_of(trace)
    ((robot, limits),) = damage["limits"].items()
    robots = made.header.robots | {robot: made.header.robots[robot] | limits}
    models = {one.model.name: one.model for one in trace.robots.values()}
    kept = {name: model.figures for name, model in models.items()}
    name = trace.robots[robot].model.name
    figures = kept[name]
    assert figures is not None
    kept[name] = replace(figures, values={**figures.values, **limits})
    monkeypatch.setattr(type(models["digit"]), "figures", property(lambda of: kept[of.name]))
    found = check_motion(replace(made, header=replace(made.header, robots=robots)), trace)
    ((rule, words),) = damage["finds"].items()
    assert any(f.rule == rule and words in str(f) for f in found), found[:4]


@pytest.mark.parametrize(
    "damage", [one for one in DAMAGES if "file" in one], ids=lambda damage: damage["name"]
)
def test_only_a_motion_file_is_read_as_a_motion(damage: dict[str, Any], tmp_path: Path) -> None:
    (file := tmp_path / "motion.jsonl").write_text(damage["file"])
    done = safenav("export", trace_of("case_study_1"), file, "-o", tmp_path / "x.csv")
    assert done.returncode == 2 and re.search(damage["refused"], done.stderr)


def test_a_swing_without_duration_does_not_stop_an_export(tmp_path: Path) -> None:
    """The duration of a swing is a divisor."""
    (damage,) = [one for one in DAMAGES if one["name"] == "a swing takes no time"]
    trace, whole = good("case_study_1")
    file = written(damaged(whole, damage), tmp_path / "m.jsonl")
    assert safenav("export", trace, file, "-o", tmp_path / "m.npz").returncode == 0


@pytest.mark.parametrize("wrong", ["trace", "gap", "reversed"])
def test_a_motion_of_another_trace_or_with_wrong_times_is_refused(
    wrong: str, tmp_path: Path
) -> None:
    (trace, whole), other = good("case_study_1"), motion("hello")
    if wrong != "trace":
        lines = lines_of(whole)
        first, second = [line for line in lines if line.get("robot") == "quad" and "t1" in line][:2]
        first["t1"] = second["t0"] = first["t0"] - 1
        if wrong == "gap":
            first["t1"] += 2
        other = written(lines, tmp_path / "m.jsonl")
    for words in (("replay", trace, "--3d", "--motion", other), ("export", trace, other)):
        done = safenav(*words, "-o", tmp_path / ("x.html" if words[0] == "replay" else "x.csv"))
        assert done.returncode == 2 and "recompute it: safenav export" in done.stderr


@pytest.mark.parametrize(("by", "rule"), [(0.02, "turning"), (np.pi, "feet")])
def test_a_walker_that_faces_off_its_path_is_refused(by: float, rule: str, tmp_path: Path) -> None:
    trace, whole = good("case_study_1")
    lines = lines_of(whole)
    for turning in (line.get("turning", []) for line in lines):
        turning[:2] = [yaw + by for yaw in turning[:2]]
    (said,) = findings(trace, written(lines, tmp_path / "m.jsonl"))
    assert {finding["rule"] for finding in said["findings"]} == {rule}


def test_feet_that_point_apart_are_refused(tmp_path: Path) -> None:
    trace, whole = good("case_study_1")
    lines = lines_of(whole)
    for line in lines:
        for foot in line.get("feet", ()):
            foot[2] += foot[3] * np.pi / 2
        for side, *_, start, goal in line.get("swings", ()):
            start[2], goal[2] = (state[2] + side * np.pi / 2 for state in (start, goal))
    (said,) = findings(trace, written(lines, tmp_path / "m.jsonl"))
    assert {finding["rule"] for finding in said["findings"]} == {"feet"}

"""Checkpoints: an interrupted run and its continuation are the run that was not interrupted."""

import json
import random
from functools import reduce
from operator import getitem
from pathlib import Path

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from runtime.worlds import Driven
from safenav import (
    Clock,
    InputError,
    Mission,
    Scenario,
    TraceWriter,
    UsageError,
    check_trace,
    load_scenario,
    load_scenario_text,
    read_trace,
    resumption,
)
from safenav.runtime.run.checkpoint import sealed
from safenav.trace.records import Checkpoint
from scenario.mistakes import places, recorded
from warm import safenav


def interrupted(name: str, passes: int, folder: Path) -> Path:
    """The trace of a run of a shipped scenario that is interrupted after some passes."""
    path = folder / "part.jsonl"
    with TraceWriter(path) as writer:
        mission = Mission(shipped(name), listeners=[writer], checkpoints=True)
        mission.start()
        for _ in range(passes):
            mission.step()
        assert mission.result is None
        mission.give_up()
    return path


def write(lines: list[object], path: Path) -> None:
    """Write a trace as it was written, with other values."""
    told = (json.dumps(line, separators=(",", ":"), ensure_ascii=False) for line in lines)
    path.write_text("".join(f"{line}\n" for line in told))


def shipped(name: str) -> Scenario:
    return load_scenario(SCENARIOS / f"{name}.yaml")


def test_a_run_continues_beyond_its_limit(tmp_path: Path) -> None:
    """Its trace is that of one run, so its header has the limit that holds, and its checkpoints
    belong to that header."""
    scenario, path = shipped("case_study_1"), tmp_path / "t.jsonl"
    short = replace(scenario, limits=replace(scenario.limits, ticks=30))
    with TraceWriter(path) as writer:
        Mission(short, listeners=[writer], checkpoints=True).run()
    begun = resumption(read_trace(path), scenario)
    with TraceWriter(tmp_path / "whole.jsonl") as writer:
        assert Mission(scenario, listeners=[writer], begun=begun).run().outcome == "completed"
    lines = (tmp_path / "whole.jsonl").read_text().splitlines(keepends=True)
    assert check_trace(lines).ok
    end = next(n for n, line in enumerate(lines) if json.loads(line)["type"] == "resumed")
    path.write_text("".join(lines[:end]))
    assert resumption(read_trace(path), scenario).kept.state.time > 0


def test_runs_that_cannot_be_resumed_are_refused(tmp_path: Path) -> None:
    hello, path = shipped("hello"), interrupted("hello", 5, tmp_path)
    trace, (robot,) = read_trace(path), hello.robots
    text = (SCENARIOS / "hello.yaml").read_text()

    def more(key: str, value: object) -> Scenario:
        return load_scenario_text(f"{text}{key}: {json.dumps(value)}\n", hello.source)

    change = {"at": 9, "robot": robot.name, "service": "out"}
    for why, scenario in {
        "the scenario is not that of .*: it differs in map and": shipped("corridor_swap"),
        "it differs in changes": more("changes", [change]),
        "it differs in inputs": more("inputs", {"alarm": {"at": 9}}),
        "it differs in resolve_within": replace(hello, resolve_within=9),
        "it differs in tiles": replace(hello, tiles=(2, 2)),
        "is the trace of a run in ticks": replace(hello, clock=Clock.LIVE),
    }.items():
        with pytest.raises(UsageError, match=why):
            resumption(trace, scenario)
    # Its trace says that it was simulated, so what real robots do would break its rules.
    begun = resumption(trace, hello)
    mission = Mission(hello, world=Driven(hello), begun=begun)
    with pytest.raises(UsageError, match="began in its simulation: continue it there"):
        mission.run()
    with pytest.raises(UsageError, match="began in an external world: continue it there"):
        Mission(hello, begun=replace(begun, kept=replace(begun.kept, truth=None))).run()
    *_, last = (line for line in trace.records if isinstance(line, Checkpoint))
    newer = sealed(replace(last, run={**last.run, "more": 1}), trace.first)
    with pytest.raises(UsageError, match="another version of safenav wrote its checkpoints"):
        resumption(replace(trace, records=(*trace.records, newer)), hello)
    lines = path.read_text().splitlines()
    path.write_text("".join(line + "\n" for line in lines if '"checkpoint"' not in line))
    with pytest.raises(UsageError, match="the trace ends before its first checkpoint"):
        resumption(read_trace(path), hello)
    with TraceWriter(path) as writer:
        Mission(hello, listeners=[writer], checkpoints=True).run()
    with pytest.raises(UsageError, match="nothing to resume"):
        resumption(read_trace(path), hello)


def test_a_changed_checkpoint_is_refused(tmp_path: Path) -> None:
    """Every change of one value of a checkpoint is refused."""
    scenario = shipped("case_study_3")
    path = interrupted("case_study_3", 12, tmp_path)
    lines = path.read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if json.loads(line)["type"] == "checkpoint")
    draw = random.Random(1)
    run = json.loads(lines[at])["run"]
    for place in draw.sample([*places(run)], 60):
        data = json.loads(lines[at])
        holder = reduce(getitem, place[:-1], data["run"])
        holder[place[-1]] = draw.choice([-1, 7, 10**30, None, "x", [], {}, True, 0.5])
        if data["run"] == run:
            continue
        path.write_text("\n".join([*lines[:at], json.dumps(data), *lines[at + 1 :]]) + "\n")
        with pytest.raises((UsageError, InputError)):
            resumption(read_trace(path), scenario)


def test_a_changed_header_is_refused(tmp_path: Path) -> None:
    path = interrupted("corridor_swap", 2, tmp_path)
    header, *lines = map(json.loads, path.read_text().splitlines())
    header["scenario"]["robots"][0]["model"]["timing"] = 2
    write([header, *lines], path)
    done = safenav("resume", path)
    assert done.returncode == 2 and "the header was changed" in done.stderr, done.stderr


def test_a_checkpoint_that_contradicts_its_lines_is_refused(tmp_path: Path) -> None:
    """Robots are where the lines before it leave them."""
    path = interrupted("case_study_1", 12, tmp_path)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    before = [line["lines"] for line in lines if line["type"] == "checkpoint"][-1]
    last = [line for line in lines[:before] if line.get("from") != line.get("to")][-1]
    last["to"] = last["from"]
    write(lines, path)
    done = safenav("resume", path)
    told = f"a checkpoint has {last['robot']} in"
    assert done.returncode == 2 and told in done.stderr, done.stderr


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_scenario_is_read_back_from_its_trace(path: Path, tmp_path: Path) -> None:
    recorded(load_scenario(path), tmp_path / "t.jsonl")

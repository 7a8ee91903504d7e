"""Checkpoints: an interrupted run and its continuation are the run that was not interrupted."""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from safenav.checked_trace import check_trace
from safenav.errors import InputError, UsageError
from safenav.runtime.run.checkpoint import _digest, resumption
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.trace import records
from safenav.trace.fields import convert, plain
from safenav.trace.reading import read_trace
from safenav.trace.writing import TraceWriter, as_data
from warm import safenav

ROOT = Path(__file__).parents[2]


def interrupted(scenario: Scenario, passes: int, folder: Path) -> Path | None:
    """The trace of a run that is interrupted after some passes; None if it ends before."""
    lines = list[records.Record]()
    mission = Mission(scenario, listeners=[lines.append], checkpoints=True)
    mission.start()
    for _ in range(passes):
        if mission.result is not None:
            return None
        mission.step()
    if mission.result is not None:
        return None
    mission.give_up()
    path = folder / "part.jsonl"
    path.write_text("".join(json.dumps(as_data(line)) + "\n" for line in lines))
    return path


def test_a_run_continues_beyond_its_limit(tmp_path: Path) -> None:
    """Its trace is that of one run, so its header has the limit that holds."""
    scenario, path = load_scenario(ROOT / "scenarios" / "case_study_1.yaml"), tmp_path / "t.jsonl"
    short = replace(scenario, limits=replace(scenario.limits, ticks=20))
    with TraceWriter(path) as writer:
        Mission(short, listeners=[writer], checkpoints=True).run()
    begun, lines = resumption(read_trace(path), scenario), list[records.Record]()
    mission = Mission(scenario, listeners=[lines.append], begun=begun)
    assert mission.run().outcome == "completed"
    assert check_trace(json.dumps(as_data(line)) for line in lines).ok


def test_runs_that_cannot_be_resumed_are_refused(tmp_path: Path) -> None:
    hello = load_scenario(ROOT / "scenarios" / "hello.yaml")
    other = load_scenario(ROOT / "scenarios" / "corridor_swap.yaml")
    path = interrupted(hello, 5, tmp_path)
    assert path is not None
    with pytest.raises(UsageError, match=r"the scenario is not that of .*: it differs in map and"):
        resumption(read_trace(path), other)
    lines = path.read_text().splitlines()
    path.write_text("".join(line + "\n" for line in lines if '"checkpoint"' not in line))
    with pytest.raises(UsageError, match="it has no checkpoint"):
        resumption(read_trace(path), hello)
    whole = list[records.Record]()
    Mission(hello, listeners=[whole.append], checkpoints=True).run()
    path.write_text("".join(json.dumps(as_data(line)) + "\n" for line in whole))
    with pytest.raises(UsageError, match="nothing to resume"):
        resumption(read_trace(path), hello)


def test_a_changed_checkpoint_is_refused(tmp_path: Path) -> None:
    """Every change of one value of a checkpoint is refused."""
    scenario = load_scenario(ROOT / "scenarios" / "case_study_3.yaml")
    path = interrupted(scenario, 12, tmp_path)
    assert path is not None
    lines = path.read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if json.loads(line)["type"] == "checkpoint")
    draw = random.Random(1)
    run = json.loads(lines[at])["run"]
    for place in draw.sample([*places(run)], 60):
        data = json.loads(lines[at])
        changed(data["run"], place, draw.choice([-1, 7, 10**30, None, "x", [], {}, True, 0.5]))
        if data["run"] == run:
            continue
        path.write_text("\n".join([*lines[:at], json.dumps(data), *lines[at + 1 :]]) + "\n")
        with pytest.raises((UsageError, InputError)):
            resumption(read_trace(path), scenario)


def test_every_scenario_is_read_back_from_a_checkpoint() -> None:
    for path in sorted((ROOT / "scenarios").glob("*.yaml")):
        scenario = load_scenario(path)
        assert convert(Scenario, json.loads(json.dumps(plain(scenario)))) == scenario, path


def places(data: Any, before: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The place of each value in the data."""
    if before:
        yield before
    nested = data if isinstance(data, dict | list) else ()
    pairs = nested.items() if isinstance(nested, dict) else enumerate(nested)
    for key, value in pairs:
        yield from places(value, (*before, key))


def changed(data: Any, place: tuple[Any, ...], value: Any) -> None:
    for key in place[:-1]:
        data = data[key]
    data[place[-1]] = value


def test_a_made_up_checkpoint_is_refused_or_a_run(tmp_path: Path) -> None:
    """Its digest shows changes, not who has written it: its places, robots and requests are those
    of the scenario, and of the lines before it."""
    draw = random.Random(1)
    for name in ("case_study_3", "battery_delivery", "warehouse_orders", "corridor_swap"):
        path = interrupted(load_scenario(ROOT / "scenarios" / f"{name}.yaml"), 12, tmp_path)
        assert path is not None
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        at = next(n for n, line in enumerate(lines) if line["type"] == "checkpoint")
        run = lines[at]["run"]
        chosen = draw.sample([*places(run)], 6)
        wrong = [(place, draw.choice([-1, 1, 10**9, None, [], True, "x"])) for place in chosen]
        robot = ("state", "robots", 0)
        lies = [((*robot, "pose"), -1), ((*robot, "pose"), 10**9), (("due",), {"\ud800": 1})]
        lies += [(("state", "requests"), [99]), (("own", 0), {"visit": [10**9]})]
        other = next(p for p in read_trace(path).header.scenario.robots.values()).start
        lies += [((*robot, "pose"), other), ((*robot, "own"), [99, 0, False])]
        lies += [((*robot, "objective"), {"ltl": {"safety": ["nothing = 1"]}})]
        for place, value in (*wrong, *lies):
            made = json.loads(json.dumps(run))
            changed(made, place, value)
            made["sha256"] = "" if place == ("due",) else _digest(made)
            data = [*lines[:at], lines[at] | {"run": made}, *lines[at + 1 :]]
            path.write_text("".join(json.dumps(line) + "\n" for line in data))
            done = safenav("resume", path, "--max-ticks", 60)
            codes = (2,) if (place, value) in lies else (0, 1, 2, 3)
            assert done.returncode in codes, (name, place, value, done.stderr)
            assert "internal" not in done.stderr

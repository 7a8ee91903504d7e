"""Checkpoints: an interrupted run and its continuation are the run that was not interrupted."""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from safenav.checked_trace import check_trace
from safenav.errors import InputError, UsageError
from safenav.runtime.run.checkpoint import Kept, Moment, Resumption, _restored, resumption
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.team.team import team_of
from safenav.trace import records
from safenav.trace.reading import read_trace
from safenav.trace.writing import TraceWriter, as_data
from team.boards import scenario as board

ROOT = Path(__file__).parents[2]
SEEDS = range(40, 52)
OWN = {"checkpoint", "resumed", "outcome", "synthesis", "plan", "plan_end"}
"""Lines that a continuation may add, or write otherwise."""


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


def continued(begun: Resumption) -> tuple[str, list[str]]:
    lines = list[records.Record]()
    mission = Mission(begun.team.scenario, listeners=[lines.append], begun=begun)
    return mission.run().outcome, facts(lines)


def facts(lines: list[records.Record]) -> list[str]:
    return [json.dumps(as_data(line)) for line in lines if line.type not in OWN]


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


@pytest.mark.parametrize("seed", SEEDS)
def test_a_resumed_run_is_the_whole_run(seed: int, tmp_path: Path) -> None:
    scenario, whole = board(seed), list[records.Record]()
    ended = Mission(scenario, listeners=[whole.append]).run()
    for passes in (1, 4, 9):
        if (path := interrupted(scenario, passes, tmp_path)) is not None:
            outcome, lines = continued(resumption(read_trace(path), scenario))
            assert outcome == ended.outcome
            shared = all(scenario.robots[0].conflicts(other) for other in scenario.robots[1:])
            if shared and len(scenario.robots) > 1:  # joint plans alone: exactly the same
                assert lines == facts(whole)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_resumed_live_run_ends_as_the_whole_run(seed: int, tmp_path: Path) -> None:
    scenario = replace(board(seed), clock=Clock.LIVE)
    ended = Mission(scenario).run()
    for passes in (2, 9):
        if (path := interrupted(scenario, passes, tmp_path)) is not None:
            outcome, _ = continued(resumption(read_trace(path), scenario))
            assert outcome == ended.outcome


@pytest.mark.parametrize("seed", SEEDS)
def test_a_checkpoint_restores_each_state(seed: int) -> None:
    mission = Mission(board(seed))
    mission.start()
    while mission.result is None:
        moment = mission._run.moment()
        data = json.loads(json.dumps(as_data(record_of(moment))))
        team, state = _restored(team_of(mission.scenario), convert(data["run"]))
        plan, before = state.plan, moment.state.plan
        assert replace(state, plan=None) == replace(moment.state, plan=None)
        assert (plan and (plan.ways, plan.foreseen)) == (before and (before.ways, before.foreseen))
        assert [each.source for each in team.obstacles] == [o.source for o in moment.team.obstacles]
        mission.step()


def record_of(moment: Moment) -> records.Checkpoint:
    return records.Checkpoint(0, 1, msgspec.to_builtins(moment.kept()))


def convert(data: Any) -> Any:
    return msgspec.convert(data, Kept)


def test_what_cannot_be_resumed_is_refused(tmp_path: Path) -> None:
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


def test_a_hostile_checkpoint_is_refused_or_resumed(tmp_path: Path) -> None:
    """Every change of one value of a checkpoint is refused with its reason, or leads to a run."""
    scenario = load_scenario(ROOT / "scenarios" / "case_study_3.yaml")
    path = interrupted(scenario, 12, tmp_path)
    assert path is not None
    lines = path.read_text().splitlines()
    at = next(n for n, line in enumerate(lines) if json.loads(line)["type"] == "checkpoint")
    draw, refused = random.Random(1), 0
    run = json.loads(lines[at])["run"]
    every = [place for place in places(run) if place[0] != "scenario"]  # the file's is resumed
    for place in draw.sample(every, 60):
        data = json.loads(lines[at])
        changed(data["run"], place, draw.choice([-1, 7, 10**30, None, "x", [], {}, True, 0.5]))
        path.write_text("\n".join([*lines[:at], json.dumps(data), *lines[at + 1 :]]) + "\n")
        try:
            begun = resumption(read_trace(path), scenario)
            mission = Mission(scenario, begun=begun)
            mission.start()
            for _ in range(8):
                if mission.result is None:
                    mission.step()
        except (UsageError, InputError):
            refused += 1
    assert refused > 30


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

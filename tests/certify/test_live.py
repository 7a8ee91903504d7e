"""Runs in time, certified: bundles of shipped runs, told in seconds, and broken."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from audit.living import living
from audit.trace_script import edit, find
from certify.making import SCENARIOS, files_of, rewrite, run_checker, shipped
from certify.mutants import lines_of, with_lines
from safenav import Mission, TraceWriter, load_scenario
from safenav.certify.checker.check import Passes, Robot
from safenav.certify.checker.check_strategies import RefusedError
from safenav.certify.record import bundle_of_trace
from safenav.scenario.model import Clock

Line = dict[str, Any]
Broken = Callable[[list[Line]], object]


def told_of(name: str, mutate: Broken, tmp_path: Path) -> str:
    """What the checker says of the manifest's claims aside."""
    bundle = shipped(name)
    lines = living(lines_of(files_of(bundle)))
    mutate(lines)
    files = with_lines(files_of(bundle), lines)
    files.pop("motion.jsonl", None)
    status, said = run_checker(rewrite(bundle, files, tmp_path / "bundle"))
    assert status == 1, "the manifest claims what the run in ticks has shown"
    return said.splitlines()[-1]


ELSE = "refused: the manifest does not claim what the evidence establishes"


@pytest.mark.parametrize("name", ["hello", "case_study_2", "corridor_swap"])
def test_a_run_in_seconds_is_followed_as_one_in_ticks(name: str, tmp_path: Path) -> None:
    """But for one sentence more among the claims."""
    assert told_of(name, json.dumps, tmp_path) == ELSE


@pytest.mark.parametrize("name", ["corridor_swap", "case_study_2"])
def test_a_live_run_is_certified(name: str, tmp_path: Path) -> None:
    scenario = replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock.LIVE)
    with TraceWriter(tmp_path / "run.jsonl") as writer:
        Mission(scenario, listeners=[writer]).run()
    bundle_of_trace(tmp_path / "run.jsonl", tmp_path / "bundle")
    status, said = run_checker(tmp_path / "bundle")
    assert status == 0, said
    assert "in seconds, robots in conflict never have a region both" in said


PAIR = {
    name: Robot(name, {"start": start, "objective": {"visit": [start]}}, [other])
    for name, start, other in (("a", 1, "b"), ("b", 3, "a"))
}


def step(robot: str, t: float, end: float, origin: int, to: int) -> list[Line]:
    """A step in passes of their own, so that only seconds tell whether it overlaps another."""
    base = {"robot": robot, "command": int(10 * t), "heading": None}
    depart = {"type": "depart", "t": t, "from": origin, "to": to, "by": "strategy", **base}
    return [depart, {"type": "arrive", "t": end, "at": to, "result": "arrived", **base}]


@pytest.mark.parametrize(("second", "ok"), [(2.0, True), (1.5, False)])
def test_two_robots_have_a_region_one_after_the_other(second: float, ok: bool) -> None:
    lines = sorted([*step("a", 1, 2, 1, 0), *step("b", second, 4, 3, 1)], key=lambda x: x["t"])
    passes = Passes(PAIR).expand({"tick": k, **line} for k, line in enumerate(lines, 1))
    if ok:
        assert sum(line["type"] == "move" for line in passes) == 8
    else:
        with pytest.raises(RefusedError, match="a and b have a region both until"):
            list(passes)


@pytest.mark.parametrize(
    ("mutate", "refused"),
    [
        (edit("arrive", {}, t=0.0), "0.0 s come after 1.0 s"),
        (edit("arrive", {}, command=7), "ends what it has not begun"),
        (edit("depart", {}, to=57), "has not arrived where it was to go"),
        (lambda lines: lines.pop(find(lines, "arrive")), "departs before its last step has ended"),
    ],
)
def test_a_run_in_seconds_is_refused(mutate: Broken, refused: str, tmp_path: Path) -> None:
    assert refused in told_of("case_study_2", mutate, tmp_path)

"""Runs with tight deadlines: the judge, which follows them independently, accepts each; deadlines
reported as lost are never met; a missed one must be listed."""

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from certify.making import bundle_at, certified, files_of, judged, rewrite
from certify.mutants import lines_of, with_lines
from drawn import loads
from once import beside
from runtime.deadlines.timed import busy_scenario, timed_scenario
from runtime.played import play

COUNT = int(os.environ.get("SAFENAV_FUZZ", "0")) // 4 or 30
"""``SAFENAV_FUZZ=5000`` runs 1,875 scenarios."""


SCENARIOS = [(timed_scenario, seed) for seed in range(COUNT)]
SCENARIOS += [(busy_scenario, seed) for seed in range(max(COUNT // 2, 1))]


@pytest.mark.parametrize("case", range(len(SCENARIOS)))
def test_random_runs_with_deadlines_meet_none_that_is_lost(
    case: int, played: Callable[[], None]
) -> None:
    """And do not list a missed one as met."""
    draw, seed = SCENARIOS[case]
    text, _ = loads(draw, seed)
    run = play(text)
    played()
    lost: dict[str, int] = {}
    for line in run.records:
        if line["type"] == "deadline":
            if line["verdict"] == "lost":
                lost[line["of"]] = line["due"]
            assert line["verdict"] != "kept" or lost.get(line["of"]) != line["due"]
    if run.outcome.get("late") and run.outcome["outcome"] != "interrupted":
        run.outcome["late"].clear()
        assert run.findings


def test_robots_that_hold_and_targets_met_before_bound_the_end_of_a_mission() -> None:
    text = timed_scenario(9_200_531).replace("[sense], timing: 2", "[sense]")
    lines = play(text).records  # whose trace the judge accepts
    assert any(x["type"] == "deadline" and x["verdict"] == "lost" for x in lines)


LOST = beside(__file__, "scenarios/timed_runs_lost.yaml")


def test_the_checker_of_a_bundle_proves_that_a_deadline_is_lost(tmp_path: Path) -> None:
    assert re.search(r"gate@12 cannot be resolved by tick \d+, when it is due", certified(LOST))
    files = files_of(bundle_at("plan", LOST))
    lines = lines_of(files)
    (lost,) = (line for line in lines if line.get("verdict") == "lost")
    lost["due"] = lost["earliest"]  # which could be met
    forged = rewrite(bundle_at("plan", LOST), with_lines(files, lines), tmp_path / "forged")
    code, said = judged(forged)
    assert code == 1 and "(deadline)" in said


def test_the_earliest_tick_of_a_patrol_is_that_of_the_target_it_begins_with() -> None:
    """The strategy begins with 48, from which a round ends sooner than from 39."""
    run = play(timed_scenario(9001584))
    lost = run.one("deadline", verdict="lost")
    assert lost["earliest"] == 20
    lost["earliest"] = 21
    assert "possible from tick 20 on, not 21" in run.findings

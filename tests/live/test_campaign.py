"""Campaigns in time: no overlap, no entry, no hang, each run completed or with a true statement.

A sample by default; ``SAFENAV_FUZZ=5000`` plays 2,000 missions, with faults in 500 of them, and
compares 1,000 with lockstep.
"""

import os
from collections.abc import Callable, Iterable

import pytest
from msgspec.structs import replace

import warm
from live.campaign import play, repeated, serially
from safenav.plan.order import next_step
from safenav.runtime.run import decide
from safenav.runtime.run.loop import Run
from safenav.team import floor
from safenav.team.state import RobotNow, State
from safenav.team.team import Team
from safenav.world.poses import region_mask

PART = 50
LONG = 2000 if os.environ.get("SAFENAV_FUZZ") else 0
PARTS = [f"{k}:{k + PART}" for k in range(0, LONG, PART)] or ["0:10"]


FAILED = [
    (4246, True, "a plan lets a robot that is under way wait for another"),
    (10568, False, "see its file in cases"),
    (11047, True, "a report that comes after a robot was given up as lost"),
    (10163, True, "see its file in cases"),
    (46123, True, "see its file in cases"),
    (40128, False, "a need that was met before its obstacle was encountered"),
]
"""Runs that have failed: the seed, whether with faults, and why."""


@pytest.mark.parametrize(("seed", "faults", "why"), FAILED, ids=[str(s) for s, _, _ in FAILED])
def test_a_run_that_once_failed_is_sound(seed: int, faults: bool, why: str) -> None:
    assert play(seed, faults=faults).found in ("", "?"), why


def test_a_blocking_world_may_have_counted_a_need_before_the_mission() -> None:
    """What it said to be done was dropped, since a need was left that another robot had met."""
    assert (serially(64838).outcome, serially(64838).found) == ("completed", "")


@pytest.mark.parametrize("seed", [31032, 31107, 31138])
def test_a_run_with_faults_is_the_same_over_a_socket(seed: int) -> None:
    """Whatever happens follows from the events: the same ones make the same trace."""
    first = play(seed, faults=True)
    assert first.found in ("", "?") and first.injected
    assert repeated(seed, first, faults=True, wired=False) == ""


def run(*options: object) -> None:
    done = warm.program("live.campaign", *options)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("seeds", PARTS)
def test_the_judge_finds_no_defect_in_random_runs(seeds: str) -> None:
    run("--seeds", seeds, "--faults", *(["--both"] if int(seeds.split(":")[0]) < LONG // 2 else []))


def reserved(patch: pytest.MonkeyPatch, region: Callable[[RobotNow], int]) -> None:
    """Let each robot have only one region."""

    def occupied(team: Team, state: State, among: Iterable[int]) -> int:
        return region_mask({region(state.robots[i]) % team.size for i in among})

    patch.setattr(floor, "occupied", occupied)


def destination_not_reserved(patch: pytest.MonkeyPatch) -> None:
    """The orders of plans alone would keep it free."""

    def disordered(team: Team, state: State, i: int) -> int | None:
        if state.plan is None:
            return None
        ways = tuple(tuple(w._replace(after=()) for w in way) for way in state.plan.ways)
        return next_step(team, replace(state, plan=replace(state.plan, ways=ways)), i)

    reserved(patch, lambda robot: robot.pose)
    patch.setattr(decide, "next_step", disordered)


def origin_released_at_departure(patch: pytest.MonkeyPatch) -> None:
    reserved(patch, lambda robot: robot.next)


def nothing_characterized(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Run, "characterize", lambda *_: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mutate", "told", "seeds"),
    [
        (destination_not_reserved, "at the same time", (22, 57, 20)),
        (origin_released_at_departure, "at the same time", (22, 57, 25)),
        (nothing_characterized, "before its sensor", (25, 26, 60, 61)),
    ],
)
def test_the_judge_finds_each_error_planted_in_the_runtime(
    mutate: Callable[[pytest.MonkeyPatch], None],
    told: str,
    seeds: tuple[int, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mutate(monkeypatch)
    found = []
    for seed in seeds:
        found.append(play(seed, patience=30).found)
        if told in found[-1]:
            return
    pytest.fail(f"no run shows it: {found}")

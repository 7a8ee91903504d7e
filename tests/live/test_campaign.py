"""Campaigns in time: no overlap, no entry, no hang, each run completed or with a true statement.

A sample by default; ``SAFENAV_FUZZ=5000`` plays 2,000 missions, with faults in 500 of them, and
compares 1,000 with lockstep.
"""

import os
from collections.abc import Callable

import pytest
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.traffic.joint_search.execution import Execution
from safenav.runtime.turns import step_choice

import warm
from live.campaign import play, repeated, serially
from safenav.scenario.model import Robot

PART = 50
LONG = 2000 if os.environ.get("SAFENAV_FUZZ") else 0
PARTS = [f"{k}:{k + PART}" for k in range(0, LONG, PART)] or ["0:10"]


FAILED = [
    (4246, True, "a plan lets a robot that is under way wait for another"),
    (10568, False, "see its file in cases"),
    (11047, True, "a report that comes after a robot was given up as lost"),
    (10163, True, "see its file in cases"),
    (46123, True, "see its file in cases"),
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


def reserved(patch: pytest.MonkeyPatch, region: Callable[[RobotState], int]) -> None:
    """Let each robot have only one region."""

    def taken(self: TeamState, robot: Robot, _: object = None) -> set[int]:
        rivals = (o for o in self.robots.values() if robot.conflicts(o.robot))
        return {region(other) for other in rivals if other.name != robot.name}

    patch.setattr(RobotState, "occupied", property(lambda self: frozenset({region(self)})))
    patch.setattr(TeamState, "had_by_others", taken)


def destination_not_reserved(patch: pytest.MonkeyPatch) -> None:
    reserved(patch, lambda robot: robot.pose.region)


def origin_released_at_departure(patch: pytest.MonkeyPatch) -> None:
    reserved(patch, lambda robot: robot.next_pose.region)


def orders_of_plans_ignored(patch: pytest.MonkeyPatch) -> None:
    def next_pose(self: Execution, robot: int) -> int | None:
        return None if self.done(robot) else self.schedule.paths[robot][self.taken[robot] + 1]

    patch.setattr(Execution, "next", next_pose)


def nothing_characterized(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(step_choice, "characterize", lambda *_: None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mutate", "told", "seeds"),
    [
        (destination_not_reserved, "at the same time", (22, 57, 20)),
        (origin_released_at_departure, "at the same time", (22, 57, 25)),
        (orders_of_plans_ignored, "does not wait until", (20, 26, 75, 76, 77)),
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

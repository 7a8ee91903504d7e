"""Flight in wind: near its reference, in its regions, refused if the wind exceeds its tilt."""

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from motion.runs import played, trace_of
from once import made_once
from safenav.errors import UsageError
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import sample
from safenav.motion.file import Flight, FlownTrack, Motion, parsed, text_of
from safenav.motion.flyer import HORIZON, AxisTracker
from safenav.motion.making import Disturbances, motion_of
from safenav.trace.reading import read_bytes

NAME = "case_study_1"

pytestmark = pytest.mark.slow


@cache
def windy(gust: float) -> Motion:
    def make(folder: Path) -> None:
        made = motion_of(trace_of(NAME), None, Disturbances(1, gust=gust))
        (folder / "windy").write_bytes(text_of(made).encode())

    return parsed((made_once(f"wind of {gust}", make) / "windy").read_bytes(), "windy")


def errors(motion: Motion) -> np.ndarray:
    """Metres off its reference: the checker compares them with the flight."""
    return np.concatenate([track.errors for track in motion.of(FlownTrack)])


@pytest.mark.parametrize(("gust", "mean", "most"), [(2.0, 0.06, 0.15), (5.0, 0.3, 0.9)])
def test_flight_in_wind_is_accepted_and_near_its_reference(
    gust: float, mean: float, most: float
) -> None:
    assert check_motion(windy(gust), trace_of(NAME)) == []
    off = errors(windy(gust))
    assert np.sqrt((off**2).mean()) < mean and off.max() < most


def test_a_flyer_tracks_its_flight_through_centres_without_wind() -> None:
    still = motion_of(trace_of(NAME), None, Disturbances(track=True))
    assert check_motion(still, trace_of(NAME)) == []
    off = errors(still)
    assert len(off) > 19 * still.outcome.makespan and off.max() < 0.05


@pytest.mark.parametrize("name", ["case_study_1", "case_study_3", "search_and_rescue"])
def test_a_flyer_passes_centres_without_a_halt_where_its_next_step_follows(name: str) -> None:
    moved, passed, stopped = motion_of(trace_of(name)), 0, 0
    flyers = [n for n, own in moved.header.robots.items() if own["kind"] == "flyer"]
    for robot in flyers:
        for one, other in pairwise(moved.of(Flight, robot)):
            end = np.array([one.t1 - 1e-6 - one.t0])
            row = sample(one, end, moved.header.robots[robot])[0]
            flies_on = one.primitive == other.primitive == "fly" and one.origin != other.to
            speed = float(np.hypot(row[3], row[4]))
            assert (speed > 0.2) is flies_on, (robot, one.t1, speed)
            passed, stopped = passed + flies_on, stopped + (not flies_on)
    assert passed > 5 and stopped > 1


def test_gusts_beyond_the_tilt_limit_are_refused() -> None:
    with pytest.raises(UsageError, match=r"beyond its tilt limit of 3\.4 m/s\^2"):
        windy(8.0)


def test_same_seed_gives_the_same_wind() -> None:
    run = played("""
        safenav: 1
        map: {grid: ["#####", "#...#", "#####"]}
        robots: {quad: {model: quadcopter, start: 6, objective: {visit: [8, 6]}}}
        until: {rounds: 1}
        """)

    def flown(seed: int) -> str:
        wind = Disturbances(seed, gust=2.0)
        return text_of(motion_of(read_bytes(run), None, wind))

    assert flown(1) == flown(1) != flown(2)


def test_command_keeps_to_the_tilt_limit_and_turns_back_at_the_border() -> None:
    """Flying towards a border at speed, with a reference beyond it."""
    tracker = AxisTracker(0.0, 3.4)
    tracker.state = np.array([0.0, 1.0, 0.0, 0.0])
    wanted = np.tile([2.0, 0.0, 0.0], (HORIZON, 1))
    free = tracker.command(wanted, np.full(HORIZON, -9.0), np.full(HORIZON, 9.0))
    assert free == pytest.approx(3.4)
    tracker.state = np.array([0.0, 1.0, 0.0, 0.0])
    bound = tracker.command(wanted, np.full(HORIZON, -9.0), np.full(HORIZON, 0.2))
    assert -3.4 <= bound < 0
    assert tracker.failed == 0

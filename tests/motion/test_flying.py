"""Flight: through centres, and simulated near its reference and in its regions."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import trace_of
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import report_of, sample
from safenav.motion.file import Flight, FlownTrack, TrackRow, parsed, text_of
from safenav.motion.flyer import HORIZON, AxisTracker
from safenav.motion.making import motion_of

NAME = "case_study_1"

pytestmark = pytest.mark.slow


def test_a_simulated_flight_tracks_its_reference_through_centres() -> None:
    """A row that is missing, elsewhere, or not explained by its thrust is refused."""
    made = motion_of(trace_of(NAME), track=True)
    moved = parsed(text_of(made).encode(), "tracked")
    assert check_motion(moved, trace_of(NAME)) == []
    assert "simulated flight of quad: at most 0.00" in report_of(moved)
    (track,) = moved.of(FlownTrack)

    def refused(rows: tuple[TrackRow, ...], step: float = track.step) -> set[str]:
        wrong = replace(track, rows=rows, step=step)
        lines = tuple(wrong if line is track else line for line in moved.lines)
        return {found.rule for found in check_motion(replace(moved, lines=lines), trace_of(NAME))}

    assert refused(track.rows[:-2]) == refused(track.rows[::2], 2 * track.step) == {"track"}
    assert refused(tuple((row[0] + 0.07, *row[1:]) for row in track.rows)) == {"track"}
    jumps = tuple((row[0] + 0.04 * (k > 500), *row[1:]) for k, row in enumerate(track.rows))
    assert refused(jumps) == {"dynamics"}
    assert {"track", "room"} <= refused(tuple((row[0] + 2.7, *row[1:]) for row in track.rows))
    assert refused(tuple((*row[:13], row[13] * 1.1) for row in track.rows)) == {"dynamics"}
    assert "dynamics" in refused(tuple((*row[:3], 2.0, *row[4:]) for row in track.rows))
    assert "attitude" in refused(tuple((*row[:6], 0.9, *row[7:]) for row in track.rows))
    leaning = (0.8, 0.6, 0.0, 0.0)
    assert "tilt" in refused(tuple((*row[:6], *leaning, *row[10:]) for row in track.rows))


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

"""A lockstep run on the clock of its motion: text and bodies agree at every instant."""

import pytest

from motion.runs import motion, played, trace_of
from safenav.motion.check.examination import Examination
from safenav.motion.check.room import holdings
from safenav.motion.file import Action, Moving
from safenav.motion.making import motion_of
from safenav.motion.timing.in_time import in_time
from safenav.run.reading import run_of
from safenav.trace import records
from safenav.trace.reading import read_bytes
from safenav.trace.vocabulary import MovedBy

RUNS = ["beam", "case_study_2", "corridor_swap", "hospital", "team_of_six", "two_digits"]


@pytest.mark.parametrize("name", RUNS)
def test_words_and_bodies_agree(name: str) -> None:
    trace, moved = trace_of(name), motion(name)
    told = in_time(trace, moved)
    assert len([r for r in told.records if not isinstance(r, LIVE)]) == len(
        [r for r in trace.records if not isinstance(r, records.Move)]
    )
    times = [record.t for record in told.records]
    assert None not in times and times == sorted(times, key=float)
    ends = {round(line.t1, 9) for line in moved.lines if isinstance(line, Action)}
    strategy: dict[str, float] = {}
    for record in told.records:
        assert record.t is not None
        if isinstance(record, records.Resolved):
            assert record.t in ends
        elif isinstance(record, records.Synthesis):
            strategy[record.robot] = record.t
        elif isinstance(record, records.Depart) and record.by is MovedBy.STRATEGY:
            assert record.t >= strategy[record.robot]
    held = holdings(Examination(moved, told))
    replay = run_of(told)
    assert replay.seconds is not None
    for tick, time in enumerate(replay.seconds[:-1]):
        middle = (time + replay.seconds[tick + 1]) / 2
        if middle - time < 0.01:
            continue  # instants within a millisecond are one
        for track in replay.robots:
            step = track.transit(tick)
            shown = {track.regions[tick]} | ({step.toward} if step else set())
            has = {h.region for h in held if h.robot == track.name and h.begin <= middle < h.end}
            assert shown == has, (middle, track.name)


LIVE = (records.Depart, records.Arrive, records.Act, records.ActionEnd)


def test_a_run_in_time_stays_as_it_is() -> None:
    told = in_time(trace_of("hello"), motion("hello"))
    assert in_time(told, motion("hello")) is told


CLOSING = """\
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots:
  quad: {model: quadcopter, start: 10, objective: {patrol: [10, 12]}}
  digit: {model: digit, start: 28, heading: east, objective: {visit: [28, 30]}}
obstacles: [{type: door, region: 22, from: 5, until: 12}]
until: {rounds: 5}
"""


def test_an_obstacle_appears_and_disappears_at_the_instants_of_its_ticks() -> None:
    """In 3D a door of tick 5 was there, and gone, from the beginning."""
    trace = read_bytes(played(CLOSING), "t.jsonl")
    moved = motion_of(trace)
    steps = [line for line in moved.of(Moving) if line.origin != line.to]
    ends = {tick: max(line.t1 for line in steps if line.tick < tick) for tick in (5, 12)}
    told = {type(r): r.t for r in in_time(trace, moved).records}
    assert told[records.Appeared] == pytest.approx(ends[5])
    assert told[records.Gone] == pytest.approx(ends[12])

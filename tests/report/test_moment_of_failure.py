"""A run that ends within a tick is shown as it was in that moment."""

from pathlib import Path

import pytest

from safenav.cli.run import command as run_command
from safenav.report.replay.reading import read_replay
from safenav.report.replay.timeline import ObstacleStatus, Replay
from safenav.report.terminal.replay import frame

SCENARIO = """
safenav: 1
map:
  grid: |
    #########
    #...#...#
    #.......#
    #...#...#
    #########
robots:
  quad: {model: quadcopter, start: [1, 1], objective: {patrol: [[3, 1], [1, 7]]}}
  late: {model: quadcopter, start: [1, 3], objective: {visit: [[3, 3], [1, 3]]}}
obstacles:
  - {type: door, region: [2, 4]}
"""


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> Replay:
    folder = tmp_path_factory.mktemp("failed")
    (folder / "s.yaml").write_text(SCENARIO)
    trace: Path = folder / "run.jsonl"
    arguments = [str(folder / "s.yaml"), "--trace", str(trace), "--no-map"]
    assert run_command.main(arguments, standalone_mode=False) == 1
    return read_replay(trace)


def test_the_last_tick_is_that_of_the_outcome(failed: Replay) -> None:
    (violation,) = [event for event in failed.events if event.kind.value == "violation"]
    assert failed.events[-1].tick == failed.last == violation.tick
    assert failed.within, "the second robot had not taken its turn"
    assert f"tick {failed.last} of {failed.last}, ended within it: operator needed" == (
        failed.scene(failed.last).moment
    )


def test_who_took_no_turn_stands_where_it_was(failed: Replay) -> None:
    late = failed.track("late")
    assert late.regions[-1] == late.regions[-2]
    assert len({len(track.regions) for track in failed.robots}) == 1


def test_the_obstacle_is_known_in_that_moment_and_not_before(failed: Replay) -> None:
    def status(tick: int) -> ObstacleStatus:
        return failed.scene(tick).obstacles[0][1]

    assert status(failed.last) is ObstacleStatus.BLOCKED
    assert status(failed.last - 1) is ObstacleStatus.HIDDEN


def test_the_terminal_shows_the_same_moment(failed: Replay) -> None:
    text = "\n".join(frame(failed, failed.last))
    assert f"tick {failed.last} of {failed.last}" in text
    assert "XX" in text

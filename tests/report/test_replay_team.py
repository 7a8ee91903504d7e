"""Sight and steps of several ticks in a run, and the size of its page."""

from pathlib import Path

import pytest

from report import made_traces
from safenav.report.page.html import page_of
from safenav.run.reading import read_run
from safenav.run.run import Run, SightCache
from safenav.world.poses import bits
from safenav.world.sight import visible_from


def test_a_step_of_several_ticks_is_drawn_between_its_regions(replays: dict[str, Run]) -> None:
    places = [replays["slow"].at(tick).robots[0] for tick in range(4)]
    assert [place.col for place in places] == pytest.approx([3, 3 - 1 / 3, 3 - 2 / 3, 2])
    assert [place.taken for place in places] == [(), (8, 7), (8, 7), ()]
    halfway = replays["slow"].at(1, 0.5).robots[0]
    assert (halfway.row, halfway.col) == (1.0, 2.5)


def test_sight_is_that_of_the_runtime(replays: dict[str, Run]) -> None:
    meeting = replays["meeting"]
    view, sight = visible_from(meeting.map, 3.0), SightCache(meeting.map)
    for tick in range(meeting.last + 1):
        for track in meeting.robots:
            seen = sight.after(meeting, track.name, tick)
            assert seen == [*bits(view.mask(track.regions[tick]))]
    first = sight.after(meeting, "west", 0) or []
    assert 22 in first and 23 not in first


def test_found_obstacles_block_the_view_until_they_are_resolved(tmp_path: Path) -> None:
    lines = made_traces.door()
    lines[0]["scenario"]["robots"]["quad"]["vision"] = 4
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    sight = SightCache(replay.map)
    quad = replay.track("quad")
    assert quad.regions[10] == quad.regions[11] == 46
    before, found, after = (sight.after(replay, "quad", tick) or [] for tick in (10, 11, 16))
    assert 48 in before and 48 not in found and 48 in after
    assert 47 in found, "the closed doorway itself is seen"


def test_a_page_of_a_thousand_watchful_ticks_stays_under_a_megabyte(tmp_path: Path) -> None:
    lines = made_traces.watched(made_traces.crowd(), 12.0)
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    assert (replay.last, len(replay.robots), len(replay.beliefs)) == (1000, 6, 30)
    assert len(page_of(replay, "t.jsonl").encode()) < 1_000_000

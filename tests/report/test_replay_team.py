"""Beliefs, sight, steps of several ticks and giving way, in a replay and in its pictures."""

from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from once import SCENARIOS
from report import made_traces
from safenav.cli.replay import draw as draw_command
from safenav.cli.replay import replay as replay_command
from safenav.errors import UsageError
from safenav.report.page.html import page_of
from safenav.report.picture.scene import Options, svg_of
from safenav.run.looks import looks
from safenav.run.reading import read_run
from safenav.run.run import Run, SightCache, shading_of
from safenav.world.poses import bits
from safenav.world.sight import visible_from

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def meeting(replays: dict[str, Run]) -> Run:
    return replays["meeting"]


def test_a_step_of_several_ticks_is_drawn_between_its_regions(replays: dict[str, Run]) -> None:
    places = [replays["slow"].at(tick).robots[0] for tick in range(4)]
    assert [place.col for place in places] == pytest.approx([3, 3 - 1 / 3, 3 - 2 / 3, 2])
    assert [place.taken for place in places] == [(), (8, 7), (8, 7), ()]
    halfway = replays["slow"].at(1, 0.5).robots[0]
    assert (halfway.row, halfway.col) == (1.0, 2.5)


def test_sight_is_that_of_the_runtime(meeting: Run) -> None:
    view = visible_from(meeting.map, 3.0)
    for tick in range(meeting.last + 1):
        for track in meeting.robots:
            seen = shading_of(meeting, track.name, tick).sight
            assert seen == frozenset(bits(view.mask(track.regions[tick])))
    assert 22 in (shading_of(meeting, "west", 0).sight or ())
    assert 23 not in (shading_of(meeting, "west", 0).sight or ())


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


@pytest.mark.parametrize("vision", [4.0, 12.0])
def test_a_page_of_a_thousand_watchful_ticks_stays_under_a_megabyte(
    tmp_path: Path, vision: float
) -> None:
    lines = made_traces.watched(made_traces.crowd(), vision)
    replay = read_run(made_traces.write(lines, tmp_path / "t.jsonl"))
    assert (replay.last, len(replay.robots), len(replay.beliefs)) == (1000, 6, 30)
    assert len(page_of(replay, "t.jsonl").encode()) < 1_000_000


def test_a_picture_tints_beliefs_and_sight(replays: dict[str, Run]) -> None:
    meeting = replays["meeting"]
    scene = meeting.at(1)
    svg = svg_of(scene, Options(shading=shading_of(meeting, "west", 1)))
    words = " ".join(e.text or "" for e in ElementTree.fromstring(svg).iter(f"{SVG}text"))
    assert "what west sees (radius 3 regions)" in words
    assert "where west believed east to be at its last observation" in words
    assert "occupies both" not in words and "occupies both" in svg_of(replays["slow"].at(1))
    east = looks(["west", "east"])[1].colour
    tinted = [
        path.attrib["d"]
        for path in ElementTree.fromstring(svg).iter(f"{SVG}path")
        if (path.get("fill"), path.get("fill-opacity")) == (east, "0.13")
    ]
    assert len(tinted) == 1 and tinted[0].count("M") == 3  # rows of the room
    assert 'fill-opacity="0.13"' not in svg_of(scene)


def test_the_command_shades_for_a_robot(
    traces: dict[str, Path], meeting: Run, tmp_path: Path
) -> None:
    out = tmp_path / "p.svg"
    arguments = [str(traces["meeting"]), "--svg", "3", "--sight", "east", "-o", str(out)]
    assert CliRunner().invoke(replay_command, arguments, standalone_mode=False).exception is None
    words = out.read_text()
    assert f"tick 3 of {meeting.last}" in words and "what east sees" in words


@pytest.mark.parametrize(
    ("trace", "robot", "why"),
    [("meeting", "nobody", "there is no robot 'nobody'"), ("door", "quad", "nothing to shade")],
)
def test_a_robot_that_cannot_be_shaded_is_refused(
    traces: dict[str, Path], trace: str, robot: str, why: str
) -> None:
    arguments = [str(traces[trace]), "--svg", "0", "--sight", robot]
    result = CliRunner().invoke(replay_command, arguments, standalone_mode=False)
    assert isinstance(result.exception, UsageError) and why in str(result.exception)


def test_sight_is_for_pictures_only(traces: dict[str, Path]) -> None:
    arguments = [str(traces["meeting"]), "--sight", "east"]
    result = CliRunner().invoke(replay_command, arguments, standalone_mode=False)
    assert isinstance(result.exception, UsageError) and "--gif" in str(result.exception)


def test_draw_shows_what_a_robot_sees_from_its_start(tmp_path: Path) -> None:
    out = tmp_path / "map.svg"
    scenario = str(SCENARIOS / "case_study_3_beliefs.yaml")
    arguments = [scenario, "--sight", "digit"]
    text = CliRunner().invoke(draw_command, arguments, standalone_mode=False).output
    assert "digit sees 18-20, 31-33, 42-48, 57-59, 70-72" in text
    CliRunner().invoke(draw_command, [*arguments, "-o", str(out)], standalone_mode=False)
    assert "what digit sees (radius 4 regions)" in out.read_text()

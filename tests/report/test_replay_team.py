"""Beliefs, sight, steps of several ticks and giving way, in a replay and in its pictures."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from once import SCENARIOS
from report import made_traces, team_trace
from safenav.cli.draw import command as draw_command
from safenav.cli.replay import command as replay_command
from safenav.errors import InputError, UsageError
from safenav.report.page.encode import RegionSets, encoded, written
from safenav.report.page.html import page_of
from safenav.report.picture.scene import Options, svg_of
from safenav.report.replay.perception import SightCache, shading_lines, shading_of, viewers
from safenav.report.replay.reading import read_replay
from safenav.report.replay.timeline import Replay, StoryKind
from safenav.report.terminal.replay import frame
from safenav.trace.words import regions_words
from safenav.world.map import RegionMap
from safenav.world.poses import bits
from safenav.world.sight import visible_from

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def meeting(replays: dict[str, Replay]) -> Replay:
    return replays["meeting"]


def test_a_step_of_several_ticks_is_drawn_between_its_regions(meeting: Replay) -> None:
    slow = meeting.scene(1).robots[1]
    assert (slow.row, slow.col) == (2.0, 6.5)
    assert slow.taken == (25, 24)
    arrived = meeting.scene(2).robots[1]
    assert (arrived.row, arrived.col) == (2.0, 6.0) and arrived.taken == ()
    halfway = meeting.scene(1, 0.5).robots[1]
    assert (halfway.row, halfway.col) == (2.0, 6.25)


def test_a_step_of_three_ticks_moves_a_third_a_tick(tmp_path: Path) -> None:
    lines = team_trace.meeting()
    for line in lines:
        if line["type"] == "move" and line["robot"] == "slow" and line["tick"] == 2:
            line.update({"to": 25, "toward": 24})
        if line["type"] == "move" and line["robot"] == "slow" and line["tick"] == 3:
            line.update({"from": 25})
    replay = read_replay(made_traces.write(lines, tmp_path / "t.jsonl"))
    cols = [replay.scene(tick).robots[1].col for tick in range(4)]
    assert cols == pytest.approx([7, 7 - 1 / 3, 7 - 2 / 3, 6])


def test_who_gives_way_is_on_the_stack_and_told(meeting: Replay) -> None:
    (held,) = meeting.stack.at(3)
    assert held.about() == "slow gives way to fast" and held.roles == "fast goes first"
    assert meeting.stack.at(2) == meeting.stack.at(8) == ()
    told = {e.kind: e.text for e in meeting.events if e.kind in (StoryKind.YIELD, StoryKind.POP)}
    assert told[StoryKind.YIELD] == "slow gives way to fast (slow: hold 15)"
    assert told[StoryKind.POP].startswith("slow has given way to fast: objectives restored")


def test_all_who_give_way_are_named(tmp_path: Path) -> None:
    lines = team_trace.meeting()
    third = {
        **lines[0]["scenario"]["robots"]["slow"],
        "start": 34,
        "objective": {"visit": [34, 32]},
    }
    lines[0]["scenario"]["robots"]["third"] = third
    for line in lines:
        if line["type"] in ("push", "pop"):
            aside = {"hold": 33} if line["type"] == "push" else third["objective"]
            line["objectives"] = {**line["objectives"], "third": aside}
    still = [
        {"type": "move", "tick": t, "robot": "third", "from": 34, "to": 34, "heading": None}
        for t in range(1, 9)
    ]
    replay = read_replay(made_traces.write([*lines[:-1], *still, lines[-1]], tmp_path / "t.jsonl"))
    assert replay.stack.at(3)[0].about() == "slow and third give way to fast"


def test_beliefs_hold_until_the_next_is_told(meeting: Replay) -> None:
    told = meeting.beliefs["fast", "slow"]
    assert told.at(0) is None
    for tick in (1, 2, 3):
        belief = told.at(tick)
        assert belief is not None and not belief.seen
        assert belief.regions == frozenset(team_trace.EAST)
    seen = told.at(4)
    assert seen is not None and seen.seen and seen.regions == {24}


def test_sight_is_that_of_the_runtime(meeting: Replay) -> None:
    view = visible_from(meeting.map, 3.0)
    for tick in range(meeting.last + 1):
        for track in meeting.robots:
            seen = shading_of(meeting, track.name, tick).sight
            assert seen == frozenset(bits(view.mask(track.regions[tick])))
    assert 22 in (shading_of(meeting, "fast", 0).sight or ())
    assert 23 not in (shading_of(meeting, "fast", 0).sight or ())


def test_found_obstacles_block_the_view_until_they_are_resolved(tmp_path: Path) -> None:
    lines = made_traces.door()
    lines[0]["scenario"]["robots"]["quad"]["vision"] = 4
    replay = read_replay(made_traces.write(lines, tmp_path / "t.jsonl"))
    sight = SightCache(replay.map)
    quad = replay.track("quad")
    assert quad.regions[10] == quad.regions[11] == 46
    before, found, after = (sight.after(replay, "quad", tick) or [] for tick in (10, 11, 16))
    assert 48 in before and 48 not in found and 48 in after
    assert 47 in found, "the closed doorway itself is seen"


def test_without_limits_and_beliefs_there_is_nothing_to_shade(replays: dict[str, Replay]) -> None:
    assert viewers(replays["door"]) == ()
    assert viewers(replays["meeting"]) == ("fast", "slow")


def test_a_radius_that_sees_nothing_is_refused(tmp_path: Path) -> None:
    lines = team_trace.meeting()
    lines[0]["scenario"]["robots"]["fast"]["vision"] = 0.5
    with pytest.raises(InputError, match="does not even see"):
        read_replay(made_traces.write(lines, tmp_path / "t.jsonl"))


@given(st.sets(st.integers(0, 5000)))
def test_written_sets_of_regions_can_be_read_again(regions: set[int]) -> None:
    numbers = [int(number) for number in written(sorted(regions)).split(",") if number]
    read: set[int] = set()
    end = 0
    for gap, length in zip(numbers[::2], numbers[1::2], strict=True):
        read |= set(range(end + gap, end + gap + length))
        end += gap + length
    assert read == regions


def test_equal_sets_are_written_once(meeting: Replay) -> None:
    sets = RegionSets()
    assert sets.index([3, 4, 7]) == sets.index([3, 4, 7]) == 0
    assert sets.index([]) == 1
    data = encoded(meeting, "t.jsonl")
    assert len(set(data["sets"])) == len(data["sets"]) > 5


@pytest.mark.parametrize("vision", [4.0, 12.0])
def test_a_page_of_a_thousand_watchful_ticks_stays_under_a_megabyte(
    tmp_path: Path, vision: float
) -> None:
    lines = team_trace.watched(made_traces.crowd(), vision)
    replay = read_replay(made_traces.write(lines, tmp_path / "t.jsonl"))
    assert len(replay.beliefs) == 30
    assert len(page_of(replay, "t.jsonl").encode()) < 1_000_000


def test_a_picture_hatches_beliefs_and_tints_sight(meeting: Replay) -> None:
    scene = meeting.scene(1)
    svg = svg_of(scene, Options(shading=shading_of(meeting, "fast", 1)))
    words = " ".join(e.text or "" for e in ElementTree.fromstring(svg).iter(f"{SVG}text"))
    assert "what fast sees (up to 3 regions far)" in words
    assert "where fast took slow to be when it last looked" in words
    assert "occupies both" in words
    hatched = [
        path.attrib["d"]
        for path in ElementTree.fromstring(svg).iter(f"{SVG}path")
        if path.get("fill") == "url(#hatch-1)"
    ]
    assert len(hatched) == 1 and hatched[0].count("M") == 3  # rows of the room
    assert "url(#" not in svg_of(scene)


def test_regions_are_told_in_short() -> None:
    assert regions_words([24, 22, 23, 35]) == "22-24, 35"
    assert regions_words([]) == ""


def test_the_terminal_tells_beliefs_and_transit(meeting: Replay) -> None:
    text = "\n".join(frame(meeting, 1))
    assert "fast believes slow in 14-16, 23-25, 32-34" in text
    assert "slow at 25 [2, 7]: visit 19, 25 in turn (in transit to 24 [2, 6])" in text
    assert "stack 1: slow gives way to fast" in "\n".join(frame(meeting, 3))


def test_the_command_shades_for_a_robot(traces: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "p.svg"
    arguments = [str(traces["meeting"]), "--svg", "yield", "--sight", "slow", "-o", str(out)]
    assert CliRunner().invoke(replay_command, arguments, standalone_mode=False).exception is None
    assert "tick 3 of 8" in out.read_text() and "what slow sees" in out.read_text()


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
    arguments = [str(traces["meeting"]), "--sight", "slow"]
    result = CliRunner().invoke(replay_command, arguments, standalone_mode=False)
    assert isinstance(result.exception, UsageError) and "--gif" in str(result.exception)


def test_draw_shows_what_a_robot_sees_from_its_start(tmp_path: Path) -> None:
    out = tmp_path / "map.svg"
    scenario = str(SCENARIOS / "case_study_3_beliefs.yaml")
    arguments = [scenario, "--sight", "digit"]
    text = CliRunner().invoke(draw_command, arguments, standalone_mode=False).output
    assert "digit sees 18-20, 31-33, 42-48, 57-59, 70-72" in text
    CliRunner().invoke(draw_command, [*arguments, "-o", str(out)], standalone_mode=False)
    assert "what digit sees (up to 4 regions far)" in out.read_text()


def test_the_words_of_a_shading_name_every_region(meeting: Replay) -> None:
    world: RegionMap = meeting.map
    (sees, saw) = shading_lines(shading_of(meeting, "fast", 4))
    assert saw == "fast saw slow at 24"
    listed = re.findall(r"\d+", sees)
    assert sees.startswith("fast sees ") and all(world.is_free(int(r)) for r in listed)

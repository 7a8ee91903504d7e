"""Motion files, and the columns and waypoints of a motion."""

import json
from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import motion, played, trace_bytes
from safenav.errors import InputError, UsageError
from safenav.motion import waypoints
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import columns_of
from safenav.motion.file import parsed, text_of
from safenav.motion.making import motion_of
from safenav.trace.reading import read_bytes


@pytest.mark.parametrize("name", ["case_study_1", "team_of_six"])
def test_file_is_read_as_it_was_written(name: str) -> None:
    text = text_of(motion(name))
    again = parsed(text.encode(), "again")
    assert again == motion(name)
    assert text_of(again) == text


@pytest.mark.parametrize("kind", ["disc", "rover", "flyer"])
def test_steps_of_a_minute_join_as_steps_of_a_second_do(kind: str) -> None:
    """Coefficients of high powers were cut to twelve decimals, whatever the seconds."""
    trace = played(f"""
safenav: 1
map: {{grid: ["#####", "#...#", "#####"]}}
catalogue: {{robots: {{snail: {{mobility: free, layer: ground, motion: {kind}, speed: 0.08}}}}}}
robots: {{gary: {{model: snail, start: [1, 1], objective: {{visit: [[1, 3], [1, 1]]}}}}}}
until: {{rounds: 1}}
""")
    read = read_bytes(trace, "trace.jsonl")
    written = text_of(motion_of(read))
    assert check_motion(parsed(written.encode(), "slow"), read) == []


def test_further_lines_and_fields_are_skipped() -> None:
    lines = text_of(motion("case_study_1")).splitlines()
    lines.insert(3, '{"type": "weather", "rain": true}')
    first = json.loads(lines[1])
    lines[1] = json.dumps({**first, "colour": "red"})
    assert parsed("\n".join(lines).encode(), "more") == motion("case_study_1")


def broken(change: dict[str, object] | None = None, without: str | None = None) -> bytes:
    lines = text_of(motion("case_study_1")).splitlines()
    index = next(i for i, line in enumerate(lines) if '"segment"' in line)
    data = {**json.loads(lines[index]), **(change or {})}
    if without is not None:
        del data[without]
    lines[index] = json.dumps(data)
    return "\n".join(lines).encode()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty"),
        (b"{}\n", "first line must be the header"),
        (b'{"type": "header", "motion": 9}\n', "this safenav reads 1"),
        (b'{"type": "header", "motion": 1}\n', "`trace` is missing"),
        (b"nonsense\n", "not JSON: Expecting value at column 1"),
        (b"\x80 binary", "not JSON: byte 0 is not UTF-8"),
    ],
    ids=["empty", "no header", "another version", "header without a trace", "no JSON", "binary"],
)
def test_a_file_that_is_not_a_motion_is_refused(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parsed(content, "file")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (lambda: broken(without="phases"), "`phases` is missing"),
        (lambda: broken({"t0": "soon"}), "`t0` must be a number, not a string"),
        (lambda: broken({"t0": 1e300}), "the number 1e.300 is beyond"),
        (lambda: broken({"t0": None}), "`t0` must be a number, not null"),
        (lambda: broken({"start": [1, 2]}), r"`start` must be a list of length 4"),
        (lambda: broken({"phases": [[1]]}), r"`phases\[0\]` must be a list of at least length 5"),
        (lambda: broken({"tick": 1.5}), "`tick` must be a whole number, not a number"),
        (lambda: broken({"swings": [[1, 0, 1, 0, 1, [0], [0]]]}), "must be a list of length 9"),
    ],
    ids=[
        "missing",
        "text",
        "too large",
        "null",
        "too short",
        "row too short",
        "no whole number",
        "foot",
    ],
)
def test_a_broken_line_is_reported_with_its_field(content, words: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=words):
        parsed(content(), "file")


def test_a_motion_file_that_is_cut_off_is_refused() -> None:
    text = text_of(motion("case_study_1"))
    with pytest.raises(InputError, match="cut off"):
        parsed(text[: text.rindex('{"type":"outcome"')].encode(), "file")


@pytest.mark.parametrize("to", [b"90", b"71"], ids=["a jump", "backwards"])
def test_no_motion_is_made_of_moves_that_no_robot_makes(to: bytes) -> None:
    """Such traces ended in KeyError, StopIteration or ZeroDivisionError."""
    content, old = trace_bytes("case_study_1"), b'"from":58,"to":57'
    assert old in content
    with pytest.raises(UsageError, match=r"moved\.jsonl breaks a rule"):
        motion_of(read_bytes(content.replace(old, old[:-2] + to, 1), "moved.jsonl"))


NAME = "case_study_1"


def test_columns_are_each_other_s_derivatives() -> None:
    for robot, place in (("digit", "com_"), ("quad", "")):
        columns = columns_of(motion(NAME), robot, 1000.0).columns
        for axis in "xy":
            speed = np.gradient(columns[f"{place}{axis}"], 1e-3)
            assert np.abs(speed - columns[f"vel_{axis}"])[1:-1].max() < 0.01


def test_columns_are_in_the_world_of_the_map_s_origin() -> None:
    header = replace(motion(NAME).header, origin=(10.0, 20.0, np.pi / 2))
    turned = columns_of(replace(motion(NAME), header=header), "digit", 10.0).columns
    plain = columns_of(motion(NAME), "digit", 10.0).columns
    np.testing.assert_allclose(turned["com_x"], 10 - plain["com_y"], atol=1e-9)
    np.testing.assert_allclose(turned["com_y"], 20 + plain["com_x"], atol=1e-9)
    np.testing.assert_allclose(turned["vel_x"], -plain["vel_y"], atol=1e-9)
    np.testing.assert_allclose(turned["yaw"], plain["yaw"] + np.pi / 2, atol=1e-9)


def test_timed_waypoints_are_the_ends_of_moves() -> None:
    found = waypoints.timed_waypoints(motion(NAME))
    quad = [waypoint for waypoint in found if waypoint.robot == "quad"]
    assert quad[0].t == 0
    assert (quad[0].x, quad[0].y) == (4.05, 14.85)
    assert all(later.t >= earlier.t for earlier, later in pairwise(quad))
    assert quad[1].speed == pytest.approx(0.533, abs=1e-3)  # it flies through centres
    assert quad[-1].speed == 0
    walking = {round(w.speed, 3) for w in found if w.robot == "digit"}
    assert walking == {0.0, 0.45}
    assert waypoints.as_csv(found).splitlines()[0] == "robot,tick,t,x,y,z,yaw,speed,region"


def test_a_run_without_moves_still_has_all_poses() -> None:
    content = played(
        "safenav: 1\nmap: {grid: ['#####', '#...#', '#####']}\n"
        "robots: {a: {model: quadcopter, start: [1, 1], objective: {hold: [1, 1]}}}\n"
        "until: {rounds: 1}\n"
    )
    trace = read_bytes(content, "made")
    still = motion_of(trace)
    found = columns_of(still, "a", 10.0).columns
    assert set(found["x"]) == {1.5 * 2.7} and set(found["vel_x"]) == {0.0}
    assert check_motion(still, trace) == []

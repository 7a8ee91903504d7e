"""A run as a ROS 2 bag, read by a reader that shares nothing with its writer."""

import json
import re
from math import atan2
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.conftest import Command
from once import ROOT, trace_of_shipped
from safenav.report.bag import TRAIL


@pytest.fixture
def trace() -> Path:
    return trace_of_shipped("case_study_1")


def lines(trace: Path, kind: str) -> list[dict[str, Any]]:
    told = [json.loads(line) for line in trace.read_text().splitlines()]
    return [line for line in told if line["type"] == kind]


def read(bag: Path) -> dict[str, list[tuple[float, Any]]]:
    """Topic -> (seconds, message) of every message, all of them deserialized by the definitions
    that the bag itself holds."""
    from rosbags.highlevel import AnyReader

    found: dict[str, list[tuple[float, Any]]] = {}
    with AnyReader([bag]) as reader:
        for connection, time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time / 1e9, message))
    return found


def test_the_bag_holds_the_facts_of_the_trace(
    safenav: Command, trace: Path, tmp_path: Path
) -> None:
    done = safenav("export", trace, "-o", "run.mcap", "--side", "0.5")
    assert done.returncode == 0, done.stderr
    bag = read(tmp_path / "run.mcap")
    topics = " ".join(sorted(topic.removeprefix("/") for topic in bag))
    others = "map obstacles places plan quad/path robots rosout tf"
    assert topics == f"digit/path {others}"
    header = lines(trace, "header")[0]["scenario"]["map"]
    ((_, grid),) = bag["/map"]
    assert (grid.info.width, grid.info.height) == (header["cols"], header["rows"])
    southward = [grid.data[r * 13 : (r + 1) * 13] for r in reversed(range(7))]
    drawn = ["".join("#" if value == 100 else "." for value in row) for row in southward]
    cells = range(header["cols"] * header["rows"])
    assert "".join(drawn) == "".join("#" if r in header["walls"] else "." for r in cells)

    moves = {(move["tick"], move["robot"]): move for move in lines(trace, "move")}
    facing = {"east": 0, "north": 1, "west": 2, "south": -1}
    for seconds, message in bag["/tf"][1:]:
        for transform in message.transforms:
            move = moves[round(seconds), transform.child_frame_id]
            row, col = divmod(move["to"], 13)
            place = transform.transform.translation
            assert (place.x, place.y) == pytest.approx(((col + 0.5) * 0.5, (6.5 - row) * 0.5))
            turn = transform.transform.rotation
            quarter = 2 * atan2(turn.z, turn.w) / (3.141592653589793 / 2)
            if move["heading"] is not None:
                assert (round(quarter) - facing[move["heading"]]) % 4 == 0

    paths = [len(message.poses) for _, message in bag["/quad/path"]]
    assert max(paths) == TRAIL < len(paths), "a bag grows with the ticks, not with their square"

    told = [message.msg for _, message in bag["/rosout"]]
    assert any("requests help with door@47" in text for text in told)
    assert told[-1].startswith("completed")
    actions = [marker.action for _, message in bag["/obstacles"] for marker in message.markers]
    assert actions[0] == 0 and actions[-1] == 2, "found, later resolved"


def test_a_robot_named_map_has_another_frame_than_the_map(
    safenav: Command, trace: Path, tmp_path: Path
) -> None:
    """Its frame was its own parent, so that no viewer could place any robot."""
    (tmp_path / "map.jsonl").write_text(trace.read_text().replace('"quad"', '"map"'))
    assert safenav("export", "map.jsonl", "-o", "map.mcap", "--side", "1").returncode == 0
    bag = read(tmp_path / "map.mcap")
    tree = {(t.header.frame_id, t.child_frame_id) for _, m in bag["/tf"] for t in m.transforms}
    assert tree == {("map", "map_2"), ("map", "digit")}


def test_foxglove_gets_bodies_names_and_the_plan(safenav: Command, tmp_path: Path) -> None:
    clinic = ROOT / "tests/report/scenarios/clinic.yaml"
    assert safenav("run", clinic, "--trace", "clinic.jsonl").returncode == 0
    trace = tmp_path / "clinic.jsonl"
    assert safenav("export", trace, "-o", "clinic.mcap").returncode == 0
    bag = read(tmp_path / "clinic.mcap")
    ((_, robots),) = bag["/robots"]
    bodies = [marker for marker in robots.markers if marker.ns == "bodies"]
    frames = {transform.child_frame_id for transform in bag["/tf"][0][1].transforms}
    assert {marker.header.frame_id for marker in bodies} == frames
    assert all(marker.frame_locked for marker in robots.markers)
    heights = {marker.header.frame_id: marker.pose.position.z for marker in bodies}
    assert heights["eye"] > heights["hugo"] > 0
    assert {marker.text for marker in robots.markers if marker.ns == "names"} == frames
    noses = {marker.header.frame_id for marker in robots.markers if marker.ns == "headings"}
    assert noses == frames - {"eye"}

    ((_, places),) = bag["/places"]
    named = {marker.text: marker.pose.position for marker in places.markers if marker.text}
    assert len(named) == 20
    assert (named["dock"].x, named["dock"].y) == pytest.approx((22.5 * 1.5, 1.5 * 1.5))

    plans = lines(trace, "plan")
    shown = {round(seconds): message.markers for seconds, message in bag["/plan"]}
    for plan in plans:
        ways = {m.text: len(m.points) for m in shown.get(plan["tick"], []) if m.ns == "ways"}
        ended = {line["tick"] for line in lines(trace, "plan_end")}
        moving = {name: len(way) for name, way in plan["robots"].items() if len(way) > 1}
        assert ways == moving or plan["tick"] in ended
    assert plans
    targets = [marker for marker in shown[0] if marker.ns == "targets"]
    assert {marker.text for marker in targets} == frames
    assert shown[0][0].action == 3, "each message replaces the plan before"


def values(message: object) -> str:
    """All fields of a message, without the constants of its type."""
    return re.sub(r"\b[A-Z_]{2,}=\d+, ", "", str(message))


def test_the_definitions_are_those_of_ros(safenav: Command, trace: Path, tmp_path: Path) -> None:
    """The bytes mean the same to a reader that has ROS's own definitions."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    assert safenav("export", trace, "-o", "run.mcap", "--side", "1").returncode == 0
    store = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([tmp_path / "run.mcap"]) as reader:
        for connection, _, data in reader.messages():
            own = reader.deserialize(data, connection.msgtype)
            theirs = store.deserialize_cdr(data, connection.msgtype)
            assert values(own) == values(theirs)


def test_robots_are_at_the_positions_of_the_motion(
    safenav: Command, trace: Path, tmp_path: Path
) -> None:
    assert safenav("export", trace, "--motion", "motion.jsonl").returncode == 0
    export = ("export", trace, "motion.jsonl", "-o", "run.mcap")
    done = safenav(*export, "-o", "run.npz", "--rate", "20")
    assert done.returncode == 0, done.stderr
    transforms = read(tmp_path / "run.mcap")["/tf"]
    times = [seconds for seconds, _ in transforms]
    makespan = json.loads((tmp_path / "motion.jsonl").read_text().splitlines()[-1])["makespan"]
    assert times == sorted(times) and times[0] == 0
    assert times[-1] == pytest.approx(makespan, abs=0.05)
    told: dict[str, list[tuple[float, float]]] = {}
    for _, message in transforms:
        for one in message.transforms:
            place = one.transform.translation
            told.setdefault(one.child_frame_id, []).append((place.x, place.y))
    with np.load(tmp_path / "run.npz") as columns:
        for name, places in told.items():
            for at, axis in enumerate("xy"):
                found = [place[at] for place in places]
                assert found == pytest.approx(columns[f"{name}.{axis}"], abs=1e-9)
    found = safenav(*export, "--side", "0.5")
    assert found.returncode == 2 and "leave out --side" in found.stderr

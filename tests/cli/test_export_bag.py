"""A run as a ROS 2 bag, read by a reader that shares nothing with its writer."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.conftest import Command
from once import trace_of_shipped
from support.damage import GOOD, text
from support.transcripts import golden

Bag = dict[str, list[tuple[float, Any]]]
"""Topic -> (seconds, message) of every message, all of them deserialized by the definitions that
the bag itself holds."""
Export = Callable[..., Bag]


@pytest.fixture
def trace() -> Path:
    return trace_of_shipped("case_study_1")


@pytest.fixture
def exported(safenav: Command, tmp_path: Path) -> Export:
    """Export a trace, and read the bag."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    ros = get_typestore(Stores.ROS2_HUMBLE)

    def export(*words: object) -> Bag:
        done = safenav("export", *words, "-o", "run.mcap")
        assert done.returncode == 0, done.stderr
        found: Bag = {}
        with AnyReader([tmp_path / "run.mcap"]) as reader:
            for connection, time, data in reader.messages():
                message = reader.deserialize(data, connection.msgtype)
                theirs = ros.deserialize_cdr(data, connection.msgtype)
                assert values(message) == values(theirs), "the same by ROS's own definitions"
                found.setdefault(connection.topic, []).append((time / 1e9, message))
        return found

    return export


def values(message: object) -> str:
    """All fields of a message, without the constants of its type."""
    return re.sub(r"\b[A-Z_]{2,}=\d+, ", "", str(message))


def test_a_robot_named_map_has_a_frame_of_its_own(
    exported: Export, trace: Path, tmp_path: Path
) -> None:
    """With a frame that is its own parent, no viewer could place any robot."""
    (tmp_path / "map.jsonl").write_text(trace.read_text().replace('"quad"', '"map"'))
    transforms = [t for _, m in exported("map.jsonl", "--side", "1")["/tf"] for t in m.transforms]
    tree = {(each.header.frame_id, each.child_frame_id) for each in transforms}
    assert tree == {("map", "robot/map"), ("map", "digit")}


def test_the_messages_of_a_bag_stay_the_same(exported: Export, tmp_path: Path) -> None:
    """Topics except /tf: the first two messages and the last one; texts and times of the rest."""
    found = []
    for name in ("door", "planned"):
        header, *more = GOOD[name]()
        header["scenario"]["map"] |= {"names": {"dock": 7}, "areas": {"hall": [8, 10]}}
        (tmp_path / "run.jsonl").write_text("\n".join(text([header, *more])) + "\n")
        for topic, sent in sorted(exported("run.jsonl", "--side", "0.5").items()):
            for number, (seconds, message) in enumerate(sent):
                whole = topic == "/tf" or number in (0, 1, len(sent) - 1)
                shown = values(message) if whole else getattr(message, "msg", "")
                short = re.sub(r"\w+__msg__|, __msgtype__='[^']*'|\s+", " ", shown)
                found.append(f"{topic} {seconds:g}: {short.strip()}")
    golden("\n".join(found) + "\n", Path(__file__).with_name("bag.txt"))


def test_robots_are_at_the_positions_of_the_motion(
    exported: Export, safenav: Command, trace: Path, tmp_path: Path
) -> None:
    assert safenav("export", trace, "--motion", "motion.jsonl").returncode == 0
    transforms = exported(trace, "motion.jsonl", "-o", "run.npz", "--rate", "20")["/tf"]
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
            expected = np.stack([columns[f"{name}.x"], columns[f"{name}.y"]], axis=1)
            assert np.abs(np.array(places) - expected).max() < 1e-9
    assert told

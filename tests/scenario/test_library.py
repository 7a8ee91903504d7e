"""The library: each robot model moves, each obstacle type is resolved by robots of the library, and
docs/catalogue.md has the figures that the files have."""

import re
from pathlib import Path

import pytest
import yaml

from motion.runs import played
from safenav import built_in, check_motion, check_trace, motion_of
from safenav.report.picture.svg import obstacle_pictogram, robot_pictogram
from safenav.scenario.model import Catalogue
from safenav.trace.file import read_bytes
from safenav.trace.records import Resolved

LIBRARY: Catalogue = built_in()

ROOMS = {"grid": ["##########", "#...##...#", "#........#", "#...##...#", "##########"]}
GAP = 24
"""The region west of the middle of the way between the rooms."""


def run(robots: dict[str, object], obstacles: list[object]) -> bytes:
    data = {"safenav": 1, "map": ROOMS, "robots": robots, "obstacles": obstacles}
    return played(yaml.safe_dump(data | {"until": {"rounds": 1}}, sort_keys=False))


@pytest.mark.parametrize("name", LIBRARY.robots)
def test_each_robot_moves_as_the_checker_demands(name: str) -> None:
    heading = {"heading": "east"} if LIBRARY.robots[name].mobility.value == "heading" else {}
    robot = {"model": name, "start": 21, **heading, "objective": {"patrol": [21, 28]}}
    trace = read_bytes(run({"one": robot}, []), name)
    assert trace.outcome is not None
    assert trace.outcome.outcome == "completed"
    assert check_motion(motion_of(trace), trace) == []


@pytest.mark.parametrize("name", LIBRARY.obstacles)
def test_each_obstacle_is_resolved_by_robots_of_the_library(name: str) -> None:
    kind = LIBRARY.obstacles[name]
    capable = [
        next(m.name for m in LIBRARY.robots.values() if need.action in m.capabilities)
        for need in kind.needs
        for _ in range(need.robots)
    ]
    robots: dict[str, object] = {}
    for number, model in enumerate(["cassie", *capable]):
        heading = {"heading": "east"} if model in ("cassie", "digit") else {}
        region = (21, 16, 32)[number]  # the requester, then helpers on both sides
        far = 32 if kind.blocks == frozenset() else (28, 38, 12)[number]
        goal = {"patrol": [region, 28 if number == 0 else far]}
        robots[f"r{number}"] = {"model": model, "start": region, **heading, "objective": goal}
    obstacle = {"type": name, "region": GAP} | ({"traversable": True} if kind.has_truth else {})
    content = run(robots, [obstacle])
    trace = read_bytes(content, name)
    assert trace.outcome is not None
    assert trace.outcome.outcome == "completed"
    assert check_trace(trace).findings == ()
    resolved = {record.obstacle for record in trace.records if isinstance(record, Resolved)}
    assert resolved == {f"{name}@{GAP}"}


def test_every_robot_and_obstacle_has_a_silhouette_and_so_have_those_named_like_them() -> None:
    for names, shape in (
        (LIBRARY.robots, robot_pictogram),
        (LIBRARY.obstacles, obstacle_pictogram),
    ):
        for name in names:
            assert shape(name) == shape(f"my_{name}") == shape(f"my-{name}") != ""
    assert obstacle_pictogram("fire_door") == obstacle_pictogram("door")
    assert obstacle_pictogram("my_pulled_door") != obstacle_pictogram("door")
    assert robot_pictogram("rover") == obstacle_pictogram("trapdoor") == ""


def test_the_page_has_the_figures_of_each_model_and_every_obstacle_type() -> None:
    page = (Path(__file__).parents[2] / "docs" / "catalogue.md").read_text(encoding="utf-8")
    rows = re.findall(
        r"^\| `(\w+)` \| [^|]+ \| ([\d.]+) \| ([\d.]+) \| (\w+) \|", page, re.MULTILINE
    )
    shown = {name: (float(size), float(speed), kind) for name, size, speed, kind in rows}
    assert shown == {
        name: (model.size, model.speed, model.motion) for name, model in LIBRARY.robots.items()
    }
    types = page.partition("## Obstacles")[2]
    assert {*re.findall(r"^\| `(\w+)` \|", types, re.MULTILINE)} == {*LIBRARY.obstacles}

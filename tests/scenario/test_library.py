"""The library: each robot model moves, each obstacle type is resolved by robots of the library, and
docs/catalogue.md has the figures that the files have."""

import re
from pathlib import Path

import pytest
import yaml

from safenav import (
    Mission,
    Trace,
    TraceWriter,
    built_in,
    check_motion,
    check_trace,
    load_scenario_text,
    motion_of,
    read_trace,
)

LIBRARY = built_in()

ROOMS = {"grid": ["##########", "#...##...#", "#........#", "#...##...#", "##########"]}
GAP = 24
"""The region west of the middle of the way between the rooms."""


def run(robots: dict[str, object], obstacles: list[object], folder: Path) -> Trace:
    """The trace of a completed run."""
    data = {"safenav": 1, "map": ROOMS, "robots": robots, "obstacles": obstacles}
    scenario = load_scenario_text(yaml.safe_dump(data | {"until": {"rounds": 1}}, sort_keys=False))
    with TraceWriter(folder / "t.jsonl") as writer:
        assert Mission(scenario, listeners=[writer]).run().outcome == "completed"
    trace = read_trace(folder / "t.jsonl")
    assert check_trace(trace).findings == ()
    return trace


@pytest.mark.parametrize("name", LIBRARY.robots)
def test_the_motion_of_each_built_in_robot_is_accepted(name: str, tmp_path: Path) -> None:
    heading = {"heading": "east"} if LIBRARY.robots[name].mobility.value == "heading" else {}
    robot = {"model": name, "start": 21, **heading, "objective": {"patrol": [21, 28]}}
    trace = run({"one": robot}, [], tmp_path)
    assert check_motion(motion_of(trace), trace) == []


@pytest.mark.parametrize("name", LIBRARY.obstacles)
def test_each_built_in_obstacle_is_resolved_by_built_in_robots(name: str, tmp_path: Path) -> None:
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
    records = run(robots, [obstacle], tmp_path).records
    resolved = {record.obstacle for record in records if record.type == "resolved"}
    assert resolved == {f"{name}@{GAP}"}


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

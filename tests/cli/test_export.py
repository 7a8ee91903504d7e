"""``safenav export``: a run as waypoints in the frame of its map."""

import csv
import io
import json
from math import pi
from pathlib import Path

import pytest

from cli.conftest import Command
from runtime.played import play

ROOT = Path(__file__).parents[2]
MAPS = ROOT / "tests" / "maps"

WALK = """\
safenav: 1
map: {%s}
robots:
  ann: {model: digit, start: 4, heading: east, objective: {visit: [6, 4]}}
  fly: {model: quadcopter, start: 0, objective: {hold: 0}}
until: {rounds: 1}
"""
OPEN = "grid: ['....', '....', '....']"


def run(folder: Path, scenario: str) -> None:
    (folder / "s.jsonl").write_text(play(scenario).text, encoding="utf-8")


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def moves(folder: Path) -> list[tuple[str, int, int]]:
    lines = (folder / "s.jsonl").read_text(encoding="utf-8").splitlines()
    records = [json.loads(line) for line in lines]
    return [(r["robot"], r["tick"], r["to"]) for r in records if r["type"] == "move"]


def test_waypoints_are_the_middles_of_regions_tick_by_tick(
    safenav: Command, tmp_path: Path
) -> None:
    run(tmp_path, WALK % f"{OPEN}, resolution: 0.5, origin: [-1, 10]")
    found = safenav("export", "s.jsonl", "-o", "way.csv")
    assert found.returncode == 0, found.stderr
    text = (tmp_path / "way.csv").read_text(encoding="utf-8")
    assert text.splitlines()[:2] == ["robot,tick,x,y,yaw,region", "ann,0,-0.75,10.75,0.0,4"]
    way = rows(text)
    assert [row["robot"] for row in way] == sorted(row["robot"] for row in way)
    told = {(row["robot"], int(row["tick"]), int(row["region"])) for row in way}
    assert told == set(moves(tmp_path)) | {("ann", 0, 4), ("fly", 0, 0)}
    for row in way:
        line, col = divmod(int(row["region"]), 4)
        assert float(row["x"]) == pytest.approx(-1 + 0.5 * col + 0.25)
        assert float(row["y"]) == pytest.approx(10 + 0.5 * (2 - line) + 0.25)
        assert (row["yaw"] == "") == (row["robot"] == "fly")


def test_yaw_is_counterclockwise_from_the_east(safenav: Command, tmp_path: Path) -> None:
    run(tmp_path, WALK % f"{OPEN}, resolution: 1")
    way = rows(safenav("export", "s.jsonl", "-o", "-").stdout)
    lines = (tmp_path / "s.jsonl").read_text(encoding="utf-8").splitlines()
    facing = {
        (r["tick"]): r["heading"]
        for r in map(json.loads, lines)
        if r["type"] == "move" and r["robot"] == "ann"
    }
    expected = {"east": 0.0, "north": pi / 2, "west": pi, "south": -pi / 2}
    seen = set()
    for row in way:
        if row["robot"] == "ann" and row["tick"] != "0":
            heading = facing[int(row["tick"])]
            seen.add(heading)
            difference = float(row["yaw"]) - expected[heading]
            assert abs(difference) < 1e-5 or abs(abs(difference) - 2 * pi) < 1e-5
    assert len(seen) >= 3, "it turned on its way"


def test_json_holds_the_same_with_its_frame(safenav: Command, tmp_path: Path) -> None:
    run(tmp_path, WALK % f"{OPEN}, resolution: 0.5, origin: [-1, 10, 0.1]")
    assert safenav("export", "s.jsonl", "-o", "way.json").returncode == 0
    data = json.loads((tmp_path / "way.json").read_text(encoding="utf-8"))
    assert data["resolution"] == [0.5, 0.5]
    assert data["origin"] == [-1.0, 10.0, 0.1]
    table = rows(safenav("export", "s.jsonl", "-o", "-").stdout)
    for robot, way in data["robots"].items():
        same = [row for row in table if row["robot"] == robot]
        assert [(w["tick"], w["x"], w["y"], w["region"]) for w in way] == [
            (int(r["tick"]), float(r["x"]), float(r["y"]), int(r["region"])) for r in same
        ]


def test_a_run_on_a_ros_map_lies_in_the_frame_of_that_map(safenav: Command, tmp_path: Path) -> None:
    scenario = (
        f"safenav: 1\nmap: {{ros: {MAPS / 'office.yaml'}, resolution: 0.4}}\n"
        "robots: {fly: {model: quadcopter, start: 14, objective: {hold: 14}}}\nuntil: {rounds: 1}\n"
    )
    run(tmp_path, scenario)
    first = rows(safenav("export", "s.jsonl", "-o", "-").stdout)[0]
    # 0.6 m east and 2.2 m north of the lower left corner, which is at (-2.5, -1.5)
    assert (float(first["x"]), float(first["y"])) == pytest.approx((-1.9, 0.7))


def test_a_trace_without_metres_needs_them(safenav: Command, tmp_path: Path) -> None:
    run(tmp_path, WALK % OPEN)
    refused = safenav("export", "s.jsonl", "-o", "way.csv")
    assert refused.returncode == 2
    assert "the size of a region in metres is missing" in refused.stderr
    assert "--side 0.5" in refused.stderr
    assert not (tmp_path / "way.csv").exists()
    told = safenav("export", "s.jsonl", "-o", "-", "--side", "2", "--origin", "5", "-3")
    assert rows(told.stdout)[0]["x"] == "6.0"
    assert rows(told.stdout)[0]["y"] == "0.0"

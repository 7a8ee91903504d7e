"""Motions by safenav export, and their check: files, exit codes, errors that say what to do."""

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from cli.conftest import Command

DOOR = """\
safenav: 1
map:
  grid: |
    #######
    #..#..#
    #.....#
    #..#..#
    #######
  {metres}
{catalogue}
robots:
  rover: {{model: {model}, start: [2, 1], {heading} objective: {{visit: [[2, 5], [2, 1]]}}}}
obstacles: [{{type: door, region: [2, 3]}}]
until: {{rounds: 1}}
"""


def scenario(
    tmp_path: Path, model: str = "cart", metres: str = "", motion: str = "speed: 1"
) -> Path:
    path = tmp_path / "door.yaml"
    own = f"{{mobility: free, layer: ground, capabilities: [push], {motion}}}"
    catalogue = f"catalogue: {{robots: {{cart: {own}}}}}"
    path.write_text(DOOR.format(metres=metres, catalogue=catalogue, model=model, heading=""))
    return path


@pytest.fixture
def moved(safenav: Command, tmp_path: Path) -> Path:
    """A folder with run.jsonl and run.motion.jsonl."""
    made = safenav(
        "run", scenario(tmp_path), "--trace", "run.jsonl", "--motion", "run.motion.jsonl"
    )
    assert made.returncode == 0, made.stderr
    return tmp_path


def test_run_with_motion_equals_the_motion_command(safenav: Command, moved: Path) -> None:
    again = safenav("export", "run.jsonl", "--motion", "again.jsonl")
    assert again.returncode == 0
    assert (moved / "again.jsonl").read_text() == (moved / "run.motion.jsonl").read_text()
    assert "using 2.7 m (change with --side M)" in again.stderr


def test_run_with_motion_names_immovable_robots_before_the_run(
    safenav: Command, tmp_path: Path
) -> None:
    large = scenario(tmp_path, metres="resolution: 1", motion="speed: 1, size: 1.2")
    found = safenav("run", large, "--trace", "run.jsonl", "--motion", "run.motion.jsonl")
    assert (found.returncode, found.stdout) == (2, "")
    refused = "rover: a body of 1.2 m does not fit into regions of 1 m"
    assert refused in found.stderr
    assert {file.name for file in tmp_path.iterdir()} == {"door.yaml"}
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("safenav-fleet: 1\ntransport: simulation\n")
    found = safenav("drive", large, "--fleet", fleet, "--motion", "run.motion.jsonl")
    assert (found.returncode, found.stdout) == (2, "") and refused in found.stderr


def test_no_motion_is_written_of_a_trace_that_breaks_a_rule(safenav: Command, moved: Path) -> None:
    """Its moves are possible, but its goals are met in other ticks."""
    text = (moved / "run.jsonl").read_text()
    (moved / "late.jsonl").write_text(
        text.replace('"type":"goal","tick":', '"type":"goal","tick":9')
    )
    made = safenav("export", "late.jsonl", "--motion", "late.motion.jsonl")
    assert made.returncode == 2 and "late.jsonl breaks a rule" in made.stderr
    assert not (moved / "late.motion.jsonl").exists()


def test_damaged_motion_exits_with_1_and_its_first_finding(safenav: Command, moved: Path) -> None:
    path = moved / "run.motion.jsonl"
    lines = path.read_text().splitlines()
    lines.remove(next(line for line in lines if '"from":15,"to":16' in line))
    path.write_text("\n".join(lines) + "\n")
    found = safenav("check", path, "run.jsonl")
    assert found.returncode == 1
    assert "no motion recorded until" in found.stdout
    data = json.loads(safenav("check", "--json", path, "run.jsonl").stdout)[0]
    assert data["ok"] is False
    assert data["findings"][0]["robot"] == "rover"


def test_motion_of_another_trace_is_a_finding(safenav: Command, moved: Path) -> None:
    other = moved / "other.jsonl"
    other.write_text((moved / "run.jsonl").read_text() + "\n")
    found = safenav("check", "run.motion.jsonl", other)
    assert found.returncode == 1
    assert "of another trace" in found.stdout


@pytest.mark.parametrize(
    ("motion", "metres", "words"),
    [
        ("size: 0.5", "", "has no motion in metres"),
        ("speed: 1, size: 3", "", "a body of 3 m does not fit into regions of 2.7 m"),
        ("motion: rover, size: 1", "resolution: 0.9", "does not fit into regions of 0.9 m"),
    ],
    ids=["no parameters", "too large a body", "too small a region"],
)
def test_a_robot_that_cannot_move_so_is_reported_and_nothing_is_written(
    safenav: Command, tmp_path: Path, motion: str, metres: str, words: str
) -> None:
    path = scenario(tmp_path, motion=motion, metres=metres)
    assert safenav("run", path, "--trace", "run.jsonl").returncode == 0
    found = safenav("export", "run.jsonl", "--motion", "out.jsonl")
    assert found.returncode == 2
    assert words in found.stderr
    assert not (tmp_path / "out.jsonl").exists()


REQUIRED = """\
requirements:
  - calm: always(speed(rover) <= 3)
  - always(resolved_door@17 -> once requested_door@17)
"""


def test_requirements_from_scenario_to_verdict(safenav: Command, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(scenario(tmp_path).read_text() + REQUIRED)
    made = safenav("run", "a.yaml", "--trace", "a.jsonl", "--motion", "a.motion.jsonl")
    assert made.returncode == 1
    assert "not as expected: requirement always(resolved_door@17 -> once" in made.stderr
    assert safenav("run", "a.yaml").returncode == 0, "without a motion nothing can be measured"
    alone = safenav("check", "a.jsonl")
    assert alone.returncode == 0
    assert "Not judged: 2 requirements; give the motion of the run also." in alone.stdout
    found = safenav("check", "a.motion.jsonl", "a.jsonl")
    assert found.returncode == 1
    assert "calm: always(speed(rover) <= 3): satisfied (robustness 2." in found.stdout
    assert "once requested_door@17): violated (robustness -1.000)" in found.stdout
    only = ("check", "a.motion.jsonl", "a.jsonl", "--json", "--rate", "200")
    data = json.loads(safenav(*only, "--require", "x(rover) >= 0").stdout)[0]
    assert [one["verdict"] for one in data["requirements"]] == [
        "satisfied",
        "violated",
        "satisfied",
    ]
    wrong = safenav(*only, "--require", "x(bat) >= 0")
    assert wrong.returncode == 2
    assert "'bat' is not a robot" in wrong.stderr

    ran = safenav("batch", "a.yaml", "--junit", "j.xml", "--json")
    assert ran.returncode == 1
    assert "once requested_door@17): violated" in ran.stderr
    (case,) = ET.parse(tmp_path / "j.xml").iter("testcase")
    assert [part.tag for part in case] == ["failure", "system-out"]
    assert "requirement calm: satisfied" in str(case[1].text)
    (result,) = json.loads(ran.stdout)["results"]
    assert result["requirements"]["calm"]["verdict"] == "satisfied"


def test_exports_have_the_times_of_a_motion_file_or_of_the_computed_one(
    safenav: Command, moved: Path
) -> None:
    assert safenav("export", "run.jsonl", "run.motion.jsonl", "-o", "read.npz").returncode == 0
    made = safenav("export", "run.jsonl", "--motion", "same.jsonl", "-o", "made.npz")
    assert made.returncode == 0, made.stderr
    assert (moved / "made.npz").read_bytes() == (moved / "read.npz").read_bytes()
    other = safenav("export", "run.jsonl", "run.motion.jsonl", "-o", "x.npz", "--side", "1")
    assert other.returncode == 2 and "leave out --side" in other.stderr


def test_several_files_are_judged_in_order_and_the_worst_code_is_returned(
    safenav: Command, moved: Path
) -> None:
    files = ("door.yaml", "none.yaml", "run.motion.jsonl", "run.jsonl")
    done = safenav("check", *files)
    assert done.returncode == 2
    assert "door.yaml:\nrover: realizable" in done.stdout
    assert "error: none.yaml: no such file" in done.stderr
    assert done.stdout.index("run.motion.jsonl: no rule") < done.stdout.index("run.jsonl: no rule")
    found = safenav("check", *files, "--json")
    data = json.loads(found.stdout)
    assert [each["file"] for each in data] == list(files)
    assert ["error" in each for each in data] == [False, True, False, False]
    assert found.returncode == 2
    (moved / "second.jsonl").write_text((moved / "run.jsonl").read_text() + "\n")
    paired = safenav("check", "second.jsonl", "run.motion.jsonl", "run.jsonl")
    assert paired.returncode == 0, paired.stdout

"""The case studies driven: by physics in this process, and by ROS 2 between processes.

No scenario lists an obstacle: lidars and reports find them. Behind every transport is the physics
simulation, whose contacts are the judge.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.driving import ALARMED, FIRST, ROOT, SECOND, THIRD, Lab
from fleet.sockets import addresses, confined, is_loopback
from safenav.fleet.file import template_text
from safenav.run.checked import check_trace
from safenav.scenario.reading.loader import load_scenario
from warm import safenav


@pytest.fixture
def lab(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Lab]:
    made = Lab(*request.param[:2], tmp_path, request.param[2] if len(request.param) > 2 else {})
    yield made
    made.close()


def labs(*cases: tuple[Any, ...]) -> list[Any]:
    """Labs by case study, transport and faults."""
    return [pytest.param(case, id=f"{case[1]}-{case[0]}") for case in cases]


def lines_of(trace: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in trace.read_text().splitlines()]


DRIVEN = labs(
    (SECOND, "simulation"),
    (THIRD, "ros2", {"digit": "abort+late+lag", "quad": "doubled+lag+tf"}),
)


@pytest.mark.slow
@pytest.mark.parametrize("lab", DRIVEN, indirect=True)
def test_a_case_study_is_driven_without_a_listed_obstacle(lab: Lab) -> None:
    """In the simulation robots follow references. Goals that are aborted, replies that are late or
    come twice do no harm. Processes of ROS 2 listen and send on loopback only."""
    process = under_way(lab, 2)
    if lab.physics is not None and sys.platform.startswith("linux"):
        found, outside = addresses(process.pid), confined(process.pid)
        assert found != [] and outside in ({"lo"}, None)
        for table, own, other in found:
            anyone = own in ("0.0.0.0", "::")
            assert is_loopback(own) or (table.startswith("udp") and anyone), found
            assert is_loopback(other) or other in ("0.0.0.0", "::"), found
    told = process.communicate(timeout=600)[0]
    assert process.returncode == 0, told[-2000:]
    lines = lines_of(lab.trace)
    assert lines[-1]["outcome"] == "completed"
    hidden = set(re.findall(r"type: (\w+), region: (\d+)", lab.fleet.read_text()))
    discovered = [line["obstacle"] for line in lines if line["type"] == "discovered"]
    assert {(o["type"]["name"], str(o["region"])) for o in discovered} == hidden
    assert check_trace(lab.trace).findings == ()
    assert overlap(lines) > 0.0
    judged = safenav("check", "--json", lab.motion, lab.trace)
    assert judged.returncode == 0, judged.stdout
    tracked = json.loads(judged.stdout)[0]["execution"]
    assert {one["robot"] for one in tracked} == {"quad", "digit"}
    follows = lab.physics is None
    assert all(one["driven"] == ("setpoints" if follows else "goals") for one in tracked)
    assert all(one["measurements"] > 50 and one["off"] < 0.3 for one in tracked)
    if lab.physics is not None:
        log = lab.physics.log()
        assert log["contacts"] == {} and log["standing"] == []
        assert log["moving"] == []


CALLED = {"digit": "alarm"}


@pytest.mark.slow
@pytest.mark.parametrize("lab", labs((ALARMED, "ros2", CALLED)), indirect=True)
def test_a_topic_sets_an_input_of_the_environment(lab: Lab) -> None:
    """Digit has set out, hears the alarm, goes home, and continues when it is over."""
    done = lab.drive()
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    lines = lines_of(lab.trace)
    assert [x["values"] for x in lines if x["type"] == "inputs"] == [{"alarm": v} for v in (1, 0)]
    given = [x["objective"] for x in lines if x.get("cause") == "input"]
    assert given == [{"hold": 13}, {"visit": [14, 16]}]
    assert lines[-1]["outcome"] == "completed" and check_trace(lab.trace).findings == ()


def rested(lab: Lab) -> None:
    """Wait until no robot moves."""
    for _ in range(6000):
        if lab.physics.log()["moving"] == []:
            return
        time.sleep(0.05)
    raise AssertionError(f"{lab.physics.log()['moving']} do not stop")


def overlap(lines: list[dict[str, Any]]) -> float:
    """The seconds in which both robots were in transit."""
    begun: dict[int, dict[str, Any]] = {}
    ways: dict[str, list[tuple[float, float]]] = {"digit": [], "quad": []}
    for line in lines:
        if line["type"] == "depart":
            begun[line["command"]] = line
        elif line["type"] == "arrive":
            ways[line["robot"]].append((begun[line["command"]]["t"], line["t"]))
    pairs = ((one, two) for one in ways["digit"] for two in ways["quad"])
    return sum(max(0.0, min(one[1], two[1]) - max(one[0], two[0])) for one, two in pairs)


def under_way(lab: Lab, departs: int) -> subprocess.Popen[str]:
    """A drive that has sent its robots so many times."""
    process = subprocess.Popen(
        lab.command(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=lab.environment,
    )
    for _ in range(6000):
        if lab.trace.exists() and lab.trace.read_text().count('"depart"') >= departs:
            return process
        time.sleep(0.05)
    process.kill()
    raise AssertionError("the robots do not move")


@pytest.mark.slow
@pytest.mark.parametrize("lab", labs((FIRST, "ros2")), indirect=True)
def test_robots_stop_when_safenav_ends_and_are_lost_when_their_programs_do(lab: Lab) -> None:
    process = under_way(lab, 6)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=300)
    assert process.returncode == 130
    lines = lines_of(lab.trace)
    departs = [line for line in lines[1:] if line["type"] == "depart"]
    allowed = {line["robot"]: {line["from"], line["to"]} for line in departs}
    rested(lab)
    log = lab.physics.log()
    assert all(log["regions"][name] in regions for name, regions in allowed.items())
    assert lines[-1]["outcome"] == "interrupted"

    lab.physics.send("quad", 3.0, 11.0, None)
    lab.physics.send("digit", 13.0, 3.0, 0.0)
    rested(lab)
    lab.trace.unlink()
    process = under_way(lab, 4)
    lab.processes[-1].kill()  # digit's
    told = process.communicate(timeout=300)[0]
    lines = lines_of(lab.trace)
    assert process.returncode == 1, told
    assert lines[-1]["outcome"] == "operator_needed"
    ended = [line for line in lines if line["type"] == "arrive" and line["robot"] == "digit"]
    assert ended[-1]["result"] == "lost"
    assert "digit" in lines[-1]["explanation"]
    assert check_trace(lab.trace).findings == ()


@pytest.mark.parametrize("name", ["case_study_1", "hospital", "warehouse_orders"])
def test_a_rehearsal_is_the_run_in_time(name: str, tmp_path: Path) -> None:
    """For its first half minute."""
    scenario = ROOT / "scenarios" / f"{name}.yaml"
    fleet, one, two = (tmp_path / name for name in ("fleet.yaml", "run.jsonl", "rehearsal.jsonl"))
    fleet.write_text("safenav-fleet: 1\ntransport: ros2\n")
    options = (scenario, "--json", "--time-limit", LIMIT, "--trace")
    run = safenav("run", *options, one, "--clock", "live")
    rehearsal = safenav("drive", *options, two, "--fleet", fleet, "--rehearse")
    assert run.returncode == rehearsal.returncode == 3
    kept = [
        [{k: v for k, v in line.items() if k not in TIMES} for line in lines_of(path)]
        for path in (one, two)
    ]
    assert kept[0] == kept[1] and len(kept[0]) > 4


LIMIT = 30
TIMES = {"seconds", "synthesis_seconds", "cached", "verified"}


def test_a_drive_that_cannot_begin_is_refused_before_any_move(tmp_path: Path) -> None:
    case = ROOT / "scenarios" / "case_study_1.yaml"
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("safenav-fleet: 1\ntransport: simulation\n")
    trace = tmp_path / "run.jsonl"
    done = safenav("drive", case, "--fleet", fleet, "--trace", trace)
    assert done.returncode == 2 and "add 'resolution: 1.0'" in done.stderr
    assert not trace.exists()
    metres = tmp_path / "metres.yaml"
    metres.write_text(case.read_text().replace("map:\n", "map:\n  resolution: 2.0\n"))
    fleet.write_text("safenav-fleet: 1\ntransport: ros2\nnetwork: {domain: 231}\n")
    done = safenav("drive", metres, "--fleet", fleet, "--patience", "0.2")
    assert done.returncode == 2
    assert "no answer in 0.2 s from /quad/odom, /digit/odom" in done.stderr


DEBRIS = """\
safenav: 1
name: hall
map: {resolution: 2.0, grid: ["#######", "#.....#", "##..###", "#######"]}
robots: {digit: {model: digit, start: [1, 1], heading: east, objective: {visit: [[1, 5]]}}}
until: {rounds: 1}
"""
BLOCKED = """\
safenav-fleet: 1
transport: simulation
simulation: {pace: 60, obstacles: [{type: debris, region: [1, 3]}]}
robots: {digit: {speed: 0.45, scan: {obstacle: debris}}}
"""


FREE = BLOCKED.replace(", obstacles: [{type: debris, region: [1, 3]}]", "")


def test_a_drive_is_resumed_with_each_robot_where_its_step_began(tmp_path: Path) -> None:
    """It began again at the starts of the scenario, so that robots were lost. ``resume`` refuses a
    run of real robots."""
    scenario, fleet, first, rest = (
        tmp_path / name for name in ("hall.yaml", "fleet.yaml", "t.jsonl", "rest.jsonl")
    )
    corridor = DEBRIS.replace("##..###", "#######").replace("#######", "#" * 9)
    scenario.write_text(corridor.replace("#.....#", "#.......#").replace("[[1, 5]]", "[[1, 7]]"))
    fleet.write_text(FREE)
    drive = ("drive", scenario, "--fleet", fleet)
    assert safenav(*drive, "--trace", first, "--time-limit", "22").returncode == 3
    again = safenav(*drive, "--resume", first, "--trace", first)
    assert again.returncode == 2 and "would overwrite" in again.stderr
    refused = safenav(*drive, "--resume", first, "--trace", rest, "--motion", tmp_path / "m.jsonl")
    assert refused.returncode == 2 and "has no motion before its checkpoint" in refused.stderr
    assert safenav(*drive, "--resume", first, "--trace", rest).returncode == 0
    lines = lines_of(rest)
    begun = next(i for i, line in enumerate(lines) if line["type"] == "resumed")
    assert lines[1:begun] == lines_of(first)[1:begun]  # the header has other limits
    ends = [line["at"] for line in lines[:begun] if line["type"] == "arrive"]
    departures = [line["from"] for line in lines[begun:] if line["type"] == "depart"]
    assert ends[-1] == departures[0] >= 12
    assert not any(line.get("result") == "lost" for line in lines)
    assert safenav("check", rest).returncode == 0
    assert "safenav drive --resume continues it" in safenav("resume", first).stderr


def test_an_obstacle_may_be_there_again_when_a_robot_is_about_to_enter(tmp_path: Path) -> None:
    """An operator declares it resolved, and it is not: the judge refused the honest trace."""
    scenario, fleet, trace = (tmp_path / name for name in ("hall.yaml", "fleet.yaml", "t.jsonl"))
    scenario.write_text(DEBRIS)
    fleet.write_text(BLOCKED)
    drive = ("drive", scenario, "--fleet", fleet, "--operator", "--trace", trace)
    assert safenav(*drive, text="resolved debris@10\n").returncode == 1
    assert any(line["type"] == "appeared" for line in lines_of(trace))
    assert safenav("check", trace).returncode == 0


def test_robots_without_a_lidar_report_the_obstacles_beside_them(tmp_path: Path) -> None:
    """A lidar would take the gate for a pulled door, which no robot opens by pulling."""
    scenario, fleet, trace = (tmp_path / name for name in ("night.yaml", "fleet.yaml", "t.jsonl"))
    night = (ROOT / "scenarios" / "night_round.yaml").read_text()
    scenario.write_text(night.replace("map:\n", "map:\n  resolution: 2.0\n"))
    template = template_text(load_scenario(scenario))
    assert "scan:" not in template and "cannot distinguish gate and pulled_door" in template
    told = template.replace("transport: ros2 ", "simulation: {pace: 1000}\ntransport: simulation ")
    fleet.write_text(re.sub(r"^network:\n(  .*\n)+", "", told, flags=re.MULTILINE))
    done = safenav("drive", scenario, "--fleet", fleet, "--trace", trace, "--json")
    assert done.returncode == 0, done.stderr
    resolved = {line["obstacle"] for line in lines_of(trace) if line["type"] == "resolved"}
    assert resolved == {"pulled_door@43", "gate@47"}
    assert check_trace(trace.read_text().splitlines()).findings == ()


def test_walls_are_not_obstacles_on_small_regions(tmp_path: Path) -> None:
    """On regions of half a metre the wall behind the next one is 0.75 m away."""
    scenario, fleet, trace = (tmp_path / name for name in ("ward.yaml", "fleet.yaml", "t.jsonl"))
    scenario.write_text(
        """\
safenav: 1
map: {resolution: 0.5, grid: ["######", "#....#", "#.##.#", "#....#", "######"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, size: 0.3, speed: 0.8}}}
robots: {cart: {model: cart, start: [1, 1], objective: {visit: [[3, 4], [1, 1]]}}}
until: {rounds: 1}
"""
    )
    head = "safenav-fleet: 1\ntransport: simulation\nsimulation: {pace: 1000}\n"
    fleet.write_text(head + "robots: {cart: {scan: {obstacle: door}}}\n")
    done = safenav("drive", scenario, "--fleet", fleet, "--trace", trace, "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert not [line for line in lines_of(trace) if line["type"] in ("discovered", "violation")]


ELSEWHERE = "objective digit {visit: [[2, 3]]}\n\n"


@pytest.mark.slow
@pytest.mark.parametrize("answer", [ELSEWHERE, None], ids=["tells", "ends"])
def test_a_drive_queries_its_operator_and_is_shown(tmp_path: Path, answer: str | None) -> None:
    """Who answers by Ctrl-C ends the run."""
    scenario, fleet, trace = (tmp_path / name for name in ("hall.yaml", "fleet.yaml", "t.jsonl"))
    scenario.write_text(DEBRIS)
    fleet.write_text(BLOCKED)
    words = ["drive", scenario, "--fleet", fleet, "--trace", trace, "--json", "--operator"]
    process = subprocess.Popen(
        [Path(sys.executable).with_name("safenav"), *words, "--live"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "BROWSER": "true", "SAFENAV_CACHE": str(tmp_path / "cache")},
    )
    assert process.stdin is not None and process.stderr is not None
    address = process.stderr.readline().removeprefix("live: ").strip()
    with urllib.request.urlopen(address, timeout=300) as page:
        assert "hall" in page.read().decode()
    while not (trace.exists() and '"type":"waiting"' in trace.read_text()):
        assert process.poll() is None
        time.sleep(0.05)
    if answer is None:
        process.send_signal(signal.SIGINT)
    process.communicate(answer, timeout=300)
    lines = lines_of(trace)
    assert process.returncode == (130 if answer is None else 0)
    assert lines[-1]["outcome"] == ("interrupted" if answer is None else "completed")
    assert [line["type"] for line in lines].count("operator") == (answer is not None)
    assert check_trace(trace).findings == ()

"""The case studies driven: by physics in this process, and by ROS 2 between processes.

No scenario lists an obstacle: lidars and reports find them. Behind every transport is the physics
simulation, whose contacts are the judge.
"""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.drives import driven, lines_of
from once import SCENARIOS, beside, from_yaml
from safenav import check_trace, read_trace
from safenav.motion.timing import actions_of
from warm import safenav

PROGRAM, TESTS = Path(sys.executable).with_name("safenav"), Path(__file__).parents[1]
FIRST, SECOND, THIRD = (f"case_study_{number}" for number in (1, 2, 3))
ALARMED = beside(__file__, "scenarios/alarmed.yaml")
LAB = beside(__file__, "scenarios/lab.fleet.yaml")


def files(folder: Path, scenario: object, fleet: object) -> tuple[str, ...]:
    """The words of a drive whose files are text or data, and whose trace is ``t.jsonl``."""
    for name, content in (("hall.yaml", scenario), ("fleet.yaml", fleet)):
        (folder / name).write_text(content if isinstance(content, str) else json.dumps(content))
    words = folder / "hall.yaml", "--fleet", folder / "fleet.yaml", "--trace", folder / "t.jsonl"
    return ("drive", *map(str, words))


class Lab:
    """A scenario without its obstacles, a fleet file that has them, and behind ROS 2 the process
    ``peer`` of the robots. ``faults``: of each robot, None in the simulation."""

    def __init__(self, case: str, faults: dict[str, str] | None, folder: Path) -> None:
        data = from_yaml(ALARMED if case == "alarmed" else (SCENARIOS / f"{case}.yaml").read_text())
        self.hidden = data.pop("obstacles", [])
        data.pop("expect", None)
        data["map"]["resolution"], data["until"] = 2.0, {"rounds": 1}
        fleet, pace, domain = from_yaml(LAB), 50.0, 20 + os.getpid() % 200
        robots, defaults = fleet["robots"], fleet["defaults"]
        if faults is None:
            fleet["transport"], pace, robots["quad"]["follow"] = "simulation", 1000.0, {}
        else:  # its robots are as many times faster
            fleet["network"], defaults["speed"] = {"domain": domain}, pace * defaults["speed"]
        fleet["simulation"] = {"pace": pace, "obstacles": self.hidden}
        if case == "alarmed":
            fleet["inputs"] = {"alarm": "/building/alarm"}
        for name, own in (faults or {}).items():
            if "tf" in own:
                robots[name]["tf"] = {"frame": f"{name}/base"}
        self.words, self.trace = files(folder, data, fleet), folder / "t.jsonl"
        self.environment = os.environ | {"PYTHONPATH": str(TESTS), "SAFENAV_CACHE": str(folder)}
        self.peer: subprocess.Popen[str] | None = None
        if faults is not None:
            named = [f"{name}+{faults.get(name, '')}".rstrip("+") for name in robots]
            peer = sys.executable, TESTS / "fleet/ros2_peer.py", domain, *self.words[1:4:2]
            self.peer = self.started(*peer, pace, *named)
            assert self.said() == "ready"

    def started(self, *words: object, **streams: Any) -> subprocess.Popen[str]:
        streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True} | streams
        return subprocess.Popen([*map(str, words)], env=self.environment, **streams)

    def said(self) -> Any:
        """Return what the process of the robots says next."""
        assert self.peer is not None and self.peer.stdout is not None
        return json.loads(self.peer.stdout.readline())

    def physics(self, *call: object) -> Any:
        """Call a method of the physics."""
        assert self.peer is not None and self.peer.stdin is not None
        print(json.dumps(call), file=self.peer.stdin, flush=True)
        return self.said()

    def rested(self) -> Any:
        """Wait until no robot moves; return the log of the physics."""
        for _ in range(6000):
            log = self.physics("log")
            if log["moving"] == []:
                return log
            time.sleep(0.05)
        raise AssertionError(f"{log['moving']} do not stop")

    def under_way(self, departs: int) -> subprocess.Popen[str]:
        """Start a drive; return it when it has sent its robots so many times."""
        process = self.started(PROGRAM, *self.words, "--patience", 300, stderr=subprocess.STDOUT)
        while process.poll() is None:
            if self.trace.exists() and self.trace.read_text().count('"depart"') >= departs:
                return process
            time.sleep(0.05)
        raise AssertionError(process.communicate()[0])

    def driven(self) -> list[dict[str, Any]]:
        """The lines of a drive that completes its mission, and breaks no rule."""
        process = self.under_way(0)
        told = process.communicate(timeout=600)[0]
        assert process.returncode == 0, told[-2000:]
        lines = lines_of(self.trace)
        assert lines[-1]["outcome"] == "completed" and check_trace(self.trace).findings == ()
        return lines


@pytest.fixture
def lab(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Lab]:
    made = Lab(*request.param, tmp_path)
    yield made
    if made.peer is not None:
        made.peer.kill()
        made.peer.communicate()


def in_labs(*cases: tuple[str, dict[str, str] | None]) -> pytest.MarkDecorator:
    """Play a test in labs: of a case, with faults."""
    names = [f"{'simulation' if faults is None else 'ros2'}-{case}" for case, faults in cases]
    return pytest.mark.parametrize("lab", cases, indirect=True, ids=names)


@pytest.mark.slow
@in_labs((SECOND, None), (THIRD, {"digit": "abort+late+lag", "quad": "doubled+lag+tf"}))
def test_a_drive_completes_a_case_study_whose_obstacle_is_not_listed(lab: Lab) -> None:
    """In the simulation the flyer follows references. Goals that are aborted, replies that are late
    or come twice do no harm."""
    lines = lab.driven()
    discovered = [line["obstacle"] for line in lines if line["type"] == "discovered"]
    found = {(one["type"]["name"], one["region"]) for one in discovered}
    assert found == {(one["type"], one["region"]) for one in lab.hidden}
    steps = [line for line in lines if line["type"] in ("depart", "arrive")]
    pairs = [pair for pair in pairwise(steps) if {one["type"] for one in pair} == {"depart"}]
    assert any(one["robot"] != other["robot"] for one, other in pairs)  # at the same time
    if lab.peer is not None:
        log = lab.physics("log")
        assert log["contacts"] == {} and log["standing"] == log["moving"] == []


@pytest.mark.slow
@in_labs(("alarmed", {"digit": "alarm"}))
def test_a_topic_sets_an_input_of_the_environment(lab: Lab) -> None:
    """Digit has departed, hears the alarm, goes home, and continues when it is over."""
    lines = lab.driven()
    assert [x["values"] for x in lines if x["type"] == "inputs"] == [{"alarm": v} for v in (1, 0)]
    given = [x["objective"] for x in lines if x.get("cause") == "input"]
    assert given == [{"hold": 13}, {"visit": [14, 16]}]


@pytest.mark.slow
@in_labs((FIRST, {}))
def test_robots_stop_when_safenav_ends_and_are_lost_when_their_own_programs_end(lab: Lab) -> None:
    process = lab.under_way(6)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=300)
    assert process.returncode == 130
    lines = lines_of(lab.trace)
    departs = [line for line in lines if line["type"] == "depart"]
    allowed = {line["robot"]: {line["from"], line["to"]} for line in departs}
    log = lab.rested()
    assert all(log["regions"][name] in regions for name, regions in allowed.items())
    assert lines[-1]["outcome"] == "interrupted"

    lab.physics("send", "quad", 3.0, 11.0, None)
    lab.physics("send", "digit", 13.0, 3.0, 0.0)
    lab.rested()
    lab.trace.unlink()
    process = lab.under_way(4)
    assert lab.peer is not None
    lab.peer.kill()
    told = process.communicate(timeout=300)[0]
    assert process.returncode == 1, told
    lines = lines_of(lab.trace)
    assert lines[-1]["outcome"] == "operator_needed" and "digit" in lines[-1]["explanation"]
    ended = [line for line in lines if line["type"] == "arrive" and line["robot"] == "digit"]
    assert ended[-1]["result"] == "lost"
    assert check_trace(lab.trace).findings == ()


@pytest.mark.parametrize("name", ["case_study_1", "hospital", "warehouse_orders"])
def test_a_rehearsal_has_the_events_of_the_live_run(name: str, tmp_path: Path) -> None:
    """For its first half minute."""
    drive = files(tmp_path, (SCENARIOS / f"{name}.yaml").read_text(), ROS)
    options = ("--json", "--time-limit", 30)
    run = ("run", drive[1], "--trace", tmp_path / "run.jsonl", "--clock", "live")
    for words in (run, (*drive, "--rehearse")):
        assert safenav(*words, *options).returncode == 3
    own = {"seconds", "synthesis_seconds", "cached", "verified"}
    kept = [
        [{k: v for k, v in line.items() if k not in own} for line in lines_of(tmp_path / file)]
        for file in ("run.jsonl", "t.jsonl")
    ]
    assert kept[0] == kept[1] and len(kept[0]) > 4


ROS = "safenav-fleet: 1\ntransport: ros2\n"
ALONE = f"{ROS}network: {{domain: 231}}\n"
SIDE = "  resolution: 2.0\n"
SIMULATION = "safenav-fleet: 1\ntransport: simulation\nsimulation: {pace: 1000}\n"


@pytest.mark.parametrize(
    ("side", "fleet", "told"),
    [
        ("", SIMULATION, "add 'resolution: 1.0'"),
        (SIDE, ALONE, "no answer in 0.2 s from /quad/odom, /digit/odom"),
        (
            SIDE,
            ALONE + "robots: {digit: {namespace: /lab/a/}}\n",
            "no answer in 0.2 s from /quad/odom, /lab/a/odom",
        ),
        (
            SIDE,
            ALONE + "robots: {digit: {namespace: /}, quad: {tf: {topic: /s, frame: quad}}}\n",
            "no answer in 0.2 s from /s, /odom",
        ),
    ],
    ids=["no metres", "no robots", "below a namespace", "absolute topics"],
)
def test_a_drive_that_cannot_begin_is_refused_before_any_move(
    side: str, fleet: str, told: str, tmp_path: Path
) -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text().replace("map:\n", f"map:\n{side}")
    done = safenav(*files(tmp_path, text, fleet), "--patience", "0.2")
    assert done.returncode == 2 and told in done.stderr
    assert not (tmp_path / "t.jsonl").exists()


DEBRIS = beside(__file__, "scenarios/debris.yaml")
FREE = beside(__file__, "scenarios/debris.fleet.yaml")
BLOCKED = FREE.replace("60", "60, obstacles: [{type: debris, region: [1, 3]}]")


def test_a_drive_is_resumed_with_each_robot_where_its_step_began(tmp_path: Path) -> None:
    """Robots expected elsewhere would be lost. ``resume`` refuses a run of real robots."""
    corridor = DEBRIS.replace("##..###", "#######").replace("#######", "#" * 9)
    corridor = corridor.replace("#.....#", "#.......#").replace("[[1, 5]]", "[[1, 7]]")
    drive = files(tmp_path, corridor, FREE)[:4]
    first, rest = tmp_path / "t.jsonl", tmp_path / "rest"
    assert safenav(*drive, "--trace", first, "--time-limit", "22").returncode == 3
    again = safenav(*drive, "--resume", first, "--trace", first)
    assert again.returncode == 2 and "would overwrite" in again.stderr
    assert safenav(*drive, "--resume", first, "--trace", rest).returncode == 0
    before, lines = ([{**line, "run": 0} for line in lines_of(each)] for each in (first, rest))
    begun = next(i for i, line in enumerate(lines) if line["type"] == "resumed")
    assert lines[1:begun] == before[1:begun]  # checkpoints belong to a header, with its limits
    ends = [line["at"] for line in lines[:begun] if line["type"] == "arrive"]
    departures = [line["from"] for line in lines[begun:] if line["type"] == "depart"]
    assert ends[-1] == departures[0] >= 12
    assert not any(line.get("result") == "lost" for line in lines)
    assert safenav("check", rest).returncode == 0
    assert "safenav drive --resume continues it" in safenav("resume", first).stderr


def test_a_killed_drive_knows_the_load_that_a_robot_has_taken(tmp_path: Path) -> None:
    """Its next action is the delivery. Drives have checkpoints at the start and every 10 s."""
    scenario, fleet = (beside(__file__, f"scenarios/load{each}.yaml") for each in ("", ".fleet"))
    drive, rest, trace = files(tmp_path, scenario, fleet), tmp_path / "rest", tmp_path / "t.jsonl"
    assert safenav(*drive).returncode == 0
    lines = trace.read_text().splitlines(keepends=True)
    marks = [n for n, line in enumerate(lines, 1) if "checkpoint" in line]
    trace.write_text("".join(lines[: marks[1]]))
    assert safenav(*drive[:-1], rest, "--resume", trace).returncode == 0
    assert [line["need"] for line in lines_of(rest) if line["type"] == "part"] == [0, 1]


def test_an_obstacle_declared_resolved_may_still_be_there(tmp_path: Path) -> None:
    """The judge accepts the trace, although the operator was wrong."""
    drive = files(tmp_path, DEBRIS, BLOCKED)
    assert safenav(*drive, "--operator", text="resolved debris@10\n").returncode == 1
    assert any(line["type"] == "appeared" for line in lines_of(tmp_path / "t.jsonl"))
    assert safenav("check", tmp_path / "t.jsonl").returncode == 0


def test_robots_without_a_lidar_report_the_obstacles_beside_them(tmp_path: Path) -> None:
    """A lidar would take the gate for a pulled door, which no robot opens by pulling. One service
    performs two actions."""
    night = (SCENARIOS / "night_round.yaml").read_text()
    fleet = SIMULATION + "defaults: {report: seen, act: {pull: arm, unlock: key, push: arm}}\n"
    done = safenav(*files(tmp_path, night.replace("map:\n", f"map:\n{SIDE}"), fleet))
    assert done.returncode == 0, done.stderr
    lines = lines_of(tmp_path / "t.jsonl")
    resolved = {line["obstacle"] for line in lines if line["type"] == "resolved"}
    assert resolved == {"pulled_door@43", "gate@47"}
    assert check_trace(tmp_path / "t.jsonl").findings == ()


ELSEWHERE = "objective digit {visit: [[2, 3]]}\n\n"


@pytest.mark.slow
@pytest.mark.parametrize("answer", [ELSEWHERE, None], ids=["an intervention", "an interrupt"])
def test_a_drive_prompts_its_operator_and_shows_the_run(tmp_path: Path, answer: str | None) -> None:
    """An answer by Ctrl-C ends the run."""
    trace = tmp_path / "t.jsonl"
    process = subprocess.Popen(
        [PROGRAM, *files(tmp_path, DEBRIS, BLOCKED), "--json", "--operator", "--live"],
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
    if answer is None:  # an open page is not waited for
        with urllib.request.urlopen(f"{address}events", timeout=300) as page:
            page.readline()
            process.send_signal(signal.SIGINT)
            process.wait(60)
    process.communicate(answer, timeout=300)
    lines = lines_of(trace)
    assert process.returncode == (130 if answer is None else 0)
    assert lines[-1]["outcome"] == ("interrupted" if answer is None else "completed")
    assert [line["type"] for line in lines].count("operator") == (answer is not None)
    assert check_trace(trace).findings == ()


DRIVES = from_yaml(beside(__file__, "drives.yaml"))


@pytest.mark.parametrize("case", DRIVES, ids=lambda case: case["name"])
def test_a_drive_in_the_simulation_ends_as_expected(case: dict[str, Any]) -> None:
    texts = [beside(__file__, f"scenarios/{case['scenario']}{end}.yaml") for end in ("", ".fleet")]
    for was, now in case.get("or", {}).items():
        texts = [text.replace(was, now) for text in texts]
    trace = read_trace(driven(texts[0], texts[1], tuple(case.get("goals", ()))))
    lines = lines_of(Path(trace.source))
    assert lines[-1]["outcome"] == case.get("outcome", "completed")
    assert check_trace(trace).findings == ()
    assert not {line["type"] for line in lines} & {*case.get("no", ())}
    steps = [line for line in lines if line["type"] == "arrive" and line["result"] != "arrived"]
    assert sorted({(s["at"], s["result"]) for s in steps}) == [*map(tuple, case.get("ends", ()))]
    actions = actions_of(trace)[0]
    acts = sorted([robot, one.action, one.obstacle] for one in actions for robot in one.robots)
    times = {one.command for one in actions}
    assert acts == case.get("acts", []) and len(times) <= case.get("times", 1)
    held = {line.get("reason", "") for line in lines if line["type"] == "arrive"} - {""}
    assert all(case["held"] in reason for reason in held) if held else "held" not in case


def test_a_drive_of_the_simulation_does_not_depend_on_the_machine(tmp_path: Path) -> None:
    """Time stands still there while the mission thinks, however long that takes."""
    texts = [beside(__file__, f"scenarios/blocked{end}.yaml") for end in ("", ".fleet")]
    quick, words = driven(*texts), files(tmp_path, *texts)
    with subprocess.Popen([PROGRAM, *words]) as process:
        while process.poll() is None:
            if (tmp_path / "t.jsonl").exists():
                process.send_signal(signal.SIGSTOP)
                time.sleep(0.02)
                process.send_signal(signal.SIGCONT)
            time.sleep(0.02)
    own = {"seconds", "synthesis_seconds", "cached"}
    one, two = (
        [{k: v for k, v in line.items() if k not in own} for line in lines_of(at)]
        for at in (quick, tmp_path / "t.jsonl")
    )
    assert one == two

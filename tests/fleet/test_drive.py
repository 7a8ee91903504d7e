"""The case studies driven: by physics in this process, and by ROS 1 and ROS 2 between processes.

No scenario lists an obstacle: lidars and reports find them. Behind every transport is the physics
simulation, whose contacts are the judge.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import lab_at
from safenav.audit.check import check_trace
from safenav.fleet import ros1
from warm import safenav

ROOT = Path(__file__).parents[2]
TESTS = Path(__file__).parents[1]
SIDE = 2.0
FIRST, SECOND, THIRD = (f"case_study_{number}" for number in (1, 2, 3))
FLEET = """\
safenav-fleet: 1
transport: {transport}
network: {{domain: {domain}, master: "http://127.0.0.1:{port}"}}
simulation: {{pace: {pace}, obstacles: {obstacles}}}
defaults: {{report: obstacles, scan: {{obstacle: door}}, timeout: 6, speed: {speed}}}
robots:
  digit: {{act: {{push: push}}}}
  quad: {{act: {{sense: sense}}}}
"""
PACE = 50.0
NO_ROS1 = pytest.mark.skipif(
    not ros1.importable(), reason=f"rospy is missing: apt install {ros1.PACKAGES}"
)


class Lab:
    """A scenario without its obstacles, a fleet file that has them, and the processes of robots."""

    def __init__(self, case: str, transport: str, folder: Path, faults: dict[str, str]) -> None:
        text = (ROOT / "scenarios" / f"{case}.yaml").read_text()
        listed = re.search(r"obstacles:\n((?:  .*\n)+)", text)
        assert listed is not None
        obstacles = re.findall(r"^  - (.*)$", listed[1], re.MULTILINE)
        text = text.replace(listed[0], "").replace("map:\n", f"map:\n  resolution: {SIDE}\n")
        text = re.sub(r"^  (resolved|blocked|helpers):.*\n", "", text, flags=re.MULTILINE)
        self.scenario, self.fleet = folder / f"{case}.yaml", folder / "fleet.yaml"
        self.trace = folder / "trace.jsonl"
        self.scenario.write_text(text)
        self.port, self.domain = _free_port(), 20 + os.getpid() % 200
        fast = 1.0 if transport == "simulation" else PACE
        given = {
            "transport": transport,
            "domain": self.domain,
            "port": self.port,
            "pace": PACE,
            "obstacles": f"[{', '.join(obstacles)}]",
            "speed": 0.45 * fast,
        }
        self.fleet.write_text(FLEET.format(**given))
        self.processes: list[subprocess.Popen[str]] = []
        self.environment = {
            **os.environ,
            "PYTHONPATH": str(TESTS),
            "ROS_MASTER_URI": f"http://127.0.0.1:{self.port}",
            "ROS_IP": "127.0.0.1",
            "ROS_HOME": str(folder / "ros"),
            "SAFENAV_CACHE": str(folder / "cache"),
        }
        self.physics: Any = None
        if transport != "simulation":
            port = self.started("fleet/lab.py", self.scenario, self.fleet, PACE)
            self.physics = lab_at(int(port))
            if transport == "ros1":
                self.master()
            where = [port.strip()] if transport == "ros1" else [port.strip(), self.domain]
            for name in ("quad", "digit"):
                robot = f"{name}+{faults[name]}" if name in faults else name
                self.started(f"fleet/{transport}_robots.py", *where, robot)

    def started(self, program: str, *arguments: object) -> str:
        """Start a program of the tests; the first line that it prints."""
        process = subprocess.Popen(
            [sys.executable, str(TESTS / program), *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self.environment,
        )
        self.processes.append(process)
        assert process.stdout is not None
        said = process.stdout.readline()
        assert said, f"{program} did not start"
        return said

    def master(self) -> None:
        """A real ROS master."""
        run = f"import sys; sys.path.append({ros1.DEBIAN!r}); import rosmaster; "
        run += f"rosmaster.rosmaster_main(['rosmaster', '--core', '-p', '{self.port}'])"
        self.processes.append(
            subprocess.Popen(
                [sys.executable, "-c", run],
                env=self.environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                text=True,
            )
        )
        _wait_for(self.port)

    def drive(self, *options: str, seconds: float = 150.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            self.command(*options),
            capture_output=True,
            text=True,
            env=self.environment,
            timeout=seconds,
            check=False,
        )

    def command(self, *options: str) -> list[str]:
        words = ["drive", self.scenario, "--fleet", self.fleet, "--trace", self.trace, *options]
        return [str(Path(sys.executable).with_name("safenav")), *map(str, words)]

    def close(self) -> None:
        for process in reversed(self.processes):
            with contextlib.suppress(OSError):
                assert process.stdin is not None
                process.stdin.close()
                if process.stdout is not None:
                    process.stdout.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(2.0)
            process.kill()
            process.wait()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _wait_for(port: int) -> None:
    for _ in range(100):
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        time.sleep(0.1)
    raise AssertionError("no ROS master")


@pytest.fixture
def lab(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Lab]:
    made = Lab(*request.param[:2], tmp_path, request.param[2] if len(request.param) > 2 else {})
    yield made
    made.close()


def labs(*cases: tuple[Any, ...]) -> list[Any]:
    """Labs by case study, transport and faults; those of ROS 1 are skipped where it is missing."""
    marks = {"ros1": [NO_ROS1]}
    return [
        pytest.param(case, marks=marks.get(case[1], []), id=f"{case[1]}-{case[0]}")
        for case in cases
    ]


def lines_of(trace: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in trace.read_text().splitlines()]


DRIVEN = labs(
    (THIRD, "simulation"),
    (FIRST, "ros1", {"digit": "abort", "quad": "abort"}),
    (SECOND, "ros1"),
    (THIRD, "ros1"),
    (FIRST, "ros2", {"digit": "abort+late", "quad": "doubled"}),
    (SECOND, "ros2"),
    (THIRD, "ros2"),
)


@pytest.mark.slow
@pytest.mark.parametrize("lab", DRIVEN, indirect=True)
def test_a_case_study_is_driven_without_a_listed_obstacle(lab: Lab) -> None:
    """Goals that are aborted, replies that are late or come twice do no harm."""
    done = lab.drive()
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    lines = lines_of(lab.trace)
    assert lines[-1]["outcome"] == "completed"
    hidden = set(re.findall(r"type: (\w+), region: (\d+)", lab.fleet.read_text()))
    found = [line["obstacle"] for line in lines if line["type"] == "discovered"]
    assert {(o["type"], str(o["region"])) for o in found} == hidden
    assert check_trace(lab.trace).findings == ()
    if lab.physics is not None:
        log = lab.physics.log()
        assert set(log["contacts"]) <= {"digit door@47"} and log["closed"] == []
        assert log["moving"] == []


def under_way(lab: Lab, departs: int) -> subprocess.Popen[str]:
    """A drive that has sent its robots so many times."""
    process = subprocess.Popen(
        lab.command(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=lab.environment,
    )
    for _ in range(600):
        if lab.trace.exists() and lab.trace.read_text().count('"depart"') >= departs:
            return process
        time.sleep(0.05)
    process.kill()
    raise AssertionError("the robots do not move")


@pytest.mark.parametrize("lab", labs((FIRST, "ros1")), indirect=True)
def test_a_robot_whose_programs_die_is_lost_and_the_run_says_so(lab: Lab) -> None:
    process = under_way(lab, 8)
    lab.processes[-1].kill()  # digit's
    told = process.communicate(timeout=120)[0]
    lines = lines_of(lab.trace)
    assert process.returncode == 1, told
    assert lines[-1]["outcome"] == "operator_needed"
    ended = [line for line in lines if line["type"] == "arrive" and line["robot"] == "digit"]
    assert ended[-1]["result"] == "lost"
    assert "digit" in lines[-1]["explanation"]
    assert check_trace(lab.trace).findings == ()


@pytest.mark.parametrize("lab", labs((FIRST, "ros2")), indirect=True)
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=str)
def test_no_robot_goes_on_beyond_its_goal_when_safenav_ends(
    lab: Lab, number: signal.Signals
) -> None:
    process = under_way(lab, 6)
    process.send_signal(number)
    process.communicate(timeout=30)
    assert process.returncode == (-signal.SIGKILL if number is signal.SIGKILL else 130)
    allowed = {}
    for line in lines_of(lab.trace)[1:]:
        if line["type"] == "depart":
            allowed[line["robot"]] = {line["from"], line["to"]}
    time.sleep(1.0)  # up to fifty seconds of the physics
    log = lab.physics.log()
    assert log["moving"] == []
    assert all(log["regions"][name] in regions for name, regions in allowed.items())
    if number is not signal.SIGKILL:
        assert lines_of(lab.trace)[-1]["outcome"] == "interrupted"


def test_a_rehearsal_is_the_run_in_time(tmp_path: Path) -> None:
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("safenav-fleet: 1\ntransport: ros2\n")
    for name in (THIRD, "team_of_six"):
        scenario = ROOT / "scenarios" / f"{name}.yaml"
        one, two = tmp_path / "run.jsonl", tmp_path / "rehearsal.jsonl"
        options = ("--fleet", fleet, "--rehearse", "--trace", two)
        assert safenav("run", scenario, "--clock", "live", "--trace", one).returncode == 0
        assert safenav("drive", scenario, *options).returncode == 0
        kept = [
            [{k: v for k, v in line.items() if k not in TIMES} for line in lines_of(path)]
            for path in (one, two)
        ]
        assert kept[0] == kept[1]


TIMES = {"seconds", "synthesis_seconds", "cached", "verified"}


def test_what_cannot_be_driven_is_said_before_anything_moves(tmp_path: Path) -> None:
    case = ROOT / "scenarios" / "case_study_1.yaml"
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text("safenav-fleet: 1\ntransport: simulation\n")
    done = safenav("drive", case, "--fleet", fleet)
    assert done.returncode == 2 and "add 'resolution: 1.0'" in done.stderr
    metres = tmp_path / "metres.yaml"
    metres.write_text(case.read_text().replace("map:\n", "map:\n  resolution: 2.0\n"))
    fleet.write_text("safenav-fleet: 1\ntransport: ros2\nnetwork: {domain: 231}\n")
    done = safenav("drive", metres, "--fleet", fleet, "--patience", "0.2")
    assert done.returncode == 2
    assert "no answer in 0.2 s from /quad/odom, /digit/odom" in done.stderr

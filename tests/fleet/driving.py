"""Drives of scenarios whose obstacles no file lists, with the processes of their robots."""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from children import ran

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import lab_at
from once import beside

ROOT = Path(__file__).parents[2]
TESTS = Path(__file__).parents[1]
SIDE = 2.0
FIRST, SECOND, THIRD = (f"case_study_{number}" for number in (1, 2, 3))
FLEET = """\
safenav-fleet: 1
transport: {transport}
network: {{domain: {domain}}}
simulation: {{pace: {pace}, obstacles: {obstacles}}}
defaults: {{report: obstacles, scan: {{obstacle: door}}, timeout: 6, speed: {speed}}}
robots:
  digit: {{act: {{push: push}}}}
  quad: {{act: {{sense: sense}}}}
"""
PACE = {"simulation": 1000.0, "ros2": 50.0}
"""Times that simulated time goes faster: in one process as fast as it can."""
ALARMED = "alarmed"
HALL = beside(__file__, "scenarios/alarmed.yaml")


class Lab:
    """A scenario without its obstacles, a fleet file that has them, and the processes of robots."""

    def __init__(self, case: str, transport: str, folder: Path, faults: dict[str, str]) -> None:
        text = HALL if case == ALARMED else (ROOT / "scenarios" / f"{case}.yaml").read_text()
        obstacles: list[str] = []
        if listed := re.search(r"obstacles:\n((?:  .*\n)+)", text):
            obstacles = re.findall(r"^  - (.*)$", listed[1], re.MULTILINE)
            text = text.replace(listed[0], "")
        text = text.replace("map:\n", f"map:\n  resolution: {SIDE}\n")
        text = re.sub(r"^  (resolved|blocked|helpers):.*\n", "", text, flags=re.MULTILINE)
        text = text.replace("until: {rounds: 2}", "until: {rounds: 1}")
        self.scenario, self.fleet = folder / f"{case}.yaml", folder / "fleet.yaml"
        self.trace, self.motion = folder / "trace.jsonl", folder / "motion.jsonl"
        self.scenario.write_text(text)
        self.transport = transport
        self.domain = 20 + os.getpid() % 200
        pace = PACE[transport]
        fast = 1.0 if transport == "simulation" else pace
        given = {
            "transport": transport,
            "domain": self.domain,
            "pace": pace,
            "obstacles": f"[{', '.join(obstacles)}]",
            "speed": 0.45 * fast,
        }
        follow = "follow: {}, " if transport == "simulation" else ""
        inputs = "inputs: {alarm: /building/alarm}\n" if case == ALARMED else ""
        defaults = "defaults: {" + follow
        fleet = FLEET.format(**given).replace("defaults: {", defaults)
        for name, own in faults.items():
            if "tf" in own:
                fleet = fleet.replace(f"{name}: {{", f"{name}: {{tf: {{frame: {name}/base}}, ")
        self.fleet.write_text(inputs + fleet)
        self.processes: list[subprocess.Popen[str]] = []
        self.environment = {
            **os.environ,
            "PYTHONPATH": str(TESTS),
            "SAFENAV_CACHE": str(folder / "cache"),
        }
        self.physics: Any = None
        if transport != "simulation":
            self.start("fleet/lab.py", self.scenario, self.fleet, pace)
            for name in ("quad", "digit"):
                robot = f"{name}+{faults[name]}" if name in faults else name
                self.start("fleet/ros2_robots.py", self.domain, robot)
            self.physics = lab_at(int(port := self.says(0)))
            for robots in self.processes[1:]:
                assert robots.stdin is not None
                robots.stdin.write(f"{port}\n")
                robots.stdin.flush()
            assert [self.says(number) for number in (1, 2)] == ["ready", "ready"]

    def start(self, program: str, *arguments: object) -> None:
        """Start a program of the tests, while others start as well."""
        process = subprocess.Popen(
            [sys.executable, str(TESTS / program), *map(str, arguments)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=self.environment,
        )
        self.processes.append(process)

    def says(self, number: int) -> str:
        """Return the next line that a process prints."""
        process = self.processes[number]
        assert process.stdout is not None
        said = process.stdout.readline()
        assert said, f"{process.args!r} did not start"
        return said.strip()

    def drive(self, *options: str, seconds: float = 600.0) -> subprocess.CompletedProcess[str]:
        return ran(self.command(*options), env=self.environment, timeout=seconds)

    def command(self, *options: str) -> list[str]:
        words = ["drive", self.scenario, "--fleet", self.fleet, "--trace", self.trace]
        words += ["--motion", self.motion, "--patience", "300", *options]
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

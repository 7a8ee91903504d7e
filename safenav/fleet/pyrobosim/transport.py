"""Robots in pyrobosim: a world file of its own format, whose closed hallways are obstacles.

The simulator runs in a child process (``safenav.fleet.pyrobosim.host``) that ends with this one: in
this process its threads would not end, and its log would clutter the terminal.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from math import inf
from threading import Lock, Thread
from typing import Any

from safenav.errors import UsageError
from safenav.extras import missing
from safenav.fleet import transport
from safenav.fleet.place import Places
from safenav.fleet.stations import PyrobosimUse, Station
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region

GOALS_ONLY = "robot '{}': pyrobosim's robots find their own way to goals\n    leave out 'follow'"

OPENING = "open"
"""The action of pyrobosim that opens hallways."""
ENDING = 5.0
"""Seconds after which a child process that does not end is killed."""


class PyrobosimTransport:
    """A pyrobosim world in a process of its own."""

    def __init__(self, places: Places, stations: Mapping[str, Station], use: PyrobosimUse) -> None:
        if find_spec("pyrobosim") is None:
            raise missing("transport pyrobosim", "pyrobosim", "pyrobosim")
        for name, station in stations.items():
            if station.follow is not None:
                raise UsageError(GOALS_ONLY.format(name))
            for service in set(station.act.values()) - {OPENING}:
                problem = f"'act' of robot '{name}': pyrobosim has no action '{service}'"
                raise UsageError(f"{problem}\n    the action that opens a hallway is '{OPENING}'")
        self._places = places
        self._stations = stations
        self._use = use
        self._child: subprocess.Popen[str] | None = None
        self._log = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115
        self._writing = Lock()
        self._post: Callable[[transport.Message], None] = transport.ignore
        self._halls: dict[Region, str] = {}
        self._at: dict[str, Region | None] = {}

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self._post = post
        words = ["-m", "safenav.fleet.pyrobosim.host", self._use.world, self._use.pace]
        self._child = subprocess.Popen(
            [sys.executable, *map(str, words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            start_new_session=True,  # Ctrl-C reaches only safenav, which ends the child
        )
        assert self._child.stdout is not None
        first = self._child.stdout.readline()
        begun: dict[str, Any] = json.loads(first) if first else {"error": self._last_words()}
        if "error" in begun:
            raise UsageError(f"{self._use.world}: pyrobosim cannot load it: {begun['error']}")
        self._check(begun["ready"], begun["hallways"])
        sensors = {n: s.scan.topic for n, s in self._stations.items() if s.scan is not None}
        self._order(do="start", sensors=sensors, closing=dict(self._use.closing))
        Thread(target=self._listen, daemon=True).start()

    def _check(self, robots: list[str], hallways: Mapping[str, tuple[float, float]]) -> None:
        """Compare a world with the fleet file. Raises UsageError."""
        for needed, there, what in (
            (self._stations, robots, "robot"),
            (self._use.closing, hallways, "hallway"),
        ):
            for name in needed:
                if name not in there:
                    known = ", ".join(sorted(there)) or "none"
                    problem = f"{self._use.world}: the world has no {what} '{name}'"
                    raise UsageError(f"{problem}\n    it has {known}")
        for name, (x, y) in hallways.items():
            region = self._places.region(x, y)
            if region is None or not self._places.world.is_free(region):
                where = f"the centre of hallway '{name}' ({x:.2f}, {y:.2f} m)"
                raise UsageError(f"{self._use.world}: {where} is in no free region of the scenario")
            self._halls[region] = name

    def missing(self) -> list[str]:
        return []

    def navigate(self, robot: str, goal: transport.GoalPoint) -> None:
        within = self._regions(robot, self._places.region(goal.x, goal.y))
        self._order(
            do="go",
            robot=robot,
            number=goal.number,
            x=goal.x,
            y=goal.y,
            yaw=goal.yaw,
            within=within,
        )

    def follow(self, robot: str, reference: transport.Setpoints) -> None:
        del reference
        raise UsageError(GOALS_ONLY.format(robot))

    def cancel(self, robot: str) -> None:
        self._order(do="stop", robot=robot)

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        del action  # the only one
        region = int(obstacle.rpartition("@")[2].partition("#")[0])
        hallway = self._halls.get(region)
        if hallway is None:
            self._post(
                transport.Performed(robot, number, ActResult.NOTHING, f"no hallway in {region}")
            )
            return
        within = self._regions(robot, region)
        self._order(do="open", robot=robot, number=number, hallway=hallway, within=within)

    def close(self) -> None:
        child, self._child, self._post = self._child, None, transport.ignore
        if child is None:
            return
        assert child.stdin is not None
        with contextlib.suppress(OSError):
            child.stdin.close()
        try:
            child.wait(ENDING)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()
        if child.stdout is not None:
            child.stdout.close()
        self._log.close()

    def _regions(self, robot: str, goal: Region | None) -> list[list[tuple[float, float]]]:
        """Return the corners of the regions to which a robot's path is restricted: its own and the
        goal's."""
        allowed = {region for region in (self._at.get(robot), goal) if region is not None}
        return [self._places.corners(region) for region in sorted(allowed)]

    def _order(self, **line: Any) -> None:
        child = self._child
        if child is None or child.stdin is None:
            return
        with (
            self._writing,
            contextlib.suppress(OSError),
        ):  # the child process has died, so odometry also ends
            child.stdin.write(json.dumps(line) + "\n")
            child.stdin.flush()

    def _listen(self) -> None:
        child = self._child
        if child is None or child.stdout is None:
            return
        with contextlib.suppress(ValueError):  # closed
            for text in child.stdout:
                for message in self._messages(json.loads(text)):
                    self._post(message)

    def _messages(self, line: dict[str, Any]) -> list[transport.Message]:
        if "at" in line:
            name = line["at"]
            self._at[name] = self._places.region(line["x"], line["y"])
            return [transport.Located(name, line["t"], line["x"], line["y"], line["yaw"])]
        if "scan" in line:
            ranges = [inf if metres is None else metres for metres in line["ranges"]]
            return [transport.Scanned(line["scan"], line["t"], 0.0, line["step"], ranges)]
        if "closed" in line:
            return list(self._reported(line["by"], set(line["closed"])))
        if "end" in line:
            end = transport.GoalEnd(line["result"])
            return [transport.GoalEnded(line["end"], line["number"], end, line["reason"])]
        result = ActResult(line["result"])
        return [transport.Performed(line["acted"], line["number"], result, line["reason"])]

    def _reported(self, robot: str, closed: set[str]) -> list[transport.Reported]:
        """Return reports on the hallways adjacent to a robot, as far as it knows them."""
        here, station = self._at.get(robot), self._stations.get(robot)
        if here is None or station is None or station.report is None:
            return []
        beside = [r for r in self._places.world.neighbours(here) if r in self._halls]
        return [
            transport.Reported(
                robot, f"{'' if self._halls[r] in closed else '-'}{self._use.hallway}@{r}"
            )
            for r in beside
        ]

    def _last_words(self) -> str:
        """Return the last line that the child process wrote."""
        self._log.seek(0)
        return next((line for line in reversed(self._log.read().splitlines()) if line.strip()), "")

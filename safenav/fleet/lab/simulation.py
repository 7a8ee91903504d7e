"""Robots of a physics simulation in this process in place of real ones."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import tau

from safenav.errors import needing
from safenav.fleet import transport
from safenav.fleet.file import FleetFile
from safenav.fleet.goals import frame_of
from safenav.fleet.transport import Places
from safenav.runtime.run.checkpoint import Resumption
from safenav.scenario.model import Obstacle, Scenario, name_parts
from safenav.world.map import Region

RATE = 50.0
"""Odometry messages per second of simulated time."""
LOOKS = 5
"""Odometry messages per scan and per report of a robot at rest."""


class SimulationTransport:
    """A fleet in MuJoCo. Only ``step`` advances time, at most ``pace`` times as fast as real time,
    but not while the run computes, so a drive is independent of the machine's speed. ``begun``: the
    run that the drive continues."""

    def __init__(
        self, scenario: Scenario, fleet: FleetFile, begun: Resumption | None = None
    ) -> None:
        with needing("transport simulation", "simulation"):
            from safenav.fleet.lab.physics import Physics
        places = Places(scenario.map, frame_of(scenario))
        left = [o for o in fleet.obstacles if begun is None or not begun.resolved(o)]
        self.physics = Physics(scenario, places, left, begun)
        self.navigate, self.follow = self.physics.navigate, self.physics.follow
        self.cancel = self.physics.cancel
        self._stations, self._types = fleet.stations, scenario.catalogue.obstacles
        self._pace = fleet.pace
        self._beside: dict[str, dict[Region, str | None]] = {}
        self._post: Callable[[transport.Message], None] = print  # until ``open``
        self._due, self._steps = 0.0, 0

    def open(self, post: Callable[[transport.Message], None]) -> None:
        self._post = post

    def now(self) -> float:
        return self.physics.now

    def missing(self) -> list[str]:
        return []

    def perform(self, robot: str, action: str, obstacle: str, number: int) -> None:
        kind, region, which = name_parts(obstacle)
        self.physics.bring(Obstacle(self._types[kind], int(region), number=which))
        # A service may perform several actions.
        actions = [name for name, one in self._stations[robot].act.items() if one == action]
        due = self.physics.due(obstacle)
        self.physics.perform(robot, due if due in actions else actions[0], number)

    def close(self) -> None:
        """Stop all robots: ``step`` no longer advances the simulation."""

    def step(self) -> None:
        """Advance to the time of the next odometry, and post the robots' messages."""
        ahead = self._due - time.monotonic()
        if ahead > 0:  # a sleep of zero seconds may yield the processor for milliseconds
            time.sleep(ahead)
        self._due = time.monotonic() + 1.0 / (RATE * self._pace)
        self.physics.step(1.0 / RATE)
        self._steps += 1
        for name in self._stations:
            self._tell(name, looks=self._steps % LOOKS == 0)

    def _tell(self, name: str, *, looks: bool) -> None:
        located, ended = self.physics.told(name)
        self._post(located)
        if any(isinstance(each, transport.GoalEnded) for each in ended):
            self._report(name)  # with a scan at the robot's destination
        for each in ended:
            self._post(each)
        if not looks or self.physics.moves(name):
            return
        self._report(name)
        if self._stations[name].scan is not None:
            stamp, ranges = self.physics.scan(name)
            self._post(transport.Scanned(name, stamp, 0.0, tau / len(ranges), ranges))

    def _report(self, name: str) -> None:
        """Report obstacles beside a robot; without a lidar, also those that have disappeared."""
        station = self._stations[name]
        sees = station.report is not None and station.scan is None
        found, before = self.physics.noticed(name, bodies=sees), self._beside.get(name, {})
        self._beside[name] = found
        for region, each in found.items():
            if each is not None:
                self._post(transport.Reported(name, each))
            elif sees and (gone := before.get(region)) is not None:
                self._post(transport.Reported(name, f"-{gone}"))

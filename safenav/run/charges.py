"""The charge of each robot with a battery, derived from the lines of a run (docs/batteries.md).

In lockstep each tick without a step consumes ``stay`` or restores ``charge``; in a live run, each
second without one does. A step consumes ``move`` when it ends, whatever its duration, so that the
charge that a robot needs does not depend on durations.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from safenav.trace.setting import BatteryHeader
from safenav.world.map import Region

SHARPNESS = 6
"""Decimals of a charge in a live run."""


class Charges:
    """Charges and regions of robots with a battery. ``since`` (live): the time in seconds since
    when each robot has been standing; ``charge`` applies to that time."""

    def __init__(
        self,
        batteries: Mapping[str, BatteryHeader],
        starts: Mapping[str, Region],
        chargers: Collection[Region],
        *,
        live: bool,
    ) -> None:
        self.batteries, self._chargers = batteries, chargers
        self._charge: dict[str, float] = {name: each.start for name, each in batteries.items()}
        self._region = {name: starts[name] for name in batteries}
        self._since = dict.fromkeys(batteries if live else (), 0.0)

    def percent(self, robot: str, now: float) -> int:
        """Return the charge of a robot at a time, in percent of its capacity."""
        return round(100 * self._at(robot, now) / self.batteries[robot].capacity)

    def lowest(self, region: Region, now: float) -> str | None:
        """Return the robot in a region with the least charge; None if there is none."""
        here = [name for name, place in self._region.items() if place == region]
        return min(here, key=lambda name: self._at(name, now), default=None)

    def stayed(self, robot: str) -> None:
        """Count a tick in which a robot has not moved."""
        if robot in self.batteries:
            self._charge[robot] = self._after(robot, 1)

    def left(self, robot: str, now: float) -> None:
        """A robot with a clock begins a step."""
        if robot in self._since:
            self._charge[robot] = self._at(robot, now)
            del self._since[robot]

    def came(self, robot: str, region: Region, now: float | None = None) -> None:
        """A robot ends a step; ``now``: at this time of the run's clock."""
        if robot in self.batteries:
            charge = round(self._charge[robot] - self.batteries[robot].move, SHARPNESS)
            self._charge[robot], self._region[robot] = max(0, charge), region
            if now is not None:
                self._since[robot] = now

    def placed(self, robot: str, region: Region, now: float) -> None:
        """A standing robot was put into a region by an operator."""
        if robot in self._since:
            self._charge[robot], self._since[robot] = self._at(robot, now), now
            self._region[robot] = region

    def replaced(self, robot: str, now: float) -> None:
        """A robot has a full battery."""
        self._charge[robot] = self.batteries[robot].capacity
        if robot in self._since:
            self._since[robot] = now

    def _at(self, robot: str, now: float) -> float:
        if robot not in self._since:
            return self._charge[robot]
        return self._after(robot, now - self._since[robot])

    def _after(self, robot: str, time: float) -> float:
        battery = self.batteries[robot]
        rate = battery.charge if self._region[robot] in self._chargers else -battery.stay
        charge = self._charge[robot] + rate * time
        return round(min(battery.capacity, max(0, charge)), SHARPNESS)

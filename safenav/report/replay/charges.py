"""The charge of each robot with a battery, derived from the records of a run (docs/batteries.md).

In lockstep each tick without a step consumes ``stay`` or restores ``charge``; in a live run, each
second without one does. A step consumes ``move`` when it ends, whatever its duration, so that the
charge that a robot needs does not depend on durations.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from safenav.scenario.model import Battery, name_parts
from safenav.trace import records, setting
from safenav.trace.vocabulary import ChangeCause
from safenav.world.map import Region

SHARPNESS = 6
"""Decimals of a charge in a live run."""


class Charges:
    """Charges updated by the records of a run. ``since`` (live): the time in seconds since when
    each robot has been standing; ``charge`` applies to that time."""

    def __init__(
        self,
        batteries: Mapping[str, Battery | setting.BatteryHeader],
        starts: Mapping[str, Region],
        chargers: Collection[Region],
        *,
        live: bool,
    ) -> None:
        self.batteries, self.chargers = batteries, chargers
        self.charge: dict[str, float] = {name: each.start for name, each in batteries.items()}
        self.region = {name: starts[name] for name in batteries}
        self.since = dict.fromkeys(batteries if live else (), 0.0)

    def take(self, record: records.Record) -> None:
        """Update the charges by a record."""
        match record:
            case records.Move() if record.robot in self.charge and record.to != record.from_:
                self._stepped(record.robot, record.to)
            case records.Move() if record.robot in self.charge and record.toward is None:
                self.charge[record.robot] = self._after(record.robot, 1)
            case records.Depart() if record.robot in self.since:
                self.charge[record.robot] = self.at(record.robot, record.t or 0.0)
                del self.since[record.robot]
            case records.Arrive() if record.robot in self.charge:
                self._stepped(record.robot, record.at)
                self.since[record.robot] = record.t or 0.0
            case records.Operator() if record.robot in self.since and record.region is not None:
                assert record.robot is not None  # a robot lost in transit is in no region
                charge = self.at(record.robot, record.t or 0.0)
                self.stands(record.robot, record.region, record.t or 0.0, charge)
            case _:
                pass

    def stands(self, robot: str, region: Region, now: float, charge: float | None = None) -> None:
        """Record that a robot stands in a region with some charge, by default a full battery."""
        self.charge[robot] = self.batteries[robot].capacity if charge is None else charge
        self.region[robot] = region
        if robot in self.since:
            self.since[robot] = now

    def at(self, robot: str, now: float) -> float:
        """Return the charge of a robot at a time."""
        if robot not in self.since:
            return self.charge[robot]
        return self._after(robot, now - self.since[robot])

    def rate(self, robot: str) -> float:
        """Return the change of charge of a standing robot per tick or second."""
        battery, charges = self.batteries[robot], self.region[robot] in self.chargers
        return battery.charge if charges else -battery.stay

    def _after(self, robot: str, time: float) -> float:
        charge = self.charge[robot] + self.rate(robot) * time
        return round(min(self.batteries[robot].capacity, max(0, charge)), SHARPNESS)

    def _stepped(self, robot: str, region: Region) -> None:
        charge = round(self.charge[robot] - self.batteries[robot].move, SHARPNESS)
        self.charge[robot], self.region[robot] = max(0, charge), region


class TracedCharges(Charges):
    """The charges at the end of a trace, computed from its lines alone. ``flat``: the robot with an
    empty battery that each obstacle represents, until the battery is replaced."""

    def __init__(self, header: records.Header) -> None:
        robots = header.scenario.robots
        batteries = {name: each.battery for name, each in robots.items() if each.battery}
        starts = {name: each.start for name, each in robots.items()}
        chargers = header.scenario.chargers or ()
        super().__init__(batteries, starts, chargers, live=header.clock is not None)
        self._time = 0.0
        self.flat: dict[str, str] = {}

    def take(self, record: records.Record) -> None:
        self._time = record.t if record.t is not None else record.tick
        super().take(record)
        if isinstance(record, records.Appeared) and record.cause is ChangeCause.BATTERY:
            _, region, _ = name_parts(record.obstacle)
            here = [name for name in self.charge if str(self.region[name]) == region]
            if here:
                self.flat[record.obstacle] = min(here, key=lambda name: self.at(name, self._time))
        elif isinstance(record, records.Resolved) and record.obstacle in self.flat:
            robot = self.flat.pop(record.obstacle)
            self.stands(robot, self.region[robot], self._time)

    def now(self, robot: str) -> int | None:
        """Return the charge of a robot at the last line in whole units; None without a battery."""
        return int(self.at(robot, self._time)) if robot in self.charge else None

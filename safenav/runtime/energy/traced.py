"""The charge of each robot at the end of a trace, from its lines alone (docs/batteries.md)."""

from __future__ import annotations

from safenav.scenario.model import name_parts
from safenav.trace import records
from safenav.trace.vocabulary import ChangeCause
from safenav.world.map import Region


class TracedCharges:
    """Charges that follow the lines of a trace. ``flat``: obstacle -> the robot whose battery was
    empty when it appeared, until that is replaced."""

    def __init__(self, header: records.Header) -> None:
        robots = header.scenario.robots
        self._chargers = frozenset(header.scenario.chargers or ())
        self._batteries = {name: r.battery for name, r in robots.items() if r.battery is not None}
        self._charge: dict[str, float] = {n: b.start for n, b in self._batteries.items()}
        self._region: dict[str, Region] = {name: robots[name].start for name in self._batteries}
        # live: since when the charge of a robot without a step is the one above
        self._since = dict.fromkeys(self._batteries if header.clock is not None else (), 0.0)
        self._time = 0.0
        self.flat: dict[str, str] = {}

    def take(self, record: records.Record) -> None:
        """Follow a line."""
        self._time = record.t if record.t is not None else record.tick
        match record:
            case records.Move() if record.robot in self._charge:
                if record.to != record.from_:
                    self._use(record.robot, self._batteries[record.robot].move)
                    self._region[record.robot] = record.to
                elif record.toward is None:
                    self._stand(record.robot, 1)
            case records.Depart() if record.robot in self._charge:
                self._wait(record.robot)
                self._since.pop(record.robot, None)
            case records.Arrive() if record.robot in self._charge:
                self._use(record.robot, self._batteries[record.robot].move)
                self._region[record.robot] = record.at
                self._since[record.robot] = self._time
            case records.Appeared() if record.cause is ChangeCause.BATTERY:
                _, region, _ = name_parts(record.obstacle)
                here = [name for name in self._charge if str(self._region[name]) == region]
                for name in here:
                    self._wait(name)
                if here:
                    self.flat[record.obstacle] = min(here, key=self._charge.__getitem__)
            case records.Resolved() if record.obstacle in self.flat:
                robot = self.flat.pop(record.obstacle)
                self._wait(robot)
                self._charge[robot] = self._batteries[robot].capacity
            case records.Operator() if record.robot in self._charge and record.region is not None:
                self._wait(record.robot)
                self._region[record.robot] = record.region
            case _:
                pass

    def now(self, robot: str) -> int | None:
        """The charge of a robot at the last line, whole units; None without a battery."""
        if robot not in self._charge:
            return None
        self._wait(robot)
        return int(self._charge[robot])

    def _use(self, robot: str, charge: float) -> None:
        self._charge[robot] = max(0, self._charge[robot] - charge)

    def _stand(self, robot: str, time: float) -> None:
        battery = self._batteries[robot]
        if self._region[robot] in self._chargers:
            charge = self._charge[robot] + battery.charge * time
            self._charge[robot] = min(battery.capacity, charge)
        else:
            self._use(robot, battery.stay * time)

    def _wait(self, robot: str) -> None:
        """Live: bring the charge of a robot that stands to the time of the last line."""
        if robot in self._since:
            self._stand(robot, self._time - self._since[robot])
            self._since[robot] = self._time

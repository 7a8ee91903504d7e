"""The charge of robots over a run, from the lines of its trace (docs/batteries.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from safenav.trace import records, setting
from safenav.world.map import Region


class ChargeLevels:
    """Charges in the making: ``percent`` of each robot with a battery, as [from tick, level]."""

    def __init__(self, header: setting.ScenarioHeader) -> None:
        self._header = header
        self._batteries = {n: r.battery for n, r in header.robots.items() if r.battery}
        self._charge: dict[str, float] = {}
        self.percent: dict[str, list[tuple[int, int]]] = {name: [] for name in self._batteries}
        for name, battery in self._batteries.items():
            self._set(name, 0, float(battery.start))

    def moved(self, line: records.Move) -> None:
        """A tick in lockstep: a step, or a stay at a charger or elsewhere."""
        if battery := self._batteries.get(line.robot):
            charge = self._charge[line.robot]
            if line.to != line.from_:
                charge -= battery.move
            elif line.toward is None:
                charge += self._rate(battery, line.to)
            self._set(line.robot, line.tick, charge)

    def passed(self, seconds: float, tick: int, standing: Callable[[str], Region | None]) -> None:
        """Time of a live run up to the instant ``tick``. ``standing``: the region of a robot that
        is not on its way."""
        for name, battery in self._batteries.items():
            if (region := standing(name)) is not None:
                self._set(name, tick, self._charge[name] + self._rate(battery, region) * seconds)

    def arrived(self, robot: str, tick: int) -> None:
        """A step ends in a live run."""
        if battery := self._batteries.get(robot):
            self._set(robot, tick, self._charge[robot] - battery.move)

    def filled(self, tick: int, kind: str, region: Region, at: Mapping[str, Region]) -> None:
        """An obstacle is resolved; that of a robot without charge gives it a full battery.
        ``at``: where the robots are."""
        if kind == self._header.flat:
            for name, battery in self._batteries.items():
                if at[name] == region and self._charge[name] < battery.move:
                    self._set(name, tick, battery.capacity)

    def _rate(self, battery: setting.BatteryHeader, region: Region) -> int:
        """Charge for a tick or second of standing in a region."""
        return battery.charge if region in (self._header.chargers or ()) else -battery.stay

    def _set(self, robot: str, tick: int, charge: float) -> None:
        capacity = self._batteries[robot].capacity
        self._charge[robot] = max(0.0, min(float(capacity), charge))
        level, told = round(100 * self._charge[robot] / capacity), self.percent[robot]
        if not told or told[-1][1] != level:
            told.append((tick, level))

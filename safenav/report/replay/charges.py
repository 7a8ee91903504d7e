"""The charge of robots over a run, from the lines of its trace (docs/batteries.md)."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from msgspec import Struct

from safenav.trace import records, setting
from safenav.world.map import Region


class ChargeLevels(Struct):
    """Charges in the making: ``percent`` of each robot with a battery, as [from tick, level]."""

    header: setting.ScenarioHeader
    charge: dict[str, float]
    percent: dict[str, list[tuple[int, int]]]

    @classmethod
    def begin(cls, header: setting.ScenarioHeader) -> ChargeLevels:
        charge = {n: float(r.battery.start) for n, r in header.robots.items() if r.battery}
        levels = cls(header, charge, {name: [] for name in charge})
        for name in charge:
            levels._set(name, 0, charge[name])
        return levels

    def moved(self, line: records.Move) -> None:
        """A tick in lockstep: a step, or a stay at a charger or elsewhere."""
        battery = self._battery(line.robot)
        if battery is None:
            return
        charge = self.charge[line.robot]
        if line.to != line.from_:
            charge -= battery.move
        elif line.toward is None:
            charge += battery.charge if self._at_charger(line.to) else -battery.stay
        self._set(line.robot, line.tick, charge)

    def passed(self, seconds: float, tick: int, standing: Callable[[str], Region | None]) -> None:
        """Time of a live run up to the instant ``tick``. ``standing``: the region of a robot that
        is not on its way."""
        for name in self.charge:
            battery, region = self._battery(name), standing(name)
            if battery is not None and region is not None:
                rate = battery.charge if self._at_charger(region) else -battery.stay
                self._set(name, tick, self.charge[name] + rate * seconds)

    def arrived(self, robot: str, tick: int) -> None:
        """A step ends in a live run."""
        battery = self._battery(robot)
        if battery is not None:
            self._set(robot, tick, self.charge[robot] - battery.move)

    def filled(self, tick: int, kind: str, region: Region, at: Mapping[str, Region]) -> None:
        """An obstacle is resolved; that of a robot without charge gives it a full battery.
        ``at``: where the robots are."""
        if kind != self.header.flat:
            return
        for name, charge in self.charge.items():
            battery = self._battery(name)
            if battery is not None and at[name] == region and charge < battery.move:
                self._set(name, tick, battery.capacity)

    def _battery(self, robot: str) -> setting.BatteryHeader | None:
        known = self.header.robots.get(robot)
        return None if known is None else known.battery

    def _at_charger(self, region: Region) -> bool:
        return region in (self.header.chargers or ())

    def _set(self, robot: str, tick: int, charge: float) -> None:
        battery = self._battery(robot)
        assert battery is not None
        self.charge[robot] = max(0.0, min(float(battery.capacity), charge))
        level, told = round(100 * self.charge[robot] / battery.capacity), self.percent[robot]
        if not told or told[-1][1] != level:
            told.append((tick, level))

"""Live simulations whose steps take other times than the motion of their robots."""

from collections.abc import Mapping, Sequence
from random import Random

from safenav import LiveSimulation, Obstacle, Region, Scenario


class Uneven(LiveSimulation):
    """``speeds``: factors of the robots' speeds; a share ``delayed`` of the steps, drawn from
    ``seed`` (default: the scenario's), takes ``factor`` times as long."""

    def __init__(
        self,
        scenario: Scenario,
        speeds: Mapping[str, float] | None = None,
        delayed: float = 0.0,
        factor: float = 5.0,
        seed: int | None = None,
    ) -> None:
        super().__init__(scenario)
        self.speeds, self._delayed, self._factor = speeds or {}, delayed, factor
        seed = scenario.seed if seed is None else seed
        self._draws = {r.name: Random(f"{seed}/{r.name}") for r in scenario.robots}

    def step_seconds(self, name: str, here: Region, there: Region) -> float:
        late = self._factor if self._draws[name].random() < self._delayed else 1.0
        took = self._paces[name].step(self._now, here, there, late)
        return took / self.speeds.get(name, 1.0)

    def action_seconds(self, obstacle: Obstacle, group: Sequence[str], now: float) -> float:
        slowest = min(self.speeds.get(name, 1.0) for name in group)
        return super().action_seconds(obstacle, group, now) / slowest

"""An operator who intervenes at random."""

from collections.abc import Mapping
from random import Random
from typing import Any

from safenav import Mission
from safenav.scenario.model import Scenario
from safenav.world.poses import Mobility


class Operator:
    """An operator who intervenes at random. ``attends``: whether the run waits for the operator."""

    def __init__(self, scenario: Scenario, data: Mapping[str, Any], seed: int) -> None:
        self.random = Random(f"operator of {seed}")
        self.data = data
        self.attends = self.random.random() < 0.6
        self.often = self.random.choice([0.02, 0.05, 0.15])
        self.left = self.random.randint(1, 6)
        self.free = [*scenario.map.free]
        types = (data.get("catalogue") or {}).get("obstacles") or {}
        self.orders = [name for name, it in types.items() if it.get("blocks") == []]

    def words(self, mission: Mission) -> list[str]:
        """Return the interventions before a pass."""
        waits = mission.waiting is not None
        if not (waits or (self.left and self.random.random() < self.often)):
            return []
        if waits and not self.left:
            return ["give_up"]
        self.left -= 1
        count = self.random.choice([1, 1, 2, 3])
        return [w for w in (self._word(mission) for _ in range(count)) if w is not None]

    def _word(self, mission: Mission) -> str | None:
        random, run = self.random, mission._run
        turning = {m.name: m.robot.model.mobility is Mobility.HEADING for m in run.team.members}
        robot = random.choice([*turning])
        pairs = zip(run.team.obstacles, run.state.obstacles, strict=True)
        met = [one.name for one, now in pairs if now.known]
        known = [name for name in met if not name.startswith("lost_")]
        there = [name for name in known if not name.startswith("p")]
        other = random.choice(self.free)
        match random.randrange(12):
            case 0 | 1 | 2 if known:
                return f"resolved {random.choice(known)}"
            case 3 if there:  # a carried load is never declared permanent
                return f"permanent {random.choice(there)}"
            case 4 | 5:
                heading = random.choice(["north", "east", "south", "west"])
                return f"put_back {robot} {other}" + (f" {heading}" if turning[robot] else "")
            case 6:
                return f"service {robot} out"
            case 7 | 8:
                return f"service {robot} back"
            case 9:
                kind = random.choice(["visit", "cover", "once", "patrol"])
                return f"objective {robot} {{{kind}: {random.sample(self.free, 2)}}}"
            case 10 if self.orders:
                return f"order {random.choice(self.orders)} {other}"
            case 11 if self.data.get("inputs"):
                return f"input alarm {random.choice(['on', 'off'])}"
        return None

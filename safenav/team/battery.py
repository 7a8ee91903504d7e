"""Batteries: the charge that steps and stays use, the poses from which a robot can continue, and a
robot's next destination.

More charge is never worse. So one number for each pose and next target, the least charge, suffices,
and searches keep only the highest charges of a state.
"""

from collections.abc import Iterator, Mapping, Sequence
from heapq import heappop, heappush
from operator import ge

from msgspec import Struct

from safenav.components import reached
from safenav.data import cached_method
from safenav.scenario.model import Battery
from safenav.world.poses import FAR, Mask, PoseGraph, bits

NEVER = 1 << 30
AMPLE = 0.25
"""The reserve, as a share of the capacity, with which a robot ends a plan off the chargers, if
possible: others may charge first. Robots also leave chargers with this reserve, since they may be
late in a lab."""
ROUNDING = 1e-6
"""The tolerance for charge lost by rounded times."""


class Energy(Struct, frozen=True, eq=False, dict=True):
    """A robot's battery. ``chargers``: poses; ``targets`` in turn; ``settles``: whether the robot
    stays at the last target; ``returns``: whether it always keeps the charge to reach a charger,
    for another objective or a duty."""

    graph: PoseGraph
    chargers: Mask
    battery: Battery
    targets: tuple[Mask, ...]
    settles: bool
    returns: bool = False

    def charging(self, pose: int) -> bool:
        return bool(self.chargers >> pose & 1)

    def is_flat(self, charge: float, pose: int) -> bool:
        """Return whether a robot with this charge can take no step and gets no charge in its
        pose."""
        return charge < self.battery.move - ROUNDING and not self.charging(pose)

    def yields(self, least: float) -> float:
        """Return the charge with which a robot leaves its charger to another one with ``least``."""
        return min(self.battery.capacity, least + AMPLE * self.battery.capacity)

    # The least charge from which it can continue.

    def turn(self, number: int) -> int:
        last = len(self.targets) - 1
        return min(number, last) if self.settles else number % (last + 1)

    @cached_method
    def needs(self, allowed: Mask) -> tuple[dict[int, float], ...]:
        """Return, for each next target, the least charge in each pose with which the robot can meet
        all targets forever (a greatest fixpoint). Poses where no charge suffices are omitted."""
        least: dict[int, float] = dict.fromkeys(bits(allowed), 0)
        if self.returns:
            at = dict.fromkeys(bits(self.chargers & allowed), 0.0)
            least = self._leg(allowed, self.chargers, at, direct=True) | at
        found = [least for _ in self.targets]
        grown = True
        while grown:
            grown = False
            for k, before in enumerate(found):
                new = self._leg(allowed, self.targets[k], found[self.turn(k + 1)])
                new = {p: max(c, before[p]) for p, c in new.items() if p in before}
                if new != before:
                    found[k], grown = new, True
        return tuple(found)

    def need(self, allowed: Mask, pose: int, turn: int) -> float:
        return self.needs(allowed)[turn].get(pose, NEVER)

    @cached_method
    def suffices(self, allowed: Mask, turn: int, goals: int) -> dict[int, float]:
        """Return, for each pose, the least charge with which the robot alone can meet its next
        ``goals`` goals."""
        then: Mapping[int, float] = dict.fromkeys(bits(allowed), 0)
        for k in range(goals - 1, -1, -1):
            then = self._leg(allowed, self.targets[self.turn(turn + k)], then)
        return dict(then)

    def _leg(
        self, allowed: Mask, goal: Mask, then: Mapping[int, float], *, direct: bool = False
    ) -> dict[int, float]:
        """Return, for each pose, the least charge with which the robot reaches a goal and then has
        the charge ``then``. It may stop at chargers unless ``direct``."""
        battery = self.battery
        best, queue = dict[int, float](), list[tuple[float, int]]()

        def before(pose: int) -> Iterator[int]:
            return bits(self.graph.backward(1 << pose) & allowed)

        def offer(pose: int, charge: float) -> None:
            if charge > battery.capacity:
                return
            if not direct and self.chargers >> pose & 1:
                charge = 0
            if charge < best.get(pose, NEVER):
                best[pose] = charge
                heappush(queue, (charge, pose))

        for pose in bits(goal & allowed):
            if pose in then:
                for former in before(pose):
                    offer(former, then[pose] + battery.move)
                on = self.chargers >> pose & 1
                offer(pose, then[pose] if on else max(then[pose] + battery.stay, battery.move))
        while queue:
            charge, pose = heappop(queue)
            if charge == best[pose]:
                for former in before(pose):
                    offer(former, charge + battery.move)
        return best

    # The next destination.

    @cached_method
    def _direct(self, allowed: Mask, goal: Mask, turn: int, lasting: bool) -> dict[int, float]:
        """Return, for each pose, the charge to reach a goal without a stop and, if ``lasting``, to
        continue from there to target ``turn``."""
        then = self.needs(allowed)[turn] if lasting else dict.fromkeys(bits(allowed), 0)
        return self._leg(allowed, goal, then, direct=True)

    @cached_method
    def _levels(self, allowed: Mask, goal: Mask, turn: int, lasting: bool) -> dict[int, int]:
        """Return the number of further stops before the goal, for each charger from which the robot
        can reach it."""
        direct, full = self._direct(allowed, goal, turn, lasting), self.battery.capacity
        far = self.graph.distances
        places, found = [*bits(self.chargers & allowed)], dict[int, int]()
        begins = (c for c in places if direct.get(c, NEVER) <= full)
        before = reached(
            begins,
            lambda at: (c for c in places if far(1 << at, allowed)[c] * self.battery.move <= full),
        )
        for c, after in before.items():
            found[c] = 0 if c == after else found[after] + 1
        return found

    def aim(
        self, allowed: Mask, goal: Mask, turn: int, at: tuple[int, float], how: tuple[bool, bool]
    ) -> Mask:
        """Return the poses to visit next: the goal if the charge suffices or no charger helps;
        ``home`` if the robot waits for a resolution; else the chargers in reach with fewest stops
        before the goal, or its own. ``turn``: the target after the goal; ``at``: pose, charge;
        ``how``: the charge must be ``lasting``, and the robot leaves chargers ``full`` only."""
        (pose, charge), (lasting, full), battery = at, how, self.battery
        on, far = self.chargers >> pose & 1, self.graph.distances
        if goal >> pose & 1:
            return goal
        charging = full and on and charge < battery.capacity
        direct = self._direct(allowed, goal, turn, lasting).get(pose, NEVER)
        if direct <= charge and not charging:
            return goal
        if battery.stay and far(goal, allowed)[pose] >= FAR:
            return self.home(allowed) or goal  # the robot waits for a resolution
        levels, reach = self._levels(allowed, goal, turn, lasting), dict[int, Mask]()
        mine = levels.get(pose, NEVER) if on else NEVER
        for c, level in levels.items() if not charging else ():
            if level < mine and far(1 << c, allowed)[pose] * battery.move <= charge:
                reach[level] = reach.get(level, 0) | 1 << c
        if reach:
            return reach[min(reach)]
        if on and mine < NEVER and charge < battery.capacity:
            return 1 << pose
        return self.aim(allowed, goal, turn, at, (False, full)) if lasting else goal

    def home(self, allowed: Mask) -> Mask:
        """Return the chargers if waiting elsewhere uses charge, else no pose (any is suitable)."""
        return self.chargers & allowed if self.battery.stay else 0


def dominated(charges: Sequence[float], known: list[tuple[float, ...]]) -> bool:
    """Return whether one of ``known`` is at least as high as ``charges`` everywhere. If not, add
    ``charges`` to ``known``, and remove those that are nowhere higher."""
    if any(all(map(ge, one, charges)) for one in known):
        return True
    known[:] = [one for one in known if not all(map(ge, charges, one))]
    known.append(tuple(charges))
    return False

"""Rules on the charge of robots (docs/batteries.md)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.audit.deriving import pose_of
from safenav.audit.grid import opposite
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation, Status
from safenav.audit.team import Pose
from safenav.trace.records import Appeared, Move, Outcome, Record, Resolved, Service
from safenav.trace.setting import BatteryHeader
from safenav.trace.vocabulary import ChangeCause

BATTERY = ".battery"


class ChargeRule(Rule):
    """A robot with a battery takes no step for which its charge does not suffice: it begins with
    ``start``, a step takes ``move``, a tick without one ``stay`` or gives ``charge`` on a charger.
    A robot off the chargers that can no longer take a step is out of service in that turn, by an
    obstacle of the type ``flat`` that appears there, if the scenario has one; no other is. Its
    resolution fills the battery (T Batteries)."""

    name = "charge"

    def __init__(self) -> None:
        self._charge: dict[str, int] = {}
        self._flat: dict[str, str] = {}
        self._filled: set[str] = set()
        self._owed: str | None = None
        self._asks = False

    def opening(self, now: Situation) -> Iterator[Finding]:
        for name, robot in now.header.robots.items():
            if robot.battery is not None:
                self._charge[name] = robot.battery.start
        yield from ()

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        match record:
            case Move():
                yield from self._owes(record)
                if record.robot in self._charge:
                    yield from self._moved(record, now)
            case Appeared(cause=ChangeCause.BATTERY):
                if self._owed is None:
                    problem = f"{record.obstacle} appears, but no charge is used up"
                    yield self.broken_by(record, None, problem)
                elif now.obstacles[record.obstacle].region != now.region[self._owed]:
                    problem = f"{record.obstacle} appears elsewhere than {self._owed} is"
                    yield self.broken_by(record, self._owed, problem)
                else:
                    self._flat[record.obstacle] = self._owed
            case Service(cause=ChangeCause.BATTERY, active=False):
                if record.robot != self._owed:
                    problem = f"the charge of {record.robot} is not used up"
                    yield self.broken_by(record, record.robot, problem)
                elif self._asks and record.robot not in self._flat.values():
                    problem = f"nothing appears at {record.robot}, whose charge is used up"
                    yield self.broken_by(record, record.robot, problem)
                self._owed = None
            case Service(cause=ChangeCause.BATTERY):
                if record.robot not in self._filled:
                    problem = f"the battery of {record.robot} was not replaced"
                    yield self.broken_by(record, record.robot, problem)
                else:
                    self._filled.discard(record.robot)
                    self._charge[record.robot] = _battery(now, record.robot).capacity
            case Resolved():
                if record.obstacle in self._flat:
                    self._filled.add(self._flat.pop(record.obstacle))
            case Outcome():
                if not now.is_cut_short() and not now.turn.torn:
                    yield from self._owes(record)
                for of, least in (record.refused or {}).items():
                    if of.endswith(BATTERY):
                        yield from self._refused(of.removesuffix(BATTERY), least, record, now)
            case _:
                pass

    def _owes(self, record: Record) -> Iterator[Finding]:
        if self._owed is not None:
            problem = f"the charge of {self._owed} is used up, but no line takes it out of service"
            yield self.broken_by(record, self._owed, problem)
            self._owed = None

    def _moved(self, move: Move, now: Situation) -> Iterator[Finding]:
        name, battery = move.robot, _battery(now, move.robot)
        charger = move.to in (now.header.chargers or ())
        self._charge[name] = charge_after(now, move, self._charge[name])
        if self._charge[name] < 0:
            problem = f"{name} takes a step with a charge of {self._charge[name] + battery.move}"
            yield self.broken_by(move, name, problem)
            self._charge[name] = 0
        empty = self._charge[name] < battery.move and not charger and move.toward is None
        stands = any(
            obstacle.region == move.to and now.status[obstacle.name] is Status.UNRESOLVED
            for obstacle in now.obstacles.values()
        )
        if empty and name not in now.out:
            self._owed = name
            self._asks = now.header.flat is not None and not stands and not now.external

    def _refused(
        self, name: str, least: int | None, record: Outcome, now: Situation
    ) -> Iterator[Finding]:
        if name not in self._charge:
            yield self.broken_by(record, None, f"{name} has no battery")
            return
        truth = need(now, name)
        if least != truth:
            problem = f"{name} is refused since it needs a charge of {least}, but it is {truth}"
            yield self.broken_by(record, name, problem)
        elif least is not None and least <= self._charge[name]:
            problem = f"{name} is refused, but its charge of {self._charge[name]} suffices"
            yield self.broken_by(record, name, problem)


def _battery(now: Situation, robot: str) -> BatteryHeader:
    battery = now.header.robots[robot].battery
    assert battery is not None
    return battery


def charge_after(now: Situation, move: Move, charge: int) -> int:
    """A robot's charge after a move, below 0 if it did not suffice."""
    battery = _battery(now, move.robot)
    if move.to != move.from_:
        return charge - battery.move
    if move.toward is not None:
        return charge
    if move.to in (now.header.chargers or ()):
        return min(battery.capacity, charge + battery.charge)
    return max(0, charge - battery.stay)


def lasts_until(
    now: Situation, tick: int, robot: str, obstacle: str, charge: int, turn: int
) -> int | None:
    """The last tick in which an obstacle that cuts a robot off from its chargers can be resolved;
    None if it does not cut it off, or if waiting takes no charge."""
    stay = _battery(now, robot).stay
    known = [name for name in now.requests if robot in now.blocked_by(name)]
    stays = [
        o.name
        for o in now.obstacles.values()
        if now.status[o.name] in (Status.UNTRAVERSABLE, Status.GIVEN_UP) and robot in o.blocks
    ]
    shut = frozenset(now.obstacles[name].region for name in (*known, *stays))
    least = need(now, robot, shut, turn)
    behind = need(now, robot, shut - {now.obstacles[obstacle].region}, turn)
    if not stay or behind is None or behind > charge or (least is not None and least <= charge):
        return None
    return tick + (charge - behind) // stay


def need(
    now: Situation, robot: str, shut: frozenset[int] = frozenset(), turn: int = 0
) -> int | None:
    """The least charge with which a robot can continue forever from where it is, meeting its
    targets in turn from number ``turn`` on outside the regions ``shut``; None if none suffices.
    By relaxation of numbers on poses, for each
    target repeatedly, until nothing changes."""
    battery, chargers = _battery(now, robot), now.header.chargers or ()
    targets = now.header.robots[robot].objective.targets
    targets = (
        targets[-1:] if now.header.robots[robot].objective.kind in ("hold", "once") else targets
    )
    start = pose_of(robot, now)

    def steps(pose: Pose) -> list[Pose]:
        ways = [(to, now.grid.direction(pose[0], to)) for to in now.grid.neighbours(pose[0])]
        open_ = [(to, way) for to, way in ways if to not in shut]
        if pose[1] is None:
            return [(to, None) for to, _ in open_]
        return [(to, way) for to, way in open_ if way is not None and opposite(way) != pose[1]]

    poses, queue = {start}, [start]
    while queue:
        for pose in steps(queue.pop()):
            if pose not in poses:
                poses.add(pose)
                queue.append(pose)
    after = {pose: steps(pose) for pose in poses}
    needs: list[dict[Pose, int]] = [dict.fromkeys(poses, 0) for _ in targets]

    def leg(target: frozenset[int], then: Mapping[Pose, int]) -> dict[Pose, int]:
        found: dict[Pose, int] = {}
        changed = True
        while changed:
            changed = False
            for pose in poses:
                stay = 0 if pose[0] in chargers else battery.stay
                ways = [then[q] + battery.move for q in after[pose] if q[0] in target and q in then]
                ways += [found[q] + battery.move for q in after[pose] if q in found]
                ways += [then[pose] + stay] if pose[0] in target and pose in then else []
                ways = [
                    0 if pose[0] in chargers else way for way in ways if way <= battery.capacity
                ]
                if ways and min(ways) < found.get(pose, battery.capacity + 1):
                    found[pose] = min(ways)
                    changed = True
        return found

    while True:
        found = [leg(t, needs[(k + 1) % len(targets)]) for k, t in enumerate(targets)]
        grown = [
            {p: max(n, old[p]) for p, n in new.items() if p in old}
            for new, old in zip(found, needs, strict=True)
        ]
        if grown == needs:
            return needs[turn % len(needs)].get(start)
        needs = grown

"""Rules on the charge of batteries (docs/batteries.md)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from math import ceil

from safenav.audit.kinds import STAYING, shape_of
from safenav.audit.language import Pose, RefusedError, closure, distance
from safenav.audit.lines import Line, Objective
from safenav.audit.poses import PoseGraph
from safenav.audit.possibilities.deriving import member_of, open_obstacles, permanent, poses_in
from safenav.audit.possibilities.team import Team
from safenav.audit.proofs.case import case_of
from safenav.audit.proofs.joint import can_get
from safenav.audit.rules.rule import UNREAD, Message, Rule
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Status, taken

BATTERY = ".battery"
MOST_MOVED = 20_000
"""Limit on the joint states enumerated to judge a stop that a robot gives up."""
_FLOOR = ("violation", "blocked", "gone", "appeared", "operator", "objective", "service", "plan")
"""Lines after which a robot may be assigned another objective before it reaches its stop."""


_NOT_OUT = "the charge of {} is used up, but no line takes it out of service"


class ChargeRule(Rule):
    """A robot with a battery takes no step for which its charge does not suffice. The charge begins
    with ``start``; a step takes ``move``; a tick without a step takes ``stay``, or gives ``charge``
    on a charger (live: each second without a step). A robot off the chargers that can no longer
    take a step is out of service in that turn, by an obstacle of the type ``flat`` that appears
    there, if the scenario has one; no other robot is. Its resolution fills the battery. A robot
    reaches a stop before it gets another one, unless the known floor changes, another robot stays
    there, no order of moves brings it there, or its charge no longer suffices. A robot without
    other robots in its way stays nowhere else (T Batteries)."""

    name = "charge"

    def __init__(self) -> None:
        self._pass = (0, 0.0)
        self._acted: tuple[int, frozenset[str]] = 0, frozenset()
        """The tick in which an action ended, and the robots that took part in it."""
        self._flat: dict[str, str] = {}
        self._filled: set[str] = set()
        self._owed: str | None = None
        self._asks = False
        self._stops: dict[str, tuple[Objective, int, int]] = {}  # its line, and its tick

    def opening(self, now: Situation) -> Iterable[Message]:
        charges = now.charge.items()
        self._empty = [name for name, left in charges if _is_empty(name, left, now)]
        return ()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if now.live:
            yield from self._in_time(record, now)
        elif self._owed is None and self._empty and record.tick > 0:
            name = self._empty.pop(0)  # its charge does not suffice for a step
            self._runs_flat(name, now.region[name], now)
        match record.type:
            case "move" if not now.live:
                yield from self._owes()
                if record.robot in now.charge:
                    yield from self._moved(record, now)
            case "appeared" if record.cause == "battery":
                if self._owed is None:
                    yield f"{record.obstacle} appears, but no charge is used up"
                elif now.obstacles[record.obstacle].region != now.region[self._owed]:
                    yield (
                        self._owed,
                        f"{record.obstacle} does not appear in the region of {self._owed}",
                    )
                else:
                    self._flat[record.obstacle] = self._owed
            case "service" if record.cause == "battery" and record.active is False:
                if record.robot != self._owed:
                    yield f"the charge of {record.robot} is not used up"
                elif self._asks and record.robot not in self._flat.values():
                    yield f"nothing appears at {record.robot}, whose charge is used up"
                self._owed = None
            case "service" if record.cause == "battery":
                if record.robot not in self._filled:
                    yield f"the battery of {record.robot} was not replaced"
                else:
                    self._filled.discard(record.robot)
            case "synthesis":
                yield from self._stop(record, now)
            case "resolved":
                self._stops.clear()
                if record.obstacle in self._flat:
                    self._filled.add(self._flat.pop(record.obstacle))
            case "outcome":
                for of, least in (record.refused or {}).items():
                    if of.endswith(BATTERY):
                        yield from self._refused(of.removesuffix(BATTERY), least, record, now)
            case _ if record.type in _FLOOR:
                self._stops.clear()

    def ending(self, now: Situation) -> Iterator[Message]:
        if not now.is_cut_short():
            yield from self._owes()

    def turn(self, now: Situation) -> Iterator[Message]:
        turn = now.turn
        stop, line, tick = self._stops.get(turn.robot or "", (None, 0, 0))
        move = turn.first("move")
        if stop is None or line >= turn.line or move is None or move.by != "strategy":
            return
        if now.live and tick >= turn.tick:
            return  # no line records when in the pass a robot stays
        others = (name for name in now.region if name != move.robot)
        alone = not any(now.conflict(move.robot, o) or now.zones(move.robot, o) for o in others)
        if alone and taken(move) == {move.from_} and move.to not in stop.targets[0]:
            yield move.robot, f"{move.robot} must {stop}, but stays at {now.show(move.to)}", move

    def _stop(self, record: Line, now: Situation) -> Iterator[str]:
        """Judge a new stop by the previous one."""
        robot, here = record.robot, now.region.get(record.robot)
        before, *_ = self._stops.pop(robot, (None,))
        if record.reason != "charge" or robot not in now.charge or now.requests:
            return  # it can wait for a resolution
        if before is not None and here not in before.targets[0]:
            again = record.objective.targets == before.targets  # in another pose there
            again = again or _kept_from(robot, before.targets[0], now)
            if (
                not again
            ):  # also if no order of the team's moves brings it there, or that is unknown
                case = case_of(now)
                again = case is None or not can_get(robot, before.targets[0], case, MOST_MOVED)
            left = now.charge[robot] if record.t is None else now.charge_at(robot, record.t)
            if not again and not _too_far(now, robot, before.targets[0], left):
                yield f"{robot} gets another stop before it reaches its last one, {before}"
        if record.objective.kind == STAYING and record.objective != now.own[robot]:
            self._stops[robot] = (record.objective, record.line, record.tick)

    def _owes(self) -> Iterator[Message]:
        if self._owed is not None:
            yield self._owed, _NOT_OUT.format(self._owed)
            self._owed = None

    def _moved(self, move: Line, now: Situation) -> Iterator[Message]:
        name, left = move.robot, now.charge_after(move)
        if left < 0:
            yield f"{name} takes a step with a charge of {now.charge[name]:g}"
        if _is_empty(name, left, now, move.to) and move.toward is None and name not in now.out:
            self._runs_flat(name, move.to, now)

    def _in_time(self, record: Line, now: Situation) -> Iterator[Message]:
        """Live: follow the charges of robots that stand still."""
        t, name = record.t, getattr(record, "robot", None)
        if t is None:
            return  # an inserted move
        if record.tick > self._pass[0]:
            before, then = self._pass
            ended, busy = self._acted  # some robots had their turns before it ended
            busy = busy if ended == before else frozenset()
            for one in self._flat_at(then, now) if before else ():  # since the last pass began
                if one not in busy:
                    yield one, _NOT_OUT.format(one)
            self._pass = record.tick, t
        if record.type in ("appeared", "service") and record.cause == "battery":
            at = now.obstacles[record.obstacle].region if record.type == "appeared" else None
            for one in self._flat_at(t, now):
                if one == name or now.region[one] == at:
                    self._runs_flat(one, now.region[one], now)
        if record.type == "acted" and record.robot in now.acting:
            before, busy = self._acted
            others = busy if before == record.tick else frozenset[str]()
            self._acted = record.tick, others.union(now.acting[record.robot].robots)
        if record.type == "depart" and record.robot in now.charge:
            charge = now.charge_at(record.robot, t)
            if charge < _battery(now, record.robot).move:
                yield f"{name} takes a step with a charge of {charge:g}"

    def _flat_at(self, t: float, now: Situation) -> list[str]:
        """Live: return the robots in service off the chargers that lack the charge for a step."""
        chargers = now.header.chargers or ()
        acting = {name for act in now.acting.values() for name in act.robots}
        return [
            name
            for name in now.stands
            if name not in now.out | acting
            and now.region[name] not in chargers
            and now.charge_at(name, t) < _battery(now, name).move
        ]

    def _runs_flat(self, name: str, at: int, now: Situation) -> None:
        """Expect lines that take a robot out of service."""
        stands = any(
            obstacle.region == at and now.status[obstacle.name] is Status.UNRESOLVED
            for obstacle in now.obstacles.values()
        )
        self._owed = name
        self._asks = now.header.flat is not None and not stands and not now.external

    def _refused(
        self, name: str, least: int | None, outcome: Line, now: Situation
    ) -> Iterator[Message]:
        if name not in now.charge:
            yield None, f"{name} has no battery"
            return
        try:
            truth = need(now, name, member_of(name, now, (), ()).steps)
        except RefusedError:
            yield self.not_judged(outcome, name, UNREAD)
            return
        if least != truth:
            yield name, f"{name} is refused since it needs a charge of {least}, but it is {truth}"
        elif least is not None and least <= now.charge[name]:
            yield name, f"{name} is refused, but its charge of {now.charge[name]:g} suffices"


def _battery(now: Situation, robot: str) -> Line:
    return now.header.robots[robot].battery


def _kept_from(robot: str, regions: frozenset[int], now: Situation) -> bool:
    """Return whether another robot occupies one of the regions and its own objective does not make
    it leave: it is out of service, or its only target is there."""
    return any(
        here in regions
        and now.conflict(robot, other)
        and (other in now.out or all({*target} == {here} for target in now.own[other].targets))
        for other, here in now.region.items()
        if other != robot and now.toward[other] is None
    )


def _is_empty(robot: str, charge: float, now: Situation, at: int | None = None) -> bool:
    """Return whether a robot off the chargers lacks the charge for a step. ``at``: its region
    (default: the present one)."""
    charger = (now.region[robot] if at is None else at) in (now.header.chargers or ())
    return charge < _battery(now, robot).move and not charger


def _too_far(now: Situation, robot: str, target: frozenset[int], charge: float) -> bool:
    """Return whether a robot's charge does not suffice for the path to a region of a target."""
    graph, shut = member_of(robot, now, permanent(now), ()).steps, _shut(now, robot)
    there = {*poses_in(target, robot, now)}
    steps = distance([now.pose(robot)], lambda pose: _after(pose, graph, shut), there)
    return steps is None or steps * _battery(now, robot).move > charge


def _after(pose: Pose, graph: PoseGraph, shut: frozenset[int]) -> list[Pose]:
    return [to for to in graph.get(pose, ()) if to[0] not in shut]


def _shut(now: Situation, robot: str) -> frozenset[int]:
    """Return the regions of the known open obstacles that block a robot."""
    return Team.walls(robot, open_obstacles(now))


def lasts_until(
    now: Situation, tick: int, robot: str, obstacle: str, turn: int, *, had: bool
) -> int | None:
    """Return the last tick in which an obstacle that cuts a robot off from its chargers can be
    resolved; None if it does not cut the robot off, or if waiting takes no charge. ``turn``: number
    of the robot's next target; ``had``: it has had its turn in this tick."""
    stay, charge = _battery(now, robot).stay, int(now.charge[robot])
    charge -= 0 if had else stay
    graph, shut = member_of(robot, now, permanent(now), ()).steps, _shut(now, robot)
    least = need(now, robot, graph, shut, turn)
    behind = need(now, robot, graph, shut - {now.obstacles[obstacle].region}, turn)
    if not stay or behind is None or behind > charge or (least is not None and least <= charge):
        return None
    if not _too_far(now, robot, frozenset(now.header.chargers or ()), charge):
        return None  # it can wait at a charger
    return tick + (charge - behind) // stay


def need(
    now: Situation, robot: str, graph: PoseGraph, shut: frozenset[int] = frozenset(), turn: int = 0
) -> int | None:
    """Return the least charge with which a robot can continue forever from where it is, and meet
    its targets in turn from number ``turn`` on, by steps in ``graph`` outside the regions ``shut``;
    None if none suffices. Where staying meets a target, the robot may step to another region of
    that target instead, if it can meet its targets forever from there (``lasts``).

    Numbers on poses are relaxed, for each target repeatedly, until nothing changes.
    """
    battery, chargers = _battery(now, robot), now.header.chargers or ()
    own, start = now.own[robot], now.pose(robot)
    targets = own.targets
    last, settles = len(targets) - 1, shape_of(own.kind).settles

    def in_turn(turn: int) -> int:
        return min(turn, last) if settles else turn % len(targets)

    reached = closure([start], lambda pose: _after(pose, graph, shut))
    after = {pose: _after(pose, graph, shut) for pose in reached}
    lasts: list[dict[Pose, int]] = [{} for _ in targets]

    def leg(turn: int, then: Mapping[Pose, int], full: Collection[int]) -> dict[Pose, int]:
        target, lives = targets[turn], lasts[in_turn(turn + 1)]
        found: dict[Pose, int] = {}
        changed = True
        while changed:
            changed = False
            for pose in after:
                stay, least = (0, 0) if pose[0] in full else (ceil(battery.stay), battery.move)
                there = [q for q in after[pose] if q[0] in target]
                charges = [then[q] + battery.move for q in there if q in then]
                charges += [found[q] + battery.move for q in after[pose] if q in found]
                if pose[0] in target and pose in then:  # below ``least`` it is out of service
                    goes = [q for q in there if q in lives and not (settles and turn == last)]
                    aside = [then.get(q, battery.capacity) + battery.move for q in goes]
                    charges.append(max(then[pose] + stay, least, *aside))
                charge = min(charges, default=battery.capacity + 1)
                if charge <= battery.capacity and pose[0] in full:
                    charge = 0
                if charge < found.get(pose, battery.capacity + 1):
                    found[pose], changed = charge, True
        return found

    def forever(full: Collection[int]) -> list[dict[Pose, int]]:
        needs: list[dict[Pose, int]] = [dict.fromkeys(after, 0) for _ in targets]
        while True:
            found = [leg(k, needs[in_turn(k + 1)], full) for k in range(len(targets))]
            grown = [
                {p: max(n, old[p]) for p, n in new.items() if p in old}
                for new, old in zip(found, needs, strict=True)
            ]
            if grown == needs:
                return needs
            needs = grown

    lasts = forever({pose[0] for pose in after})
    return forever(chargers)[in_turn(turn)].get(start)

"""Rules on robots' knowledge of each other: sightings and beliefs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice

from safenav.audit.kinds import STAYING
from safenav.audit.lines import Line
from safenav.audit.rules.rule import Finding, Message, Rule
from safenav.audit.run.situation import Situation


class BeliefRule(Rule):
    """A robot's belief about another robot contains that robot's region, after every turn in which
    it looked; a sighting is one region; no belief contains a wall; a belief consists of whole cells
    of the partition (D 4, Beliefs)."""

    name, kinds = "belief", ("belief",)

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        robot, other = record.robot, record.of
        before = now.beliefs.get((robot, other))
        if before is not None and (before.seen, before.regions) == (record.seen, record.regions):
            yield f"{robot} learns nothing new about {other}"
        if record.seen and len(record.regions) != 1:
            places = ", ".join(now.show(region) for region in sorted(record.regions))
            yield f"{robot} sees {other} in several regions or none: {places or 'none'}"
        shut = sorted(region for region in record.regions if not now.grid.is_free(region))
        if shut:
            yield f"{robot} believes {other} at {now.show(shut[0])}, which is not free"
        elif not record.seen and record.regions != {now.region[other]}:
            for cell in now.header.partition or ():
                if 0 < len(record.regions.intersection(cell)) < len(cell):
                    where = ", ".join(map(str, sorted(record.regions.intersection(cell))))
                    yield f"{robot} believes {other} at {where}, which is only a part of a cell"


class MissedBeliefRule(Rule):
    """A belief line follows whenever a look changes a robot's knowledge of another robot. It tracks
    robots from its first look on; a robot in sight is seen, one out of sight is not; a belief grows
    by all possible steps out of sight (in a live run: by all paths) and loses the cells that the
    robot sees wholly (D 4, Beliefs).

    If the trace does not record which obstacles block the view, both possibilities are accepted. A
    robot that waits, believed exactly where it is, is not searched for.
    """

    name, kinds = "missed-belief", ("synthesis", "violation")

    def __init__(self) -> None:
        self._tracked: dict[str, frozenset[str]] = {}
        self._watching: dict[str, frozenset[str]] = {}
        self._before: Mapping[tuple[str, str], Line] = {}
        self._found: set[int] = set()
        self._closed: dict[str, frozenset[int]] = {}
        self._shut: dict[str, frozenset[int]] = {}

    def line(self, record: Line, now: Situation) -> Iterable[Message]:
        if record.type == "violation":
            self._found.add(now.obstacles[record.obstacle].region)
        elif record.node is not None:
            others = (*(record.moving or ()), *(record.tracked or ()))
            self._tracked[record.robot] = frozenset(others if record.tracking == "belief" else ())
            if record.sight_closed is not None:
                self._closed[record.robot] = frozenset(record.sight_closed)
        return ()

    def turn(self, now: Situation) -> Iterator[Message]:
        turn, robot = now.turn, now.turn.robot
        looked = robot and not turn.on_the_way and not turn.torn and turn.first("move")
        if robot and looked:
            for other in sorted(self._watching.get(robot, frozenset())):
                if (robot, other) not in now.beliefs:
                    yield f"{robot} tracks {other}, but no line records where it may be"
            for (believer, other), belief in now.beliefs.items():
                there = now.region[other]
                if believer == robot and there not in belief.regions:
                    how = "sees" if belief.seen else "believes"
                    message = f"{robot} {how} {other} elsewhere, but it is at {now.show(there)}"
                    yield Finding(BeliefRule.name, turn.tick, robot, belief.line, message)
                problems = self._problems(robot, other, belief, now) if believer == robot else ()
                for problem in islice(problems, 1):
                    yield robot, problem, belief if belief in turn.records else turn
        self._before, self._watching = dict(now.beliefs), dict(self._tracked)
        self._shut = dict(self._closed)

    def _problems(self, robot: str, other: str, belief: Line, now: Situation) -> Iterator[str]:
        own, there = now.turn.origin, now.region[other]
        if own is None or there not in belief.regions or not now.grid.is_free(own):
            return
        waits = now.objectives[other].kind in (STAYING, "ltl") or other in now.out
        alone = any(set(cell) == {there} for cell in now.header.partition or ())
        if not belief.seen and belief.regions == {there} and (waits or alone):
            return  # neither a robot that waits nor a cell of one region requires a search
        place = now.show(there)
        if belief.seen and not self._may_see(robot, own, there, now):
            yield f"{robot} sees {other} at {place}, which is out of its sight"
        if belief.seen:
            return
        if self._must_see(robot, own, there, now):
            yield f"{robot} sees {other} at {place}, but the line is missing"
            return
        before = self._before.get((robot, other))
        if before is None:
            return
        reach = now.grid.later(set(filter(now.grid.is_free, before.regions)))
        hidden = sorted(r for r in reach - belief.regions if not self._may_see(robot, own, r, now))
        if hidden:
            yield f"{other} may have reached {now.show(hidden[0])}, out of {robot}'s sight"
        for cell in now.header.partition or ():
            believed = belief.regions.issuperset(cell)
            if believed and all(self._must_see(robot, own, r, now) for r in reach & set(cell)):
                shown = now.show(min(cell))
                yield f"{robot} can exclude the cell of {shown}, where it believes {other}"

    def _may_see(self, robot: str, own: int, region: int, now: Situation) -> bool:
        closed = self._shut.get(robot, frozenset())
        return now.grid.sees(own, region, now.header.robots[robot].vision, closed)

    def _must_see(self, robot: str, own: int, region: int, now: Situation) -> bool:
        closed = self._shut.get(robot, self._found)
        return now.grid.sees(own, region, now.header.robots[robot].vision, closed)

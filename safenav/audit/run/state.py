"""Obstacles, requests and the objective stack, as queried by the rules."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from itertools import takewhile

from safenav.audit.lines import Line, Obstacle
from safenav.audit.needs import Need, OpenObstacle
from safenav.audit.run.robots import Robots
from safenav.audit.run.turn import StackEntry, Status, Turn, helpers_of


class State(Robots):
    """The state at a trace line. Only ``actions`` and ``situation`` change it."""

    def __init__(self, header: Line, records: Iterable[Line]) -> None:
        super().__init__(header)
        self._list(records)
        begun = self.begun
        stays, closed = {*(begun.stays or ())}, {*(begun.closed or ())} & self.status.keys()
        self.status |= dict.fromkeys(closed, Status.UNTRAVERSABLE)
        self.status |= dict.fromkeys(stays, Status.GIVEN_UP)
        self.requests: dict[str, dict[str, int]]
        self.requests = {name: dict(waits) for name, waits in (begun.asked or {}).items()}
        """The open requests, the oldest first: obstacle -> requesters, each with the region where
        it waits."""
        self.discovered = {*closed, *stays, *self.requests}
        self.given_up: dict[str, dict[str, int]] = {}
        """The requests for obstacles that are given up."""
        self.permanent = stays
        """The obstacles that an operator has declared permanent."""
        self.aside: set[str] = set()
        """The obstacles that no joint state serves until something changes."""
        self.orders: set[str] = set()
        """Obstacles that were ordered, so that no robot has made the request."""
        self.stack: list[StackEntry] = []
        self.helping: dict[str, frozenset[str]] = {}
        """The helpers of each obstacle that were named last."""
        self.resting = frozenset[str]()
        """The robots without a duty because they are out of service."""
        self.named: dict[str, str] = {}
        """The obstacle for which each robot was named a helper last."""
        self.helped: dict[str, str] = {}
        """The same, at the last change of the objectives in force."""
        self.barred: set[tuple[str, str]] = set()
        """Live: (robot, obstacle) that the robot leaves to others, because its actions failed."""
        self.dues = dict.fromkeys(self.begun.late or (), 0) | dict(self.begun.due or {})
        """The ticks in which requests are due, also where these have passed."""
        self.plan: Line | None = None
        """The joint plan in force."""
        self.waits: Line | None = None
        """The line by which the team waits for an operator, or for a change of the scenario."""
        self.fails_in: int | None = None
        """The tick in which a robot has failed, or was charged, while the team waits."""
        self.outcome: Line | None = None
        self.time = 0.0
        """Live: the time of the last line, in seconds."""
        self.turn = Turn(0, None, self.header_line, dict(self.objectives))

    def _list(self, records: Iterable[Line]) -> None:
        """Add the obstacles of the header, and those that lines describe."""
        robots, begun = self.header.robots, self.begun
        first = [Obstacle.of(stated, robots) for stated in self.header.obstacles]
        found = [record.obstacle for record in records if record.type == "discovered"]
        later = [Obstacle.of(stated, robots) for stated in found]
        self.obstacles = {o.name: o for o in later} | {o.name: o for o in first}
        self.truth = {name: o.traversable for name, o in self.obstacles.items()}
        self.listed = {
            name: [o for o in first if o.name == name] or [obstacle]
            for name, obstacle in self.obstacles.items()
        }
        """All obstacles of one name: an obstacle may reappear."""
        later = sorted((o for o in first if o.from_ is not None), key=lambda one: one.from_)
        self.coming: list[Obstacle] = later
        """The obstacles of the header that have not appeared yet, in the order of their times."""
        self.until = {o.name: o.until for o in first if o.from_ is None and o.until}
        """The time at which each present obstacle of the header disappears, if it does."""
        self.status = {
            name: Status.ABSENT if all(o.from_ is not None for o in listed) else Status.UNRESOLVED
            for name, listed in self.listed.items()
        }
        self.met_before: dict[str, list[frozenset[str]]] = {
            name: [frozenset(group) for group in groups]
            for name, groups in (begun.met or {}).items()
        }
        """The groups that met needs of obstacles before, as long as these have not appeared."""
        self.open = {
            name: self.opened(name) if self.status[name] is Status.UNRESOLVED else obstacle.opened()
            for name, obstacle in self.obstacles.items()
        }
        """Each obstacle with its unmet needs; its last need always stays."""
        self.introduced = {obstacle.name for obstacle in self.header.obstacles}
        """Obstacles that the scenario lists, or that a line has described."""
        self.obstacles_at: dict[int, list[Obstacle]] = {}
        """The obstacles of each region, present or not."""
        for obstacle in self.obstacles.values():
            self.obstacles_at.setdefault(obstacle.region, []).append(obstacle)

    def opened(self, obstacle: str) -> OpenObstacle:
        """Return the open needs of an obstacle that becomes present, at the stage that it had
        reached before."""
        found = self.obstacles[obstacle].opened()
        for group in self.met_before.pop(obstacle, ()):
            found = found.advanced(group)
        return found

    def resolves_alone(self, obstacle: str) -> bool:
        """Return whether a single action resolves an obstacle, so that no partial result exists."""
        left = self.obstacles[obstacle].all_needs[self.open[obstacle].stage :]
        return len(left) == 1 and left[0].robots == 1

    def carriers(self, obstacle: str) -> frozenset[str]:
        """Return the robots that carry a load: they have taken it, or taken part in that, and have
        not put it down in this turn."""
        last = obstacle, len(self.obstacles[obstacle].all_needs) - 1
        there = self.status[obstacle].unmet
        there = there and last not in self.turn.met
        return self.open[obstacle].carriers() if there else frozenset()

    def loads(self, robot: str) -> list[str]:
        """Return the loads that a robot carries; it can take no other."""
        return [name for name in self.obstacles if robot in self.carriers(name)]

    def need(self, obstacle: str) -> Need:
        """Return the obstacle's next need, or its last one if all are met; if the need before it
        required the same robots, only those are able to meet it."""
        return self.open[obstacle].left[0]

    def unmet(self, one: OpenObstacle) -> tuple[Need, ...]:
        """Return an obstacle's unmet needs with the robots that do not take a load by them: the map
        and their own ``avoid`` leave no path to the regions of a later need of the load. A robot
        that has begun to take it is not among them."""
        acts = (act.robots for act in self.acting.values() if one.name in act.obstacles)
        busy, left = frozenset[str]().union(*acts), one.left
        return tuple(
            need._replace(cut_off=frozenset(self._cut_off(need, later)) - busy)
            if not need.same and (later := [*takewhile(lambda one: one.same, left[k + 1 :])])
            else need
            for k, need in enumerate(left)
        )

    def _cut_off(self, need: Need, later: Collection[Need]) -> Iterator[str]:
        for robot in need.able:
            reach = self.grid.connected(self.pose(robot)[0], self.own[robot].avoid)
            if any(reach.isdisjoint(one.regions) for one in later):
                yield robot

    def too_few(self, obstacle: str) -> list[bool]:
        """Return for each unmet need whether too few robots can fulfil it and the later needs that
        the same robots must fulfil."""
        left = self.obstacles[obstacle].all_needs[self.open[obstacle].stage :]
        return [len(need.able) < need.robots for need in left]

    def stopped_by(self, obstacle: str) -> set[str]:
        """Return the robots that the obstacle physically stops."""
        return set(self.obstacles[obstacle].blocks & self.header.robots.keys())

    def blocked_by(self, obstacle: str) -> set[str]:
        """Return the robots that must not enter the obstacle's region now: those that it stops,
        except robots that resolve it by entering, as long as it can be resolved."""
        stopped = self.stopped_by(obstacle)
        if self.status[obstacle] is not Status.UNRESOLVED:
            return stopped
        return {name for name in stopped if not self.open[obstacle].entered_by(name)}

    def is_inside(self, robot: str, obstacle: str) -> bool:
        """Return whether a robot has walked into an obstacle that stops it, to resolve it."""
        here = self.obstacles[obstacle].region == self.region[robot]
        here = here and self.came[robot] is not None and self.toward[robot] is None
        enters = self.open[obstacle].ends_by_entering(robot)
        return here and enters and robot in self.stopped_by(obstacle)

    def is_cut_short(self) -> bool:
        """Return whether the run ended within this turn, which is therefore incomplete."""
        if not self.turn.final:
            return False
        endings = ("completed", "tick_limit")
        return self.outcome is None or self.outcome.outcome not in endings

    def entry_of(self, record: Line) -> StackEntry | None:
        """Return the entry that a pop removes: that of its request, anywhere in the stack."""
        why = (record.obstacle, record.requester, helpers_of(record))
        entries = reversed(self.stack)
        return next((e for e in entries if (e.obstacle, e.requester, e.helpers) == why), None)

    def standing(self, obstacle: str) -> set[str]:
        """Return the robots that can perform the obstacle's next action and stand where it is
        performed."""
        regions = self.need(obstacle).regions
        able = self.need(obstacle).able - self.under_way.keys()
        there = {robot for robot in able if self.region[robot] in regions}
        if not self.open[obstacle].takes():
            return there
        out, act = self.unmet(self.open[obstacle])[0].cut_off, self.turn.act
        there -= out - self.open[obstacle].done - {*(act.robots if act is not None else ())}
        carriers = self.carriers(obstacle)
        return {n for n in there if n in carriers or not self.loads(n)}

    def takers(self, robot: str, obstacle: str) -> frozenset[str] | None:
        """Return all robots that take a load with this one in its turn; None if it cannot take
        it."""
        need, there = self.need(obstacle), self.standing(obstacle)
        whole = self.open[obstacle].takes() and (need.robots == 1 or need.together)
        known = obstacle in self.requests and self.status[obstacle] is Status.UNRESOLVED
        if not (whole and known) or robot not in there or len(there) < need.robots:
            return None
        return frozenset(there if need.together else [robot])

    def meets_without_line(self, robot: str, obstacle: str) -> frozenset[str] | None:
        """Return the robots that fulfil the next need of an obstacle, not its last one, if the
        action of one of them takes no time: a live run records no lines for that."""
        last = len(self.open[obstacle].left) == 1
        if not self.live or last or self.open[obstacle].takes() or robot in self.acting:
            return None
        need, there = self.need(obstacle), self.standing(obstacle)
        group = there if need.together else self.open[obstacle].done | {robot}
        return frozenset(group) if robot in there and len(group) >= need.robots else None

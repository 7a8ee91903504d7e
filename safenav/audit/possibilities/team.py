"""The team's possibilities at one moment: reachable poses, resolutions and helpers.

An open obstacle is a wall for the robots that it stops; robots are sets of poses, and do not
collide (docs/coordination.md, SOLVE). Written from that page, independently of the runtime's
decisions.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import combinations, product

from safenav.audit.language import Pose, distance
from safenav.audit.needs import OpenObstacle, OpenObstacles
from safenav.audit.poses import Poses
from safenav.audit.possibilities.members import FAR, Duty, Member, Sets, Settlement, Step

MOST_NODES = 20_000


class TooManyError(Exception):
    """A search exceeded the limits of this check."""


class Team:
    """The possibilities of the robots, for any order of their moves."""

    def __init__(self, members: Mapping[str, Member]) -> None:
        self.members, self.names = members, [*members]

    @staticmethod
    def walls(name: str, obstacles: OpenObstacles) -> frozenset[int]:
        return frozenset(obstacle.region for obstacle in obstacles if obstacle.closes(name))

    def reach(self, name: str, poses: Poses, obstacles: OpenObstacles) -> Poses:
        """Return the poses that a robot can reach from some poses."""
        return self.members[name].steps.reach(poses, self.walls(name, obstacles))

    def around(self, name: str, pose: Pose, obstacles: OpenObstacles) -> Poses:
        """Return the poses between which a robot can move back and forth."""
        return self.members[name].steps.spread(pose, self.walls(name, obstacles)).around

    def can_continue(self, name: str, poses: Poses, obstacles: OpenObstacles) -> bool:
        """Return whether a robot can meet each target infinitely often from some of the poses."""
        member = self.members[name]
        return member.steps.can_continue(poses, member.aims, self.walls(name, obstacles))

    def is_live(self, name: str, pose: Pose, obstacles: OpenObstacles) -> bool:
        """Return whether a robot can meet each of its targets infinitely often from a pose."""
        shut = pose[0] in self.walls(name, obstacles)
        return not shut and self.can_continue(name, frozenset([pose]), obstacles)

    def ticks(self, name: str, poses: Poses, there: Poses, obstacles: OpenObstacles) -> int | None:
        """Return an upper bound on the ticks to the nearest of the poses ``there``; None if there
        is no path."""
        walls, steps = self.walls(name, obstacles), self.members[name].steps
        ways = distance(poses, lambda p: (q for q in steps.get(p, ()) if q[0] not in walls), there)
        return None if ways is None else ways * self.members[name].ticks

    def full(self, obstacles: Iterable[OpenObstacle]) -> frozenset[str]:
        """Return the robots that carry a load, and so can take no other."""
        laden = frozenset(name for name in self.names if self.members[name].laden)
        return laden.union(*(obstacle.carriers() for obstacle in obstacles))

    def fits(self, group: Iterable[str], at: Mapping[str, Poses]) -> bool:
        """Return whether all robots of a group can stand at some of their poses at the same time,
        robots in conflict in different regions."""
        crowd = [name for name in group if self.members[name].rivals & {*group}]
        choices = product(*({region for region, _ in at[name]} for name in crowd))
        return any(
            all(
                one != other or b not in self.members[a].rivals
                for (a, one), (b, other) in combinations(zip(crowd, regions, strict=True), 2)
            )
            for regions in choices
        )

    def in_the_way(
        self,
        name: str,
        region: int,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        duties: Mapping[str, Duty],
    ) -> bool:
        """Return whether a robot in a region would hinder a duty: it keeps a helper in conflict
        with it from every region of its duty, or a group from standing there together."""
        for helper in self.members[name].rivals & {*duties}:
            duty = duties[helper]
            stood = next(o for o in obstacles if o.name == duty.obstacle)
            places = {}
            for one in duty.group:
                shut = {region} if one in self.members[name].rivals else set()
                walls = self.walls(one, obstacles) | shut
                goal = duties.get(one, duty).regions - shut
                reached = self.members[one].steps.reach([at[one]], walls)
                places[one] = frozenset(pose for pose in reached if pose[0] in goal)
            together = stood.left[0].together
            if not all(places.values()) or (together and not self.fits(duty.group, places)):
                return True
        return False

    def clear(
        self,
        name: str,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        duties: Mapping[str, Duty],
    ) -> frozenset[int]:
        """Return the regions that a robot can reach and where it hinders no helper."""
        reached = {region for region, _ in self.reach(name, frozenset([at[name]]), obstacles)}
        return frozenset(r for r in reached if not self.in_the_way(name, r, at, obstacles, duties))

    def after(self, step: Step, sets: Sets, obstacles: OpenObstacles) -> tuple[Sets, OpenObstacles]:
        where = dict(zip(self.names, sets, strict=True))
        where |= zip(step.group, step.at, strict=True)
        then = obstacles[step.obstacle].acted(step.group)
        return tuple(where.values()), _replaced(obstacles, step.obstacle, then)

    def options(
        self,
        sets: Sets,
        origins: Sets,
        obstacles: OpenObstacles,
        present: Mapping[str, frozenset[str]],
        *,
        every: bool = False,
    ) -> list[Step]:
        """Return the possible next steps, the best first. Lossless steps come first (unless
        ``every``, one for each obstacle): each robot of the group can return to all poses of its
        set. They are then ranked by the newest request, the fewest robots that
        serve another request, the fewest that do not serve this obstacle already, the lowest ticks,
        the oldest request, and the order of the team. Last come the parts of single robots, if the
        robots of a need may act at different times."""
        found: list[tuple[tuple[object, ...], Step]] = []
        full = self.full(obstacles)
        for k, obstacle in ((k, obstacle) for k, obstacle in enumerate(obstacles) if obstacle.left):
            need, then = obstacle.left[0], _replaced(obstacles, k, obstacle.advanced(()))
            at, back = dict[str, Poses](), dict[str, bool]()
            rank = dict[str, tuple[bool, bool, int, int]]()
            others = [o.name for o in obstacles if o.left and o != obstacle]
            able_now = need.able - obstacle.done - obstacle.barred - need.cut_off
            able_now -= full if obstacle.takes() else frozenset()
            for i, name in enumerate(self.names):
                there = self._spots(name, sets, obstacles, k) if name in able_now else frozenset()
                if there:
                    at[name], back[name] = there, sets[i] <= self.reach(name, there, then)
                    stranger = name not in present.get(obstacle.name, ())
                    ticks = self.ticks(name, origins[i], there, obstacles) or 0
                    for further in obstacle.chain():
                        goal = frozenset(self.members[name].steps.on(further.regions))
                        more = self.ticks(name, there, goal, obstacles)
                        far = FAR * self.members[name].ticks
                        ticks, there = ticks + (far if more is None else more), goal
                    taken = any(name in present.get(other, ()) for other in others)
                    rank[name] = taken, stranger, ticks, i
            able = sorted(at, key=lambda name: (not back[name], rank[name]))
            missing, last = max(1, need.robots - len(obstacle.done)), None
            for group in combinations(able, missing):
                if need.together and not self.fits(group, at):
                    continue
                lossless = all(back[name] for name in group) and not obstacle.commits()
                interrupted, strange = (sum(rank[name][i] for name in group) for i in (0, 1))
                slowest = max(rank[name][2] for name in group)
                listed = tuple(rank[name][3] for name in group)
                order = (not lossless, k, interrupted, strange, slowest, listed)
                last = Step(k, group, tuple(at[n] for n in group), lossless)
                found.append(((False, *order), last))
                if lossless and not every:
                    break
            alone = missing > 1 and not need.together and (every or not (last and last.lossless))
            for name in able if alone else ():
                i, slowest = rank[name][3], rank[name][2]
                returns = sets[i] <= self.reach(name, at[name], obstacles)
                lossless = returns and not obstacle.commits()
                last = Step(k, (name,), (at[name],), lossless)
                found.append(((True, not lossless, slowest, k, i), last))
        return [step for _, step in sorted(found, key=lambda one: one[0])]

    def solve(
        self,
        sets: Sets,
        origins: Sets,
        obstacles: OpenObstacles,
        wanted: frozenset[str],
        present: Mapping[str, frozenset[str]],
    ) -> list[Step] | None:
        """Return steps after which all ``wanted`` obstacles are resolved and every robot can
        continue; None if there are none. ``origins``: the poses from which ticks are counted;
        ``present``: the robots that serve each obstacle now. Raises TooManyError."""
        failed, nodes = set[tuple[Sets, OpenObstacles]](), 0

        def search(sets: Sets, origins: Sets, obstacles: OpenObstacles) -> list[Step] | None:
            nonlocal nodes
            nodes += 1
            if nodes > MOST_NODES:
                raise TooManyError
            if self._done(sets, obstacles, wanted):
                return []
            if (sets, obstacles) in failed:
                return None
            for step in self.options(sets, origins, obstacles, present):
                after, then = self.after(step, sets, obstacles)
                rest = search(after, self.after(step, origins, obstacles)[0], then)
                if rest is not None:
                    return [step, *rest]
                if step.lossless:
                    break  # lossless: no other step can succeed either
            failed.add((sets, obstacles))
            return None

        return search(sets, origins, obstacles)

    def _done(self, sets: Sets, obstacles: OpenObstacles, wanted: frozenset[str]) -> bool:
        if any(obstacle.left for obstacle in obstacles if obstacle.name in wanted):
            return False
        return all(map(self.can_continue, self.names, sets, [obstacles] * len(sets)))

    def settle(
        self,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        present: Mapping[str, frozenset[str]],
        aside: Collection[str] = (),
    ) -> Settlement | None:
        """Return the duties of the robots; None if no order of resolutions lets every robot
        continue. ``obstacles``: in the order of service; ``present``: the robots that serve them
        now; ``aside``: obstacles that no joint state serves. Raises TooManyError."""
        sets = tuple(self.around(name, at[name], obstacles) for name in self.names)
        served = frozenset[str]()
        if self.solve(sets, sets, obstacles, served, {}) is None:
            return None
        for obstacle in obstacles:
            if obstacle.name in aside:
                continue  # no joint state serves it
            if self.solve(sets, sets, obstacles, served | {obstacle.name}, {}) is not None:
                served |= {obstacle.name}
        plan = self._planned(at, obstacles, served, present)
        assert plan is not None, "what can be done can be planned"
        duties, begun, busy = dict[str, Duty](), set[int](), set[str]()
        for step in plan:
            obstacle = obstacles[step.obstacle]
            ready = step.obstacle not in begun and not busy & {*step.group}
            begun, busy = begun | {step.obstacle}, busy | {*step.group}
            spots = tuple(
                frozenset(p for p in self._spots(n, sets, obstacles, step.obstacle) if p in there)
                for n, there in zip(step.group, step.at, strict=True)
            )
            if ready and all(spots):
                now = step._replace(at=spots)
                for name, there in zip(step.group, spots, strict=True):
                    after = self.after(now, sets, obstacles)
                    lasting = self._lasting(name, there, *after, served) or there
                    regions = frozenset(region for region, _ in lasting)
                    stays = obstacle.left[0].together or len(step.group) > 1
                    duties[name] = Duty(obstacle.name, step.group, regions, stays)
        names = tuple(obstacle.name for obstacle in obstacles if obstacle.name in served)
        return Settlement(names, duties)

    def _planned(
        self,
        at: Mapping[str, Pose],
        obstacles: OpenObstacles,
        served: frozenset[str],
        present: Mapping[str, frozenset[str]],
    ) -> list[Step] | None:
        """Return steps that resolve all ``served`` obstacles, and others only if necessary."""
        origins = tuple(frozenset([at[name]]) for name in self.names)
        sets = tuple(self.around(name, at[name], obstacles) for name in self.names)
        plan = self.solve(sets, origins, obstacles, served, present)
        for name in dict.fromkeys(obstacles[step.obstacle].name for step in reversed(plan or ())):
            if name not in served and plan is not None:  # perhaps it can stay unresolved
                rest = [step for step in plan if obstacles[step.obstacle].name != name]
                plan = self._replayed(rest, sets, obstacles, served) or plan
        return plan

    def _spots(self, name: str, sets: Sets, obstacles: OpenObstacles, k: int) -> Poses:
        """Return the poses where a robot can meet the next need of an obstacle."""
        reached = self.reach(name, sets[self.names.index(name)], obstacles)
        there = self.members[name].steps.on(obstacles[k].left[0].regions)
        return frozenset(pose for pose in there if pose in reached)

    def _lasting(
        self, name: str, there: Poses, sets: Sets, obstacles: OpenObstacles, served: frozenset[str]
    ) -> Poses:
        """Return the poses of a robot, among ``there``, from which every robot can continue."""
        k, good, bad = self.names.index(name), set[Pose](), set[Pose]()
        for pose in sorted(there, key=str):
            if pose in good or pose in bad:
                continue
            around = self.around(name, pose, obstacles)
            stood = (*sets[:k], around, *sets[k + 1 :])
            lasts = self.solve(stood, stood, obstacles, served, {}) is not None
            (good if lasts else bad).update(around & there)
        return frozenset(good)

    def _replayed(
        self, plan: list[Step], sets: Sets, obstacles: OpenObstacles, wanted: frozenset[str]
    ) -> list[Step] | None:
        """Return the steps of a plan with the poses possible in the given state; None if they no
        longer suffice."""
        found = []
        for step in plan:
            at = {name: self._spots(name, sets, obstacles, step.obstacle) for name in step.group}
            together = obstacles[step.obstacle].left[0].together
            if obstacles[step.obstacle].takes() and self.full(obstacles) & {*step.group}:
                return None  # the plan had it put down another load first
            if not all(at.values()) or (together and not self.fits(step.group, at)):
                return None
            found.append(step._replace(at=tuple(at.values())))
            sets, obstacles = self.after(found[-1], sets, obstacles)
        return found if self._done(sets, obstacles, wanted) else None


def _replaced(obstacles: OpenObstacles, k: int, then: OpenObstacle) -> OpenObstacles:
    return (*obstacles[:k], then, *obstacles[k + 1 :])

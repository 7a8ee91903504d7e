"""The role of each robot (its duty, a wait for help, or its own objective), and the obstacles that
it must not enter."""

from collections.abc import Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.scenario.objective import Objective, Target, formulas_in, ruled, station
from safenav.solve.solve import Settlement
from safenav.spec.guarantees import guarantees_of
from safenav.team.floor import Floor, Stages
from safenav.team.state import State
from safenav.team.team import Team
from safenav.world.poses import Mask, Pose, bits


class Role(Struct, frozen=True):
    """A robot's role. ``helps``: the obstacle that it has to resolve. ``avoid``: open obstacles
    that a new strategy treats as walls; ``must``: those that the present strategy must also treat
    so. ``forbidden``: poses from which the team could not continue."""

    objective: Objective
    helps: int | None = None
    avoid: frozenset[int] = frozenset()
    must: frozenset[int] = frozenset()
    forbidden: frozenset[Pose] = frozenset()


def helpers_of(roles: Sequence[Role], k: int) -> tuple[int, ...]:
    """Return the robots that have to resolve an obstacle."""
    return tuple(i for i, role in enumerate(roles) if role.helps == k)


class Roles:
    """The roles of all robots, which follow from the duties."""

    def __init__(
        self, team: Team, state: State, floor: Floor, stages: Stages, found: Settlement
    ) -> None:
        self.team, self.state, self.floor = team, state, floor
        self.stages, self.found = stages, found
        self.poses = tuple(robot.next for robot in state.robots)

    def all(self) -> tuple[Role, ...]:
        return tuple(map(self.role, range(len(self.poses))))

    def role(self, i: int) -> Role:
        if i in self.found.duties:
            first = self.own(i) if self._meets_own_first(i) else None
            helps = self.floor.gates[self.found.duties[i].g]
            return self._help(i) if first is None else replace(first, helps=helps)
        own = None if self.waits(i) else self.own(i)
        return own or self._wait(i)

    def waits(self, i: int) -> bool:
        """Return whether a robot has encountered an obstacle that is being resolved."""
        return any(
            i in dict(self.state.obstacles[self.floor.gates[g]].asked) for g in self.found.served
        )

    def _help(self, i: int) -> Role:
        duty, graph = self.found.duties[i], self.floor.graphs[i]
        k, rules = self.floor.gates[duty.g], self.team.members[i].objective
        places = frozenset(bits(graph.regions_of(duty.goal)))
        stays = duty.stays and self._may_stay(i, duty.goal)
        own = None if stays else self._own_target(i, duty.goal)
        wanted = (duty.goal,) if own is None else (duty.goal, graph.on(own))
        objective = rules.waiting(places) if stays else rules.alternating(places, own)
        return self._toward(i, wanted, objective, k)

    def _meets_own_first(self, i: int) -> bool:
        """Return whether a robot must meet the next target of its ``once`` before its duty: it can
        now, but could not meet all remaining targets after the duty."""
        member, duty, floor = self.team.members[i], self.found.duties[i], self.floor
        if not (member.pursuit.settles and member.pursuit.in_turn):
            return False
        graph, left = floor.graphs[i], member.targets[self.state.robots[i].own.memory :]
        after = floor.allowed(i, floor.advanced(duty.g, self.stages, duty.group))
        now = floor.allowed(i, self.stages)
        first = graph.closure(1 << self.poses[i], now) & left[0]
        can = bool(graph.closure(first, now) & duty.goal)
        return can and not self._in_turn(i, duty.goal, left, after)

    def _in_turn(self, i: int, at: Mask, targets: tuple[Mask, ...], allowed: Mask) -> Mask:
        """Return the poses at the last of these targets that a robot can reach after it has met all
        of them in turn from ``at``."""
        for target in targets:
            at = self.floor.graphs[i].closure(at, allowed) & target
        return at

    def _own_target(self, i: int, goal: Mask) -> Target | None:
        """Return the region where the robot waits, or else its first own target, if the robot can
        alternate between this and its duty; None if there is none."""
        waiting = (frozenset({place}) for place in self._places(i))
        for target in (*waiting, *self.team.members[i].objective.targets):
            if self._goes_between(i, (goal, self.floor.graphs[i].on(target))):
                return target
        return None

    def meanwhile(self, i: int) -> Role | None:
        """Return the role of a robot that pursues ``while_waiting``; None if it has no such
        objective, cannot pursue it, or follows joint plans."""
        member, graph = self.team.members[i], self.floor.graphs[i]
        other = member.robot.while_waiting
        if other is None or member.planned:
            return None
        other = ruled(other, member.objective)  # the robot's rules may have changed
        targets = graph.on_each(other.targets)
        return self._toward(i, targets, other) if self._goes_between(i, targets) else None

    def _wait(self, i: int) -> Role:
        """Return the role of a robot that waits: to pursue ``while_waiting``, to stay where it
        encountered the obstacle, or to return there if it may not stay."""
        other = self.meanwhile(i) if self.waits(i) else None
        if other is not None:
            return other
        graph, rules = self.floor.graphs[i], self.team.members[i].objective
        here = self.poses[i] % self.team.size
        place = next(iter(self._places(i)), here)
        if place != here and self._goes_between(i, (graph.on({place}),)):
            return self._toward(i, (graph.on({place}),), rules.waiting(frozenset({place})))
        if not self._may_stay(i, 1 << self.poses[i]):
            there = rules.alternating(frozenset({here}), None)  # the robot leaves and returns
            return self._toward(i, (graph.on({here}),), there)
        return Role(rules.waiting(frozenset({here})))

    def _may_stay(self, i: int, places: Mask) -> bool:
        """Return whether a robot's formulas allow it to stay in each of these poses."""
        formulas, graph = formulas_in(self.team.members[i].objective), self.floor.graphs[i]
        allows = None if formulas is None else guarantees_of(formulas).allows
        return allows is None or all(allows(pose, pose) for pose in graph.poses(places))

    def _places(self, i: int) -> list[int]:
        asked = (dict(self.state.obstacles[k].asked) for k in reversed(self.state.requests))
        found = [regions[i] for regions in asked if i in regions]
        present = self.state.robots[i].objective
        if present != self.team.members[i].objective and i not in self.found.duties:
            found += station(present) or ()
        return found[:1]

    def own(self, i: int) -> Role | None:
        """Return the role for the own objective, around open obstacles if possible, or None."""
        member, floor, state = self.team.members[i], self.floor, self.state
        shut = self._shut(i)
        must = frozenset(k for k in state.requests if i in dict(state.obstacles[k].asked))
        allowed, safe = floor.allowed(i, self.stages), self.found.safe[i]
        lost = 0 if safe is None else floor.graphs[i].closure(1 << self.poses[i], allowed) & ~safe
        for avoid in (shut | must, must):
            walls = floor.graphs[i].on(self.team.obstacles[k].region for k in avoid)
            free, at = floor.floors[i] & ~walls & ~lost, 1 << self.poses[i]
            if avoid > must and member.pursuit.settles:  # a door may shut off an earlier target
                at = self._in_turn(i, at, member.targets[state.robots[i].own.memory : -1], free)
            if floor.graphs[i].closure(at, free) & floor.live(i, free):
                return Role(member.objective, None, avoid, must, self._forbidden(i, member.targets))
        return None

    def _toward(
        self, i: int, targets: tuple[Mask, ...], objective: Objective, helps: int | None = None
    ) -> Role:
        shut = self._shut(i)
        return Role(objective, helps, shut, shut, self._forbidden(i, targets))

    def _shut(self, i: int) -> frozenset[int]:
        """Return the open obstacles that a robot must not enter now."""
        floor, stages = self.floor, self.stages
        shut = (g for g in floor.open(stages) if i in floor.need(g, stages).closed_to)
        return frozenset(floor.gates[g] for g in shut)

    def _goes_between(self, i: int, targets: tuple[Mask, ...]) -> bool:
        graph, safe = self.floor.graphs[i], self.found.safe[i]
        allowed = self.floor.allowed(i, self.stages) & (-1 if safe is None else safe)
        # A robot can leave a closed region, but may enter it again only if a target is there.
        inside = sum(1 << pose for _, _, pose, _ in self.floor.inside[i])
        again = allowed if any(each & inside for each in targets) else allowed & ~inside
        return bool(graph.closure(1 << self.poses[i], allowed) & graph.live(targets, again))

    def _forbidden(self, i: int, targets: tuple[Mask, ...]) -> frozenset[Pose]:
        """Return the unsafe poses one step from a safe pose from which a robot could still meet its
        targets."""
        safe, graph = self.found.safe[i], self.floor.graphs[i]
        allowed = self.floor.allowed(i, self.stages)
        if safe is None:
            return frozenset()
        lost = graph.forward(safe) & allowed & ~safe
        if lost:
            own = targets == self.team.members[i].targets
            lost &= self.floor.live(i, allowed) if own else graph.live(targets, allowed)
        return graph.poses(lost)

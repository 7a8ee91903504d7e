"""The transition model on poses: moves and actions on a floor with its obstacles, and their
results.

A ``Floor`` is the team's knowledge at one moment, without poses. SOLVE, joint searches, proofs, the
simulated world and the execution share its methods. ``stages`` are the stages of its ``gates``, in
their order.
"""

from collections.abc import Callable, Collection, Container, Iterable, Iterator, Sequence
from functools import cached_property, reduce
from operator import or_
from typing import NamedTuple, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from safenav.data import cached_method
from safenav.team.state import Count, Stage
from safenav.team.team import Member, Need, Obstacle, Team
from safenav.world.poses import Mask, PoseGraph, bits

Stages = tuple[Stage, ...]
T = TypeVar("T")
Inside = tuple[int, int, int, int | None]
"""A robot, the obstacle closed to it that contains it, and its pose; if it has entered to resolve
the obstacle, the only region to which it may leave (None: any)."""


class Joint(NamedTuple):
    """A joint state of a search: all that its future depends on. ``charges``: the charge of each
    robot; empty in searches without batteries."""

    poses: tuple[int, ...]
    counts: tuple[tuple[int, int], ...]
    stages: Stages
    charges: tuple[float, ...] = ()


class Floor(Struct, frozen=True, eq=False, dict=True):
    """The team's knowledge at one moment, without poses. ``gates``: open obstacles in the order of
    service; ``graphs``: each robot's poses and steps; ``floors``: for each robot, the poses that
    walls, its rules and sealed obstacles leave free; ``robots``: robots that take part; ``barred``:
    pairs of a robot and an obstacle that it must not resolve; ``inside``: for each robot, the
    closed obstacles that contain it; ``helping``: robots that already serve each obstacle;
    ``rounds``: the rounds of each robot, if they differ from the mission's; ``away``: for each
    robot, the poses that only robots out of service close; ``either``: whether strict objectives
    may begin with any target; ``ready``: whether robots with completed rounds must still be able to
    move; ``laden``: robots that carry loads of other obstacles; ``left``: the time until each gate
    is due, if any gate is; ``ends``: the poses where each robot has to end, unless its objective
    determines them; ``keeping``: robots whose rounds a resolution does not restart (in searches for
    rounds before it); ``resting``: robots that do not pursue their objectives."""

    team: Team
    gates: tuple[int, ...]
    graphs: tuple[PoseGraph, ...]
    floors: tuple[Mask, ...]
    robots: tuple[int, ...]
    barred: frozenset[tuple[int, int]] = frozenset()
    inside: tuple[tuple[Inside, ...], ...] = ()
    helping: tuple[tuple[int, tuple[int, ...]], ...] = ()
    rounds: tuple[int, ...] = ()
    away: tuple[Mask, ...] = ()
    either: bool = False
    ready: bool = False
    ends: tuple[Mask, ...] = ()
    keeping: frozenset[int] = frozenset()
    resting: frozenset[int] = frozenset()
    laden: frozenset[int] = frozenset()
    left: tuple[float, ...] = ()

    def while_resting(self, robots: frozenset[int]) -> "Floor":
        """Return the floor on which some robots do not pursue their objectives."""
        rounds = tuple(0 if i in robots else each for i, each in enumerate(self.wanted))
        return replace(self, rounds=rounds, resting=robots) if robots else self

    def gate(self, g: int) -> Obstacle:
        return self.team.obstacles[self.gates[g]]

    @cached_method
    def open(self, stages: Stages) -> tuple[int, ...]:
        return tuple(g for g, stage in enumerate(stages) if self.gate(g).next(stage) is not None)

    def need(self, g: int, stages: Stages) -> Need:
        return self.gate(g).needs[stages[g].need]

    @cached_property
    def flat(self) -> dict[int, int]:
        """The gates that are batteries of robots out of service, by robot. The resolution of such a
        gate returns its robot to service."""
        every = ((self.gate(g).battery_of, g) for g in range(len(self.gates)))
        return {i: g for i, g in every if i is not None and i not in self.robots}

    def in_service(self, i: int, stages: Stages) -> bool:
        """Return whether a robot is in service when the gates have these stages."""
        g = self.flat.get(i)
        return i in self.robots if g is None else self.gate(g).next(stages[g]) is None

    @cached_method
    def allowed(self, i: int, stages: Stages) -> Mask:
        """Return the poses that a robot may enter."""
        if i in self.flat and not self.in_service(i, stages):
            return 0
        closed = [
            self.gate(g).region
            for g in self.open(stages)
            if i in self.need(g, stages).closed_to
            or ((i, self.gates[g]) in self.barred and i in self.gate(g).blocks)
        ]
        found = self.floors[i] & ~self.graphs[i].on(closed)
        for _, _, pose, _ in self.inside[i]:
            found |= 1 << pose
        return found

    def shut(self, i: int, poses: Sequence[int]) -> Mask:
        """Return the regions that a robot must not enter since other robots are in its zones."""
        member = self.team.members[i]
        return member.shut(self._at(poses)) if member.zones else 0

    def _at(self, poses: Sequence[int]) -> list[Mask]:
        """Return the region of each robot that takes part, as a mask (0 for the others)."""
        at, size = [0] * len(poses), self.team.size
        for i in self.robots:
            at[i] = 1 << poses[i] % size
        return at

    @cached_method
    def live(self, i: int, allowed: Mask) -> Mask:
        """Return the ``allowed`` poses from which a robot can continue forever if robots out of
        service block none. A robot that rests can continue from all of them."""
        if i in self.resting:
            return allowed
        more = self.away[i] if self.away else 0
        return self.graphs[i].live(self.team.members[i].aims, allowed | more) & allowed

    @cached_property
    def one_way(self) -> bool:
        """Whether some robot may be unable to undo a step."""
        return any(self.graphs[i].one_way for i in self.robots)

    @cached_method
    def ahead(self, i: int, pose: int) -> frozenset[int]:
        """Return the regions into which a robot can step from ``pose`` and then continue."""
        live = self.live(i, self.floors[i])
        return frozenset(p % self.team.size for p in self.graphs[i].steps(pose) if live >> p & 1)

    def candidates(self, g: int, stages: Stages) -> Iterator[int]:
        """Yield the robots with the skills of the next need, or of the chosen group if there is
        one, also those out of service. No robot replaces its own battery."""
        skills, group = self.need(g, stages).skills, stages[g].group
        for i, member in enumerate(self.team.members):
            may = i != self.gate(g).battery_of and (group is None or i in group)
            if may and skills <= member.robot.capabilities:
                yield i

    @cached_method
    def skilled(self, g: int, stages: Stages) -> tuple[int, ...]:
        """Return the candidates in service whose actions on the gate have not failed too often."""
        able = (i for i in self.candidates(g, stages) if self.in_service(i, stages))
        return tuple(i for i in able if (i, self.gates[g]) not in self.barred)

    @cached_method
    def able(self, g: int, stages: Stages) -> tuple[int, ...]:
        """Return the robots that do their part of the next need if they are in its regions."""
        need, out = self.need(g, stages), stages[g].done
        if need.takes:
            out = out | need.strays | self.carriers(stages)
        return tuple(i for i in self.skilled(g, stages) if i not in out)

    @cached_method
    def carriers(self, stages: Stages) -> frozenset[int]:
        """Return the robots that carry a load or have taken their part of one. Each has at most one
        load."""
        carried = (carrying(self.need(g, stages), stages[g]) for g in self.open(stages))
        return self.laden.union(*carried)

    def missing(self, g: int, stages: Stages) -> int:
        return self.need(g, stages).robots - len(stages[g].done)

    def commits(self, g: int, stages: Stages) -> bool:
        """Return whether the robots that fulfil the next need must also fulfil a later need."""
        need, group = self.need(g, stages), stages[g].group
        return need.chosen and (group is None or len(group) > need.robots)

    def advanced(self, g: int, stages: Stages, group: Iterable[int] | None = None) -> Stages:
        """Return the stages after a group, and the robots that had done their part, fulfil the next
        need."""
        stage, chosen = stages[g], self.need(g, stages).chosen
        met = stage.group if group is None else stage.done.union(group)
        return put(stages, g, Stage(stage.need + 1, group=met if chosen else None))

    def took_part(self, g: int, stages: Stages, group: Iterable[int]) -> Stages:
        """Return the stages after a group has acted on the next need."""
        need, done = self.need(g, stages), stages[g].done.union(group)
        if len(done) >= need.robots:
            return self.advanced(g, stages, group)
        return stages if need.together else put(stages, g, stages[g]._replace(done=done))

    def acted(self, stages: Stages, at: Sequence[int | None], i: int) -> Stages:
        """Return the stages after robot i has acted on all gates in its region. ``at``: each
        robot's region (None: it takes no part). A robot takes loads last: begun ones first."""
        loads = [g for g in self.open(stages) if self.need(g, stages).takes]
        loads.sort(key=lambda g: (not stages[g].done, self.gate(g).source.order))
        for g in [g for g in self.open(stages) if g not in loads] + loads:
            while stages[g].need < len(self.gate(g).needs) and i in self.able(g, stages):
                need, before = self.need(g, stages), stages
                if need.takes and g not in loads:
                    break
                here = self.there(g, stages, at)
                if i not in here:
                    break
                stages = self.took_part(g, stages, here if need.together else (i,))
                if stages[g].need == before[g].need:
                    break
        return stages

    def there(self, g: int, stages: Stages, at: Sequence[int | None]) -> tuple[int, ...]:
        """Return the robots that do their part of the next need where they stand."""
        regions = self.need(g, stages).regions
        able = ((i, at[i]) for i in self.able(g, stages))
        return tuple(i for i, region in able if region is not None and regions >> region & 1)

    @cached_method
    def acting(self, stages: Stages) -> Mask:
        """Return the regions where a robot may take part in the next need of some gate."""
        needs = (self.need(g, stages) for g in self.open(stages) if self.able(g, stages))
        return reduce(or_, (need.regions for need in needs), 0)

    def performed(self, stages: Stages, poses: Sequence[int]) -> Stages:
        """Return the stages after every robot has acted where it stands."""
        size, sites = self.team.size, self.team.worksites
        at = (pose % size for pose in poses)
        return self._performed(stages, tuple(r if sites >> r & 1 else None for r in at))

    @cached_method
    def _performed(self, stages: Stages, at: tuple[int | None, ...]) -> Stages:
        before = None
        while before != stages:
            before = stages
            for i in self.robots:
                if (region := at[i]) is not None and self.acting(stages) >> region & 1:
                    stages = self.acted(stages, at, i)
        return stages

    # Joint states.

    def moved(self, joint: Joint, poses: tuple[int, ...]) -> Joint:
        """Return the joint state after the robots have gone to their ``poses``, acted and counted
        goals. If a resolution restarts rounds, or a need determines the robots of the next one, the
        robots go one at a time, as in a plan's execution."""
        moved = {i for i in self.robots if poses[i] != joint.poses[i]}
        after = self.settled(poses, joint.counts, joint.stages, moved)
        if len(moved) > 1 and (
            self.restarts(joint.stages, after.stages) or self._chooses(joint.stages, after.stages)
        ):
            *_, (_, after) = self.sequence(joint, poses)
        return after

    def sequence(self, joint: Joint, poses: tuple[int, ...]) -> Iterator[tuple[int, Joint]]:
        """Yield the robots in an order in which they can go to their poses one at a time, each with
        the joint state after its step."""
        size, left = self.team.size, [i for i in self.robots if poses[i] != joint.poses[i]]
        there: dict[int, set[int]] = {}
        for i in self.robots if left else ():
            there.setdefault(joint.poses[i] % size, set()).add(i)
        while left:
            waiting = []
            for i in left:
                region, rivals = poses[i] % size, self.team.members[i].rivals
                shut = self.shut(i, joint.poses) >> region & 1
                if shut or not rivals.isdisjoint(there.get(region, ())):
                    waiting.append(i)
                    continue
                there[joint.poses[i] % size].remove(i)
                there.setdefault(region, set()).add(i)
                joint = self.after(joint, i, poses[i])
                yield i, joint
            assert len(waiting) < len(left), "robots do not rotate"
            left = waiting

    def after(self, joint: Joint, i: int, pose: int) -> Joint:
        poses = (*joint.poses[:i], pose, *joint.poses[i + 1 :])
        if not self._meeting[i][0][pose] | self.acting(joint.stages) >> pose % self.team.size & 1:
            return Joint(poses, joint.counts, joint.stages)
        return self.settled(poses, joint.counts, joint.stages, (i,), (i,))

    @cached_method
    def steps(self, i: int, stages: Stages) -> dict[int, tuple[int, ...]]:
        graph, open_ = self.graphs[i], {self.gates[g] for g in self.open(stages)}
        for _, k, pose, behind in self.inside[i]:
            if behind is not None and k in open_:
                graph = graph.left_only(pose, behind)
        allowed = self.allowed(i, stages)
        return _Known(lambda pose: tuple(q for q in graph.steps(pose) if allowed >> q & 1))

    def moves(self, joint: Joint) -> Iterator[tuple[int, int]]:
        """Yield each step that one robot can take while the other robots stand still."""
        size, at = self.team.size, self._at(joint.poses)
        for i in self.robots:
            closed = self.team.members[i].closed(at)
            for pose in self.steps(i, joint.stages)[joint.poses[i]]:
                if not closed >> pose % size & 1:
                    yield i, pose

    @cached_property
    def wanted(self) -> tuple[int, ...]:
        """The number of rounds that each robot has to complete."""
        return self.rounds or (self.team.rounds,) * len(self.team.members)

    @cached_method
    def is_done(self, i: int, count: tuple[int, int]) -> bool:
        """Return whether a robot has completed its rounds."""
        return self.rounds_done(i, count) >= self.wanted[i]

    def rounds_done(self, i: int, count: tuple[int, int]) -> int:
        """Return the number of rounds that a robot has completed."""
        return self.team.members[i].pursuit.rounds(count[1])

    @cached_method
    def awaited(self, i: int, count: tuple[int, int]) -> Mask:
        """Return the poses of a robot's next target or, after its last round, the poses where it
        must end."""
        member = self.team.members[i]
        if not self.is_done(i, count):
            return member.awaited(count[0])
        return member.targets[-1] if member.pursuit.settles else 0

    def completed(
        self, joint: Joint, served: frozenset[int], who: tuple[int, ...] | None = None
    ) -> bool:
        """Return whether all rounds are completed, all ``served`` gates are resolved, and each
        robot (of ``who``) is in a pose where it may end."""
        robots = self.robots if who is None else who
        if not all(self.is_done(i, joint.counts[i]) for i in robots):
            return False
        if not served.isdisjoint(self.open(joint.stages)):
            return False
        return all(self.final(i, joint.stages) >> joint.poses[i] & 1 for i in robots)

    @cached_method
    def final(self, i: int, stages: Stages) -> Mask:
        """Return the poses where a robot may end: it can continue there forever. If its objective
        settles and it has rounds to complete, they are at its last target."""
        if self.ends:
            return self.ends[i]
        member, live = self.team.members[i], self.live(i, self.allowed(i, stages))
        settles = member.pursuit.settles and (not self.rounds or self.rounds[i] > 0)
        return live & member.targets[-1] if settles else live

    def settled(
        self,
        poses: tuple[int, ...],
        counts: tuple[tuple[int, int], ...],
        stages: Stages,
        moved: Container[int] = (),
        who: Collection[int] | None = None,
    ) -> Joint:
        """Return the joint state after all robots have acted where they are, and the robots ``who``
        (default: all) have counted goals. The other robots have acted and counted before.
        ``moved``: the robots that have just moved."""
        who = self.robots if who is None else who
        acting, size = self.acting(stages), self.team.size
        if acting and any(acting >> poses[i] % size & 1 for i in who):
            before, stages = stages, self.performed(stages, poses)
            if stages != before and self.restarts(before, stages):
                pairs = zip(self.team.members, counts, strict=True)
                fresh = (restarted(m, Count(*c))[:2] for m, c in pairs)
                every, who = enumerate(zip(counts, fresh, strict=True)), self.robots
                counts = tuple(old if i in self.keeping else new for i, (old, new) in every)
        changed: list[tuple[int, int]] | None = None
        for i in who:
            arriving, staying = self._meeting[i]
            kept = staying[poses[i]]
            here = arriving[poses[i]] if i in moved else kept
            if not here:
                continue
            member, count = self.team.members[i], counts[i]
            pursuit, free = member.pursuit, self.either and member.either and count[1] == 0
            if free and not here >> count[0] & 1:
                count = (next(bits(here)), 0)
            if pursuit.in_turn and self.is_done(i, count) and self.open(stages):
                # if a resolution restarts the rounds, a target met now only determines the next one
                count = pursuit.step(count[0], here)[0], count[1]
            while not self.is_done(i, count):
                memory, more = pursuit.step(count[0], here)
                if (memory, more) == (count[0], 0):
                    break
                count, here = (memory, count[1] + more), kept
            if count != counts[i]:
                changed = changed or list(counts)
                changed[i] = count
        return Joint(poses, tuple(changed) if changed else counts, stages)

    def restarts(self, before: Stages, after: Stages) -> bool:
        """Return whether a resolution restarts rounds. Resolving a flat battery does not."""
        over = {*self.open(before)} - {*self.open(after)}
        return any(self.gate(g).restarts for g in over)

    def _chooses(self, before: Stages, after: Stages) -> bool:
        """Return whether a need or a part was fulfilled that may determine the next robots."""
        changed = (g for g in self.open(before) if before[g] != after[g])
        return any(need.same for g in changed for need in self.gate(g).needs)

    @cached_property
    def _meeting(self) -> list[tuple[dict[int, int], dict[int, int]]]:
        """For each robot, the targets met by arriving in a pose, and by staying there."""
        return [(_Known(member.reached), _Known(member.kept)) for member in self.team.members]


class _Known(dict[int, T]):
    """A function of a pose that caches its values."""

    def __init__(self, of: Callable[[int], T]) -> None:
        self.of = of

    def __missing__(self, pose: int) -> T:
        found = self[pose] = self.of(pose)
        return found


def put(stages: Stages, g: int, stage: Stage) -> Stages:
    return (*stages[:g], stage, *stages[g + 1 :])


def carrying(need: Need, stage: Stage) -> frozenset[int]:
    """Return the robots that carry the load of an obstacle, or have taken their part of it."""
    carried = stage.group if need.same else stage.done if need.takes else None
    return carried or frozenset()


def restarted(member: Member, count: Count) -> Count:
    """Return the progress after a resolution: zero rounds, and the same next target."""
    return count._replace(memory=count.memory if member.pursuit.in_turn else 0, met=0)

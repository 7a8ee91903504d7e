"""A team as indexed data: robots, obstacles and their needs. A team never changes.

Robots and obstacles have indices in the scenario's order. A set of regions or poses is a mask.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, lru_cache, reduce
from itertools import takewhile
from math import ceil
from operator import or_

from msgspec import Struct
from msgspec.structs import replace

from safenav.data import cached_method
from safenav.pace.robot import SIDE, Pace, acted_by, pace_of
from safenav.scenario import model
from safenav.scenario.model import Coordination
from safenav.scenario.objective import Objective, Pursuit
from safenav.team.battery import NEVER, Energy
from safenav.team.formulas import graph_of, targets_of
from safenav.team.state import Is, ObstacleNow, Stage, State
from safenav.world.map import RegionMap
from safenav.world.poses import Mask, Pose, PoseGraph, bits, plain_graph, region_mask


class Need(Struct, frozen=True):
    """A need: ``robots`` robots do ``action`` in ``regions``, simultaneously if ``together``; if
    ``same``, the robots of the previous need. ``chosen``: whether these robots also fulfil the next
    need; ``skills``: all actions for this need and those that the same robots fulfil next;
    ``strays``: robots that do not take the load, since they have no path to its destination.
    ``closed_to``: robots that must not enter while this need is next."""

    action: str
    robots: int
    regions: Mask
    together: bool
    same: bool
    chosen: bool
    skills: frozenset[str]
    strays: frozenset[int]
    closed_to: frozenset[int]

    @property
    def takes(self) -> bool:
        """Whether the robots that fulfil the need carry a load afterwards."""
        return self.chosen and not self.same


class Obstacle(Struct, frozen=True, eq=False):
    """An obstacle. ``restarts``: whether its resolution restarts rounds; ``battery_of``: the robot
    whose empty battery it is, if any."""

    name: str
    region: int
    needs: tuple[Need, ...]
    blocks: frozenset[int]
    source: model.Obstacle
    restarts: bool
    battery_of: int | None = None

    @property
    def ordered(self) -> bool:
        return self.source.ordered

    def closes(self, i: int, now: ObstacleNow) -> bool:
        """Return whether the obstacle, in this state, closes its region to a robot."""
        if now.state is Is.SEALED:  # a sealed obstacle may have no need left
            return i in self.blocks
        return now.state not in (Is.AWAY, Is.OVER) and i in self.needs[now.stage.need].closed_to

    def lets_in(self, i: int, now: ObstacleNow) -> bool:
        """Return whether a blocked robot may enter the region to fulfil the obstacle's next
        need."""
        need = self.next(now.stage)
        return need is not None and i in self.blocks - need.closed_to

    def next(self, stage: Stage) -> Need | None:
        """Return the need that is next at a stage; None if the obstacle is resolved."""
        return self.needs[stage.need] if stage.need < len(self.needs) else None


Zone = tuple[frozenset[int], Mask]
"""An entry of ``never_together`` for one robot: the other robots and the regions."""


class Member(Struct, frozen=True, eq=False):
    """A robot. ``floor``: the poses that walls and its own rules leave free; ``targets``: masks of
    poses; ``rivals``: the robots with which it never shares a region; ``zones``: its entries of
    ``never_together``; ``base``: a pose whose paths equal those of its present pose."""

    name: str
    robot: model.Robot
    graph: PoseGraph
    floor: Mask
    targets: tuple[Mask, ...]
    pursuit: Pursuit
    rivals: frozenset[int]
    zones: tuple[Zone, ...]
    base: Pose
    energy: Energy | None = None

    @property
    def planned(self) -> bool:
        """Whether joint plans drive the robot: it has rivals, shares a zone, or has a battery."""
        return bool(self.rivals or self.zones) or self.energy is not None

    @property
    def partners(self) -> frozenset[int]:
        """The robots that this robot may have to await: rivals and those that share a zone."""
        return self.rivals.union(*(others for others, _ in self.zones))

    def shut(self, at: Sequence[Mask]) -> Mask:
        """Return the regions that the robot must not enter since other robots are in its zones.
        ``at``: the regions of each robot."""
        zones = (zone for others, zone in self.zones if any(at[j] & zone for j in others))
        return reduce(or_, zones, 0)

    def closed(self, at: Sequence[Mask]) -> Mask:
        """Return the regions of ``shut`` and those that rivals occupy."""
        found = self.shut(at)
        for j in self.rivals:
            found |= at[j]
        return found

    @property
    def objective(self) -> Objective:
        return self.robot.objective

    @property
    def ticks(self) -> int:
        """The number of ticks of the robot's steps."""
        return self.robot.model.timing

    @property
    def either(self) -> bool:
        """Whether the robot may begin a round with any target, since its objective is strict."""
        return self.objective.strict and not self.objective.literal

    @property
    def aims(self) -> tuple[Mask, ...]:
        """The targets that the robot has to meet forever."""
        return self.targets[-1:] if self.pursuit.settles else self.targets

    def awaited(self, memory: int) -> Mask:
        """Return the poses of the targets that the robot may have to reach next."""
        return reduce(or_, (self.targets[k] for k in bits(self.pursuit.awaited(memory))), 0)

    def reached(self, pose: int) -> int:
        """Return, as a mask, the targets that contain a pose."""
        return sum(1 << k for k, target in enumerate(self.targets) if target >> pose & 1)

    def kept(self, pose: int) -> int:
        """Return, as a mask, the targets that a stay in a pose meets, without goals about steps."""
        goals = self.graph.stays or self.targets
        return sum(1 << k for k, goal in enumerate(goals) if goal >> pose & 1)


def pace_on(world: RegionMap, robot: model.Robot) -> Pace:
    """Return the durations of a robot's steps from its start at time 0."""
    figures, ticks = robot.model.figures, robot.model.timing
    side = SIDE if world.frame is None else world.frame.resolution
    return pace_of(figures, world.cols, side, robot.start.facing, ticks)


class Team(Struct, frozen=True, eq=False, dict=True):
    scenario: model.Scenario
    members: tuple[Member, ...]
    obstacles: tuple[Obstacle, ...]

    @property
    def world(self) -> RegionMap:
        return self.scenario.map

    @cached_property
    def numbers(self) -> dict[str, tuple[int, ...]]:
        """The indices of the obstacles of each name. An obstacle that returns has several."""
        found: dict[str, tuple[int, ...]] = {}
        for k, each in enumerate(self.obstacles):
            found[each.name] = (*found.get(each.name, ()), k)
        return found

    @property
    def live(self) -> bool:
        return self.scenario.clock is model.Clock.LIVE

    @cached_property
    def rounds(self) -> int:
        return self.scenario.until.rounds

    @cached_property
    def size(self) -> int:
        return self.scenario.map.size

    @cached_property
    def crowds(self) -> tuple[frozenset[int] | None, ...]:
        """For each robot, it and its rivals if all are rivals of each other, else None."""
        whole = [member.rivals | {i} for i, member in enumerate(self.members)]
        return tuple(each if all(whole[j] == each for j in each) else None for each in whole)

    @cached_property
    def worksites(self) -> Mask:
        """The regions in which actions can change obstacles."""
        return reduce(or_, (need.regions for each in self.obstacles for need in each.needs), 0)

    @cached_property
    def sharing(self) -> tuple[int, ...]:
        """The robots that joint plans drive."""
        return tuple(i for i, member in enumerate(self.members) if member.planned)

    @cached_property
    def lone(self) -> tuple[int, ...]:
        """The robots that their own strategies drive."""
        return tuple(i for i, member in enumerate(self.members) if not member.planned)

    @cached_property
    def charged(self) -> tuple[int, ...]:
        """The robots that have a battery."""
        return tuple(i for i, member in enumerate(self.members) if member.energy is not None)

    @cached_property
    def step_times(self) -> tuple[float, ...]:
        """The duration of each robot's step in ticks. In a live run, the mean seconds of a straight
        step and one with a quarter turn."""
        if not self.live:
            return tuple(member.ticks for member in self.members)
        return tuple(sum(times) / 2 for times in self._step_times)

    @cached_property
    def turning(self) -> frozenset[int]:
        """The robots whose steps take longer with a turn."""
        times = enumerate(self._step_times if self.live else ())
        return frozenset(i for i, (straight, turned) in times if turned > straight)

    @cached_property
    def _step_times(self) -> tuple[tuple[float, float], ...]:
        """For each robot, the seconds of a straight step and of one with a quarter turn."""
        found = []
        for member in self.members:
            pace, times = pace_on(self.world, member.robot), []
            for facing in ("east", "north"):
                pace.placed(0, facing)
                times.append(pace.step(0, 0, 1))
            found.append((times[0], times[1]))
        return tuple(found)

    @cached_property
    def step_ticks(self) -> tuple[int, ...]:
        """The times of ``step_times``, rounded up, for the use of charge."""
        return tuple(map(ceil, self.step_times))

    @cached_property
    def act_times(self) -> tuple[float, ...]:
        """For each robot, the maximum seconds of an action in a live run, including the halt and
        turn."""
        found = []
        for member in self.members:
            pace = pace_on(self.world, member.robot)
            pace.placed(0, "west")
            pace.arrived(0)
            found.append(acted_by([(pace, 0)], 0, 1))  # the obstacle may be behind it
        return tuple(found)

    @cached_method
    def spaces(self, i: int, region: int) -> dict[object, frozenset[int]]:
        """Return a region and the zones that contain it, each with the robots that must not be in
        it together with robot i."""
        found: dict[object, frozenset[int]] = {region: self.members[i].rivals}
        for others, regions in self.members[i].zones:
            if regions >> region & 1:
                found[others | {i}, regions] = others
        return found

    def assignable(self, i: int) -> bool:
        """Return whether a robot keeps one strategy, and receives commands as its inputs."""
        return self.scenario.coordination is Coordination.ASSIGNABLE and not self.members[i].planned

    @cached_property
    def objectives(self) -> tuple[Objective, ...]:
        return tuple(member.objective for member in self.members)


def team_of(scenario: model.Scenario) -> Team:
    """Return the team of a scenario."""
    members = tuple(_member(scenario, robot, robot.start) for robot in scenario.robots)
    obstacles = (_obstacle(each, members, scenario) for each in scenario.obstacles)
    return Team(scenario, members, tuple(obstacles))


def _member(
    scenario: model.Scenario,
    robot: model.Robot,
    base: Pose,
    *,
    remember: bool = True,
    on: frozenset[str] | None = None,
) -> Member:
    """Return a robot of a scenario, perhaps with another objective. ``remember``: whether its
    states in joint plans include the memory of its formulas; ``on``: the inputs of the formulas
    that are on (None: unknown)."""
    every, name = [*enumerate(scenario.robots)], robot.name
    rivals = frozenset(k for k, o in every if o.name != name and robot.conflicts(o))
    near = ((each, each.robots - {name}) for each in scenario.never_together if name in each.robots)
    apart = ((z, frozenset(k for k, o in every if o.name in others)) for z, others in near)
    # Rivals never share a region, so an entry with one region adds nothing.
    zones = tuple((o, region_mask(z.regions)) for z, o in apart if len(z.regions) > 1 or o - rivals)
    objective, battery, energy = robot.objective, robot.model.battery, None
    planned = bool(rivals or zones or battery)
    graph = graph_of(robot, scenario.map, shared=planned and remember, on=on)
    floor, goals = graph.outside(objective.avoid), targets_of(objective, graph, on=on)
    if battery is not None:
        targets, chargers = graph.on_each(objective.targets), graph.on(scenario.chargers)
        energy = Energy(graph, chargers, battery, targets, objective.settles, bool(robot.when))
        if objective.settles and robot.capabilities:  # others may request its help there
            ready = replace(energy, returns=True)
            energy = ready if ready.need(floor, graph.number(base), 0) < NEVER else energy
    how = objective.pursuit, rivals, zones, base
    return Member(name, robot, graph, floor, goals, *how, energy)


@lru_cache(maxsize=16)
def hearing(team: Team, on: frozenset[str]) -> Team:
    """Return the team as if exactly these inputs of formulas were always on."""
    named = (m.objective.formulas for m in team.members if m.planned)
    if not any(formulas is not None and formulas.inputs for formulas in named):
        return team
    pairs = ((member.robot, member.base) for member in team.members)
    members = tuple(_member(team.scenario, *pair, on=on) for pair in pairs)
    return replace(team, members=members)


@lru_cache(maxsize=16)
def _posed(team: Team) -> Team:
    """Return the team without the memory of formulas. Decisions about obstacles ignore it."""
    if not any(member.graph.remembers for member in team.members):
        return team
    pairs = ((member.robot, member.base) for member in team.members)
    members = tuple(_member(team.scenario, *pair, remember=False) for pair in pairs)
    return replace(team, members=members)


def without_memory(team: Team, state: State) -> tuple[Team, State]:
    """Return the team and its state without the memory of formulas."""
    plain = _posed(team)
    if plain is team:
        return team, state
    robots = []
    for robot, member in zip(state.robots, plain.members, strict=True):
        poses = member.graph.size * member.graph.blocks
        to = None if robot.to is None else robot.to % poses
        robots.append(replace(robot, pose=robot.pose % poses, to=to))
    return plain, replace(state, robots=tuple(robots))


def introduced(team: Team, source: model.Obstacle, battery_of: int | None = None) -> Team:
    """Return the team with an additional obstacle that the scenario does not list."""
    new = _obstacle(source, team.members, team.scenario, battery_of)
    return replace(team, obstacles=(*team.obstacles, new))


def assigned(team: Team, i: int, objective: Objective, within: int | None) -> Team:
    """Return the team in which a robot has another own objective, with ``within`` ticks for each
    round. ``based`` then determines the robots that can deliver loads."""
    robot = replace(team.members[i].robot, objective=objective, within=within)
    new = _member(team.scenario, robot, team.members[i].base)
    return replace(team, members=(*team.members[:i], new, *team.members[i + 1 :]))


def based(team: Team, poses: Mapping[int, Pose]) -> Team:
    """Return the team with these poses as its robots' ``base``. They determine the robots that can
    deliver loads."""
    pairs = enumerate(team.members)
    members = tuple(replace(each, base=poses.get(i, each.base)) for i, each in pairs)
    obstacles = (
        replace(each, needs=tuple(_needs(each.source, members, team.scenario)))
        for each in team.obstacles
    )
    return replace(team, members=members, obstacles=tuple(obstacles))


def _obstacle(
    source: model.Obstacle,
    members: Sequence[Member],
    scenario: model.Scenario,
    battery_of: int | None = None,
) -> Obstacle:
    blocks = frozenset(i for i, member in enumerate(members) if source.blocks(member.robot))
    needs, restarts = _needs(source, members, scenario), scenario.restarts_rounds(source.name)
    about = tuple(needs), blocks, source, restarts
    return Obstacle(source.name, source.region, *about, battery_of)


def _needs(
    source: model.Obstacle, members: Sequence[Member], scenario: model.Scenario
) -> Iterator[Need]:
    listed = source.needs
    places = [source.resolution_regions(scenario.map, k) for k in range(len(listed))]
    for k, need in enumerate(listed):
        later = takewhile(lambda n: listed[n].same, range(k + 1, len(listed)))
        way = [places[n] for n in (k, *later)]
        carried = enumerate(members if len(way) > 1 and not need.same else ())
        strays = frozenset(i for i, member in carried if _cut_off(member, way, scenario))
        pairs = enumerate(members)
        closed = frozenset(i for i, member in pairs if source.closed_to(member.robot, k))
        how = need.together, need.same, len(way) > 1, model.actions_of(listed, k)
        yield Need(need.action, need.robots, region_mask(places[k]), *how, strays, closed)


def _cut_off(member: Member, places: list[tuple[int, ...]], scenario: model.Scenario) -> bool:
    """Return whether a robot can reach no region of one of ``places`` on the map. In the first, it
    takes the load, even if it otherwise avoids the region."""
    graph = plain_graph(scenario.map, member.robot.model.mobility)
    free = graph.outside(member.objective.avoid)
    there = graph.closure(1 << graph.number(member.base), free) & (free | graph.on(places[0]))
    return any(not there & graph.on(regions) for regions in places[1:])

"""Explanations of a team that needs an operator (run it, explain its end, try repairs) or of robots
without a strategy at the start.

A repair is offered only after a completed run of the repaired scenario.
"""

import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import Outcome, ResourceLimitError, SafenavError
from safenav.explain.explanation import Explanation, Repair, RepairKind
from safenav.explain.investigation import explain
from safenav.explain.repair import (
    nearest,
    offered,
    with_robots,
    without_rules,
    without_walls,
    without_words,
)
from safenav.review.foresight import Foresight, foresee
from safenav.runtime.run.mission import Mission, RunResult, first_results, uninterrupted
from safenav.scenario.model import Obstacle, Robot, RobotModel, Scenario, actions_of
from safenav.scenario.objective import Target, staying, written
from safenav.scenario.yaml.document import flow
from safenav.solve.reasons import Hindrance, Shortfall
from safenav.synthesis.slugs import Listener, Synthesizer
from safenav.trace.records import Record
from safenav.world.map import Heading, Region
from safenav.world.poses import Mobility, Pose, bits


class Missing(Struct, frozen=True):
    """The ``actions`` that one robot must have for needs of ``obstacles`` (``needs``: the index of
    the first such need of each). The needs require up to ``robots`` robots, possibly ``together``.
    ``have``, ``models``: the team's robots and the models with these actions."""

    actions: tuple[str, ...]
    robots: int
    together: bool
    obstacles: tuple[Obstacle, ...]
    needs: tuple[int, ...]
    have: tuple[str, ...]
    models: tuple[str, ...]


def missing_actions(
    scenario: Scenario, seen: Foresight, encountered: Collection[str], models: Iterable[RobotModel]
) -> tuple[Missing, ...]:
    """Return the actions that the team lacks for a minimal set of obstacles that must be resolved,
    in the scenario's order. The set has the most possible ``encountered`` ones. ``seen``: the
    scenario's foresight."""
    found: dict[tuple[str, ...], Missing] = {}
    known = tuple(models)
    for obstacle in _needed(scenario, seen, encountered):
        for number, need in enumerate(obstacle.needs):
            skills = actions_of(obstacle.needs, number)
            able = tuple(robot.name for robot in scenario.robots if skills <= robot.capabilities)
            if len(able) >= need.robots or any(
                skills < {*key} and obstacle in other.obstacles for key, other in found.items()
            ):
                continue  # enough robots, or an earlier need requires even more
            key = tuple(sorted(skills))
            having = tuple(model.name for model in known if skills <= model.capabilities)
            one = found.get(key, Missing(key, 0, False, (), (), able, having))
            new = obstacle not in one.obstacles
            found[key] = replace(
                one,
                robots=max(one.robots, need.robots),
                together=one.together or need.together,
                obstacles=(*one.obstacles, obstacle) if new else one.obstacles,
                needs=(*one.needs, number) if new else one.needs,
            )
    return tuple(found.values())


def _needed(scenario: Scenario, seen: Foresight, encountered: Collection[str]) -> list[Obstacle]:
    """Return the ``encountered`` obstacles. If robots cannot meet their objectives even from the
    start, return a minimal set of obstacles whose resolution makes this possible for all."""
    never = {each.obstacle for each in seen.lacks}
    if not seen.stuck:  # given-up obstacles may have appeared during the run
        return [o for o in scenario.obstacles if o.name in encountered]
    stays: set[str] = set()
    for name in sorted(never, key=lambda name: (name in encountered, name)):
        if not _stuck(scenario, never - stays - {name}):
            stays.add(name)
    return [o for o in scenario.obstacles if o.name in never - stays]


def _stuck(scenario: Scenario, removed: Collection[str]) -> bool:
    left = tuple(o for o in scenario.obstacles if o.name not in removed)
    return bool(foresee(replace(scenario, obstacles=left)).stuck)


SECONDS = 20.0
"""Wall time for the search for repairs, in seconds."""
RUN_SECONDS = 5.0
"""Maximum wall time of a run with a repair, in seconds."""
TRIED = 6
"""Maximum number of candidates of one kind to run."""


class TeamRepair(Struct, frozen=True):
    """A change that led to a completed run: the items and their new values, as text. ``ticks``: the
    run's ticks (live: passes); ``makespan``: the seconds of a live run."""

    kind: RepairKind
    change: tuple[tuple[str, str], ...]
    ticks: int
    makespan: float | None = None


class Postmortem(Struct, frozen=True):
    """The end of a run, with its ``stuck`` robots, the chain of reasons, and repairs. ``tried``:
    the number of runs; ``missing``: all actions that the team lacks, even for obstacles beyond the
    run."""

    result: RunResult
    stuck: tuple[str, ...]
    chain: tuple[str, ...]
    repairs: tuple[TeamRepair, ...]
    tried: int
    seconds: float
    missing: tuple[Missing, ...] = ()


def explain_run(
    scenario: Scenario, models: Mapping[str, RobotModel], synthesizer: Callable[[], Synthesizer]
) -> Postmortem:
    """Return the explanation of a scenario's run, with repairs if the run needs an operator.
    ``models``: models of robots that a repair may add."""
    begun = time.monotonic()
    mission = Mission(scenario, synthesizer())
    result = uninterrupted(mission.run())
    if result.outcome is not Outcome.OPERATOR_NEEDED:
        return Postmortem(result, (), (), (), 1, time.monotonic() - begun)
    deadline, tried = time.monotonic() + SECONDS, 1

    def completes(changed: Scenario) -> RunResult | None:
        """Return the result of a run that completes the mission in time, else None."""
        nonlocal tried
        tried += 1
        ends = min(deadline, time.monotonic() + RUN_SECONDS)
        stopped = False

        def stop_in_time(_: Record) -> None:
            nonlocal stopped
            if time.monotonic() > ends:  # 'limits: seconds' of a live run are on its own clock
                stopped = True
                played.stop()

        played = Mission(changed, synthesizer(), listeners=[stop_in_time])
        try:
            ended = played.run()
        except SafenavError:
            return None
        if not stopped:
            uninterrupted(ended)
        return ended if ended.outcome is Outcome.COMPLETED and not ended.late else None

    failed = _Failure(scenario, mission, models)
    repairs = [
        TeamRepair(repair.kind, repair.change, ended.ticks, ended.makespan)
        for kind in _KINDS
        for repair, ended in offered(kind(failed), failed.scenario, completes, TRIED, deadline)
    ]
    took = time.monotonic() - begun
    assert mission.end is not None
    stuck, links = mission.end.stuck, mission.end.links or (result.explanation,)
    return Postmortem(result, stuck, links, tuple(repairs), tried, took, failed.missing)


class _Failure:
    """A run that ended with ``operator_needed``: the input of the search for repairs."""

    def __init__(
        self, scenario: Scenario, mission: Mission, models: Mapping[str, RobotModel]
    ) -> None:
        self.scenario = scenario
        # the team's models first
        self.models = {robot.model.name: robot.model for robot in scenario.robots} | dict(models)
        seen: Foresight = foresee(scenario)
        self.reach = {name: frozenset(bits(mask)) for name, mask in seen.reach.items()}
        self.lacks = seen.lacks or mission.lacks
        encountered = [each.obstacle for each in mission.lacks]
        self.missing = missing_actions(scenario, seen, encountered, self.models.values())
        self.stuck = seen.stuck or (() if mission.end is None else mission.end.stuck)
        self.word = scenario.map.word

    def obstacle(self, lacks: Shortfall) -> Obstacle:
        return next(o for o in self.scenario.obstacles if o.name == lacks.obstacle)

    def places(self, obstacle: Obstacle, need: int) -> list[Region]:
        """Return the regions where robots can fulfil a need, then the regions beside them, without
        regions of obstacles and robots' starts."""
        world = self.scenario.map
        there = obstacle.resolution_regions(world, need)
        beside = [r for region in there for r in world.neighbours(region)]
        closed = {o.region for o in self.scenario.obstacles}
        taken = {robot.start.region for robot in self.scenario.robots}
        return [r for r in dict.fromkeys((*there, *beside)) if r not in closed | taken]

    def places_for(self, lacks: Shortfall) -> list[Region]:
        """Return the first three of the ``places`` for a never fulfilled need."""
        return self.places(self.obstacle(lacks), len(lacks.met))[:3]

    def changed(
        self, kind: RepairKind, robots: Iterable[Robot], *change: tuple[str, str]
    ) -> Repair:
        return Repair(kind, change, with_robots(self.scenario, robots))

    def without(self, wall: Region) -> Repair:
        """Return the repair that removes the wall in ``region``."""
        change = without_words([wall], self.scenario.map.label(wall))
        return Repair(RepairKind.WALL, change, without_walls(self.scenario, [wall]))


def _beside(failed: _Failure) -> list[Region]:
    """Return the walls beside the regions that the stuck robots can reach. Walls between two robots
    come first."""
    world = failed.scenario.map
    stuck = failed.stuck or [robot.name for robot in failed.scenario.robots]
    fields = [world.distances([failed.scenario.robot(name).start.region]) for name in stuck]
    ranked = []
    for wall in world.walls:
        beside = [r for r in world.neighbours(wall) if all(r in field for field in fields)]
        if beside:
            ranked.append((min(max(field[r] for field in fields) for r in beside), wall))
    return [wall for _, wall in sorted(ranked)]


def _start(model: RobotModel, region: Region, heading: Heading | None) -> Pose:
    return Pose(region, heading if model.mobility is Mobility.HEADING else None)


def _rules(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that omit rules that keep a robot from regions where it is needed."""
    helpers = (helper for lacks in failed.lacks for helper in lacks.helpers)
    for name in dict.fromkeys(h.name for h in helpers if h.hindrance is Hindrance.RULES):
        robot = failed.scenario.robot(name)
        for objective in without_rules(robot.objective):
            free = replace(robot, objective=objective)
            change = (f"robots.{name}.objective", written(objective, failed.word))
            yield failed.changed(RepairKind.OBJECTIVE, [free], change)


def _starts(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that start a robot with the missing action in a region that needs it."""
    for lacks in failed.lacks:
        for helper in lacks.helpers:
            if helper.hindrance not in (Hindrance.GATES, Hindrance.WALLS):
                continue
            robot = failed.scenario.robot(helper.name)
            for region in failed.places_for(lacks):
                moved = replace(robot, start=_start(robot.model, region, robot.start.heading))
                item = f"robots.{robot.name}.start"
                yield failed.changed(RepairKind.START, [moved], (item, failed.word(region)))


def _capabilities(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that add the missing actions to a model of the team: first all of them, then
    single ones."""
    every = {action for each in failed.missing for action in each.actions}
    wanted = [every, *({lacks.need.action} for lacks in failed.lacks)]
    for actions in (each for number, each in enumerate(wanted) if each not in wanted[:number]):
        for name in dict.fromkeys(robot.model.name for robot in failed.scenario.robots):
            team = [r for r in failed.scenario.robots if r.model.name == name]
            if actions <= team[0].capabilities:
                continue
            more = sorted({*team[0].capabilities, *actions})
            model = replace(team[0].model, capabilities=frozenset(more))
            able = [replace(robot, model=model) for robot in team]
            change = (f"catalogue.robots.{name}.capabilities", flow(more))
            yield failed.changed(RepairKind.CAPABILITY, able, change)


def _robots(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that add robots with the missing actions, which wait where these are needed:
    first a few robots for all actions, then single robots."""
    more = _covering(failed)
    for shift in range(3 if len(more) > 1 else 0):
        used, added = set[Region](), []
        for model, (obstacle, need) in more:
            free = [region for region in failed.places(obstacle, need) if region not in used]
            if free:
                added.append((model, free[min(shift, len(free) - 1)]))
                used.add(added[-1][1])
        if len(added) == len(more):
            yield _joined(failed, added)
    for lacks in failed.lacks:
        for model in failed.models.values():
            if lacks.need.action in model.capabilities:
                for region in failed.places_for(lacks):
                    yield _joined(failed, [(model, region)])


def _covering(failed: _Failure) -> list[tuple[RobotModel, tuple[Obstacle, int]]]:
    """Return models that together have all missing actions, the model with most of them first, each
    with a need that requires it. Return an empty list if an action has no model."""
    left = {each: max(1, each.robots - len(each.have)) for each in failed.missing}
    found = []
    while left:
        share = {name: [each for each in left if name in each.models] for name in failed.models}
        name = max(share, key=lambda name: len(share[name]))
        if not share[name]:
            return []
        first = share[name][0]
        found.append((failed.models[name], (first.obstacles[0], first.needs[0])))
        left = {each: count - (each in share[name]) for each, count in left.items()}
        left = {each: count for each, count in left.items() if count}
    return found


def _joined(failed: _Failure, added: Sequence[tuple[RobotModel, Region]]) -> Repair:
    """Return the repair that adds robots that stay at their starts."""
    robots, change = list(failed.scenario.robots), list[tuple[str, str]]()
    for model, region in added:
        names = {robot.name for robot in robots}
        number = next(k for k in range(1, 1000) if f"{model.name}_{k}" not in names)
        name, pose = f"{model.name}_{number}", _start(model, region, Heading.EAST)
        robot = Robot(name, model, pose, staying(frozenset({region})))
        turned = ", heading: east" if pose.heading is not None else ""
        where = f"start: {failed.word(region)}{turned}"
        objective = written(robot.objective, failed.word)
        change.append(
            (f"robots.{name}", f"{{model: {model.name}, {where}, objective: {objective}}}")
        )
        robots.append(robot)
    return Repair(RepairKind.ROBOT, tuple(change), replace(failed.scenario, robots=tuple(robots)))


def _walls(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that remove a wall: between a robot's reachable regions and its target, or
    beside robots that block each other, which can then give way."""
    world, scenario = failed.scenario.map, failed.scenario
    if not failed.lacks:
        yield from map(failed.without, _beside(failed))
        return
    wanted: list[tuple[str, Target]] = [
        (name, target) for name in failed.stuck for target in scenario.robot(name).objective.targets
    ]
    for lacks in failed.lacks:
        regions = failed.obstacle(lacks).resolution_regions(world, len(lacks.met))
        wanted += [
            (helper.name, frozenset(regions))
            for helper in lacks.helpers
            if helper.hindrance in (Hindrance.GATES, Hindrance.WALLS)
        ]
    closed = {obstacle.region for obstacle in scenario.obstacles}
    tried = set[Region]()
    for name, target in wanted:
        reach = failed.reach[name]
        if target & reach:
            continue
        around = replace(world, walls=world.walls | (closed - target))  # obstacles are walls
        beyond = {*around.distances(target)}
        for wall in sorted(world.walls - tried):
            beside = set(world.neighbours(wall))
            if beside & reach and beside & beyond - reach:
                tried.add(wall)
                yield failed.without(wall)


def _targets(failed: _Failure) -> Iterator[Repair]:
    """Yield repairs that move a target to one of its robot's nearest reachable regions."""
    world = failed.scenario.map
    for name in failed.stuck:
        robot, reach = failed.scenario.robot(name), failed.reach[name]
        targets = list(robot.objective.targets)
        for number, target in enumerate(targets):
            others = set().union(*(t for k, t in enumerate(targets) if k != number))
            if target & reach and failed.lacks:
                continue
            for region in nearest(min(target), reach - others - target, world)[:3]:
                moved = [*targets[:number], frozenset({region}), *targets[number + 1 :]]
                objective = robot.objective.changed(targets=tuple(moved))
                change = (f"robots.{name}.objective", written(objective, failed.word))
                moving = replace(robot, objective=objective)
                yield failed.changed(RepairKind.TARGET, [moving], change)


_KINDS: tuple[Callable[[_Failure], Iterator[Repair]], ...] = (
    _rules,
    _starts,
    _capabilities,
    _robots,
    _walls,
    _targets,
)


# Robots without a strategy at the start.

QUESTION_SECONDS = 2.0
"""Maximum wall time of each of an explanation's many syntheses, in seconds."""


def explain_team(
    scenario: Scenario,
    synthesizer: Synthesizer,
    names: Collection[str] | None = None,
    progress: Listener | None = None,
) -> Iterator[Explanation]:
    """Yield the reasons and repairs of each robot without a strategy at the start, among all robots
    or those of ``names``.

    Raises ResourceLimitError if a robot's first synthesis exceeds the limits.
    """
    limit = min(synthesizer.seconds or QUESTION_SECONDS, QUESTION_SECONDS)
    quick = Synthesizer(
        synthesizer.binary, seconds=limit, memory_mb=synthesizer.memory_mb, cache=synthesizer.cache
    )
    for name, answer in first_results(scenario, synthesizer, progress, names).items():
        if answer.realizable:
            continue

        def judge(changed: Scenario, name: str = name) -> bool:
            try:
                answers = first_results(changed, quick, names=[name])
            except ResourceLimitError:
                return False
            return answers[name].realizable

        yield explain(scenario, answer.task, quick, judge)

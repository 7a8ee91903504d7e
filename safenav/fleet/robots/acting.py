"""Actions of a fleet: the robots that take part in each need of an obstacle, and the meaning of
their answers.

If several robots lift a crate together, the service of each is called, and all must succeed. Once a
need is fulfilled, the obstacle's next need applies.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct, field

from safenav.fleet.file import FleetFile, Station
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.floor import Floor, Stages, floor_of
from safenav.team.state import Stage
from safenav.team.team import introduced, team_of
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region

WORST = (ActResult.DONE, ActResult.UNTRAVERSABLE, ActResult.NOTHING, ActResult.FAILED)
"""Results of a group in ascending order: the worst one counts."""
GOOD = frozenset({ActResult.DONE, ActResult.UNTRAVERSABLE})


def unserved(scenario: Scenario, fleet: FleetFile) -> Iterator[str]:
    """Yield warnings: actions that a named obstacle needs and a robot has, but without a service;
    services for actions that no robot has."""
    named = [*scenario.obstacles, *(fleet.simulation.obstacles or ())]
    types = {obstacle.type.name: obstacle.type for obstacle in named}
    for station in fleet.stations.values():
        if station.scan is not None:
            types[station.scan.obstacle] = scenario.catalogue.obstacles[station.scan.obstacle]
    for robot in scenario.robots:
        for kind in types.values():
            needed = {need.action for need in kind.needs} & {*robot.capabilities}
            for action in sorted(needed - fleet.stations[robot.name].act.keys()):
                yield (
                    f"{robot.name} has no service for '{action}', which a {kind.name} needs; add "
                    f"'act: {{{action}: SERVICE}}' to it in the fleet file"
                )
    all_actions = {action for robot in scenario.robots for action in robot.capabilities}
    services = {action for station in fleet.stations.values() for action in station.act}
    for action in sorted(services - all_actions):
        yield f"the fleet file has a service for '{action}', which no robot can perform"


class FleetProgress:
    """Progress in resolving the obstacles that a fleet knows, by the team's model."""

    def __init__(self, scenario: Scenario) -> None:
        self._team = team_of(scenario)
        self._stages: dict[str, Stage] = {}

    def need(self, obstacle: Obstacle) -> int:
        """Return the number of an obstacle's next need."""
        return self._stage(obstacle).need

    def forget(self, obstacle: Obstacle) -> None:
        """Discard the progress on an obstacle that is resolved or gone. Other work in its region,
        such as a second parcel, is unchanged."""
        self._stages.pop(obstacle.name, None)

    def group(
        self, obstacle: Obstacle, robot: Robot, idle: Mapping[str, Region]
    ) -> tuple[str, ...]:
        """Return the robots that fulfil the next need of an obstacle now, if this one is among
        them."""
        floor, stages = self._floor(obstacle)
        if not floor.open(stages):
            return ()
        need, members = floor.need(0, stages), self._team.members
        there = [
            members[i].name
            for i in floor.able(0, stages)
            if (region := idle.get(members[i].name)) is not None and need.regions >> region & 1
        ]
        if robot.name not in there:
            return ()
        if not need.together:
            return (robot.name,)
        return tuple(there) if len(there) >= need.robots else ()

    def meet(self, obstacle: Obstacle, robot: Robot, idle: Mapping[str, Region]) -> bool:
        """Record that the robot has done its part; return whether the obstacle is then resolved."""
        floor, stages = self._floor(obstacle)
        names = self.group(obstacle, robot, idle)
        group = [i for i, member in enumerate(self._team.members) if member.name in names]
        (stage,) = floor.took_part(0, stages, group)
        self._stages[obstacle.name] = stage
        return not floor.open((stage,))

    def _stage(self, obstacle: Obstacle) -> Stage:
        return self._stages.setdefault(obstacle.name, Stage())

    def _floor(self, obstacle: Obstacle) -> tuple[Floor, Stages]:
        """The floor with this obstacle alone, and its stage."""
        if obstacle not in (each.source for each in self._team.obstacles):
            self._team = introduced(self._team, obstacle)
        sources = [each.source for each in self._team.obstacles]
        floor = floor_of(self._team, (sources.index(obstacle),), frozenset(), frozenset())
        return floor, (self._stage(obstacle),)


class TeamAction(Struct):
    """One command to act. ``on``: the obstacle of the present action; ``team``: the answers of its
    participants; ``advanced``: obstacles with a need fulfilled, but not the last one; ``reasons``:
    reasons of failed parts; ``need``: the need that the action must fulfil."""

    robot: Robot
    obstacles: Sequence[Obstacle]
    progress: FleetProgress
    results: dict[str, ActResult] = field(default_factory=dict)
    on: Obstacle | None = None
    team: dict[str, ActResult | None] = field(default_factory=dict)
    advanced: set[str] = field(default_factory=set)
    reasons: list[str] = field(default_factory=list)
    need: int = 0

    def next(self, idle: Mapping[str, Region], stations: Mapping[str, Station]) -> dict[str, str]:
        """Return the service to call for each participant of the next action, which sets ``on``;
        empty if none is left. ``idle``: regions of robots without another command."""
        self.on, self.team = None, {}
        for obstacle in self.obstacles:
            group = self.progress.group(obstacle, self.robot, idle)
            if obstacle.name in self.results or (obstacle.name in self.advanced and not group):
                continue
            self.need = self.progress.need(obstacle)
            action = obstacle.needs[self.need].action
            names = group or (self.robot.name,)
            if all(action in stations[name].act for name in names):
                self.on, self.team = obstacle, dict.fromkeys(names)
                return {name: stations[name].act[action] for name in names}
            self.results[obstacle.name] = ActResult.FAILED
            self.reasons.append(f"no service for {action!r} in the fleet file")
        return {}

    def answer(
        self, robot: str, result: ActResult, idle: Mapping[str, Region], reason: str = ""
    ) -> bool:
        """Record the answer of a participant; return whether all have answered."""
        if robot not in self.team or self.team[robot] is not None or self.on is None:
            return False
        self.team[robot] = result
        if reason and result is ActResult.FAILED:
            self.reasons.append(reason if robot == self.robot.name else f"{robot}: {reason}")
        answers = [answer for answer in self.team.values() if answer is not None]
        if len(answers) < len(self.team):
            return False
        worst, obstacle = max(answers, key=WORST.index), self.on
        if self.progress.need(obstacle) != self.need:  # other robots were faster
            self.advanced.add(obstacle.name)
            return True
        more = worst in GOOD and bool(self.progress.group(obstacle, self.robot, idle))
        if more and not self.progress.meet(obstacle, self.robot, idle):
            self.advanced.add(obstacle.name)
        else:
            self.results[obstacle.name] = worst
        return True

    @property
    def resolved(self) -> Obstacle | None:
        """Return the obstacle that the last answers have resolved; None if it is still present."""
        gone = self.on is not None and self.results.get(self.on.name, ActResult.FAILED)
        return self.on if self.on is not None and gone is not ActResult.FAILED else None

    @property
    def silent(self) -> list[str]:
        """Return the participants that have not answered."""
        return [name for name, answer in self.team.items() if answer is None]

    @property
    def found(self) -> list[tuple[Obstacle, ActResult]]:
        return [(o, self.results[o.name]) for o in self.obstacles if o.name in self.results]

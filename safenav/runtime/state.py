"""The state of a running mission, shared by the parts of the coordination layer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from safenav.runtime.beliefs import Beliefs
from safenav.runtime.environment import Characterization, World
from safenav.runtime.navigation import Planner
from safenav.runtime.tasks import Assignment, TaskStack
from safenav.scenario.model import Coordination, Obstacle, Robot, Scenario
from safenav.spec.assignable import own_objective
from safenav.spec.others.tracking import Sightings
from safenav.spec.task import Task
from safenav.trace import records
from safenav.trace.header import objective_in_trace, obstacle_header
from safenav.trace.objective import Objective
from safenav.trace.writing import Listener
from safenav.world.map import Region
from safenav.world.moves import Pose


@dataclass(frozen=True)
class Transit:
    """A step that takes several ticks: until it ``arrives`` the robot occupies both the region
    that it leaves and the one that it goes to."""

    pose: Pose
    arrives: int


@dataclass
class TeamState:
    """Where everybody is, what they do, what is known, and who listens.

    ``poses`` are where robots stand; one that is in transit still stands where it set out.
    """

    scenario: Scenario
    poses: dict[str, Pose]
    tasks: TaskStack
    knowledge: Characterization
    listeners: tuple[Listener, ...] = ()
    planners: dict[str, Planner] = field(default_factory=dict)
    transits: dict[str, Transit] = field(default_factory=dict)
    beliefs: Beliefs = field(default_factory=Beliefs)
    introduced: set[str] = field(default_factory=set)
    tick: int = 0

    @classmethod
    def initial(
        cls, scenario: Scenario, world: World, listeners: Iterable[Listener] = ()
    ) -> TeamState:
        """Everybody at the start with the objective that the scenario gives."""
        return cls(
            scenario,
            {robot.name: robot.start for robot in scenario.robots},
            TaskStack({r.name: Assignment.own(r.objective) for r in scenario.robots}),
            Characterization(world),
            tuple(listeners),
        )

    def emit(self, event: records.Record) -> None:
        for listener in self.listeners:
            listener(event)

    def introduce(self, obstacle: Obstacle) -> None:
        """Tell of an obstacle that was met, if the scenario does not list it."""
        listed = {known.name for known in self.scenario.obstacles}
        if obstacle.name not in listed | self.introduced:
            self.introduced.add(obstacle.name)
            self.emit(records.Discovered(self.tick, obstacle_header(obstacle, self.scenario)))

    def region(self, robot: Robot) -> Region:
        return self.poses[robot.name].region

    def next_pose(self, robot: Robot) -> Pose:
        """Where the robot can next decide anything: where it stands, or where it arrives."""
        transit = self.transits.get(robot.name)
        return self.poses[robot.name] if transit is None else transit.pose

    def occupied(self, robot: Robot) -> frozenset[Region]:
        """The regions that ``robot`` takes up now: two while it is in transit."""
        return frozenset({self.region(robot), self.next_pose(robot).region})

    def sightings(
        self, robot: Robot, task: Task, closed: frozenset[Region] = frozenset()
    ) -> Sightings:
        """What ``robot`` can observe of those that its task is about; regions that are
        ``closed`` to it for now count as taken. Those who wait are not among them: they are
        obstacles of the task. To be asked once a turn: it takes a look."""
        here = self.region(robot)
        positions = {o.name: self.poses[o.name].region for o in task.observed}
        known = self.beliefs.look(task, self.scenario.map, here, positions)
        moving = [self.scenario.robot(o.name) for o in task.observed if o.danger]
        taken: set[Region] = set().union(*(self.occupied(other) for other in moving))
        sides = set(self.scenario.map.neighbours(here))
        # A specification counts on no more busy sides than there are others (spec.nearby).
        room = len(moving) - len(sides & taken)
        taken |= set(sorted(closed - taken)[: max(0, room)])
        return Sightings(here, frozenset(taken), positions, known)

    def objectives(self) -> dict[str, Objective]:
        """The objectives in force, as in a trace."""
        return {name: objective_in_trace(a.objective) for name, a in self.tasks.current.items()}


def with_alternation(scenario: Scenario) -> Scenario:
    """The scenario as it is played: with assignable goals a patrol is plain alternation."""
    if scenario.coordination is not Coordination.ASSIGNABLE:
        return scenario
    robots = tuple(replace(r, objective=own_objective(r.objective)) for r in scenario.robots)
    return replace(scenario, robots=robots)

"""The state of a running mission, shared by the parts of the coordination layer."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from safenav.runtime.environment import Characterization, World
from safenav.runtime.events import Event
from safenav.runtime.navigation import Planner
from safenav.runtime.tasks import Assignment, TaskStack
from safenav.runtime.trace import Listener
from safenav.scenario.model import Robot, Scenario
from safenav.scenario.objective import to_data
from safenav.world.map import Region
from safenav.world.mobility import Pose


@dataclass
class TeamState:
    """Where everybody is, what they do, what is known, and who listens."""

    scenario: Scenario
    poses: dict[str, Pose]
    tasks: TaskStack
    knowledge: Characterization
    listeners: tuple[Listener, ...] = ()
    planners: dict[str, Planner] = field(default_factory=dict)
    tick: int = 0

    @classmethod
    def initial(
        cls, scenario: Scenario, world: World, listeners: Iterable[Listener] = ()
    ) -> TeamState:
        """Everybody at the start with the objective that the scenario gives."""
        return cls(
            scenario,
            {robot.name: robot.start for robot in scenario.robots},
            TaskStack({r.name: Assignment.of(r.objective) for r in scenario.robots}),
            Characterization(world),
            tuple(listeners),
        )

    def emit(self, event: Event) -> None:
        for listener in self.listeners:
            listener(event)

    def region(self, robot: Robot) -> Region:
        return self.poses[robot.name].region

    def objectives(self) -> dict[str, dict[str, object]]:
        """The objectives in force, as in a trace."""
        return {name: to_data(a.objective) for name, a in self.tasks.current.items()}

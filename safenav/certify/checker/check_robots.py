"""A robot in the run of a bundle: its pose, and its possible strategy nodes."""

from __future__ import annotations

from typing import Any

from safenav.audit.language import Pose
from safenav.audit.run.situation import Situation
from safenav.certify.checker.check_objectives import Objective
from safenav.certify.checker.check_strategies import Json


class Robot:
    """A robot and its strategy at a moment of the run. ``data``: its entry in the header."""

    def __init__(self, name: str, data: Json, now: Situation) -> None:
        self.name, self.data, self.now = name, data, now
        self.own = self.objective = Objective(data["objective"])  # the latter: in force
        self.task: Any = None
        self.nodes, self.came_from = set[int](), set[int]()  # possible nodes, now and before
        self.answers: set[int] | None = None  # successors in its last turn
        self.row: tuple[Any, ...] = ()  # the inputs of these successors
        self.knowledge, self.signal = dict[str, int](), dict[str, Any]()  # its last inputs
        self.forms = set[str]()  # forms in which its own objective was proven

    @property
    def pose(self) -> Pose:
        return self.now.region[self.name], self.now.heading[self.name]

    @property
    def destination(self) -> Pose:
        """The pose at the end of its step if it is in transit, otherwise its pose."""
        return self.now.pose(self.name)

    @property
    def heard(self) -> dict[str, int]:
        """The inputs of the environment."""
        return {name: int(on) for name, on in self.now.inputs.items()}

    def near(self, other: Robot) -> set[int]:
        """Return the regions that another robot must not enter because of this one."""
        places = self.now.taken_by(self.name)
        zones = [zone for zone in self.now.zones(self.name, other.name) if zone & places]
        own = places if self.now.conflict(self.name, other.name) else set[int]()
        return own.union(*zones)

    def nodes_in(self, pose: Pose) -> set[int]:
        """Return the nodes of its strategy with a pose."""
        return set(self.task.of_pose.get(pose, ())) if self.task else set()

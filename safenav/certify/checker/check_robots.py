"""A robot in the run of a bundle: where it is, and where in its strategy it may be."""

from __future__ import annotations

from typing import Any

from safenav.audit.language import Pose
from safenav.audit.run.situation import Situation
from safenav.certify.checker.check_objectives import Objective
from safenav.certify.checker.check_strategies import Json


class Robot:
    """The strategy of a robot at some moment; ``data``: as the header has it."""

    def __init__(self, name: str, data: Json, now: Situation) -> None:
        self.name, self.data, self.now = name, data, now
        self.own = self.objective = Objective(data["objective"])  # its own, and the one in force
        self.task: Any = None
        self.nodes, self.came_from = set[int](), set[int]()  # where its strategy may be, and was
        self.answers: set[int] | None = None  # of its strategy, in its last turn
        self.row: tuple[Any, ...] = ()  # the inputs by which it answered
        self.knowledge, self.signal = dict[str, int](), dict[str, Any]()  # its last inputs
        self.forms = set[str]()  # in which its own objective was proven, "plan" if it was moved

    @property
    def pose(self) -> Pose:
        return self.now.region[self.name], self.now.heading[self.name]

    @property
    def destination(self) -> Pose:
        """The end of its step, if it is in transit."""
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

"""The input of one synthesis: everything that a robot's specification depends on."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from safenav.scenario.model import Robot, Tracking
from safenav.scenario.objective import Objective, Target
from safenav.scenario.settings import Input
from safenav.spec.objective import NO_MEMORY, Memory
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.partition import Partition


class Fairness(StrEnum):
    """A robot's assumption about the robots that it must avoid, without which it may be stuck; from
    weakest to strongest."""

    NONE = "none"
    OFF_MY_TARGETS = "off_my_targets"
    OUT_OF_MY_WAY = "out_of_my_way"
    OUT_OF_MY_SIGHT = "out_of_my_sight"
    AT_ITS_TARGETS = "at_its_targets"


FAIRNESS_ORDER: dict[Tracking, tuple[Fairness, ...]] = {
    Tracking.NEARBY: (Fairness.NONE, Fairness.OUT_OF_MY_WAY),
    Tracking.EXACT: tuple(each for each in Fairness if each is not Fairness.OUT_OF_MY_SIGHT),
    Tracking.BELIEF: tuple(Fairness),
}
"""The possible assumptions for each model of other robots, from weakest to strongest."""


class Known(Struct, frozen=True):
    """A region that cannot be entered now, and the scenario item that is the reason."""

    region: Region
    item: str
    reason: str


class Observed(Struct, frozen=True):
    """Another robot whose position matters: where it is, and the targets of its objective.

    ``danger``: the robot must not collide with it (else it only tracks it). ``belief``: the cells
    that may hold it, if it is out of sight (see ``spec.other_robots.belief``).
    """

    name: str
    region: Region
    targets: tuple[Target, ...] = ()
    danger: bool = True
    belief: frozenset[int] | None = None

    @property
    def variable(self) -> str:
        return f"at_{self.name}"


class Task(Struct, frozen=True):
    """Complete input of one robot's specification.

    ``blocked``: known obstacles (O beyond the walls) that block this robot. ``observed``: the
    moving robots with which it must not collide, modelled by ``tracking`` under the assumption
    ``fairness``. For beliefs: the ``partition`` of the map (None for its rooms), and the ``closed``
    regions, whose obstacles block the view. ``assignable``: goals can be assigned at runtime.
    ``forbidden``: poses from which the team could not continue. ``exclusive``: one other robot can
    close many regions to it (``never_together``). ``inputs``: the
    objective's inputs with their present values. ``live``: other robots may move any distance
    between two observations.
    """

    robot: Robot
    pose: Pose
    objective: Objective
    memory: Memory = NO_MEMORY
    blocked: tuple[Known, ...] = ()
    observed: tuple[Observed, ...] = ()
    tracking: Tracking = Tracking.NEARBY
    fairness: Fairness = Fairness.NONE
    partition: Partition | None = None
    closed: frozenset[Region] = frozenset()
    assignable: bool = False
    forbidden: frozenset[Pose] = frozenset()
    exclusive: bool = False
    inputs: tuple[tuple[Input, bool], ...] = ()
    live: bool = False

    @property
    def targets(self) -> tuple[Target, ...]:
        return self.objective.targets

    @property
    def endangered(self) -> bool:
        """Whether the robot could collide with another one."""
        return any(other.danger for other in self.observed)

    @property
    def item(self) -> str:
        """The scenario item of the robot, for origins."""
        return f"robots.{self.robot.name}"

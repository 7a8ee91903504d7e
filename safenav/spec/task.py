"""The input of one synthesis: everything that a robot's specification depends on."""

from __future__ import annotations

from msgspec import Struct

from safenav.scenario.model import Robot
from safenav.scenario.objective import Objective, Target
from safenav.scenario.settings import Input
from safenav.spec.objective import NO_MEMORY, Memory
from safenav.world.map import Region
from safenav.world.partition import Partition
from safenav.world.poses import Pose


class Known(Struct, frozen=True):
    """A region that cannot be entered now, and the scenario item that is the reason."""

    region: Region
    item: str
    reason: str


class Observed(Struct, frozen=True):
    """Another robot that a robot tracks, and where it is. ``belief``: the cells that may hold it,
    if it is out of sight (see ``spec.belief``)."""

    name: str
    region: Region
    belief: frozenset[int] | None = None

    @property
    def variable(self) -> str:
        return f"at_{self.name}"


class Task(Struct, frozen=True):
    """Complete input of one robot's specification.

    ``blocked``: known obstacles (O beyond the walls) that block this robot. ``observed``: the
    robots that it tracks, by beliefs: with the ``partition`` of the map (None
    for its rooms), and the ``closed`` regions, whose obstacles block the view. ``avoids``: names of
    robots with which it must not collide (``synth --avoiding``; in a run joint plans drive these).
    ``assignable``: goals can be assigned at runtime. ``forbidden``: poses from which the team could
    not continue. ``inputs``: the objective's inputs with their present values. ``live``: other
    robots may move any distance between two observations.
    """

    robot: Robot
    pose: Pose
    objective: Objective
    memory: Memory = NO_MEMORY
    blocked: tuple[Known, ...] = ()
    observed: tuple[Observed, ...] = ()
    partition: Partition | None = None
    closed: frozenset[Region] = frozenset()
    assignable: bool = False
    forbidden: frozenset[Pose] = frozenset()
    inputs: tuple[tuple[Input, bool], ...] = ()
    live: bool = False
    avoids: tuple[str, ...] = ()

    @property
    def targets(self) -> tuple[Target, ...]:
        return self.objective.targets

    @property
    def item(self) -> str:
        """The scenario item of the robot, for origins."""
        return f"robots.{self.robot.name}"

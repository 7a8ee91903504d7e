"""Knowledge of robots about each other during a run: a seen region, or a belief.

Each look, one per turn, updates it with the function that also derives the specifications
(``safenav.spec.other_robots.knowledge``), so a strategy observes exactly what it was synthesized
for.
"""

from __future__ import annotations

from collections.abc import Mapping

from safenav.scenario.model import Tracking
from safenav.spec.other_robots.belief import known_of, watch_for
from safenav.spec.other_robots.knowledge import Knowledge, Tracker
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap


def after_look(watch: Tracker, own: Region, other: Region, knowledge: Knowledge) -> Knowledge:
    """Return the knowledge after a look from region ``own`` while the other is in ``other``;
    ``knowledge`` is from the look before.

    The other's region only decides whether it is seen. If it is not seen although every region that
    it can have reached is in sight, the belief is all cells.
    """
    if watch.visibility.sees(own, other):
        return other
    belief = watch.update(own, knowledge).belief
    return frozenset(range(len(watch.partition.cells))) if belief is None else belief


class Beliefs:
    """The knowledge of every robot of a team about the robots in its task."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str], Knowledge] = {}

    def of(self, robot: str, other: str, reported: Knowledge) -> Knowledge:
        """Return the knowledge of ``robot`` about ``other``, or ``told`` if there is none yet: the
        start of the mission is known, and a waiting robot reports its region."""
        return self._known.get((robot, other), reported)

    def look(
        self, task: Task, world: RegionMap, own: Region, positions: Mapping[str, Region]
    ) -> dict[str, Knowledge]:
        """Update a robot's knowledge by a look from region ``own``, once per turn before it moves.
        Return the knowledge by the other robots' names."""
        if task.tracking is not Tracking.BELIEF:
            return {}
        robot, watch = task.robot.name, watch_for(task, world)
        known = {
            other.name: after_look(
                watch, own, positions[other.name], self.of(robot, other.name, known_of(other))
            )
            for other in task.observed
        }
        for pair in [pair for pair in self._known if pair[0] == robot]:
            del self._known[pair]
        self._known |= {(robot, other): knowledge for other, knowledge in known.items()}
        return known

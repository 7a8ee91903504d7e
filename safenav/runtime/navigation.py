"""Navigation planner (NP): a robot's automaton in execution.

Given what the robot observes it proposes the automaton's next state; asked to replan, it goes
back to the state before and offers what else could be done from there (paper, Section V-B).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from safenav.runtime.tasks import Assignment
from safenav.spec.assignable import Switch
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Heading
from safenav.world.moves import Mobility, Pose


@dataclass(frozen=True)
class Proposal:
    """A next pose; ``node`` is the automaton's state after it, None off the automaton."""

    pose: Pose
    node: int | None


class Planner:
    """One robot's strategy and where in it the robot is.

    ``begun``: whether the progress of its assignment has been counted from here on.
    ``before``: the values before a step that is still under way. ``switch`` steers it where
    goals are assignable.
    """

    def __init__(self, task: Task, strategy: Strategy, assignment: Assignment, node: int) -> None:
        self.task = task
        self.assignment = assignment
        self.strategy = strategy
        self.node: int | None = node
        self.begun = False
        self.before: Mapping[str, int] = {}
        self.switch: Switch | None = None

    @classmethod
    def start(cls, task: Task, strategy: Strategy, assignment: Assignment) -> Planner:
        """Begin at the initial node of the pose that the task was synthesized for.

        Raises KeyError if the strategy has no such node (it is not for this task).
        """
        values = {"region": task.pose.region}
        if task.robot.model.mobility is Mobility.HEADING and task.pose.heading is not None:
            values["heading"] = int(task.pose.heading)
        node = strategy.find_initial(values)
        if node is None:
            raise KeyError(f"no initial node for {values}")
        return cls(task, strategy, assignment, node)

    def values(self) -> dict[str, int]:
        """The variables of the specification now; empty off the automaton."""
        return {} if self.node is None else self.strategy.values(self.node)

    def propose(self, observed: Mapping[str, int]) -> Proposal | None:
        """The strategy's answer to the observed inputs.

        None when it has none: the others did what the assumptions exclude, or the robot left
        the automaton when it backtracked and was not resynthesized.
        """
        return next(self._successors(observed), None)

    def alternatives(
        self, pose: Pose, observed: Mapping[str, int], refused: Proposal
    ) -> list[Proposal]:
        """What else can be done from the state before ``refused``: the automaton's other
        successors for the same inputs, and last the mobility's stay, which leaves the
        automaton and is safe whatever the others do."""
        others = [p for p in self._successors(observed) if p.pose.region != refused.pose.region]
        if self.switch is not None:
            others += self._successors({**observed, **self.switch.stop()})
        return [*others, Proposal(pose, None)]

    def follow(self, proposal: Proposal) -> None:
        """The proposal was carried out."""
        self.node = proposal.node

    def _successors(self, observed: Mapping[str, int]) -> Iterator[Proposal]:
        if self.node is None:
            return
        for node in self.strategy.successors_for(self.node, observed):
            yield Proposal(self._pose(self.strategy.values(node)), node)

    def _pose(self, values: Mapping[str, int]) -> Pose:
        if "heading" in values:
            return Pose(values["region"], Heading(values["heading"]))
        return Pose(values["region"])

"""Navigation planner (NP): a robot's automaton in execution.

Given the robot's observation it proposes the automaton's next state; on a request to replan, it
returns to the previous state and offers the alternatives there (paper, Section V-B).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.runtime.progress import Progress
from safenav.scenario.guarantees import values_of
from safenav.scenario.objective import Ltl
from safenav.spec.assignable import CommandInputs
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.world.map import Heading, Region
from safenav.world.moves import Pose


class Proposal(Struct, frozen=True):
    """A next pose; ``node`` is the automaton's state after it, None off the automaton. ``answers``:
    it is the automaton's successor; otherwise robot and node stay. ``shown``: regions observed as
    occupied although no robot is there."""

    pose: Pose
    node: int | None
    answers: bool = False
    shown: frozenset[Region] = frozenset()


class Planner:
    """One robot's strategy and its current ``node``, None off the automaton. ``behind``: the node
    precedes the last observation, since the robot was held back. ``switch`` steers the strategy
    where goals are assignable.
    """

    def __init__(self, task: Task, strategy: Strategy, node: int) -> None:
        self.task = task
        self.strategy = strategy
        self.node: int | None = node
        self.behind = False
        self.switch: CommandInputs | None = None

    @classmethod
    def start(cls, task: Task, strategy: Strategy) -> Planner:
        """Begin at the initial node of the pose that the task was synthesized for.

        Raises KeyError if the strategy has no such node (it is not for this task).
        """
        values = values_of(task.pose)
        if task.assignable:
            values["wait"] = 0  # it begins without a command to wait
        node = strategy.find_initial(values)
        if node is None:
            raise KeyError(f"no initial node for {values}")
        return cls(task, strategy, node)

    def values(self) -> dict[str, int]:
        """The variables of the specification now; empty off the automaton."""
        return {} if self.node is None else self.strategy.values(self.node)

    def propose(self, observed: Mapping[str, int]) -> Proposal | None:
        """Return the strategy's successor for the observed inputs.

        None if there is no successor: the others violated an assumption, or the robot is off the
        automaton.
        """
        return next(self._successors(observed), None)

    def alternatives(
        self, pose: Pose, observed: Mapping[str, int], refused: Proposal
    ) -> list[Proposal]:
        """Return the alternatives in the state before ``refused``: the automaton's other
        successors for the same inputs, and last the mobility's stay, which keeps the node and is
        safe whatever the other robots do."""
        others = [p for p in self._successors(observed) if p.pose.region != refused.pose.region]
        if self.switch is not None:
            others += self._successors({**observed, **self.switch.stop()})
        return [*others, Proposal(pose, self.node)]

    def held_back(self, pose: Pose, observed: Mapping[str, int]) -> Proposal:
        """Return the proposal for a robot that must not move: a command to wait, or the same
        node."""
        waiting = None
        if self.switch is not None:
            waiting = self.propose({**observed, **self.switch.stop()})
        return waiting or Proposal(pose, self.node)

    def follow(self, proposal: Proposal) -> None:
        """Record that the proposal was carried out."""
        self.node = proposal.node
        self.behind = not proposal.answers

    def relocate(self, pose: Pose, progress: Progress, inputs: Mapping[str, int]) -> bool:
        """Go to a node of the automaton for a pose, the rest of an objective and remembered inputs;
        return whether there is one. The strategy meets its goals from every node, so any of them
        suffices."""
        wanted = {**values_of(pose), **inputs}
        if self.switch is not None:
            wanted["request"] = 0
        for memory in _memories(self.task, pose, progress):
            node = self.strategy.find(wanted | memory)
            if node is not None:
                self.node = node
                self.behind = False
                if self.switch is not None:
                    self.switch.forget()
                return True
        self.node = None
        return False

    def _successors(self, observed: Mapping[str, int]) -> Iterator[Proposal]:
        if self.node is None:
            return
        for node in self.strategy.successors_for(self.node, observed):
            yield Proposal(pose_of(self.strategy.values(node)), node, answers=True)


def pose_of(values: Mapping[str, int]) -> Pose:
    """The pose encoded in the variables of a specification."""
    return Pose(values["region"], Heading(values["heading"]) if "heading" in values else None)


def _memories(task: Task, pose: Pose, progress: Progress) -> Iterator[dict[str, int]]:
    """Yield the values of the memory that represent the rest of an objective."""
    objective = task.objective
    if isinstance(objective, Ltl):
        yield {name: int(value) for name, value in progress.memory.values.items()}
    elif objective.remembers:
        numbers = range(len(objective.targets))
        yield from ({objective.turn: m} for m in numbers if progress.means(m, pose.region))
    else:
        yield {}

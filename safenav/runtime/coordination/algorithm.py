"""The coordination layer: the paper's Algorithm 1, with everything that it decides derived anew.

    met, asked   a resolvable obstacle r is encountered, c_r is not in C_p: push all objectives
    settle       the requester's objective becomes safe behaviour; S_r is added to that of a robot
                 with c_r; synthesize controllers, all of them or none
    resolved     r is resolved where a robot stands: pop, back to the original objectives, settle

Source: paper, Section V and Algorithm 1; docs/coordination.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field

from safenav.dataclass import dataclass
from safenav.runtime.characterization import Violation
from safenav.runtime.coordination.announcing import Announcing
from safenav.runtime.coordination.asking import Answer, Attempt
from safenav.runtime.coordination.assigning import Assigning
from safenav.runtime.coordination.deciding import closed, decided
from safenav.runtime.coordination.ladder import Errand
from safenav.runtime.coordination.negatives import no_strategy, nobody_goes_on
from safenav.runtime.coordination.reasons import Shortfall, shortfalls
from safenav.runtime.coordination.requests import Requests
from safenav.runtime.coordination.telling import Telling
from safenav.runtime.over import Stop
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.world import Change
from safenav.scenario.model import Obstacle, Robot
from safenav.trace import vocabulary


@dataclass
class Coordinator:
    """Reassigns robots when something was learnt. ``floor`` and ``found``: the last
    decision; ``lacks``: what obstacles lack that could not be resolved at some time."""

    state: TeamState
    telling: Telling
    stop: Stop
    requests: Requests = field(default_factory=Requests)
    lacks: dict[str, Shortfall] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.tell = Announcing(self.state, self.requests)
        self.decide({})

    def met(self, violation: Violation) -> None:
        """A robot keeps out of a hidden obstacle: the team knows of it from now on, whatever the
        robot does where it stands. ``asked`` follows in its turn. An obstacle in O stays there."""
        if violation.obstacle.name in self.state.knowledge.joined:
            return
        self.state.knowledge.meet(violation.obstacle)
        self.tell.opened(violation.obstacle, violation.robot.name)

    def asked(self, violation: Violation) -> None:
        """The robot has backed up, and asks for help from where it stands now."""
        if self.requests.of(violation.obstacle.name) is not None:
            self.tell.opened(violation.obstacle, violation.robot.name)
        self.settle(vocabulary.Reason.REQUEST)

    def resolved(self, robot: Robot, found: Sequence[tuple[Obstacle, bool | None]]) -> None:
        """Obstacles were resolved where ``robot`` stands, whether or not anybody had asked for it;
        each with its truth."""
        for obstacle, traversable in found:
            self.tell.resolved(robot, obstacle, traversable)
            self.state.knowledge.forget(obstacle)
            if traversable is False:
                self.tell.joined(obstacle, vocabulary.BlockReason.UNTRAVERSABLE)
            self.requests.close(obstacle.name)
        self.state.restart_counts()
        self.settle(vocabulary.Reason.RESOLVED)

    def changed(self, change: Change) -> None:
        """An obstacle has appeared, where nobody knows it yet, or has gone by itself."""
        self.tell.changed(change)
        if change.appeared:
            self.state.knowledge.appear(change.obstacle)
            return
        known = self.state.knowledge.forget(change.obstacle)
        self.requests.close(change.obstacle.name)
        if known:
            self.settle(vocabulary.Reason.GONE)

    def settle(self, reason: vocabulary.Reason) -> None:
        """Derive duties, find strategies for those that changed, install all of them. Raises
        RunOver, with the proof, if nobody can bring it about that all go on."""
        refused: dict[tuple[str, str], Answer] = {}
        idle: set[str] = set()
        while True:
            self.seal_what_is_never_resolved()
            self.decide(refused)
            if self.found.proof is not None:
                raise nobody_goes_on(self.state, self.floor, self.found.proof, refused, self.lacks)
            errands = self.errands(idle)
            attempt = self.telling.attempt(errands)
            if not attempt.failed:
                break
            for name in attempt.failed:
                self.blame(name, errands[name], attempt, refused, idle)
        self.tell.stack(self.floor, self.found, errands, refused, self.telling.announce)
        self.telling.install(attempt, errands, reason)

    def seal_what_is_never_resolved(self) -> None:
        """What nobody can ever bring any further joins O."""
        floor, closure = closed(self.state, self.requests, self.stop)
        lacks = {each.obstacle: each for each in shortfalls(floor, closure)}
        self.lacks |= lacks
        for gate in closure.stuck:
            self.tell.never_resolved(floor, gate, closure, lacks[floor.gates[gate]])
            self.requests.close(floor.gates[gate])

    def decide(self, refused: Mapping[tuple[str, str], Answer]) -> None:
        """Who does what, as things stand."""
        self.floor, self.solver, self.found = decided(self.state, self.requests, self.stop, refused)

    def errands(self, idle: set[str]) -> dict[str, Errand]:
        """What each robot is to do; its own objective, if nothing can be decided at all."""
        if self.found.proof is not None:
            return {
                name: Errand(robot.assignment, robot.assignment.objective)
                for name, robot in self.state.robots.items()
            }
        assigning = Assigning(self.state, self.requests, self.floor, self.found, idle)
        return {name: assigning.errand(robot) for name, robot in self.state.robots.items()}

    def blame(
        self,
        name: str,
        errand: Errand,
        attempt: Attempt,
        refused: dict[tuple[str, str], Answer],
        idle: set[str],
    ) -> None:
        """A robot has no strategy: another one helps; or it waits while anything may change."""
        answer = attempt.answers[name]
        if errand.assignment.role is Role.HELPS and errand.assignment.obstacle is not None:
            refused[name, errand.assignment.obstacle] = answer
        elif errand.assignment.role is Role.OWN and self.found.duties and name not in idle:
            idle.add(name)
        else:
            raise no_strategy(self.state, self.telling, attempt)

    def resynthesize(self, robot: RobotState, reason: vocabulary.Reason) -> bool:
        """A new strategy for what a robot does already, from where it is; whether there is one."""
        errand = self.errands(set())[robot.name]
        attempt = self.telling.attempt({robot.name: errand}, always=True)
        if attempt.failed:
            return False
        self.telling.install(attempt, {robot.name: errand}, reason)
        return True

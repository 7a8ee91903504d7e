"""Monitors: every assumption and guarantee of every robot, checked at every step of a run.

A specification's formulas are evaluated on the robot's intended move and on its observations,
independently of the strategy that chose the move. A violated assumption is caused by other robots:
it is recorded, and the run continues as safely as it can. A violated guarantee is a defect, caught
before the robot moves. No finite run can show that fairness fails.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct, field

from safenav.errors import ExitCode, SafenavError
from safenav.runtime.navigation import Proposal
from safenav.runtime.progress import holds
from safenav.runtime.team import RobotState, TeamState
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.trace import records
from safenav.world.moves import Pose

Values = Mapping[str, int]


class GuaranteeError(SafenavError):
    """A strategy was about to break a guarantee of its specification."""

    exit_code = ExitCode.INTERNAL


class _Watched(Struct):
    """One robot's specification in execution. ``broken``: the assumptions that an observation
    breaks at a node; ``sound``: steps that break no guarantee."""

    spec: Specification
    broken: dict[tuple[int, tuple[int, ...]], list[Constraint]] = field(default_factory=dict)
    sound: set[tuple[int, int, tuple[int, ...]]] = field(default_factory=set)


class Monitors:
    """Monitors of a team's guarantees and assumptions."""

    def __init__(self, state: TeamState) -> None:
        self._state = state
        self._watched: dict[str, _Watched] = {}

    def broken_assumptions(self, robot: RobotState, observed: Values) -> list[Constraint]:
        """Return a robot's assumptions that the other robots violated since its last step. None are
        known for a robot that is off its automaton or was held back after its last look."""
        watched, planner = self._watched[robot.name], robot.planner
        if planner.node is None or planner.behind or not self._complete(watched.spec, observed):
            return []
        key = (planner.node, tuple(observed.values()))
        found = watched.broken.get(key)
        if found is None:
            found = list(_violated(watched.spec, Section.ENV_TRANS, planner.values(), observed))
            watched.broken[key] = found
        return found

    def watch(self, robot: RobotState) -> None:
        """Monitor a robot's new strategy, and check its initial node. Raises GuaranteeError."""
        spec, values = robot.planner.strategy.specification, robot.planner.values()
        self._watched[robot.name] = _Watched(spec)
        for section in (Section.ENV_INIT, Section.SYS_INIT):
            for constraint in _violated(spec, section, values, values):
                raise self._defect(robot, constraint)

    def record(self, robot: RobotState, broken: Sequence[Constraint]) -> None:
        """Record broken assumptions, each rule once."""
        for rule in dict.fromkeys(str(constraint.origin) for constraint in broken):
            self._state.emit(records.Assumption(self._state.tick, robot.name, rule))

    def check_guarantees(self, robot: RobotState, observed: Values, proposal: Proposal) -> None:
        """Check a step before it is taken. Raises GuaranteeError."""
        watched, planner = self._watched[robot.name], robot.planner
        known = self._complete(watched.spec, observed)
        if planner.node is None or proposal.node is None or not known:
            return
        step = (planner.node, proposal.node, tuple(observed.values()))
        if step not in watched.sound:
            before = planner.values()
            after = {**before, **observed, **planner.strategy.values(proposal.node)}
            for broken in _violated(watched.spec, Section.SYS_TRANS, before, after):
                raise self._defect(robot, broken)
            watched.sound.add(step)

    def allows_planned(self, robot: RobotState, pose: Pose) -> bool:
        """Whether the formulas of a robot, with its memory, allow a step of a joint plan. Plans may
        ignore the memory, so only formulas that refer to memory (or inputs) can forbid a step.

        Raises GuaranteeError.
        """
        objective = robot.robot.objective
        if not isinstance(objective, Ltl):
            return True
        guarantees = guarantees_of(objective)
        around = self._state.inputs_before, self._state.inputs
        if guarantees.remembered(robot.memory.values, robot.pose, pose, around) is not None:
            return True
        if guarantees.remember_something or objective.inputs:
            return False
        raise GuaranteeError(
            f"{robot.name} was about to break its formulas at tick {self._state.tick}, by a step "
            f"of a joint plan from {robot.pose.region} to {pose.region}; it did not move"
        )

    def _defect(self, robot: RobotState, constraint: Constraint) -> GuaranteeError:
        return GuaranteeError(
            f"{robot.name} was about to break a guarantee at tick {self._state.tick}: "
            f"{constraint.origin} [{constraint.formula}]; it did not move"
        )

    def _complete(self, spec: Specification, observed: Values) -> bool:
        """Whether all inputs of the specification were observed."""
        return all(variable.name in observed for variable in spec.owned(Owner.INPUT))


def _violated(
    spec: Specification, section: Section, before: Values, after: Values
) -> Iterator[Constraint]:
    for constraint in spec.section(section):
        if not holds(constraint.formula)(before, after):
            yield constraint

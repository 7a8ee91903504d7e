"""Checks of single moves against the text of the specification, for strategies on demand.

The synthesizer reports its move and the distance to its goal; this module checks the move with the
text alone. The properties that ``verify_strategy`` proves for an explicit strategy then hold for
each move made: the guarantees were kept, and the robot came closer to its goal or waits for an
assumption that did not hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.errors import SynthesizerError
from safenav.spec.specification import Constraint, Owner, Section, Specification
from safenav.synthesis.serving.served import Position, ServedMove, falls
from safenav.verify.automaton import clauses

Values = Mapping[str, int]


class MoveCheck:
    """Checks the replies of a synthesizer for one specification.

    Raises InputError if the specification cannot be read; the methods raise SynthesizerError for a
    wrong reply.
    """

    def __init__(self, spec: Specification) -> None:
        self._spec = spec
        self._sections = {section: clauses(spec, section) for section in Section}
        self._inputs = [variable.name for variable in spec.owned(Owner.INPUT)]

    def position(self, position: Position) -> None:
        """Check that a play may continue from here: its values, its goal and its awaited assumption
        exist. Its moves are checked when they are made."""
        self._ranges(position.values)
        count = max(1, len(self._sections[Section.SYS_LIVENESS]))
        if not 0 <= position.goal < count:
            raise self.wrong(f"goal {position.goal}, of {count}")

    def start(self, position: Position) -> None:
        """Check that a play may begin here."""
        self.position(position)
        for section in (Section.ENV_INIT, Section.SYS_INIT):
            for constraint in self._broken(section, position.values):
                raise self.wrong(f"a start that violates {constraint.origin}", constraint)

    def refusal(self, here: Position, inputs: Values) -> None:
        """Check a refusal of these next inputs: some assumption must exclude them."""
        if not self._within({name: inputs[name] for name in self._inputs}):
            return
        following = {**here.values, **{name: inputs[name] for name in self._inputs}}
        if not any(self._broken(Section.ENV_TRANS, here.values, following)):
            raise self.wrong("no move, though every assumption holds")

    def move(self, here: Position, inputs: Values, move: ServedMove) -> None:
        """Check the reply to these next inputs: an allowed move that makes progress to the goal."""
        before, after = here.values, move.to.values
        if any(after[name] != inputs[name] for name in self._inputs):
            raise self.wrong("a move for other inputs than requested")
        self._ranges(after)
        for constraint in self._broken(Section.ENV_TRANS, before, after):
            raise self.wrong(f"a move although {constraint.origin} is violated", constraint)
        for constraint in self._broken(Section.SYS_TRANS, before, after):
            raise self.wrong(f"a move that violates {constraint.origin}", constraint)
        self._progress(here, move)

    def _progress(self, here: Position, move: ServedMove) -> None:
        goals = self._sections[Section.SYS_LIVENESS]
        count = max(1, len(goals))
        before, after = here.values, move.to.values
        if not 0 <= here.goal < count or move.to.goal != (here.goal + move.met) % count:
            raise self.wrong(f"goal {move.to.goal} after goal {here.goal}, of {count}")
        for number in range(min(move.met, len(goals))):
            goal = goals[(here.goal + number) % count]
            if not goal.holds(before, after):
                said = f"goal {goal.constraint.origin} as met, which it is not"
                raise self.wrong(said, goal.constraint)
        awaited = here.assumption
        fair = self._sections[Section.ENV_LIVENESS]
        if awaited is not None and not 0 <= awaited < len(fair):
            raise self.wrong(f"waiting for assumption {awaited}, of {len(fair)}")
        holds = awaited is None or fair[awaited].holds(before, after)
        if move.to.distance < 0 or not falls(here, move, holds):
            goal_said = str(goals[here.goal].constraint.origin) if goals else "its goal"
            raise self.wrong(
                f"a move that makes no progress to {goal_said}: from {here.distance} to "
                f"{move.to.distance}, and no assumption fails"
            )

    def _broken(
        self, section: Section, before: Values, after: Values | None = None
    ) -> Iterator[Constraint]:
        found = self._sections[section]
        return (clause.constraint for clause in found if not clause.holds(before, after))

    def _ranges(self, values: Values) -> None:
        if not self._within(values):
            raise self.wrong("a value outside its range")

    def _within(self, values: Values) -> bool:
        return all(
            variable.bounds[0] <= values[variable.name] <= variable.bounds[1]
            for variable in self._spec.variables
            if variable.bounds is not None and variable.name in values
        )

    def wrong(self, said: str, constraint: Constraint | None = None) -> SynthesizerError:
        """Return the error about a reply; ``constraint``: the constraint that it violates."""
        formula = f" [{constraint.formula}]" if constraint is not None else ""
        return SynthesizerError(
            f"the synthesizer sent a wrong move for {self._spec.robot}: {said}{formula}"
        )

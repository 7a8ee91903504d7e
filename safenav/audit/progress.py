"""A robot's progress with its objective, as far as its goal lines show.

A new strategy may begin the objective at any of its targets, since the format does not state that
memory survives a resynthesis. So after each the next goal is unknown until one is met."""

from __future__ import annotations

import json
from dataclasses import dataclass, field

from safenav.audit.kinds import shape_of
from safenav.audit.lines import Line, Made, Objective


@dataclass
class Progress:
    """``awaited``: the index of the next target in their order, None while unknown.

    ``covered``: the targets met in this round in any order, meaningful only if ``fresh`` (the
    beginning of the round was seen). ``reset_line``: since when all this is counted.
    ``last_round``: of the last goal since then; None if there was none."""

    objective: Objective
    awaited: int | None = None
    covered: set[int] = field(default_factory=set)
    fresh: bool = False
    reset_line: int = 0
    last_round: int | None = 0

    @classmethod
    def at_start(cls, objective: Objective, start: int) -> Progress:
        """Return the progress before the first move: a robot begins with its first target unless
        the robot is in it at the start (whether that counts is the strategy's decision)."""
        first = objective.targets[0] if objective.targets else frozenset()
        shape = shape_of(objective.kind)
        in_order = shape.in_turn and not shape.strict and start not in first
        return cls(objective, awaited=0 if in_order else None, fresh=start not in first)

    @classmethod
    def continued(cls, objective: Objective, done: Line) -> Progress:
        """Return the progress where the run continues that of another trace. A strict objective
        may begin with another target where the robot stands on one."""
        shape = shape_of(objective.kind)
        in_order = shape.in_turn and not shape.strict
        counted = Progress(objective, (done.turn or 0) if in_order else None)
        if shape.covers:
            counted.covered, counted.fresh = {*(done.seen or ())}, not done.uncounted
        counted.last_round = done.rounds or 0
        return counted

    def reset(self, objective: Objective, line: int) -> None:
        self.objective = objective
        self.awaited = None
        self.covered.clear()
        self.fresh = False
        self.reset_line = line
        self.last_round = None

    def recount(self) -> None:
        """Reset the rounds after a resolution: they count from here, and a round in any order may
        restart. The strategy continues, so the order of its targets is kept."""
        self.covered.clear()
        self.fresh = False

    def meet(self, goal: Line) -> None:
        count, shape = len(self.objective.targets), shape_of(self.objective.kind)
        if shape.in_turn and goal.goal < count:
            over = shape.ends and goal.goal == count - 1
            self.awaited = None if over else (goal.goal + 1) % count
        elif shape.covers:
            self.covered.add(goal.goal)
            counted = self.last_round is not None and goal.round > self.last_round
            if counted or (self.fresh and len(self.covered) >= count):
                self.covered.clear()
                self.fresh = True
        self.last_round = goal.round

    def copy(self) -> Progress:
        counted = self.fresh, self.reset_line, self.last_round
        return Progress(self.objective, self.awaited, set(self.covered), *counted)


def goals_before(objective: Objective, done: Line) -> list[Line]:
    """Return goals as a trace would have them since the last resolution, for what a robot has
    ``done`` of its own objective before the run continues."""
    shape, rounds = shape_of(objective.kind), done.rounds or 0
    count = len(objective.targets)
    if objective.kind == "ltl":
        count = len(json.loads(objective.body).get("liveness", ()))
    if shape.settles and rounds:
        return [Made(goal=count - 1, round=number) for number in range(1, rounds + 1)]
    seen, first = [*(done.seen or ())], 0
    if shape.in_turn and count:
        first = ((done.turn or 0) - len(seen)) % count
        seen.sort(key=lambda goal: (goal - first) % count)
    order = [(first + number) % count for number in range(count)]
    whole = [Made(goal=goal, round=number) for number in range(rounds) for goal in order]
    for number, line in enumerate(whole[count - 1 :: count], 1):
        line.round = number
    return whole + [Made(goal=goal, round=rounds) for goal in seen]

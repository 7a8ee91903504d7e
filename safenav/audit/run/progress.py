"""A robot's progress in its own objective, and in the objective in force as far as goals show it.

A new strategy may begin the objective at any of its targets, since the format does not state that
memory survives a resynthesis. So the next goal is unknown until the new strategy meets one.
"""

from __future__ import annotations

import json
from typing import NamedTuple

from safenav.audit.kinds import shape_of
from safenav.audit.lines import Line, Made, Objective


class Progress(NamedTuple):
    """Progress in the robot's own objective and in the objective in force.

    Own: ``goals`` since the last resolution; ``turn``, the target that was next when these began to
    be counted (None: the robot had met none); ``ahead``, how many targets of a terminating
    objective are met, despite interruptions; ``kept``, ``turn`` and ``ahead`` of the objective that
    it resumes after an input.

    In force, since ``reset_line``: ``awaited``, the index of the next target in their order, None
    while unknown; ``covered``, the targets met in this round in any order, meaningful only if
    ``fresh`` (the start of the round was observed); ``last_round``, the round of the last goal,
    None before the first goal.
    """

    goals: tuple[Line, ...] = ()
    turn: int | None = None
    ahead: int = 0
    kept: tuple[int | None, int] | None = None
    awaited: int | None = None
    covered: frozenset[int] = frozenset()
    fresh: bool = False
    reset_line: int = 0
    last_round: int | None = 0

    @classmethod
    def begun(cls, own: Objective, start: int, done: Line | None) -> Progress:
        """Return the progress before the first move. A robot begins with its first target unless it
        starts there: the strategy then decides whether that counts. ``done``: progress in the run
        that this one continues; a strict objective may then begin with another target if the robot
        stands on one."""
        shape = shape_of(own.kind)
        in_order = shape.in_turn and not shape.strict
        if done is None:
            off = not own.targets or start not in own.targets[0]
            return cls(awaited=0 if in_order and off else None, fresh=off)
        turn, rounds, seen = done.turn or 0, done.rounds or 0, frozenset(done.seen or ())
        return cls(
            _goals_before(own, done),
            turn if turn or rounds or seen else None,
            turn + bool(shape.ends and rounds),
            awaited=turn if in_order else None,
            covered=seen if shape.covers else frozenset(),
            fresh=shape.covers and not done.uncounted,
            last_round=rounds,
        )

    @property
    def rounds(self) -> int:
        """Return the completed rounds of the robot's own objective."""
        return self.goals[-1].round if self.goals else 0

    @property
    def met(self) -> list[int]:
        """Return the targets met in the present round of the own objective. The goal that completes
        a round belongs to that round."""
        done = self.rounds
        met = [goal.goal for goal in self.goals if goal.round == done]
        return met[1:] if done else met

    def next(self, own: Objective) -> int | None:
        """Return the next target of the own objective; None if it has never met one."""
        count = len(own.targets)
        return (self.goals[-1].goal + 1) % count if self.goals and count else self.turn

    def reset(self, line: int) -> Progress:
        """Return the progress after the robot gets a new objective or strategy."""
        after = self._replace(awaited=None, covered=frozenset(), fresh=False)
        return after._replace(reset_line=line, last_round=None)

    def remembering(self, synthesis: Line, region: int) -> Progress:
        """Return the progress after a strategy begins in a region with a target in its memory: it
        awaits that, or the next one if that is met there."""
        shape, targets = shape_of(synthesis.objective.kind), synthesis.objective.targets
        memory = first_of(synthesis)
        if not shape.in_turn or shape.ends or memory >= len(targets):
            return self
        after = (memory + (region in targets[memory])) % len(targets)
        if after != memory and (region in targets[after] or region in targets[memory - 1]):
            return self  # it meets both by staying, or has just met the one before
        return self._replace(awaited=after)

    def recounted(self, own: Objective) -> Progress:
        """Return the progress after a resolution: rounds are counted again, and a round in any
        order may restart. The strategy continues, so the next target is kept."""
        return self._replace(goals=(), turn=self.next(own), covered=frozenset(), fresh=False)

    def given(self, own: Objective, *, leaves: bool, resumes: bool) -> Progress:
        """Replace the objective ``own`` by another, which begins with its first target. An
        objective that the robot ``resumes`` after an input continues where the robot left it."""
        kept = self.kept
        if leaves and kept is None:
            kept = self.next(own), self.ahead
        turn, ahead = kept if resumes and kept else (None, 0)
        kept = None if resumes else kept
        return self._replace(goals=(), turn=turn, ahead=ahead, kept=kept)

    def reached(self, goal: Line, pursued: Objective, *, own: bool, sure: bool) -> Progress:
        """Return the progress after the robot meets a target. ``own``: of its own objective;
        ``sure``: it had no other objective in this turn to which the target could belong."""
        after, shape, count = self, shape_of(pursued.kind), len(pursued.targets)
        if own:
            goals, ahead = (*self.goals, goal), self.ahead + (goal.goal == self.ahead)
            after = after._replace(goals=goals, ahead=ahead)
        if sure and shape.in_turn and goal.goal < count:
            over = shape.ends and goal.goal == count - 1
            after = after._replace(awaited=None if over else (goal.goal + 1) % count)
        elif sure and shape.covers:
            covered = self.covered | {goal.goal}
            whole = self.last_round is not None and goal.round > self.last_round
            whole = whole or (self.fresh and len(covered) >= count)
            after = after._replace(covered=frozenset() if whole else covered)
            after = after._replace(fresh=self.fresh or whole)
        return after._replace(last_round=goal.round)


def first_of(synthesis: Line) -> int:
    """Return the number of the target with which a strategy begins."""
    return int(next(iter((synthesis.memory or {"": 0}).values())))


def _goals_before(objective: Objective, done: Line) -> tuple[Line, ...]:
    """Return the goals since the last resolution that a trace would record for the progress
    ``done`` of the earlier run."""
    shape, rounds = shape_of(objective.kind), done.rounds or 0
    count = len(objective.targets)
    if objective.kind == "ltl":
        count = len(json.loads(objective.body).get("liveness", ()))
    if shape.settles and rounds:
        return tuple(Made(goal=count - 1, round=number) for number in range(1, rounds + 1))
    seen, first = [*(done.seen or ())], 0
    if shape.in_turn and count:
        first = ((done.turn or 0) - len(seen)) % count
        seen.sort(key=lambda goal: (goal - first) % count)
    order = [(first + number) % count for number in range(count)]
    whole = [Made(goal=goal, round=number) for number in range(rounds) for goal in order]
    for number, line in enumerate(whole[count - 1 :: count], 1):
        line.round = number
    return (*whole, *(Made(goal=goal, round=rounds) for goal in seen))

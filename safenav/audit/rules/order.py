"""Rules on the header and on the order of the lines."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Message, Rule, judges
from safenav.audit.run.situation import Situation

_COMPLETE_ENDINGS = ("completed", "tick_limit")

_AT_ANY_MOMENT = (
    *("discovered", "appeared", "gone", "truth", "order", "inputs", "objective", "service"),
    *("plan", "plan_end", "depart", "arrive", "act", "acted", "hold", "late", "reopened"),
    *("waiting", "operator"),
)
_WITHOUT_TURN = ("deadline", "outcome")
_SETTLING = ("blocked", "pop", "goal", "request", "push", "told")
"""Lines that precede the first move of a tick only after a line that records a change in it."""


@judges("opening")
def header(now: Situation) -> Iterator[Message]:
    """The scenario in the header is consistent: robots start in different free regions, with a
    heading if they need one; obstacles are in free regions; targets and blocked robots exist
    (D 3)."""
    header, grid = now.header, now.grid
    if not header.robots:
        yield None, "no robots"
    for name, robot in header.robots.items():
        if not grid.is_free(robot.start):
            yield name, f"{name} starts at {now.show(robot.start)}, which is not free"
        for other in list(header.robots)[: list(header.robots).index(name)]:
            if header.robots[other].start == robot.start and now.conflict(name, other):
                yield name, f"{name} starts where {other} does, at {now.show(robot.start)}"
        if {"free": True, "heading": False}.get(robot.mobility) is not (robot.heading is None):
            how = f"mobility {robot.mobility!r} and heading {robot.heading!r}"
            yield name, f"{name} starts with {how}"
        for target in robot.objective.targets:
            for region in sorted(target):
                if not grid.is_free(region):
                    yield name, f"{name}'s target {now.show(region)} is not free"
    for first, *again in now.listed.values():
        same = [(o.region, o.blocks, o.all_needs) for o in (first, *again)]
        if same != same[:1] * len(same):
            yield None, f"{first.name} differs when it reappears"
    for obstacle in now.obstacles.values():
        if not grid.is_free(obstacle.region):
            yield None, f"{obstacle.name} is at {now.show(obstacle.region)}, which is not free"
        for name in sorted(obstacle.blocks - header.robots.keys()):
            yield name, f"{obstacle.name} blocks {name}, a robot that does not exist"


class OrderRule(Rule):
    """Ticks (live: passes) are consecutive; in each, every robot has one turn with one move, in the
    order of the header. The lines of a turn are in the order of the format, and all concern its
    robot. No line follows the outcome (D 4 and 5, T Time)."""

    name = "order"

    def __init__(self) -> None:
        self._tick = 1
        self._index = 0
        self._last = 0

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type in ("checkpoint", "resumed"):
            return  # of the run before a pass
        found = list(self._of_the_turn(record, now))
        if record.tick < self._last and not found:
            found = [(None, f"a line of tick {record.tick} after one of tick {self._last}")]
        self._last = record.tick
        yield from found

    def _of_the_turn(self, record: Line, now: Situation) -> Iterator[Message]:
        if now.live and not self._index:  # a pass in which nothing happens has no lines
            self._tick = record.tick
        if record.type in _AT_ANY_MOMENT:  # within a turn, or before the first line of one
            if record.tick not in (now.turn.tick, self._tick):
                yield None, f"a line of tick {record.tick} among those of tick {now.turn.tick}"
        elif now.starts_turn(record):
            yield from self._turn_begins(record, now)
        elif record.type not in _WITHOUT_TURN:
            yield from self._turn_goes_on(record, now)
        if record.type == "move":
            self._index += 1
            if self._index == len(now.header.robots):
                self._tick, self._index = self._tick + 1, 0

    def turn(self, now: Situation) -> Iterator[Message]:
        turn = now.turn
        if turn.robot and turn.first("move") is None and not turn.torn:
            yield f"{turn.robot}'s turn has no move (a robot that stays also has one)"

    def ending(self, now: Situation) -> Iterator[Message]:
        if now.outcome and now.outcome.outcome in _COMPLETE_ENDINGS and self._index:
            missing = list(now.header.robots)[self._index]
            yield missing, f"{missing} has not moved in the last tick, {self._tick}"

    def _turn_begins(self, record: Line, now: Situation) -> Iterator[Message]:
        names = list(now.header.robots)
        expected = names[self._index]
        if (record.tick, record.robot) == (self._tick, expected):
            return
        if record.robot == names[self._index - 1] and record.tick == now.turn.tick:
            yield f"a second turn of {record.robot} in tick {record.tick}"
        else:
            at_fault = record.robot if record.tick != self._tick else expected
            due = f"where that of {expected} in tick {self._tick} was due"
            yield at_fault, f"a turn of {record.robot} in tick {record.tick}, {due}"
        self._tick, self._index = record.tick, names.index(record.robot)

    def _turn_goes_on(self, record: Line, now: Situation) -> Iterator[Message]:
        """Judge a line within a turn. Violated assumptions and beliefs are recorded at any moment;
        lines after a move have no order, because a settlement may follow any of them."""
        turn, kind = now.turn, record.type
        moved = turn.first("move") is not None
        known = not turn.robot and bool(now.begun.asked or now.begun.stays)  # from the run before
        early = kind in ("met", "resolved", "belief") or (
            kind in _SETTLING and turn.tick == self._last and not known
        )
        if record.tick != turn.tick and ((early and not now.live) or record.tick != self._tick):
            problem = f"a {kind} line of tick {record.tick} among those of tick {turn.tick}"
            yield turn.robot, problem
        if turn.robot is None:
            if kind not in ("synthesis", "assumption", *_SETTLING):
                yield None, f"a {kind} line before the first turn"
            return
        if kind == "goal" and _begins_on_its_target(record, now):
            return
        does = kind in ("backtrack", "met", "resolved", "goal", "belief")
        if does and record.robot != turn.robot:
            yield f"a {kind} line of {record.robot} in {turn.robot}'s turn"
        if kind == "backtrack" and len(turn.all(kind)) >= max(len(turn.all("violation")), 1):
            yield turn.robot, f"{turn.robot} backs up twice in one turn"
        if kind == "backtrack" and moved:
            yield turn.robot, f"the {kind} line comes too late in {turn.robot}'s turn"
        if kind not in ("backtrack", "move", "violation") and not moved:
            yield turn.robot, f"the {kind} line comes before {turn.robot} has moved"


def _begins_on_its_target(record: Line, now: Situation) -> bool:
    """Return whether the goal may be met where an objective begins, or where an operator has put
    the robot: it is recorded immediately, in any robot's turn. A robot driven by command inputs
    needs no new strategy for it."""
    name, turn = record.robot, now.turn
    put = [line for line in turn.all("operator") if line.region is not None]
    if any(line.robot == name for line in (*turn.all("synthesis"), *turn.all("objective"), *put)):
        return True
    if now.objectives[name] != turn.objectives[name]:
        return True  # a robot that a plan drives needs no new strategy for it
    if now.has_failed(name):
        return True  # a step has ended there, elsewhere than commanded
    commanded = now.header.coordination == "assignable"
    return commanded and turn.objectives[name] != now.objectives[name]

"""Rules on the header and on the order of the lines."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.lines import Line
from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation

_COMPLETE_ENDINGS = ("completed", "tick_limit")

_BEFORE_THE_MOVE = ("violation", "backtrack")
_AFTER_THE_MOVE = (
    "met",
    "resolved",
    "blocked",
    "pop",
    "synthesis",
    "goal",
    "request",
    "push",
    "told",
)
"""When in a turn a line may come (T, Time). An assumption may be violated, and a belief told, at
any moment. What follows a move has no order of its own: a settlement may follow on anything."""
_AT_ANY_MOMENT = (
    *(
        "discovered",
        "appeared",
        "gone",
        "truth",
        "order",
        "inputs",
        "objective",
        "service",
        "plan",
        "plan_end",
    ),
    *("depart", "arrive", "act", "acted", "hold", "late", "reopened", "waiting", "operator"),
)
_SETTLING = ("blocked", "pop", "goal", "request", "push", "told")
"""Lines that come before the first move of a tick only after a line that records a change there."""
_BEFORE_THE_FIRST_MOVE = ("synthesis", "goal", "assumption")


class HeaderRule(Rule):
    """The scenario in the header makes sense: a rectangular map, robots that start on free
    regions of their own with known mobility and a heading if they need one, obstacles on free
    regions, targets and blocked robots that exist (D 3)."""

    name = "header"

    def opening(self, now: Situation) -> Iterator[Finding]:
        for robot, problem in self._problems(now):
            yield self.broken(0, robot, now.header_line, problem)

    def _problems(self, now: Situation) -> Iterator[tuple[str | None, str]]:
        header, grid, world = now.header, now.grid, now.header.map
        if len(world.grid) != world.rows or any(len(r) != world.cols for r in world.grid):
            yield None, f"the grid is not one of {world.rows} rows by {world.cols} columns"
            return
        if not header.robots:
            yield None, "no robots"
        for name, robot in header.robots.items():
            if not grid.is_free(robot.start):
                yield name, f"{name} starts at {now.show(robot.start)}, which is not free"
            for other in list(header.robots)[: list(header.robots).index(name)]:
                if header.robots[other].start == robot.start and now.conflict(name, other):
                    yield name, f"{name} starts where {other} does, at {now.show(robot.start)}"
            if robot.mobility not in ("free", "heading"):
                yield name, f"{name} has an unknown mobility, {robot.mobility!r}"
            if robot.mobility == "heading" and robot.heading is None:
                yield name, f"{name} moves by its heading but starts without one"
            for target in robot.objective.targets:
                for region in sorted(target):
                    if not grid.is_free(region):
                        yield name, f"{name}'s target {now.show(region)} is not free"
        for first, *again in now.listed.values():
            same = [(o.region, o.blocks, o.all_needs) for o in (first, *again)]
            if same != same[:1] * len(same):
                yield None, f"{first.name} is another when it comes back"
        for obstacle in now.obstacles.values():
            if not grid.is_free(obstacle.region):
                yield None, f"{obstacle.name} is at {now.show(obstacle.region)}, which is not free"
            for name in sorted(obstacle.blocks - header.robots.keys()):
                yield name, f"{obstacle.name} blocks {name}, a robot that does not exist"


class OrderRule(Rule):
    """Ticks follow one another (live: passes); in each every robot has one turn with one move, in
    the order of the header; the lines of a turn come in the order of the format, and all concern
    the robot whose turn it is; nothing comes after the outcome (D 4 and 5, T Time)."""

    name = "order"

    def __init__(self) -> None:
        self._tick = 1
        self._index = 0
        self._last = 0

    def line(self, record: Line, now: Situation) -> Iterator[Finding]:
        found = list(self._of_the_turn(record, now))
        if record.tick < self._last and not found:
            problem = f"a line of tick {record.tick} after one of tick {self._last}"
            found.append(self.broken_by(record, None, problem))
        self._last = record.tick
        yield from found

    def _of_the_turn(self, record: Line, now: Situation) -> Iterator[Finding]:
        if now.live and not self._index:  # a pass in which nothing happens has no lines
            self._tick = record.tick
        if record.type in _AT_ANY_MOMENT:  # within a turn, or before the first line of one
            if record.tick not in (now.turn.tick, self._tick):
                problem = f"a line of tick {record.tick} among those of tick {now.turn.tick}"
                yield self.broken_by(record, None, problem)
        elif record.type in ("violation", "backtrack", "move") and now.starts_turn(record):
            yield from self._turn_begins(record, now)
        else:
            yield from self._turn_goes_on(record, now)
        if record.type == "move":
            self._index += 1
            if self._index == len(now.header.robots):
                self._tick, self._index = self._tick + 1, 0

    def turn(self, now: Situation) -> Iterator[Finding]:
        turn = now.turn
        if turn.robot and turn.first("move") is None and not turn.torn:
            problem = f"{turn.robot}'s turn has no move (a robot that stays also has one)"
            yield self.broken(turn.tick, turn.robot, turn.line, problem)

    def ending(self, now: Situation) -> Iterator[Finding]:
        outcome = now.outcome
        if outcome and outcome.outcome in _COMPLETE_ENDINGS and self._index:
            missing = list(now.header.robots)[self._index]
            problem = f"{missing} has not moved in tick {self._tick}, the last"
            yield self.broken_by(outcome, missing, problem)

    def _turn_begins(self, record: Line | Line | Line, now: Situation) -> Iterator[Finding]:
        names = list(now.header.robots)
        expected = names[self._index]
        if (record.tick, record.robot) != (self._tick, expected):
            again = record.robot == names[self._index - 1] and record.tick == now.turn.tick
            at_fault = record.robot if again or record.tick != self._tick else expected
            problem = (
                f"a second turn of {record.robot} in tick {record.tick}"
                if again
                else f"a turn of {record.robot} in tick {record.tick}, "
                f"where that of {expected} in tick {self._tick} was due"
            )
            yield self.broken_by(record, at_fault, problem)
            self._tick, self._index = record.tick, names.index(record.robot)

    def _turn_goes_on(self, record: Line, now: Situation) -> Iterator[Finding]:
        turn, kind = now.turn, record.type
        any_moment = record.type in ("assumption", "belief")
        if not (any_moment or record.type in (*_BEFORE_THE_MOVE, *_AFTER_THE_MOVE, "move")):
            return  # the outcome
        early = record.type in ("met", "resolved", "belief") or (
            record.type in _SETTLING and turn.tick == self._last
        )
        early = early and not now.live
        if record.tick != turn.tick and (early or record.tick != self._tick):
            problem = f"a {kind} line of tick {record.tick} among those of tick {turn.tick}"
            yield self.broken_by(record, turn.robot, problem)
        if turn.robot is None:
            settled = record.type in ("request", "push", "pop", "blocked", "told")
            if record.type not in _BEFORE_THE_FIRST_MOVE and not settled:
                yield self.broken_by(record, None, f"a {kind} line before the first turn")
            return
        if record.type == "goal" and _begins_on_its_target(record, now):
            return
        actor = _actor(record)
        if actor is not None and actor != turn.robot:
            yield self.broken_by(record, actor, f"a {kind} line of {actor} in {turn.robot}'s turn")
        if record.type == "backtrack" and turn.first("backtrack") is not None:
            yield self.broken_by(record, turn.robot, f"{turn.robot} backs up twice in one turn")
        if record.type == "backtrack" and turn.first("move") is not None:
            problem = f"the {kind} line comes too late in {turn.robot}'s turn"
            yield self.broken_by(record, turn.robot, problem)
        if record.type in ("met", "resolved", "goal") and turn.first("move") is None:
            problem = f"the {kind} line comes before {turn.robot} has moved"
            yield self.broken_by(record, turn.robot, problem)


def _begins_on_its_target(record: Line, now: Situation) -> bool:
    """Return whether the goal may be one that is met where an objective begins: recorded
    immediately, in any robot's turn. A robot driven by command inputs needs no new strategy for
    that."""
    name = record.robot
    begun = {line.robot for line in now.turn.all("synthesis")}
    begun |= {line.robot for line in now.turn.all("objective")}
    if name in begun:
        return True
    told = now.header.coordination == "assignable"
    return told and now.turn.objectives[name] != now.objectives[name]


def _actor(record: Line) -> str | None:
    """Return the robot of a line that only records what the robot whose turn it is does."""
    return (
        record.robot if record.type in ("backtrack", "met", "resolved", "goal", "belief") else None
    )

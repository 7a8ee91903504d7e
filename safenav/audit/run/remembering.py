"""Possible memories of robots' formulas along a trace."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping

from safenav.audit.formulas import rules_of
from safenav.audit.language import Pose, RefusedError, Row
from safenav.audit.lines import Line
from safenav.audit.run.state import State


class Memories:
    """Possible memories of robots' formulas: the initial ones, then after each step those that the
    formulas allow."""

    def __init__(self, now: State) -> None:
        self.possible: dict[str, set[Row]] = {}
        self.begun: set[str] = set()
        """The robots whose strategy has chosen one."""
        self._ahead: dict[str, Row] = {}
        """The memories ahead of robots that have got a strategy in transit."""
        for robot in now.own:
            if (names := remembered(robot, now)) is not None:
                stated = None if robot not in now.done else now.done[robot].memory
                rows = rules_of(now.own[robot]).begins(now.pose(robot))
                self.begun |= {robot} if stated else set()
                known = {row_of(stated, names)} if stated else {row[: len(names)] for row in rows}
                self.possible[robot] = known

    def line(self, record: Line, now: State) -> None:
        """Process a synthesis or a move before it takes effect."""
        robot = record.robot
        if robot not in self.possible or now.own[robot].kind != "ltl":
            return
        if record.type == "synthesis":
            if (row := self.chosen(record, now)) is not None:
                if now.toward[robot] is None:
                    self.possible[robot] = {row}
                else:
                    self._ahead[robot] = row
                self.begun.add(robot)
        elif record.toward is None:
            here = now.region[robot], now.heading[robot]
            there = record.to, record.heading
            self.begun |= {robot} if here != there or record.by == "strategy" else set()
            ahead = self._ahead.pop(robot, None)
            if ahead is not None and record.to == now.toward[robot]:
                self.possible[robot] = {ahead}
                return
            if now.live or here == there:  # perhaps its strategy made it stay
                self.possible[robot] |= self._after(robot, here, here, now)
            if here != there:
                self.possible[robot] = self._after(robot, here, there, now) or self.possible[robot]

    def chosen(self, synthesis: Line, now: State) -> Row | None:
        """Return the formula memory in the first node of a robot's new strategy; None if the
        strategy is not for these formulas, or their memory is not tracked."""
        names = remembered(synthesis.robot, now)
        stated = synthesis.memory if synthesis.node is not None else None
        if not stated or names is None or synthesis.robot not in self.possible:
            return None
        return row_of(stated, names) if synthesis.objective.kind == "ltl" else None

    def may_be(self, robot: str, stated: Mapping[str, int], now: State) -> bool:
        """Return whether a robot's formulas may have this memory; in transit, at its departure
        pose."""
        return row_of(stated, remembered(robot, now) or ()) in self.possible.get(robot, ())

    def may_become(self, robot: str, stated: Mapping[str, int], now: State) -> bool:
        """Return whether a robot's formulas may have this memory in its pose; in transit, in its
        destination pose."""
        if now.toward[robot] is None:
            return self.may_be(robot, stated, now)
        row = row_of(stated, remembered(robot, now) or ())
        if robot in self._ahead:
            return row == self._ahead[robot]
        here = now.region[robot], now.heading[robot]
        return row in self._after(robot, here, now.pose(robot), now)

    def _after(self, robot: str, here: Pose, there: Pose, now: State) -> set[Row]:
        rules, size = rules_of(now.own[robot]), len(remembered(robot, now) or ())
        return {
            rules.valuations[j][:size]
            for i, j, _ in rules.steps(here, there)
            if rules.valuations[i][:size] in self.possible[robot]
        }


def remembered(robot: str, now: State) -> tuple[str, ...] | None:
    """Return the names of the memory of a robot's formulas; None if they have none, or the auditor
    cannot evaluate them."""
    if now.own[robot].kind != "ltl":
        return None
    try:
        rules_of(now.own[robot])
    except RefusedError:
        return None
    return tuple(json.loads(now.own[robot].body).get("memory") or ()) or None


def row_of(memory: Mapping[str, int], names: Iterable[str]) -> Row:
    """Return the values of a memory in the order of its names."""
    return tuple(int(memory.get(name, -1)) for name in names)

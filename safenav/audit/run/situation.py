"""The state of the run at a trace line, replayed from the lines before it alone.

Rules examine a situation before a line takes effect, and again at the end of a turn. After a broken
rule the situation follows the trace, so that one fault is not reported repeatedly.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from safenav.audit.lines import Line, Objective
from safenav.audit.run.actions import Actions
from safenav.audit.run.remembering import Memories
from safenav.audit.run.robots import DECIMALS
from safenav.audit.run.turn import (
    StackEntry,
    Status,
    Turn,
    fails,
    helpers_of,
    is_of_scenario,
    is_of_user,
    is_over,
)

RESYNTHESIS = "resynthesis"
_CHANGES = (
    *("violation", "resolved", "gone", "appeared", "blocked", "reopened", "service", "objective"),
)
"""Records after which a request that was set aside may be served again."""


class Situation(Actions):
    """The state after a trace line, and the effects of lines on it."""

    def __init__(self, header: Line, records: Iterable[Line]) -> None:
        super().__init__(header, records)
        self.memories = Memories(self)

    def starts_turn(self, record: Line) -> bool:
        """Return whether a new turn begins with this line: a violation, else a move (or, in an
        invalid trace, a backtrack without a violation)."""
        turn = self.turn
        if record.type == "violation":
            return not self._also_lost_in(record)
        if record.type not in ("backtrack", "move"):
            return False
        return turn.robot != record.robot or turn.first("move") is not None

    def _also_lost_in(self, violation: Line) -> bool:
        """Return whether the violation adds a region to those in which the lost robot may be,
        within its turn."""
        robot, turn = violation.robot, self.turn
        again = turn.robot == robot and turn.first("move") is None
        return again and self.obstacles[violation.obstacle].type == f"lost_{robot}"

    def begin_turn(self, record: Line) -> None:
        robot = record.robot
        origin = self.region[robot], self.toward[robot] is not None, self.progress[robot]
        self.turn = Turn(record.tick, robot, record.line, self.objectives, *origin)

    def ends_step(self, move: Line) -> None:
        """In ticks, before the rules judge a move: record whether it ends elsewhere than
        commanded."""
        if move.result is None:
            self.ended.pop(move.robot, None)
        else:
            self.ended[move.robot] = move

    def ends_wait(self, record: Line) -> bool:
        """Return whether a line ends a wait: any change by a user, the scenario or the world does,
        as do the end of the waiting time and the tick after a robot failed or was charged."""
        if (wait := self.waits) is None:
            return False
        changes = is_of_scenario(record) or is_of_user(record)
        later = self.fails_in is not None and record.tick > self.fails_in
        return (changes and not self.repeats_inputs(record)) or later or is_over(wait, record)

    def apply(self, record: Line) -> None:
        """Let a line take effect."""
        if record.type == "outcome":
            self.outcome = record
            return
        self.turn.add(record)
        self.time = self.time if record.t is None else record.t
        if record.type in _CHANGES and not self.repeats_inputs(record):
            self.aside.clear()
        if self.ends_wait(record):
            self.waits = self.fails_in = None
        elif self.waits is not None and fails(record):
            self.fails_in = record.tick
        robot: Any = getattr(record, "robot", None)
        if robot in self.charge:
            self._charged(record)
        if record.type in ("synthesis", "move"):
            self.memories.line(record, self)
        self._follow_robot(robot, record)
        self._follow_obstacle(getattr(record, "obstacle", None), robot, record)
        self._follow_objectives(robot, record)

    def _follow_robot(self, robot: Any, record: Line) -> None:
        """Update the robots' poses and actions."""
        match record.type:
            case "hold":
                waits = record.why == "synthesis"
                (self.awaiting.add if waits else self.awaiting.discard)(robot)
                if record.signal is not None:  # after the ``act`` line of the same turn
                    self.signals[robot] = record.signal
            case "depart":
                self.awaiting.discard(robot)
                self.under_way[robot] = record
                self.lost.pop(robot, None)
            case "arrive":
                self.under_way.pop(robot, None)
                self.ended[robot] = record
                self.lost[robot] = frozenset(record.regions or ())
            case "act":
                self.acting[robot] = record
            case "acted":
                acted = self.turn.act = self.acting.pop(robot, None)
                self.barred |= {(robot, one) for one in record.barred or ()}
                if not self.live:
                    self._fail(robot, record.results)
                elif record.results or not record.reason:  # otherwise it has failed
                    self.perform(robot, record.results, acted)
            case "operator" if record.region is not None and robot is not None:
                self._place(robot, record.region, record.heading, None)
                self.came[robot] = None
                self.lost.pop(robot, None)
                self._fit_again(robot=robot)
            case "move":
                if record.to != self.region[robot]:
                    self.came[robot] = None if self.has_failed(robot) else self.region[robot]
                self._place(robot, record.to, record.heading, record.toward)
                if record.toward is None:
                    self.set_out.pop(robot, None)
                else:
                    self.set_out.setdefault(robot, record.tick)
                if record.signal is not None:
                    self.signals[robot] = record.signal
                self._wait_here(robot)
                self.turn.failed = self.has_failed(robot)
                if self.live:
                    self.ended.pop(robot, None)
                else:
                    self.perform(robot, {})
            case "inputs":
                self.inputs = dict(record.values)
            case "service":
                (self.out.discard if record.active else self.out.add)(robot)
                if record.active:
                    self._fit_again(robot=robot)
                elif record.cause == "battery":
                    self._asks_for(robot)

    def _follow_obstacle(self, name: Any, robot: Any, record: Line) -> None:
        """Update an obstacle and the request for it."""
        match record.type:
            case "violation":
                self.discovered.add(name)
                if not self.status[name].stays:
                    requesters = self.requests.setdefault(name, {})
                    requesters.pop(robot, None)
                    requesters[robot] = self.region[robot]
                if self.external and self.status[name].away:  # a door has closed again
                    self._begin(name)
            case "discovered":
                found = record.obstacle
                self.introduced.add(found.name)
                if self.external and found.from_ is None:  # earlier actions on it are unknown
                    self._begin(found.name)
            case "appeared" | "gone":
                self.permanent.discard(name)
                self.discovered.discard(name)
                self.requests.pop(name, None)
                self.given_up.pop(name, None)
                self.until.pop(name, None)
                self.dues.pop(name, None)
                if record.type == "appeared":
                    self._begin(name)
                    listed = [one for one in self.coming if one.name == name]
                    for one in listed[:1] if record.cause != "user" else ():
                        self.coming.remove(one)
                        self.until |= {name: one.until} if one.until else {}
                    self.orders.discard(name)
                else:
                    one = self.obstacles[name]
                    for lost, regions in self.lost.items():  # by an operator
                        if one.type == f"lost_{lost}":
                            self.lost[lost] = regions - {one.region}
                    self._fit_again(obstacle=name)
                    self.status[name] = Status.ABSENT
            case "order":
                self.requests[name] = {}
                self.discovered.add(name)
                self.orders.add(name)
            case "met":
                if self.meets_without_line(robot, name) and self.open[name].stage == record.need:
                    self.perform_at(robot, name)
                self.take(record)
            case "resolved":
                self._fit_again(obstacle=name)
                whole = len(self.obstacles[name].all_needs)
                self.open[name] = self.open[name]._replace(stage=whole)
                self.dues.pop(name, None)
                self.requests.pop(name, None)
                self.given_up.pop(name, None)
                gone = record.traversable is not False
                self.status[name] = Status.RESOLVED if gone else Status.UNTRAVERSABLE
            case "truth":
                self.truth[name] = record.traversable
            case "deadline" if record.verdict == "set":
                self.dues[record.of] = record.due
            case "request":
                limit = self.obstacles[name].resolve_within
                if limit is not None and not self.live:
                    self.dues.setdefault(name, record.tick + limit)
            case "blocked":
                self.dues.pop(name, None)
                self.given_up[name] = self.requests.pop(name, {})
                found = record.reason == "untraversable"
                self.status[name] = Status.UNTRAVERSABLE if found else Status.GIVEN_UP
            case "reopened":
                self.status[name] = Status.UNRESOLVED
                self.requests[name] = self.given_up.pop(name, {})
            case "operator" if record.intervention == "permanent" and name is not None:
                self.permanent.add(name)
                self.given_up.pop(name, None)  # it is no longer a request

    def _follow_objectives(self, robot: Any, record: Line) -> None:
        """Update the robots' objectives, whom they help, and their progress."""
        match record.type:
            case "waiting":
                self.waits, self.fails_in = record, None
            case "plan" | "plan_end":
                self.plan = record if record.type == "plan" else None
            case "resolved":
                for name, progress in self.progress.items() if self.restarts(record) else ():
                    self.progress[name] = progress.recounted(self.own[name])
            case "objective":
                by_input, away = record.cause == "input", self.is_away(robot)
                turns = {"leaves": by_input and away, "resumes": by_input and not away}
                self.progress[robot] = self.progress[robot].given(self.own[robot], **turns)
                self.own[robot] = record.objective
                if not record.at_once:  # until then it may head for its charger
                    self.stop[robot] = self.objectives[robot].targets
                if record.at_once:
                    self.objectives = {**self.objectives, robot: record.objective}
                    self._reset(robot, record.line)
            case "request":
                if record.aside:
                    self.aside.add(record.obstacle)
                helpers = helpers_of(record)
                if helpers:  # otherwise the decision may have failed: the objectives tell
                    self.helping[record.obstacle] = frozenset(helpers)
                self._perhaps_changed(helpers, record.line)
                self.named |= dict.fromkeys(helpers, record.obstacle)
            case "push":
                who, before = (record.requester, helpers_of(record)), dict(self.objectives)
                self._perhaps_changed(who[1], record.line)
                entry = StackEntry(record.obstacle, *who, record.line, before, self.helped)
                self.stack.append(entry)
                self._put_in_force(record.objectives, record.line)
            case "pop":
                self._drop(record)
                serving = self.helping.get(record.obstacle or "", frozenset())
                self._perhaps_changed(serving.union(helpers_of(record)), record.line)
                self.named = {n: one for n, one in self.named.items() if one in self.requests}
                self._put_in_force(record.objectives, record.line)
            case "told":
                self._rests(robot)
                self._put_in_force({robot: record.objective}, record.line)
            case "synthesis":
                self.form[robot, record.objective] = record.form
                if record.reason == "charge":
                    self.stop[robot] = record.objective.targets
                if record.node is not None and record.places is None:  # else: own objective
                    self._rests(robot)
                    self._put_in_force({robot: record.objective}, record.line)
                if record.tick > 0:
                    self._reset(robot, record.line)
                    stands = self.toward[robot] is None and record.places is None
                    known = not self.live and (self.header.begun is None or record.tick > 1)
                    if record.node is not None and stands and known:
                        after = self.progress[robot].remembering(record, self.region[robot])
                        self.progress[robot] = after
            case "assumption":
                self._reset(robot, record.line)
            case "goal":
                pursued, progress = self.objectives[robot], self.progress[robot]
                sure = progress.reset_line < self.turn.line
                own = pursued == self.own[robot]
                self.progress[robot] = progress.reached(record, pursued, own=own, sure=sure)

    def _place(self, robot: str, at: int, heading: str | None, toward: int | None) -> None:
        self.region[robot], self.heading[robot], self.toward[robot] = at, heading, toward

    def _charged(self, record: Line) -> None:
        """Update the charge of a line's robot."""
        robot, battery = record.robot, self.header.robots[record.robot].battery
        match record.type:
            case "move" if not self.live:
                self.charge[robot] = max(0.0, self.charge_after(record))
            case "depart" | "arrive" | "operator" if self.live and record.t is not None:
                self.charge[robot] = self.charge_at(robot, record.t)
                if record.type == "depart":
                    self.stands.pop(robot, None)
                elif record.type == "arrive":
                    left = max(0.0, self.charge[robot] - battery.move)
                    self.charge[robot] = round(left, DECIMALS)
                if record.type == "arrive" or robot in self.stands:
                    self.stands[robot] = record.t
            case "service" if record.active and record.cause == "battery":
                self.charge[robot] = float(battery.capacity)
                self.stands[robot] = record.t or 0.0

    def _begin(self, obstacle: str) -> None:
        """Make an obstacle present with all needs unmet."""
        self.status[obstacle] = Status.UNRESOLVED
        self.open[obstacle] = self.opened(obstacle)

    def finish_turn(self, last: bool) -> None:
        """Record whether the turn that has ended was the last one of the trace."""
        self.turn.final = last
        from_outside = ("interrupted", "error")
        self.turn.torn = last and (self.outcome is None or self.outcome.outcome in from_outside)

    def _asks_for(self, robot: str) -> None:
        """Record that a robot with an empty battery requests the obstacle that appeared in its
        region."""
        here = self.region[robot]
        for record in self.turn.all("appeared")[-1:]:
            flat = self.obstacles[record.obstacle]
            if (flat.type, flat.region) == (self.header.flat, here):
                self.discovered.add(flat.name)
                self.requests[flat.name] = {robot: here}

    def _wait_here(self, robot: str) -> None:
        """Record that a robot that encountered an obstacle waits in the region to which it has
        backed up."""
        violation, toward = self.turn.first("violation"), self.toward[robot]
        if violation is not None and robot in self.requests.get(violation.obstacle, ()):
            here = self.region[robot] if toward is None else toward
            self.requests[violation.obstacle][robot] = here

    def restarts(self, resolved: Line) -> bool:
        """Return whether a resolution restarts the rounds; that of an empty battery does not."""
        return (
            self.header.flat is None or self.obstacles[resolved.obstacle].type != self.header.flat
        )

    def _put_in_force(self, objectives: Mapping[str, Objective], line: int) -> None:
        self.helped = dict(self.named)
        for robot, objective in objectives.items():
            if self.objectives[robot] != objective:
                self.objectives = {**self.objectives, robot: objective}
                self._reset(robot, line)

    def _reset(self, robot: str, line: int) -> None:
        """Reset the progress of a robot with a new objective or strategy."""
        self.progress[robot] = self.progress[robot].reset(line)

    def _perhaps_changed(self, helpers: Iterable[str], line: int) -> None:
        """Reset helpers whose duty equals their own objective: they may now pursue either."""
        for robot in helpers:
            if self.objectives[robot] == self.own[robot]:
                self._reset(robot, line)

    def _rests(self, robot: str) -> None:
        """Relieve a robot out of service of its duty, until it is back and gets an objective."""
        self.resting = self.resting | {robot} if robot in self.out else self.resting - {robot}

    def _fail(self, robot: str, results: Iterable[str]) -> None:
        """Revoke a robot's part in the next needs of obstacles: its actions have failed."""
        for name in self.open.keys() & {*results}:
            done = self.open[name].done - {robot}
            self.open[name] = self.open[name]._replace(done=done)

    def _fit_again(self, *, robot: str = "", obstacle: str = "") -> None:
        """Let a robot act on all obstacles again, or all robots on one obstacle."""
        self.barred = {pair for pair in self.barred if robot != pair[0] and obstacle != pair[1]}

    def _drop(self, record: Line) -> None:
        """Remove an entry from the stack, even if it differs from the one that the line names."""
        found = [e for e in self.stack if e.obstacle == record.obstacle] or self.stack
        dropped = self.entry_of(record) or (found[-1] if found else None)
        if dropped is not None:
            self.stack.remove(dropped)

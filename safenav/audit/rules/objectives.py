"""Rules on objectives: goals, their order, rounds, targets out of turn, holding."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from safenav.audit.kinds import shape_of
from safenav.audit.lines import Line, Objective
from safenav.audit.rules.rule import Message, Rule, judges
from safenav.audit.run.passes import EITHER
from safenav.audit.run.progress import Progress, first_of
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import Turn


@judges("line", "goal")
def goal(record: Line, now: Situation) -> Iterator[Message]:
    """A goal line is true: the robot is in that region, which belongs to the target with that index
    of its objective in force. In a turn that changes the objective, it may be the objective before
    or after the change (T)."""
    robot, here = record.robot, now.region[record.robot]
    in_force = (now.turn.objectives[robot], now.objectives[robot])
    if record.region != here:
        place = now.show(record.region)
        yield f"{robot} is recorded to meet a goal at {place}, but is at {now.show(here)}"
    elif all(shape_of(one.kind).known for one in in_force) and not any(
        here in target for one in in_force for target in one.targets[record.goal :][:1]
    ):
        problem = f"{now.show(here)} is not target {record.goal} of {robot}"
        yield f"{problem}: {now.objectives[robot]}"


@judges("line", "goal")
def goal_order(record: Line, now: Situation) -> Iterator[Message]:
    """Targets are met in turn, forever, or in a kind with any order, each once in a round; none is
    met twice in one turn (D 3, Objectives). After a resynthesis any target may be next."""
    robot, progress = record.robot, now.progress[record.robot]
    for goal in now.turn.all("goal"):
        if (goal.robot, goal.goal) == (robot, record.goal) and goal.line > progress.reset_line:
            yield f"{robot} meets target {goal.goal} twice in one turn"
            return
    own = now.objectives[robot] == now.own[robot]
    if own and shape_of(now.objectives[robot].kind).ends and record.goal > progress.ahead:
        yield f"{robot} meets target {record.goal}, but {progress.ahead} is next"
        return
    if progress.reset_line >= now.turn.line:
        return  # may count for the previous objective
    if progress.awaited is not None and record.goal != progress.awaited:
        yield f"{robot} meets target {record.goal}, but {progress.awaited} is next"
    if progress.fresh and record.goal in progress.covered:
        yield f"{robot} meets target {record.goal} a second time in one round"


@judges("turn")
def out_of_turn(now: Situation) -> Iterator[Message]:
    """The paper's Patrol (its equation for Patrol_p): after meeting a target a robot leaves it with
    its next step, and it never touches a target out of turn, unless it is assigned alternation or
    moved by a joint plan (D 5.3 and 5.4)."""
    turn = now.turn
    progress = _steady(turn, now)
    if progress is None or turn.robot is None:
        return
    robot, here, objective = turn.robot, now.region[turn.robot], turn.objectives[turn.robot]
    if not shape_of(objective.kind).strict:
        return
    if now.alternates(robot) or not _by_strategy(turn):
        return
    if now.toward[robot] is not None:
        return  # it is leaving: a step of several ticks
    if progress.awaited is None and turn.on_the_way:
        return  # it had another objective when it departed
    for index, target in enumerate(objective.targets):
        if here in target and turn.origin in target:
            yield f"{robot} does not leave {now.show(here)} immediately after meeting it"
        elif here in target and progress.awaited not in (None, index):
            yield f"{robot} crosses the target {now.show(here)} out of turn"


@judges("turn")
def missed_goal(now: Situation) -> Iterator[Message]:
    """A robot that reaches its next target has a goal line, as has one whose new strategy begins on
    its first target (in lockstep) (T). In a live run passes take no time,
    so a robot that stays in all its targets needs no more lines after the rounds of ``until``
    (after one round, if the objective is not its own)."""
    turn = now.turn
    for synthesis in () if now.live or now.is_cut_short() else turn.all("synthesis"):
        robot = synthesis.robot
        same = (s for s in turn.all("synthesis") if s.objective == synthesis.objective)
        since = min(s.line for s in same if s.robot == robot)  # a second one counts no new goal
        recorded = any(goal.robot == robot and goal.line > since for goal in turn.all("goal"))
        if not recorded and _begins_on_target(synthesis, now):
            place = now.show(now.region[robot])
            yield robot, f"{robot} begins on its target {place}, but the goal line is missing"
    progress = _steady(turn, now)
    if progress is None or turn.robot is None or now.is_cut_short():
        return
    robot, move, objective = turn.robot, turn.first("move"), turn.objectives[turn.robot]
    if now.had_turn(robot, turn.tick):
        return  # it had its turn in that tick before the run was continued
    here = now.region[robot] if move is None else move.to  # an operator may have moved it since
    if robot in now.acting:
        return  # goals count when its action has ended
    if now.toward[robot] is not None:
        return  # it is leaving: only a robot that ends a step, or stays, meets a target
    met = {goal.goal for goal in turn.all("goal")}
    crosses = shape_of(objective.kind).strict and not _by_strategy(turn)
    if progress.awaited is None and (now.alternates(robot) or crosses or turn.on_the_way):
        return  # the next target is not known yet
    if now.live and _stays_in_all(objective, turn.origin, here):
        own = objective == now.own[robot]
        if (progress.last_round or 0) >= (now.header.until.rounds if own else 1):
            return
    for index, target in enumerate(objective.targets):
        if here in target and index not in met and _is_due(objective, progress, index, turn.origin):
            yield f"{robot} reaches its target {now.show(here)}, but the goal line is missing"


class RoundsRule(Rule):
    """Rounds add up: among as many consecutive goals as there are targets, exactly one completes a
    round, and the outcome records the last number. Counting may restart when the robot gets another
    objective or strategy, and when an obstacle is resolved or joins O (for robots driven by command
    inputs: when a need of it is met). After a push, a pop or a synthesis for the robot's own
    objective, it may also continue from the earlier number (D 5.8, T)."""

    name = "rounds"

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self._own: dict[str, int] = {}  # the last round of the robot's own objective
        self._steps: dict[str, list[int]] = {}
        self._unsure: set[str] = set()
        self._pushed: list[tuple[dict[str, int], bool]] = []  # and whether a resolution followed

    def opening(self, now: Situation) -> Iterable[Message]:
        self._last = {name: done.rounds or 0 for name, done in now.done.items()}
        self._own = dict(self._last)
        return ()

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        advances = record.type == "met" and now.header.coordination == "assignable"
        if advances or record.type in ("resolved", "blocked", "push", "pop"):
            self._unsure.update(now.header.robots)
        if record.type == "resolved" and now.restarts(record):  # earlier rounds no longer count
            self._pushed = [(before, True) for before, _ in self._pushed]
        elif record.type == "push":
            self._pushed.append((dict(self._last), False))
            for robot, objective in record.objectives.items():
                if objective == now.own[robot] != now.objectives[robot]:  # its duty is interrupted
                    self._last[robot] = self._own.get(robot, 0)
        elif record.type == "pop" and self._pushed:
            before, since = self._pushed.pop()
            for robot, objective in record.objectives.items():
                if objective == now.own[robot] != now.objectives[robot]:
                    self._last[robot] = self._own.get(robot, 0)
                elif objective != now.objectives[robot]:
                    self._last[robot] = before.get(robot, 0)
                elif objective == now.own[robot] and not since:  # its duty equalled its objective
                    self._last[robot] = max(self._last.get(robot, 0), before.get(robot, 0))
        elif record.type == "told":
            self._unsure.add(record.robot)
            if record.objective == now.own[record.robot]:
                self._last[record.robot] = self._own.get(record.robot, 0)
        elif record.type == "objective":
            self._own[record.robot] = 0
            if record.at_once:  # else it continues with what it does
                self._unsure.add(record.robot)
                self._last[record.robot] = 0
        elif record.type in ("synthesis", "assumption"):
            self._unsure.add(record.robot)
            begun, own = record.type == "synthesis", now.own[record.robot]
            if begun and record.objective == own != now.objectives[record.robot]:
                self._last[record.robot] = self._own.get(record.robot, 0)
        elif record.type == "goal":
            if now.objectives[record.robot] == now.own[record.robot]:
                self._own[record.robot] = record.round
            yield from self._counted(record, now.objectives[record.robot])

    def ending(self, now: Situation) -> Iterator[Message]:
        outcome = now.outcome
        for robot, objective in now.objectives.items():
            if outcome is None or shape_of(objective.kind).settles:
                continue  # a tick of staying at the last target has no line
            if objective.kind == "ltl" and '"liveness"' not in objective.body:
                continue  # each tick counts, without a line
            if objective != now.own[robot]:
                continue  # the outcome counts rounds of its own objective only
            last, stated = self._last.get(robot, 0), outcome.rounds.get(robot)
            if stated is None or stated == last or (robot in self._unsure and stated == 0):
                continue
            yield robot, f"{robot} has {stated} rounds in the outcome, but {last} in its goal lines"

    def _counted(self, record: Line, objective: Objective) -> Iterator[Message]:
        robot, last = record.robot, self._last.get(record.robot, 0)
        unsure = robot in self._unsure
        self._unsure.discard(robot)
        self._last[robot] = record.round
        steps = self._steps.setdefault(robot, [])
        if unsure:
            steps.clear()
        if not shape_of(objective.kind).recurs:
            if record.round < last and not unsure:
                yield f"the rounds of {robot} decrease from {last} to {record.round}"
            return
        if record.round in (last, last + 1):
            steps.append(record.round - last)
        elif not (unsure and record.round in (0, 1)):
            steps.clear()
            yield f"{robot}'s round {record.round} follows round {last}"
            return
        count = len(objective.targets)
        if unsure:
            steps.clear()
        elif len(steps) >= count and sum(steps[-count:]) != 1:
            yield f"{robot} completes {sum(steps[-count:])} rounds with {count} goals"
            steps.clear()


@judges("turn")
def hold(now: Situation) -> Iterator[Message]:
    """A robot that holds stays in its target once it has reached it, unless a joint plan moves it
    (D 3 and 5.4)."""
    turn = now.turn
    if turn.robot is None or turn.first("violation") is not None:
        return
    objective = turn.objectives[turn.robot]
    shape = shape_of(objective.kind)
    ended = shape.settles and (not shape.ends or _ended(turn.robot, now))
    if not ended or not objective.targets or not _by_strategy(turn):
        return
    if turn.on_the_way:
        return  # that was decided at its departure
    toward, move = now.toward[turn.robot], turn.first("move")
    here = move.to if move is not None and toward is None else toward
    target = objective.targets[-1]
    signal = now.signals.get(turn.robot)
    if signal is not None and signal.request and signal.assigned not in target:
        return  # it is assigned another region, for the next of several needs
    if here is not None and turn.origin in target and here not in target:
        yield f"{turn.robot} holds, but leaves for {now.show(here)}"


def _ended(robot: str, now: Situation) -> bool:
    """Return whether a robot has met all targets of its own objective, and pursues that."""
    own = now.own[robot]
    return now.objectives[robot] == own and now.progress[robot].ahead >= len(own.targets)


def _by_strategy(turn: Turn) -> bool:
    """Return whether its strategy decided the robot's move in this turn, as far as the trace
    shows."""
    move = turn.first("move")
    if turn.failed:
        return False  # it ended elsewhere
    return move is None or move.by in (None, "strategy", EITHER)


def _is_due(objective: Objective, progress: Progress, index: int, origin: int | None) -> bool:
    """Return whether reaching the target of that index is certainly a goal."""
    targets, shape = objective.targets, shape_of(objective.kind)
    came = origin not in targets[index]
    if shape.strict:
        return progress.awaited == index or (progress.awaited is None and came)
    if shape.in_turn:
        return progress.awaited == index and (came or len(targets) > 1)
    if shape.settles:
        return came
    return shape.covers and progress.fresh and came and index not in progress.covered


def _begins_on_target(synthesis: Line, now: Situation) -> bool:
    """Return whether a robot has met a target by getting another objective where it stands."""
    robot, objective, tick = synthesis.robot, synthesis.objective, synthesis.tick
    given = now.objectives[robot]
    new = now.turn.objectives[robot] != given != now.own[robot]  # it resumes its own one
    other = tick == 0 or (objective == given and new)
    if now.header.begun is not None and tick < 2:
        return False  # it may have had that objective in the first run
    if synthesis.node is None or not other or shape_of(objective.kind).covers:
        return False
    first = first_of(synthesis)
    stands = now.toward[robot] is None and synthesis.places is None
    there = objective.targets[first : first + 1]
    return stands and any(now.region[robot] in target for target in there)


def _stays_in_all(objective: Objective, origin: int | None, here: int) -> bool:
    """Return whether a robot that may leave its targets stays in a region of all of them."""
    stays = origin == here and not shape_of(objective.kind).settles
    return stays and all(here in target for target in objective.targets)


def _steady(turn: Turn, now: Situation) -> Progress | None:
    """Return the robot's progress when its turn began, if the same strategy drove it throughout."""
    if turn.robot is None or turn.first("violation") is not None or turn.failed:
        return None
    return None if now.progress[turn.robot].reset_line >= turn.line else turn.progress

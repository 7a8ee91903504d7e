"""Rules on live runs: times, commands and their ends, reasons to stay, and waits."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.kinds import STAYING
from safenav.audit.lines import Line
from safenav.audit.possibilities.deriving import is_stop
from safenav.audit.rules.rule import Message, Rule, differences, judges
from safenav.audit.run.actions import WITHOUT_EFFECT
from safenav.audit.run.situation import Situation
from safenav.audit.run.turn import (
    FINAL,
    ROUNDED,
    SCENARIO_CHANGES,
    Status,
    is_of_user,
    moment,
    taken,
)

_INTERVENTION = "intervention"
_WHILE_WAITING = ("interrupted", "error", "time_limit", "tick_limit", "late")
"""Outcomes that a run may have while the team waits."""
_LIVE = ("depart", "arrive", "act", "acted", "hold", "late", "operator")


class ClockRule(Rule):
    """Either all lines of a run have times or none, and times never decrease (T, Live runs)."""

    name = "clock"

    def __init__(self) -> None:
        self._last = 0.0

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if not now.live:
            dropped = record.type == "late" and record.event == _INTERVENTION
            dropped = dropped or (record.type == "acted" and now.external)
            if record.t is not None or (record.type in _LIVE and not dropped):
                yield None, "this line occurs in live runs only, but the run is in lockstep"
        elif record.t is None:
            if record.type != "move":
                yield None, "the time 't' of this line of a live run is missing"
        else:
            if record.t < self._last:
                before = f"before that of the last line, {self._last} s"
                yield None, f"its time, {record.t} s, is {before}"
            self._last = record.t


class CommandRule(Rule):
    """A robot gets a command only while it has none, with a new, higher number: to depart from its
    region to another, or to act. Each ``arrive`` and ``acted`` ends the open command of its robot.
    The robot has arrived at its destination, or is back if it was blocked; a lost robot is in some
    region. It leaves to others only obstacles on which its action has just failed. No robot departs
    while it is out of service (T, Live runs). In ticks, only failed actions have a line."""

    name, kinds = "command", ("depart", "act", "arrive", "acted")

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type in ("depart", "act"):
            yield from self._begun(record, now)
            self._numbers[record.robot] = record.command
        else:
            yield from (self._arrived if record.type == "arrive" else self._acted)(record, now)

    def _begun(self, record: Line, now: Situation) -> Iterator[str]:
        robot = record.robot
        if robot in now.under_way or robot in now.acting:
            yield f"{robot} gets command {record.command} before the last one has ended"
        if record.command <= self._numbers.get(robot, -1):
            yield f"the command number {record.command} of {robot} is not new"
        if record.type == "depart":
            yield from differences(record, now, from_=now.region[robot])
            if robot in now.out:
                yield f"{robot} departs, but is out of service"
            taking = [one for one, act in now.acting.items() if robot in act.robots]
            if taking and robot not in taking:
                yield f"{robot} departs while it takes part in an action of {taking[0]}"

    def _acted(self, record: Line, now: Situation) -> Iterator[str]:
        robot, act = record.robot, now.acting.get(record.robot)
        if not now.live:
            yield from self._fails(record, now)
            return
        if act is None or act.command != record.command:
            yield f"{robot} has acted by command {record.command}, which is not open"
            return
        single = {n for n in act.obstacles if n in now.obstacles and now.resolves_alone(n)}
        if missing := single - record.results.keys():
            yield f"no result for {', '.join(sorted(missing))}, on which {robot} acted"
        if record.reason and record.results and not {*WITHOUT_EFFECT} & {*record.results.values()}:
            yield f"{robot} has acted without a failure, but has a reason for one: {record.reason}"
        for name in record.barred or ():
            if record.results.get(name) != "failed":
                yield f"{robot} leaves {name} to other robots, but its action has not failed"

    def _fails(self, record: Line, now: Situation) -> Iterator[str]:
        for name, result in record.results.items():
            if result != "failed" or record.robot not in now.standing(name):
                yield f"{record.robot} cannot fail to resolve {name} where it is"
        for name in {*(record.barred or ())} - record.results.keys():
            yield f"{record.robot} leaves {name} to other robots, but its action has not failed"

    def _arrived(self, record: Line, now: Situation) -> Iterator[str]:
        robot, depart = record.robot, now.under_way.get(record.robot)
        if depart is None or depart.command != record.command:
            yield f"{robot} ends command {record.command}, which is not open"
            return
        wanted = {"arrived": depart.to, "blocked": depart.from_}
        yield from differences(record, now, at=wanted.get(record.result, record.at))
        if record.result == "lost" and not record.regions:
            yield f"{robot} is lost, but its possible regions are missing"
        if record.result == "arrived":
            yield from differences(record, now, heading=depart.heading)


@judges("line", "act")
def act(record: Line, now: Situation) -> Iterator[Message]:
    """A robot that acts and all that take part stand still, where they can perform the next action
    of an obstacle that the line names (T, Live runs)."""
    if record.robot not in record.robots:
        yield f"{record.robot} is not among the robots of its action"
    for robot in record.robots:
        if robot in now.under_way:
            yield robot, f"{robot} acts, but is in transit"
    for name in record.obstacles:
        if name not in now.obstacles:
            yield f"{name} is not known"
        elif not set(record.robots) & now.standing(name):
            yield f"none of {', '.join(record.robots)} can act on {name} from there"


class HoldsRule(Rule):
    """A robot stays for the reason that its line names: it acts, is out of service, takes part in a
    joint plan, or the team waits for an operator. Only changes are recorded (T, Live runs)."""

    name = "holds"

    def __init__(self) -> None:
        self._why: dict[str, tuple[object, ...]] = {}
        self._acts: Line | None = None

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type in ("move", "goal", "belief"):
            return
        held, self._acts = self._acts, None
        if held is not None and not (record.type == "act" and held.robot in record.robots):
            yield held.robot, f"{held.robot} stays to act, but does not", held
        match record.type:
            case "hold":
                yield from self._held(record, now)
                self._why[record.robot] = record.why, record.signal, record.shown
            case "depart":
                self._why.pop(record.robot, None)

    def _held(self, record: Line, now: Situation) -> Iterator[Message]:
        robot = record.robot
        if robot in now.under_way:
            yield f"{robot} stays, but is in transit"
            return
        if self._why.get(robot) == (record.why, record.signal, record.shown):
            yield f"{robot} stays for the same reason as before"
            return
        if record.why == "acting":
            taking = any(robot in act.robots for act in now.acting.values())
            self._acts = None if taking else record  # an ``act`` line follows immediately
        true = {
            "service": robot in now.out,
            "plan": now.plan is not None and robot in now.plan.robots,
            "operator": now.waits is not None,
        }
        if not true.get(record.why, True):
            yield f"{robot} is recorded to stay for the reason '{record.why}', which does not apply"


class LateRule(Rule):
    """A report is dropped for a reason: it answers a command that is not open, or concerns a time
    before the last report on its obstacle (T, Live runs)."""

    name, kinds = "late", ("resolved", "gone", "appeared", "acted", "late")

    def __init__(self) -> None:
        self._learnt: dict[str, float] = {}

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        if record.type != "late":
            names = record.results if record.type == "acted" else [record.obstacle]
            self._learnt |= {} if record.t is None else dict.fromkeys(names, record.t)
            return
        if not record.reason:
            yield "a report is dropped without a reason"
        open_ = [now.under_way.get(record.robot or ""), now.acting.get(record.robot or "")]
        numbers = {command.command for command in open_ if command is not None}
        if record.command is not None and record.command in numbers:
            yield f"the event that ends command {record.command} of {record.robot} is dropped"
        learnt = self._learnt.get(record.obstacle or "", -1.0)
        about = record.command is None and record.obstacle is not None
        if about and record.at is not None and record.at > learnt + ROUNDED:
            yield (
                None,
                f"the report on {record.obstacle} is dropped, but newer than the knowledge of it",
            )


def _goes_on(record: Line, now: Situation) -> bool:
    """Return whether a robot may continue while the team waits."""
    robot, own = record.robot, now.own[record.robot]
    if own.kind == "ltl" or now.has_heading(robot):
        return False
    asked = (*now.requests.values(), *now.given_up.values())
    needs_help = any(robot in requesters for requesters in asked)
    if _charges(robot, now) and not (needs_help and record.type == "act"):
        return True
    if not needs_help:
        return now.objectives[robot] == own
    meanwhile, present = now.header.robots[robot].while_waiting, now.objectives[robot]
    kept = meanwhile is not None and (present.kind, present.targets) == (
        meanwhile.kind,
        meanwhile.targets,
    )
    return kept and now.waits is not None and now.waits.until is not None


def _charges(robot: str, now: Situation) -> bool:
    """Return whether a robot pursues a charging stop: a charger, or the target after which its
    charge suffices."""
    present = now.objectives[robot]
    stays = present.kind == STAYING and present != now.own[robot]
    return stays and is_stop(robot, present.targets, now)


class WaitingRule(Rule):
    """While the team waits for an operator or a change of the scenario, only robots that can undo
    each step (free mobility) get commands: those that pursue their own objective and wait for
    nothing, and those that go to a charger (they do not act on the way if they wait for help).
    Until a change, also those that pursue their objective while they wait, and all robots
    may act where they stand. A wait names a possible outcome of the run, expects a change (in
    lockstep), and ends with one. A reopened obstacle was given up, not found untraversable, and is
    reopened by an operator or after a change. An operator puts a robot where no robot in conflict
    is (T, Live runs)."""

    name = "waiting"

    def __init__(self) -> None:
        self._hope = False
        self._changed = -1  # tick of the last change; obstacles given up in it are reopened too

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        ended = now.ends_wait(record)
        waiting = None if ended else now.waits
        if ended and record.type != "operator":
            self._hope, self._changed = True, record.tick
        match record.type:
            case "inputs" if now.repeats_inputs(record):
                pass
            case "waiting":
                if waiting is not None:
                    yield "the team waits already"
                ends = ["operator_needed", "assumption_violated", "search_limit"]
                ends += ["time_limit"] if now.inputs and now.live else []  # for an input
                if record.outcome not in ends:
                    yield f"no robot waits because of {record.outcome}"
                until = record.until
                if record.t is None if until is None else until <= moment(record):
                    yield "the team waits, but no change is due"
            case "act" if waiting is not None and waiting.until is not None:
                pass  # no robot moves for it
            case "depart" | "act" | "move" if waiting is not None and self._waits(record, now):
                yield f"{record.robot} gets a command while the team waits"
            case "gone" if not is_of_user(record):
                self._hope = True
            case "service" if not is_of_user(record):
                by_now = waiting is None or waiting.until is None
                self._hope = self._hope or (record.active and by_now)
            case kind if kind in SCENARIO_CHANGES and waiting is None:
                self._hope, self._changed = True, record.tick
            case "operator":
                self._hope = True
                yield from self._put_down(record, now)
            case "reopened":
                if now.status[record.obstacle] is not Status.GIVEN_UP:
                    yield f"{record.obstacle} is reopened, but was not given up"
                elif not self._hope and record.tick != self._changed:
                    yield f"{record.obstacle} is reopened, but nothing has changed"
            case "blocked" if record.reason not in FINAL:
                self._hope = False
            case "outcome" if waiting is not None:
                if record.outcome not in (*_WHILE_WAITING, waiting.outcome):
                    yield f"the run ends as {record.outcome} while it waits"

    def _waits(self, record: Line, now: Situation) -> bool:
        """Return whether a robot that must stay departs or acts; in a user's world it may be moved
        elsewhere."""
        if _goes_on(record, now) or (now.has_failed(record.robot) and not now.live):
            return False
        if record.type != "move":
            return True
        departs = taken(record) != {now.region[record.robot]}
        return departs and not now.live and now.toward[record.robot] is None

    def _put_down(self, record: Line, now: Situation) -> Iterator[str]:
        if record.intervention != "put_back" or record.robot is None:
            return
        if record.region is None or not now.grid.is_free(record.region):
            yield f"{record.robot} is put down on a region that is not free"
            return
        for other in now.region:
            apart = other != record.robot and now.conflict(record.robot, other)
            if apart and record.region in now.taken_by(other):
                yield f"{record.robot} is put down where {other} is"

"""Rules on asking for help: the request, the bids, the choice of the helper."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation, Status
from safenav.trace.records import (
    Appeared,
    Blocked,
    Gone,
    Push,
    Record,
    Request,
    Resolved,
    Synthesis,
    Violation,
)
from safenav.trace.vocabulary import OperatorCause, RecordedVerdict, Region


class RequestRule(Rule):
    """Who meets an obstacle asks for help in the same turn, once and for that obstacle, unless
    it has asked before, or resolves it where it stands; the regions are those where its next
    need can be met. In version 1 a helper that is found gets its task, and if there is none the
    obstacle joins O, save where requests are cyclic; since version 2 a request stays open (D 5.2, T
    Time)."""

    name = "request"

    def __init__(self) -> None:
        self._open: set[tuple[str, str]] = set()

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Request):
            for problem in self._problems(record, now):
                yield self.broken_by(record, record.requester, problem)
            self._open.add((record.obstacle, record.requester))
        elif isinstance(record, Resolved | Gone | Appeared):
            over = {key for key in self._open if key[0] == record.obstacle}
            if not isinstance(record, Resolved) or now.is_last_need(record):
                self._open -= over

    def turn(self, now: Situation) -> Iterator[Finding]:
        turn = now.turn
        if turn.torn:
            return
        violation, requests = turn.first(Violation), turn.all(Request)
        asked = (
            now.derived
            and violation is not None
            and ((violation.obstacle, violation.robot) in self._open)
        )
        at_once = violation is not None and now.is_over(violation.obstacle)
        if violation is not None and not (requests or asked or at_once or now.is_cut_short()):
            problem = f"{turn.robot} meets {violation.obstacle} and does not ask for help"
            yield self.broken_by(violation, turn.robot, problem)
        for request in () if now.derived else requests:
            yield from self._consequences(request, now)

    def _consequences(self, request: Request, now: Situation) -> Iterator[Finding]:
        turn = now.turn
        wanted = (request.obstacle, request.requester, request.helper)
        pushed = any(wanted == (p.obstacle, p.requester, p.helper) for p in turn.all(Push))
        if request.helper is not None and not pushed and not turn.final:
            problem = f"{request.helper} is to help with {request.obstacle} but is given no task"
            yield self.broken_by(request, request.requester, problem)
        given_up = any(b.obstacle == request.obstacle for b in turn.all(Blocked))
        cyclic = now.outcome is not None and now.outcome.cause is OperatorCause.CYCLIC_REQUESTS
        if request.helper is None and not given_up and not (turn.final and cyclic):
            problem = f"nobody helps with {request.obstacle}, but it does not join the obstacles"
            yield self.broken_by(request, request.requester, problem)

    def _problems(self, record: Request, now: Situation) -> Iterator[str]:
        if replaces_helper(record, now):
            return
        violation = now.turn.first(Violation)
        met = now.derived and record.obstacle in now.discovered
        if not met and (violation is None or violation.obstacle != record.obstacle):
            yield f"{record.requester} asks for {record.obstacle} without having met it"
        if now.turn.first(Request) is not None and not now.derived:
            yield f"{record.requester} asks twice in one turn"
        if record.need is not None and record.need != now.stage[record.obstacle]:
            stage = now.stage[record.obstacle]
            yield f"need {record.need} of {record.obstacle} is asked for, but {stage} is next"
        listed = now.need(record.obstacle).regions
        wanted = {region for region in listed if now.grid.is_free(region)}
        if set(record.regions) - set(listed) or not wanted <= set(record.regions):
            told, truth = _list(record.regions), _list(sorted(wanted))
            yield f"{record.obstacle} can be resolved at {truth}, not at {told}"


class BidsRule(Rule):
    """Exactly the robots that have the action bid, each its distance under its own mobility
    (D 5.4). Obstacles that were met but not yet resolved, and robots in the way, may or may not
    be counted as passable: the design leaves that open, so any bid in between is accepted. A robot
    out of service gets nowhere."""

    name = "bids"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if not isinstance(record, Request):
            return
        able = now.capable(record.obstacle)
        for robot in sorted(set(record.bids) - able):
            problem = f"{robot} bids for {record.obstacle}, but lacks the action"
            yield self.broken_by(record, robot, problem)
        for robot in sorted(able - set(record.bids)):
            problem = f"{robot} could resolve {record.obstacle}, but does not bid"
            yield self.broken_by(record, robot, problem)
        for robot in sorted(able & set(record.bids)):
            least, most = _distances(robot, record.obstacle, now)
            bid = record.bids[robot]
            if now.derived and (bid is not None or _by_formulas(robot, now)):
                most = None  # bids are in ticks, a step may take several, and formulas forbid ways
            if not _between(least, bid, most):
                told = "no way" if bid is None else f"{bid} steps"
                truth = "no way" if least is None else f"{least} steps"
                problem = f"{robot} bids {told} to {record.obstacle}; its shortest way is {truth}"
                yield self.broken_by(record, robot, problem)


class HelperRule(Rule):
    """Helpers are robots that bid. In version 1 the lowest bid wins, ties by the order of the
    team. A lower bidder is passed over only if its synthesis failed in this turn, or that of a
    robot which does not bid (so that the fault may be with the whole plan), or if it waits for
    help itself (which may be a cycle: D 5.4 and 5.7). So every failure that decides must be in
    the trace. Since version 2 duties follow from the whole situation (D 5.2)."""

    name = "helper"

    def turn(self, now: Situation) -> Iterator[Finding]:
        # When the turn is over, so that failed attempts count wherever they were written.
        request = now.turn.first(Request)
        if request is None or now.turn.torn:
            return
        if now.derived:
            yield from self._without_bid(now)
            return
        if request.helper is not None and request.bids.get(request.helper) is None:
            problem = f"{request.helper} is chosen for {request.obstacle} without a bid"
            yield self.broken_by(request, request.helper, problem)
            return
        order = list(now.header.robots)
        bidders = [(bid, order.index(r), r) for r, bid in request.bids.items() if bid is not None]
        failed = _failed(now)
        if failed - request.bids.keys():
            return
        pushed = len(now.turn.all(Push))
        waiting = {entry.requester for entry in now.stack[: len(now.stack) - pushed]}
        for _, _, robot in sorted(bidders):
            if robot == request.helper:
                return
            if robot not in failed and robot not in waiting:
                chosen = request.helper or "nobody"
                problem = f"{robot} bids least for {request.obstacle}, but {chosen} is chosen"
                yield self.broken_by(request, robot, problem)
                return

    def _without_bid(self, now: Situation) -> Iterator[Finding]:
        for request in now.turn.all(Request):
            asked = {*(request.helpers or ()), request.helper} - {None}
            for robot in sorted(name for name in asked if name is not None):
                if request.bids.get(robot) is None:
                    problem = f"{robot} is chosen for {request.obstacle} without a bid"
                    yield self.broken_by(request, robot, problem)
            need = now.need(request.obstacle)
            if request.helpers and len(request.helpers) > need.robots:
                problem = f"{request.obstacle} takes {need.robots} robots, but others are asked"
                yield self.broken_by(request, None, problem)


def replaces_helper(record: Request, now: Situation) -> bool:
    """Whether a request is made again because its helper has lost its strategy (T, Time)."""
    failed = _failed(now)
    return any(
        entry.obstacle == record.obstacle
        and entry.requester == record.requester
        and entry.helper in failed
        for entry in now.stack
    )


def _failed(now: Situation) -> set[str]:
    """Whose synthesis failed in this turn."""
    return {
        synthesis.robot
        for synthesis in now.turn.all(Synthesis)
        if synthesis.verdict is not RecordedVerdict.REALIZABLE
    }


def _distances(robot: str, obstacle: str, now: Situation) -> tuple[int | None, int | None]:
    """The least and the greatest distance that the robot can rightly bid."""
    targets = [r for r in now.need(obstacle).regions if now.grid.is_free(r)]
    closed: set[Region] = set()
    for name, other in now.obstacles.items():
        known = now.status[name] in (Status.UNTRAVERSABLE, Status.GIVEN_UP)
        met = name in now.discovered and now.status[name] is Status.UNRESOLVED
        if (known or met) and robot in now.blocked_by(name):
            closed.add(other.region)
    if robot in now.out:
        return (0, 0) if (now.toward[robot] or now.region[robot]) in targets else (None, None)
    layer = now.header.robots[robot].layer
    others = {r for n, r in now.region.items() if now.header.robots[n].layer == layer}
    here, bound = now.region[robot], now.toward[robot]
    heading = now.heading[robot] if bound is None else now.grid.direction(here, bound)
    pose = (now.has_heading(robot), here if bound is None else bound, heading)
    least = now.grid.distance(*pose, targets, ())
    most = now.grid.distance(*pose, targets, closed | (others - {now.region[robot]}))
    return least, most


def _by_formulas(robot: str, now: Situation) -> bool:
    return now.header.robots[robot].objective.kind == "ltl"


def _between(least: int | None, bid: int | None, most: int | None) -> bool:
    if bid is None:
        return most is None
    return least is not None and least <= bid and (most is None or bid <= most)


def _list(regions: tuple[Region, ...] | list[Region]) -> str:
    return ", ".join(map(str, regions)) or "nowhere"

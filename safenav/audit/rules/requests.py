"""Rules on asking for help: the request, the bids, the choice of the helper."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.audit.rules.rule import Finding, Rule
from safenav.audit.situation import Situation, Status
from safenav.trace.records import (
    Blocked,
    OperatorCause,
    Push,
    Record,
    Region,
    Request,
    Synthesis,
    Verdict,
    Violation,
)


class RequestRule(Rule):
    """Who meets an obstacle asks for help in the same turn, once and for that obstacle; the
    regions are those where it can be resolved; a helper that is found gets its task, and if
    there is none the obstacle joins O, save where requests are cyclic (D 5.4 and 5.7, T Time)."""

    name = "request"

    def line(self, record: Record, now: Situation) -> Iterator[Finding]:
        if isinstance(record, Request):
            for problem in self._problems(record, now):
                yield self.broken_by(record, record.requester, problem)

    def turn(self, now: Situation) -> Iterator[Finding]:
        turn = now.turn
        if turn.torn:
            return
        violation, requests = turn.first(Violation), turn.all(Request)
        if violation is not None and not requests and not now.is_cut_short():
            problem = f"{turn.robot} meets {violation.obstacle} and does not ask for help"
            yield self.broken_by(violation, turn.robot, problem)
        for request in requests:
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
        if violation is None or violation.obstacle != record.obstacle:
            yield f"{record.requester} asks for {record.obstacle} without having met it"
        if now.turn.first(Request) is not None:
            yield f"{record.requester} asks twice in one turn"
        listed = now.obstacles[record.obstacle].resolution_regions
        wanted = {region for region in listed if now.grid.is_free(region)}
        if set(record.regions) - set(listed) or not wanted <= set(record.regions):
            told, truth = _list(record.regions), _list(sorted(wanted))
            yield f"{record.obstacle} can be resolved at {truth}, not at {told}"


class BidsRule(Rule):
    """Exactly the robots that have the action bid, each its distance under its own mobility
    (D 5.4). Obstacles that were met but not yet resolved, and robots in the way, may or may not
    be counted as passable: the design leaves that open, so any bid in between is accepted."""

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
            if not _between(least, bid, most):
                told = "no way" if bid is None else f"{bid} steps"
                truth = "no way" if least is None else f"{least} steps"
                problem = f"{robot} bids {told} to {record.obstacle}; its shortest way is {truth}"
                yield self.broken_by(record, robot, problem)


class HelperRule(Rule):
    """The lowest bid wins, ties by the order of the team. A lower bidder is passed over only if
    its synthesis failed in this turn, or that of a robot which does not bid (so that the fault
    may be with the whole plan), or if it waits for help itself (which may be a cycle: D 5.4 and
    5.7). So every failure that decides must be in the trace."""

    name = "helper"

    def turn(self, now: Situation) -> Iterator[Finding]:
        # When the turn is over, so that failed attempts count wherever they were written.
        request = now.turn.first(Request)
        if request is None or now.turn.torn:
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
        waiting = {frame.requester for frame in now.stack[: len(now.stack) - pushed]}
        for _, _, robot in sorted(bidders):
            if robot == request.helper:
                return
            if robot not in failed and robot not in waiting:
                chosen = request.helper or "nobody"
                problem = f"{robot} bids least for {request.obstacle}, but {chosen} is chosen"
                yield self.broken_by(request, robot, problem)
                return


def replaces_helper(record: Request, now: Situation) -> bool:
    """Whether a request is made again because its helper has lost its strategy (T, Time)."""
    failed = _failed(now)
    return any(
        frame.obstacle == record.obstacle
        and frame.requester == record.requester
        and frame.helper in failed
        for frame in now.stack
    )


def _failed(now: Situation) -> set[str]:
    """Whose synthesis failed in this turn."""
    return {
        synthesis.robot
        for synthesis in now.turn.all(Synthesis)
        if synthesis.verdict is not Verdict.REALIZABLE
    }


def _distances(robot: str, obstacle: str, now: Situation) -> tuple[int | None, int | None]:
    """The least and the greatest distance that the robot can rightly bid."""
    targets = [r for r in now.obstacles[obstacle].resolution_regions if now.grid.is_free(r)]
    closed: set[Region] = set()
    for name, other in now.obstacles.items():
        known = now.status[name] in (Status.UNTRAVERSABLE, Status.GIVEN_UP)
        met = name in now.discovered and now.status[name] is Status.UNRESOLVED
        if (known or met) and robot in now.blocked_by(name):
            closed.add(other.region)
    layer = now.header.robots[robot].layer
    others = {r for n, r in now.region.items() if now.header.robots[n].layer == layer}
    here, bound = now.region[robot], now.toward[robot]
    heading = now.heading[robot] if bound is None else now.grid.direction(here, bound)
    pose = (now.has_heading(robot), here if bound is None else bound, heading)
    least = now.grid.distance(*pose, targets, ())
    most = now.grid.distance(*pose, targets, closed | (others - {now.region[robot]}))
    return least, most


def _between(least: int | None, bid: int | None, most: int | None) -> bool:
    if bid is None:
        return most is None
    return least is not None and least <= bid and (most is None or bid <= most)


def _list(regions: tuple[Region, ...] | list[Region]) -> str:
    return ", ".join(map(str, regions)) or "nowhere"

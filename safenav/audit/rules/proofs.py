"""Rules on infeasibility: each outcome ``operator_needed`` has a proof."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

from safenav.audit.formulas import rules_of
from safenav.audit.kinds import shape_of
from safenav.audit.language import Pose, closure
from safenav.audit.lines import Line, proof_of
from safenav.audit.possibilities.deriving import team_of
from safenav.audit.possibilities.team import Team, TooManyError
from safenav.audit.proofs.case import Case, case_of
from safenav.audit.proofs.closure import closure_problems, tree_problems
from safenav.audit.proofs.joint import can_be_served, joint_problems, room_problems
from safenav.audit.rules.rule import UNREAD, Finding, Message, Rule
from safenav.audit.run.remembering import remembered, row_of
from safenav.audit.run.situation import RESYNTHESIS, Situation
from safenav.audit.run.turn import FINAL, Status

MOST_SERVED = 20_000
"""Limit on the joint states enumerated for a request that is set aside."""


class ProofRule(Rule):
    """A run that needs an operator proves it: from the present poses and with the team's knowledge,
    no sequence of moves completes the mission (D 5.6, T). An obstacle that becomes permanent
    because no robot can ever resolve it also has its proof."""

    name = "proof"

    def __init__(self) -> None:
        self._given: set[str] = set()
        """The obstacles that were given up by a proof."""
        self._stale: set[str] = set()
        """Obstacles given up before another known obstacle disappeared."""
        self._memory: dict[tuple[str, str], Mapping[str, int] | None] = {}
        """Memory of each synthesis, by its robot and specification."""
        self._waited: tuple[str, frozenset[str]] = "", frozenset()
        """The explanation of the last wait, and the robots that had no strategy then."""
        self._judged: Mapping[str, Any] | None = None
        """The proof of a wait since which robots have changed the state, and nothing else."""

    def line(self, record: Line, now: Situation) -> Iterator[Message]:
        gives_up = record.type == "operator" and record.intervention == "give_up"
        if now.ends_wait(record) and not gives_up:
            self._judged = None
        if record.type == "synthesis":
            self._memory[record.robot, record.spec] = record.memory
        elif record.type in ("appeared", "gone", "reopened"):
            self._given.discard(record.obstacle)
            self._stale.discard(record.obstacle)
            if record.type == "gone" and record.obstacle in now.discovered:
                self._stale |= self._given
        elif record.type == "blocked" and record.reason not in FINAL:
            yield from self._given_up(record, now)
        elif record.type == "request" and record.aside:
            yield from self._aside(record, now)
        elif record.type in ("outcome", "waiting") and record.outcome == "operator_needed":
            if record.cause == "out_of_service":
                if not now.out:
                    yield "no robot is out of service"
                return
            proof = proof_of(record)
            if proof is None:
                if self._unrealizable(record, now):
                    return
                failed = {s.robot for s in now.turn.all("synthesis") if s.verdict == "unrealizable"}
                if record.type == "waiting":
                    self._waited = record.explanation, frozenset(failed)
                elif record.explanation == self._waited[0]:  # an operator ends the run as it waits
                    failed |= self._waited[1]
                lost = [name for name in _lost(record, now) if name in failed]
                among = [name for name in lost if _is_a_game(name, now)]
                if among:
                    own = "formulas" if now.own[among[0]].kind == "ltl" else "literal objective"
                    what = f"whether others or inputs can keep {among[0]} from its {own} forever"
                    yield self.not_judged(record, among[0], f"{what} (a bundle proves it)")
                elif bound := [name for name in lost if _must_leave(name, now)]:
                    what = f"whether {bound[0]} could go where its formulas let it stay"
                    yield self.not_judged(record, bound[0], what)
                else:
                    yield None, "an operator is needed, but that is not proven"
                return
            if record.type == "waiting":
                self._judged = proof
            elif proof == self._judged:
                return  # what robots have done since was possible before, so that it still holds
            stale = self._stale - now.permanent
            for name in sorted(n for n in stale if now.status[n] is Status.GIVEN_UP):
                yield name, f"{name} is still given up, though an obstacle has disappeared since"
            for name in _could_be_given_up(proof, now):
                yield f"no need of {name} can ever be met, but it does not become permanent"
            try:
                memory = _numbers(proof.get("memory") or {}, now)
                if isinstance(memory, str):
                    yield memory
                    return
                begins = record.tick == 0
                case = case_of(now, begins=begins, memory=memory)
                unread = [] if case else [self.not_judged(record, None, UNREAD)]
                yield from problems_of(proof, case) if case else unread
            except TooManyError as large:
                yield Finding(self.name, record.tick, None, record.line, str(large), unknown=True)

    def _unrealizable(self, record: Line, now: Situation) -> bool:
        """Return whether some robot has permanently lost its objective, as a synthesis states:
        alone, and without any obstacle that may yet be resolved, it cannot continue forever. True
        also if this check cannot read some robot's formulas."""
        team, stated = team_of(now), _lost(record, now)
        return any(
            team is None or not _continues(name, now, team, self._memory.get((name, spec)))
            for name, spec in stated.items()
            if name in now.region
        )

    def _aside(self, record: Line, now: Situation) -> Iterator[Message]:
        """Judge a request that is set aside: no order of moves completes the mission with its
        obstacle and those of the served requests resolved."""
        case, name = case_of(now), record.obstacle
        served = {name, *now.requests} - (now.aside - {name})
        can_be = None if case is None else can_be_served(served, case, MOST_SERVED)
        if can_be:
            problem = f"{name} is set aside, but robots can resolve it and complete the mission"
            yield record.requester, problem
        elif can_be is None:
            why = UNREAD if case is None else f"more than {MOST_SERVED} joint states"
            what = f"whether {name} can be resolved and the mission completed ({why})"
            yield self.not_judged(record, record.requester, what)

    def _given_up(self, record: Line, now: Situation) -> Iterator[Message]:
        """Judge an obstacle that is given up: it can never be resolved, even if every robot is back
        in service."""
        case = case_of(now, hopeful=True)
        proof = proof_of(record)
        if proof is not None:
            found = case and never_resolved_problems(proof, case, record.obstacle)
            yield from found or ()
        else:
            yield f"{record.obstacle} is given up without proof"
        self._given.add(record.obstacle)
        self._stale.discard(record.obstacle)


def _numbers(stated: Mapping[str, Any], now: Situation) -> Mapping[str, int] | str:
    """Return the number of each robot's formula memory in a proof, or why it is impossible."""
    found = dict[str, int]()
    for name, memory in stated.items():
        names = remembered(name, now) if name in now.own else None
        if names is None or {*names} != memory.keys():
            return f"the formulas of {name} do not remember {', '.join(memory) or 'nothing'}"
        if not now.memories.may_become(name, memory, now):
            return f"the formulas of {name} cannot remember {memory}"
        found[name] = rules_of(now.own[name]).valuations.index(row_of(memory, names))
    return found


def _lost(record: Line, now: Situation) -> Mapping[str, str]:
    """Return the robots that have lost their objective by a line, each with its specification."""
    if record.type == "outcome":
        return record.unrealizable or {}
    failed = [s for s in now.turn.all("synthesis") if s.verdict == "unrealizable"]
    return {synthesis.robot: synthesis.spec for synthesis in failed}  # a wait: those of the turn


def _is_a_game(name: str, now: Situation) -> bool:
    """Return whether this check cannot judge that a robot has no strategy, because it is a game
    against other robots or inputs: the robot has formulas, or a literal strict objective, on a
    shared floor or in zones of ``never_together``, or formulas with inputs."""
    own = now.own.get(name)
    if own is None or not (own.kind == "ltl" or (own.literal and shape_of(own.kind).strict)):
        return False
    hears = own.kind == "ltl" and bool(json.loads(own.body).get("inputs"))
    others = (other for other in now.header.robots if other != name)
    return hears or any(now.conflict(name, o) or now.zones(name, o) for o in others)


def _must_leave(name: str, now: Situation) -> bool:
    """Return whether a robot's formulas forbid it to stay where it is, so that it cannot wait there
    for a resolution by others."""
    own = now.own.get(name)
    if own is None or own.kind != "ltl":
        return False  # ``always`` does not concern a robot that stays
    return not rules_of(own).allows(now.pose(name), now.pose(name))


def _could_be_given_up(proof: Mapping[str, Any], now: Situation) -> Iterator[str]:
    """Yield the open obstacles whose next need can never be met, as a closure shows."""
    if proof.get("kind") != "closure" or now.out:
        return
    regions = {name: {r for r, _ in reach["poses"]} for name, reach in proof["robots"].items()}
    for name in proof["never"]:
        if name in now.obstacles and now.status[name] is Status.UNRESOLVED:
            need = now.need(name)
            done = frozenset[str]() if need.together else now.open[name].done
            there = [
                robot
                for robot in need.able - done - now.unmet(now.open[name])[0].cut_off
                if regions.get(robot, set()) & set(need.regions)
            ]
            if len(there) < need.robots - len(done):
                yield name


def _continues(name: str, now: Situation, team: Team, memory: Mapping[str, int] | None) -> bool:
    """Return whether a robot alone can continue forever from its pose, with the ``memory`` of its
    formulas if that is known."""
    own, here = now.own[name], frozenset([now.pose(name)])
    if shape_of(own.kind).ends and name not in now.out:
        for target in own.targets[min(now.progress[name].ahead, len(own.targets) - 1) :]:
            here = frozenset(p for p in team.reach(name, here, ()) if p[0] in target)
        if now.header.coordination != RESYNTHESIS:  # it may be sent away, and must come back
            here = frozenset(p for p in here if _comes_back(name, p, team))
        return bool(here)
    if own.kind == "ltl" and memory is not None and name not in now.out:
        formulas = rules_of(own)
        rows = [tuple(memory.get(variable, -1) for variable in formulas.names)]
        rows = [row for row in rows if row in formulas.valuations]
        if formulas.names and not memory:  # they begin
            rows = formulas.begins(now.pose(name))
        if rows:
            live = formulas.live(team.reach(name, here, ()), team.members[name].steps)
            return any((now.pose(name), formulas.valuations.index(row)) in live for row in rows)
    if own.literal and shape_of(own.kind).strict and memory and name not in now.out:
        turn = next(iter(memory.values()))
        return team.can_continue(name, here, ()) and _keeps_order(name, now, team, turn)
    return team.can_continue(name, here, ())


def _comes_back(name: str, pose: Pose, team: Team) -> bool:
    """Return whether a robot alone can leave the region of a pose and return to that pose."""
    steps = team.members[name].steps.get(pose, ())
    away = frozenset(to for to in steps if to[0] != pose[0])
    return pose in team.reach(name, away, ())


def _keeps_order(name: str, now: Situation, team: Team, turn: int) -> bool:
    """Return whether a robot alone can meet its targets in turn forever from its pose, from target
    number ``turn`` on, without touching one out of turn: whether it reaches a cycle on which it
    meets the first target."""
    targets, walkable = now.own[name].targets, team.reach(name, frozenset([now.pose(name)]), ())
    steps = team.members[name].steps

    def after(state: tuple[Pose, int]) -> Iterator[tuple[Pose, int]]:
        pose, due = state
        due = (due + 1) % len(targets) if pose[0] in targets[due] else due
        shut = frozenset[int]().union(*(t for k, t in enumerate(targets) if k != due))
        yield from ((to, due) for to in steps[pose] if to in walkable and to[0] not in shut)

    found = closure([(now.pose(name), turn)], after)
    first = [state for state in found if state[1] == 0 and state[0][0] in targets[0]]
    return any(state in closure(after(state), after) for state in first)


def problems_of(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield why this proof does not show that the mission cannot be completed in that case."""
    closures = partial(closure_problems, lame=True)
    problems: Mapping[str, Callable[..., Iterator[str]]]
    problems = {"closure": closures, "tree": tree_problems, "joint": joint_problems}
    problems |= {"room": room_problems}
    if proof.get("kind") not in problems:
        yield f"unknown kind of proof: {proof.get('kind')!r}"
    else:
        yield from _read(problems[proof["kind"]](proof, case))


def never_resolved_problems(proof: Mapping[str, Any], case: Case, obstacle: str) -> Iterator[str]:
    """Yield why this proof does not show that an obstacle can never be resolved."""
    if proof.get("kind") != "closure":
        yield f"only a closure proves that {obstacle} can never be resolved"
        return
    if obstacle not in proof.get("never", ()):
        yield f"{obstacle} is not among the obstacles that are never resolved"
    yield from _read(closure_problems(proof, case, lame=False))


def _read(problems: Iterator[str]) -> Iterator[str]:
    try:
        yield from problems
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        yield f"the proof cannot be read: {error!r}"

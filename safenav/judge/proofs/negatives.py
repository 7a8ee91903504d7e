"""Claims that the mission cannot be completed, and the proof of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from safenav.judge.formulas import Pose, all_memories
from safenav.judge.lines import Line
from safenav.judge.proofs.case import Case, TooLargeError
from safenav.judge.proofs.joint import can_complete, joint_problems, room_problems
from safenav.judge.proofs.tables import closure_problems, tree_problems
from safenav.judge.rule import NotJudged
from safenav.judge.state import Robot, State, agrees
from safenav.judge.world import closure

MOST_SERVED = 20_000
TOO_LARGE = "whether the proof holds: {}"


def negative_problems(e: Line, s: State) -> Iterator[str]:
    """Yield why an `operator_needed` is not proven."""
    if e.cause == "out_of_service":
        yield from _out_of_service_problems(e, s)
        return
    if unread := _unread(s):
        yield NotJudged(f"why an operator is needed: the formulas of {unread} have many memories")
        return
    if e.proof is None:
        yield from _lost_problems(e, s)
        return
    numbers = {}
    for name, stated in (e.proof.memory or {}).items():
        if (number := _memory(name, stated, s)) is None:
            yield f"the formulas of {name} cannot remember {', '.join(stated)} so"
            return
        numbers[name] = number
    case = Case(s, memory=numbers)
    if e.cause not in (causes := _causes(e.proof, case)):
        yield f"its cause is {e.cause}; proven is {causes[0]}"
    try:
        match e.proof.kind:
            case "closure":
                yield from closure_problems(e.proof, case, lame=True)
            case "tree":
                yield from tree_problems(e.proof, case)
            case "joint":
                yield from joint_problems(e.proof, case)
            case "room":
                yield from room_problems(e.proof, case)
    except TooLargeError as error:
        yield NotJudged(TOO_LARGE.format(error))


def shut_problems(e: Line, s: State) -> Iterator[str]:
    """Yield why an obstacle that is given up may still be resolved, with all robots in service."""
    if e.proof.kind != "closure" or e.obstacle not in e.proof.never:
        yield f"only a closure with {e.obstacle} among its `never` proves that"
    elif unread := _unread(s):
        yield NotJudged(f"whether {e.obstacle} can be resolved: {unread} has many memories")
    else:
        yield from closure_problems(e.proof, Case(s, hopeful=True), lame=False)


def _unread(s: State) -> str:
    each = ((name, robot.own.formulas) for name, robot in s.robots.items())
    return ", ".join(name for name, formulas in each if formulas and not formulas.whole)


def _causes(proof: Line, case: Case) -> tuple[str, ...]:
    """Return the causes that a proof shows, the most specific first."""
    if proof.kind in ("joint", "room"):
        return ("deadlock",)
    if proof.kind == "tree" or not proof.never:
        return ("unrealizable",)
    known = [case.state.obstacles[name] for name in proof.never if name in case.state.obstacles]
    short = [[len(need.able) < need.robots for need in one.needs[one.stage :]] for one in known]
    if any(few[0] for few in short if few):
        return ("no_capable_robot",)
    others = ("never_resolvable", "cyclic_requests")
    return (*others, "no_capable_robot") if any(map(any, short)) else others


def _out_of_service_problems(e: Line, s: State) -> Iterator[str]:
    """Robots are out of service, and the others cannot do their part of the mission."""
    if not any(robot.out for robot in s.robots.values()):
        yield "no robot is out of service"
    elif e.kind == "outcome" and not any(robot.acts for robot in s.robots.values()):
        case = Case(s)
        try:
            if done := can_complete(case, MOST_SERVED):
                yield f"the robots in service can do their part of the mission, with {done}"
        except TooLargeError as error:
            yield NotJudged(f"whether the robots in service can do their part: {error}")


def _lost_problems(e: Line, s: State) -> Iterator[str]:
    """Some robot has lost its objective forever: alone, and without any obstacle that may yet be
    resolved, it cannot continue."""
    stated = {**s.unrealizable, **(e.unrealizable or {})}
    if s.waiting is not None:
        stated = {**s.lost_before, **stated}
    case = Case(s)
    games = list[str]()
    for name, spec in stated.items():
        robot = s.robots[name]
        if not _continues(robot, case, s.spec_memory.get((name, spec))):
            return
        if _is_a_game(robot, s):
            games.append(name)
    if games:
        what = f"whether others or inputs can keep {games[0]} from its objective forever"
        yield NotJudged(f"{what} (a bundle proves it)")
        return
    for name in stated:
        own, here = s.robots[name].own, s.destination(name)
        if own.kind == "ltl" and own.formulas and not own.formulas.allows(here, here):
            yield NotJudged(f"whether {name} could go where its formulas let it stay")
            return
    yield "an operator is needed, but that is not proven"


def _is_a_game(robot: Robot, s: State) -> bool:
    own = robot.own
    if own.kind != "ltl" and not (own.literal and own.strict):
        return False
    hears = bool(own.formulas and own.formulas.inputs)
    return hears or bool(s.rivals[robot.name]) or any(robot.name in who for who, _ in s.zones)


def _continues(robot: Robot, case: Case, memory: Mapping[str, int] | None) -> bool:
    """Return whether a robot alone can continue forever from its pose."""
    name, own, s = robot.name, robot.own, case.state
    pose = s.destination(name)
    there = case.reach(name, frozenset([pose]), ())
    if robot.out:
        return case.can_continue(name, [pose], ())
    if own.ends:
        here = frozenset([pose])
        for target in own.targets[min(robot.progress.ahead, own.count - 1) :]:
            here = frozenset(p for p in case.reach(name, here, ()) if p[0] in target)
        if s.scenario.coordination != "resynthesis":  # it may be sent away, and must come back
            here = frozenset(p for p in here if _comes_back(name, p, case))
        return bool(here)
    if own.kind == "ltl" and own.formulas is not None and memory is not None:
        formulas = own.formulas
        rows = [k for k, r in enumerate(formulas.values) if agrees(formulas.names, r, memory)]
        rows = rows if memory or not formulas.names else formulas.begins(pose)
        live = _live(formulas, there, case.members[name].steps)
        return any((pose, row) in live for row in rows) if rows else bool(live)
    if own.literal and own.strict and memory:
        turn = next(iter(memory.values()))
        return case.can_continue(name, [pose], ()) and _keeps_order(robot, case, turn)
    return case.can_continue(name, [pose], ())


def _comes_back(name: str, pose: Pose, case: Case) -> bool:
    away = frozenset(to for to in case.members[name].steps.get(pose, ()) if to[0] != pose[0])
    return pose in case.reach(name, away, ())


def _live(formulas: Any, inside: frozenset[Pose], steps: Mapping[Pose, Any]) -> set[Any]:
    """Return the greatest set of poses with memories from which a robot can meet every goal
    infinitely often by steps, or by staying, within it."""
    pairs = ((a, b) for a in inside for b in (a, *steps.get(a, ())) if b in inside)
    edges = [*all_memories(formulas, pairs)]
    kept, before = {state for edge in edges for state in edge[:2]}, set[Any]()
    while kept != before:
        before = kept
        for goal in range(max(formulas.count, 1)):
            within = [edge for edge in edges if edge[0] in kept and edge[1] in kept]
            found = {a for a, _, goals in within if goal in goals or not formulas.count}
            more = found
            while more:
                more = {a for a, b, _ in within if b in more} - found
                found = found | more
            kept = found
    return kept


def _keeps_order(robot: Robot, case: Case, turn: int) -> bool:
    """Return whether a robot alone can meet its targets in turn forever without touching one out of
    turn: whether it reaches a cycle on which it meets the first target."""
    targets, steps = robot.own.targets, case.members[robot.name].steps
    pose = case.state.destination(robot.name)

    def after(state: tuple[Pose, int]) -> Iterator[tuple[Pose, int]]:
        here, due = state
        due = (due + 1) % len(targets) if here[0] in targets[due] else due
        shut = frozenset[int]().union(*(t for k, t in enumerate(targets) if k != due))
        yield from ((to, due) for to in steps.get(here, ()) if to[0] not in shut)

    found = closure([(pose, turn)], after)
    first = [state for state in found if state[1] == 0 and state[0][0] in targets[0]]
    return any(state in closure(after(state), after) for state in first)


def _memory(name: str, stated: Mapping[str, int], s: State) -> int | None:
    """Return the number of a stated memory of a robot's formulas, if they may remember it."""
    robot = s.robots.get(name)
    formulas = None if robot is None else robot.own.formulas
    if robot is None or formulas is None or robot.memories is None:
        return None
    if {*stated} != {*formulas.names} - {*formulas.inputs}:
        return None
    possible = robot.memories
    if robot.bound is not None:
        possible = formulas.after(possible, robot.pose, s.destination(name))
    rows = (k for k in possible if agrees(formulas.names, formulas.values[k], {**stated}))
    return next(rows, None)

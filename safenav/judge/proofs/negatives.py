"""The check of claims that the mission is infeasible, and of their proofs."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, partial
from itertools import product
from math import prod
from typing import Any, NamedTuple

from safenav.judge.formulas import Pose
from safenav.judge.lines import Line
from safenav.judge.progress import Progress
from safenav.judge.proofs.closures import (
    Case,
    able_now,
    case_now,
    case_of,
    is_hopeless,
    team_closure,
)
from safenav.judge.rules import NotJudged
from safenav.judge.state import Rest, Robot, State
from safenav.judge.world import TooLargeError, closure

PER_JOINT_STATE, PER_SERVED_STATE = 5, 50
"""Cost in states per four robots of a joint state: in a proof; of all robots in service."""
MOST_MEMORIES = 8
"""Maximum number of joint formula memories for which sequences of moves are searched."""
ELSEWHERE = -1


class _State(NamedTuple):
    poses: tuple[Any, ...]
    met: tuple[Progress, ...]
    opened: tuple[Rest, ...]

    def open(self) -> set[str]:
        return {one.name for one in self.opened}


class Enumeration:
    """The joint states of some robots with some open obstacles. ``cost``: the work for one state;
    ``most``: the number of goals (or rounds, if in any order) that each robot has to meet."""

    def __init__(
        self, case: Case, robots: list[str], opened: Iterable[Rest], cost: int = PER_JOINT_STATE
    ) -> None:
        self.case, self.robots, self.opened = case, robots, tuple(opened)
        self.cost = cost * max(1, len(robots) // 4)
        self.owns = [case.state.robots[name].own for name in robots]
        self.targets = [[] if n in case.out else case.targets[n] for n in robots]
        rounds = case.state.scenario.until.rounds
        goals = [0 if own.settles else own.count if own.ordered else 1 for own in self.owns]
        self.most = [rounds * many * bool(t) for many, t in zip(goals, self.targets, strict=True)]
        self._acted, self._walls = cache(self._act), cache(case.walls)
        self._live = cache(self._is_live)

    def complete(self) -> Iterator[_State]:
        """Yield the reachable states with a completed mission. Raises TooLargeError."""
        spend = partial(self.case.world.spend, self.cost)
        return filter(self._is_complete, closure(self.starts(), self._successors, spend))

    def starts(self) -> Iterator[_State]:
        poses = tuple(self.case.now[name] for name in self.robots)
        for met in product(*map(self._begins, range(len(self.robots)))):
            yield from self._settled(_State(poses, met, self.opened))

    def _begins(self, k: int) -> list[Progress]:
        """Return the possible present progress of the robot with index ``k``."""
        name, own = self.robots[k], self.owns[k]
        robot = self.case.state.robots[name]
        found = self._after(k, robot.progress)
        here = [goal for goal, at in enumerate(self.targets[k]) if self.case.at[name] in at]
        if own.strict and own.literal and robot.progress.turn is None:
            return found + [replace(found[0], turn=goal) for goal in here]
        acts = robot.acts and own.strict and not own.literal and not robot.progress.goals
        # The target where it acts counts first, when the action ends.
        return [replace(found[0], turn=goal) for goal in here if acts] or found

    def _after(self, k: int, met: Progress) -> list[Progress]:
        """Return the possible progress of a robot that continues, at most its goals to meet."""
        own, goals = self.owns[k], min(met.goals, self.most[k])
        if self.targets[k] and own.strict and not own.literal and not goals:
            return [Progress(turn=first) for first in range(own.count)]
        return [Progress(goals, met.turn or 0, met.seen)]

    def _successors(self, state: _State) -> Iterator[_State]:
        s, at = self.case.state, dict(zip(self.robots, state.poses, strict=True))
        opened, held = state.open(), {name: frozenset([pose[0]]) for name, pose in at.items()}
        for name in (n for n, one in self.case.leaving.items() if at.get(n) == one):
            held[name] |= {self.case.at[name][0]}
        for k, name in enumerate(self.robots):
            if self.case.flat.get(name) in opened:
                continue
            taken = self._walls(name, state.opened).union(
                *(s.kept_out(name, other, held[other]) for other in s.mates[name] if other in at)
            )
            back = self.case.way_back(name, at[name], state.opened)
            if at[name] == self.case.leaving.get(name):
                taken, back = frozenset(), None  # the robot arrives
            for to in self.case.steps[name].get(at[name], ()):
                if to[0] not in taken and (back is None or to[0] in (back, at[name][0])):
                    poses = (*state.poses[:k], to, *state.poses[k + 1 :])
                    yield from self._settled(_State(poses, state.met, state.opened), k)

    def _is_complete(self, state: _State) -> bool:
        """Return whether each robot has met all goals, can continue forever and, if its objective
        settles, is at its last target."""
        for k, pose in enumerate(state.poses):
            own, met, targets = self.owns[k], state.met[k], self.targets[k]
            whole = met.ended(own) if own.ends else met.goals == self.most[k]
            if targets and not (whole and (pose in targets[-1] or not own.settles)):
                return False
        each = zip(self.robots, state.poses, strict=True)
        return all(self._live(name, pose, state.opened) for name, pose in each)

    def _is_live(self, name: str, pose: Any, opened: tuple[Rest, ...]) -> bool:
        outside = pose[0] not in self.case.walls(name, opened)
        return outside and self.case.can_continue(name, frozenset([pose]), opened)

    def _settled(self, state: _State, moved: int | None = None) -> Iterator[_State]:
        """Yield the states after the robots have performed all actions where they stand and then
        counted all goals. If a resolution restarts rounds, patrols may begin with any target."""
        needs = (need for one in state.opened for need in one.left)
        regions = frozenset(region for need in needs for region in need.regions)
        places = tuple(p[0] if p[0] in regions else ELSEWHERE for p in state.poses)
        after, every = self._acted(state.opened, places), iter([state.met])
        kind = self.case.state.flat_type
        if restarts := any(not one.left and one.order[0] != kind for one in after):
            every = product(*(self._after(k, met.anew()) for k, met in enumerate(state.met)))
        opened = tuple(one for one in after if one.left)
        empty = [{one.name for one in each} for each in (state.opened, opened)]
        flat = [self.case.flat.get(name) for name in self.robots]  # robots without charge wait
        some = [k for k, one in enumerate(flat) if k == moved or one in empty[0]]
        for met in every:
            now = [*met]
            for k in range(len(met)) if restarts or moved is None else some:
                if flat[k] not in empty[1]:
                    now[k] = self._counted(k, state.poses[k], met[k])
            yield _State(state.poses, tuple(now), opened)

    def _counted(self, k: int, pose: Any, met: Progress) -> Progress:
        """Return a robot's progress ``met`` after it has counted its goals in ``pose``."""
        own, targets, most = self.owns[k], self.targets[k], self.most[k]
        here = [goal for goal, target in enumerate(targets) if pose in target]
        if here and len(here) == len(targets) and not own.ends:  # all rounds are then done
            turn = (met.turn or 0) + most - met.goals
            return Progress(most, turn % len(targets) if own.ordered else 0)

        def is_due(goal: int) -> bool:
            unseen = met.goals < most and not met.seen >> goal & 1
            return goal == met.turn if own.ordered else unseen

        # Continue even without open goals: the next target survives a restart.
        while due := [*filter(is_due, here)]:
            met = met.after(own, due[0])
            met = replace(met, goals=min(met.goals, most))
        return met

    def _act(self, opened: tuple[Rest, ...], places: tuple[int, ...]) -> tuple[Rest, ...]:
        """Return the obstacles after all robots have acted where they stand. Robots take loads
        last, begun ones first, and only as many as they can carry."""
        flat = {one.name for one in opened}.intersection(self.case.flat.values())
        pairs = zip(self.robots, places, strict=True)
        at = {name: place for name, place in pairs if self.case.flat.get(name) not in flat}
        after = [_performed(one, at, None) for one in opened]
        loads = [k for k, one in enumerate(after) if one.takes()]
        for k in sorted(loads, key=lambda k: (not after[k].done, after[k].order)):
            after[k] = _performed(after[k], at, self.case.full(one for one in after if one.left))
        return tuple(after)


def _performed(one: Rest, at: dict[str, int], full: frozenset[str] | None) -> Rest:
    """Return an obstacle after the robots have acted on it where they stand. ``full``: robots that
    can take no other load; None: no robot takes a load now."""
    while one.left:
        need, takes = one.left[0], one.takes()
        if takes and full is None:
            return one
        able = able_now(one, full or frozenset())
        group = [name for name in at if name in able and at[name] in need.regions]
        if takes and not need.together:  # one by one, in the order of turns
            group = group[: need.robots - len(one.done)]
        if len(done := one.done.union(group)) < need.robots:
            return one if need.together else one._replace(done=done)
        one = one.advanced(group)
    return one


def negative_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why the claim `operator_needed` is not proven. Raises TooLargeError."""
    if e.cause == "out_of_service":
        yield from _out_of_service_problems(e, s)
        return
    _require_read(s)
    out = any(robot.out for robot in s.robots.values())
    if out and (e.proof or not (e.unrealizable or is_hopeless(case_of(s)))):
        yield f"the stated cause is {e.cause}, but only robots out of service are missing"
    elif e.proof is not None:
        yield from _deadlock_problems(e, s)
    elif not is_hopeless(case := case_of(s)):  # as if all robots were in service
        yield from _lost_problems(e, case)
    elif e.cause not in (causes := _causes(case_now(s))):
        yield f"the stated cause is {e.cause}, but {causes[0]} is proven"


def _deadlock_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why some robots can complete their part of the mission on a floor without
    the other robots and the obstacles that those may resolve."""
    robots, numbers = [name for name in s.names if name in e.proof.robots], dict[str, int]()
    for name, stated in (e.proof.memory or {}).items():
        robot, known = s.robots[name], set[int]()
        formulas = robot.own.formulas
        if robot.memories and {*stated} == {*formulas.names} - {*formulas.inputs}:
            known = s.arriving(robot) & formulas.remembering(stated)
        if not known:
            yield f"the formulas of {name} exclude this memory: {', '.join(stated)}"
            return
        numbers[name] = min(known)
    if e.cause != "deadlock":
        yield f"the stated cause is {e.cause}, but deadlock is proven"
    if not robots:
        yield "the proof names no robot"
    elif not _without_room(robots, s):
        case, others = case_now(s, numbers), {*s.names} - {*robots}
        alone = (o for o in case.obstacles if all(others.isdisjoint(n.able) for n in o.left))
        every = Enumeration(case, robots, alone)
        if any(every.complete()):
            yield "the mission can be completed"


def _without_room(robots: list[str], s: State) -> bool:
    """Return whether robots in conflict outnumber the regions of their last targets."""
    owns = [s.robots[name].own for name in robots]
    apart = all(own.settles for own in owns) and all(
        {*robots} <= {name, *s.rivals[name]} for name in robots
    )
    return apart and len(frozenset[int]().union(*(own.last for own in owns))) < len(robots)


def shut_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why robots, if all are in service, may still resolve a given-up obstacle.
    Raises TooLargeError."""
    _require_read(s)
    case = case_of(s)
    if e.obstacle not in {one.name for one in team_closure(case, case.start, case.obstacles)[1]}:
        yield f"{e.obstacle} can be resolved: enough robots reach its resolution regions"


def _require_read(s: State) -> None:
    each = ((name, robot.own.formulas) for name, robot in s.robots.items())
    if unread := [name for name, formulas in each if formulas and not formulas.whole]:
        raise TooLargeError(f"too many memory values of {', '.join(unread)}")


def _causes(now: Case) -> list[str]:
    """Return the causes for which no order of moves completes the mission, the most specific first,
    then those that would remain if all robots were in service."""
    found = list[str]()
    for case in [now, case_of(now.state)] if now.out else [now]:
        stuck = team_closure(case, case.start, case.obstacles)[1]
        each = [one for one in case.shut if one.open]
        each += [case.state.obstacles[one.name] for one in stuck]
        known = [one for one in each if not one.declared]
        short = [[len(n.able) < n.robots for n in one.needs[one.stage :]] for one in known]
        found += ["no_capable_robot"] * any(map(any, short))
        if known and not any(few[0] for few in short if few):
            found += ["never_resolvable", "cyclic_requests"]
    return [*found, "unrealizable"]


def _out_of_service_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why the robots in service can still do their part of the mission. Robots
    that have done theirs may have left to charge while the team waited."""
    if not any(robot.out for robot in s.robots.values()):
        yield "no robot is out of service"
        return
    now, every, wanted = case_now(s), s.robots.items(), s.scenario.until.rounds
    never = {one.name for one in team_closure(now, now.start, now.obstacles)[1]}
    behind = [n for n, r in every if (not r.out or r.filled) and s.behind(n, e)]
    rests = all(s.robots[n].data.battery and s.rounds(n, e) >= wanted for n in behind)
    work = s.orders.union(s.flat).intersection(one.name for one in now.obstacles) - never
    if now.out and behind and rests and s.scenario.chargers and not work:
        return
    known = {name: s.arriving(robot) for name, robot in every if robot.memories and not robot.out}
    ended = e.kind != "outcome" or not behind
    if prod(map(len, known.values())) > MOST_MEMORIES:
        raise TooLargeError(f"too many memories of {', '.join(known)}")
    for row in product(*known.values()):  # with each possible memory of the robots
        case = case_now(s, dict(zip(known, row, strict=True)))
        states = Enumeration(case, case.names, case.obstacles, PER_SERVED_STATE)
        ways = (way for way in states.complete() if s.orders.isdisjoint(way.open() - never))
        way = next(ways, None)
        if way is None or (case.out and ended and way in states.starts()):
            return
    yield "the robots in service can do their part of the mission"


def _lost_problems(e: Line, case: Case) -> Iterator[str]:
    """Yield a problem unless one of the stated robots provably cannot continue, even alone and
    without the obstacles that may still be resolved."""
    s = case.state
    stated = e.unrealizable or {}
    if not all(_continues(s.robots[n], case, s.failed.get((n, stated[n]))) for n in stated):
        if e.cause != "unrealizable":
            yield f"the stated cause is {e.cause}, but unrealizable is proven"
        return
    for name in stated:
        own = s.robots[name].own
        here, ltl = s.destination(name), own.kind == "ltl"
        hears = own.formulas is not None and own.formulas.inputs
        if (ltl or (own.literal and own.strict)) and (hears or s.mates[name]):
            what = f"whether robots or inputs can keep {name} from its objective forever"
            yield NotJudged(f"{what} (a bundle proves it)")
            return
        if ltl and not own.formulas.allows(here, here):
            yield NotJudged(f"whether {name} could go where its formulas let it stay")
            return
    yield "an operator is needed, but that is not proven"


def _continues(robot: Robot, case: Case, memory: Mapping[str, int] | None) -> bool:
    """Return whether a robot alone can continue forever (True for a robot out of service)."""
    name, own, s = robot.name, robot.own, case.state
    pose = s.destination(name)
    if robot.out:
        return True
    if own.ends:
        here = case.start[name]
        for target in case.targets[name][min(robot.progress.turn or 0, own.count - 1) :]:
            here = case.reach(name, here, ()) & target
        return bool(here)
    if memory is not None and not may_have(robot, memory, s):
        return True
    if own.kind == "ltl" and memory is not None:
        rows, never = _rows(robot, memory, s), [one.name for one in case.shut]
        begins: frozenset[Any] = frozenset((*pose, row, frozenset[int]()) for row in rows)
        return Case(s, memory={name: 0}, never=never).can_continue(name, begins, ())
    if own.literal and own.strict and memory:
        return _keeps_order(robot, case, next(iter(memory.values())))
    return True  # by the closure, it can continue


def _rows(robot: Robot, memory: Mapping[str, int], s: State) -> set[int]:
    formulas = robot.own.formulas
    if formulas.names and not memory:
        return {*formulas.begins(s.destination(robot.name))}
    return {*formulas.remembering(memory)}


def may_have(robot: Robot, memory: Mapping[str, int], s: State) -> bool:
    """Return whether a robot may have this memory of its own objective now. A proof for any other
    memory is void."""
    own = robot.own
    if own.kind == "ltl":
        return robot.memories is None or not s.arriving(robot).isdisjoint(_rows(robot, memory, s))
    turn = next(iter(memory.values()), None)
    if turn is None or not (own.literal and own.strict):
        return True
    return 0 <= turn < own.count and robot.progress.turn in (None, turn)


def _keeps_order(robot: Robot, case: Case, turn: int) -> bool:
    """Return whether a robot alone can meet its targets in turn forever and touch each only in its
    turn."""
    targets, steps = robot.own.targets, case.steps[robot.name]
    others = [targets[:k] + targets[k + 1 :] for k in range(len(targets))]
    shut = [frozenset[int]().union(*each) for each in others]

    def after(state: tuple[Pose, int]) -> list[tuple[Pose, int]]:
        here, due = state
        due = (due + 1) % len(targets) if here[0] in targets[due] else due
        return [(to, due) for to in steps.get(here, ()) if to[0] not in shut[due]]

    found = case.world.closure([(case.at[robot.name], turn)], after)
    first = [state for state in found if state[1] == 0 and state[0][0] in targets[0]]
    return any(state in case.world.closure(after(state), after) for state in first)

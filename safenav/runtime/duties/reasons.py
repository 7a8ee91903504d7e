"""Reasons why an obstacle is never resolved, or no robot helps now: as data, and in words."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from enum import Enum

from msgspec import Struct

from safenav.components import explored
from safenav.runtime.duties.settlement import Settlement
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.resolution.proofs import TeamClosure
from safenav.scenario.model import OPERATOR_ACTION
from safenav.scenario.objective import Word
from safenav.trace.vocabulary import OperatorCause
from safenav.trace.words import listed, obstacle_words
from safenav.world.poses import bits


class Hindrance(Enum):
    """Hindrance of a robot that has the action of a need."""

    NOTHING = "can reach it"
    GATES = "obstacles are in the way"
    INSIDE = "one robot alone cannot enter that region; 'at' of the need can name other regions"
    WALLS = "no path leads there"
    NO_STRATEGY = "no strategy leads there"
    CUT_OFF = "no path leads to where the load is put down"
    OUT_OF_SERVICE = "it is out of service"
    FAILED = "too many attempts have failed"


class Helper(Struct, frozen=True):
    """A robot that has the action of a need. ``waits_for``: the obstacles in its way."""

    name: str
    hindrance: Hindrance
    waits_for: tuple[str, ...] = ()


class Shortfall(Struct, frozen=True):
    """The unfulfilled need of an obstacle that is never resolved. ``met``: the actions of its needs
    that are fulfilled, or will be; ``action``: that of the need that never is, by ``robots``
    robots, ``together`` in one tick; ``done``: robots that have fulfilled their part of it;
    ``helpers``: the other robots that have the action and those ``beside`` it: the actions of later
    needs that the same robots must fulfil."""

    obstacle: str
    action: str
    robots: int
    together: bool
    helpers: tuple[Helper, ...]
    met: tuple[str, ...] = ()
    done: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()

    @property
    def too_few(self) -> bool:
        """Whether fewer robots have the action than the need requires."""
        return len(self.helpers) + len(self.done) < self.robots


def shortfalls(
    floor: Floor,
    closure: TeamClosure,
    out: Collection[str] = (),
    vain: Collection[tuple[str, str]] = (),
) -> tuple[Shortfall, ...]:
    """Return the shortfall of each obstacle that a closure never resolves; ``out``: robots out of
    service; ``vain``: (robot, obstacle) where actions have failed too often."""
    return tuple(_shortfall(floor, closure, gate, out, vain) for gate in closure.never)


def _shortfall(
    floor: Floor,
    closure: TeamClosure,
    number: int,
    out: Collection[str],
    vain: Collection[tuple[str, str]],
) -> Shortfall:
    problem = floor.problem
    stage, gate = closure.left[number], problem.gates[number]
    need, skilled = gate.needs[stage.need], problem.skilled(number, closure.left)
    helpers = [
        Helper(member.name, Hindrance.OUT_OF_SERVICE)
        if member.name in out
        else Helper(member.name, Hindrance.FAILED)
        if (member.name, gate.name) in vain
        else _helper(floor, closure, number, robot)
        for robot, member in enumerate(problem.members)
        if robot in skilled and robot not in stage.done
    ]
    return Shortfall(
        gate.name,
        need.action,
        need.robots,
        need.together,
        tuple(helpers),
        tuple(former.action for former in gate.needs[: stage.need]),
        tuple(floor.names[robot] for robot in sorted(stage.done)),
        tuple(sorted(gate.skills[stage.need] - {need.action})),
    )


def _helper(floor: Floor, closure: TeamClosure, number: int, robot: int) -> Helper:
    problem, name = floor.problem, floor.names[robot]
    member = problem.members[robot]
    graph = member.graph
    regions, its_own = problem.next_need(number, closure.left).regions, problem.gates[number]
    there, reach = graph.poses_on(regions), closure.reach[robot]
    if robot in its_own.barred | its_own.refused:
        return Helper(name, Hindrance.NO_STRATEGY)
    if robot in its_own.cut_off_at(closure.left[number].need):
        return Helper(name, Hindrance.CUT_OFF)
    if reach & there:
        return Helper(name, Hindrance.NOTHING)
    beyond = member.floor & ~reach
    border = graph.regions_of(graph.forward(reach) & beyond)
    waits_for = []
    for other in closure.never:
        gate = problem.gates[other]
        opened = graph.poses_on(1 << gate.region)
        keeps_out = robot in gate.closed_to[closure.left[other].need]
        borders = keeps_out and border >> gate.region & 1
        if borders and graph.closure(opened, beyond) & there:
            waits_for.append(gate.name)
    if waits_for == [its_own.name] and regions == 1 << its_own.region:
        return Helper(name, Hindrance.INSIDE, tuple(waits_for))
    return Helper(name, Hindrance.GATES if waits_for else Hindrance.WALLS, tuple(waits_for))


def cause_of(found: Collection[Shortfall]) -> OperatorCause:
    """The cause of a negative: too few robots, or robots that wait for each other's help."""
    if any(each.too_few for each in found):
        return OperatorCause.NO_CAPABLE_ROBOT
    waits = {
        each.obstacle: {gate for helper in each.helpers for gate in helper.waits_for}
        for each in found
    }
    if any(gate in explored(waits[gate], lambda one: [*waits.get(one, ())]) for gate in waits):
        return OperatorCause.CYCLIC_REQUESTS
    return OperatorCause.NEVER_RESOLVABLE


def shortfall_words(found: Shortfall, word: Word, it: str | None = None) -> str:
    """``crate@gate needs two robots with 'lift' at the same time; this team has one: ben``. ``it``:
    the obstacle's name in the text."""
    met = f" ('{found.met[-1]}' is fulfilled, '{found.action}' is open)" if found.met else ""
    actions = "' and '".join((found.action, *found.beside))
    takes = need_words(actions, found.robots, together=found.together)
    parts = [f"{it or obstacle_words(found.obstacle, word)} needs {takes}{met}"]
    names = [*found.done, *(helper.name for helper in found.helpers)]
    if not names and found.action == OPERATOR_ACTION:
        return f"{it or obstacle_words(found.obstacle, word)} needs an operator"
    if not names:
        return f"{parts[0]}, and no robot of this team has {_ALL.get(len(found.beside), 'all')}"
    if found.too_few:
        parts.append(f"this team has {_NUMBERS.get(len(names), len(names))}: {listed(names)}")
    if found.done:
        parts.append(f"{listed(found.done)} {'has' if len(found.done) == 1 else 'have'} done it")
    hindered: dict[str, list[str]] = {}
    for each in found.helpers:
        hindered.setdefault(_why(each, found.obstacle, word), []).append(each.name)
    for why, robots in hindered.items():
        has, there = ("has", "it is") if len(robots) == 1 else ("have", "they are")
        parts += [f"{listed(robots)} {has} it, but {why.replace('it is', there)}"] if why else []
    if not found.too_few:
        ready = [each.name for each in found.helpers if each.hindrance is Hindrance.NOTHING]
        parts += [f"{listed(ready)} can reach it"] if ready else []
    return "; ".join(parts)


def _why(helper: Helper, obstacle: str, word: Word) -> str:
    match helper.hindrance:
        case Hindrance.GATES if helper.waits_for == (obstacle,):
            return f"{obstacle_words(obstacle, word)} itself is in the way"
        case Hindrance.GATES:
            are = "is" if len(helper.waits_for) == 1 else "are"
            return f"{listed(obstacle_words(o, word) for o in helper.waits_for)} {are} in the way"
        case Hindrance.NOTHING:
            return ""
        case other:
            return str(other.value)


_ALL = {0: "it", 1: "both"}
_NUMBERS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def need_words(action: str, robots: int, *, together: bool) -> str:
    """``two robots with 'lift' at the same time``, ``a robot with 'push'``."""
    if robots == 1:
        return f"a robot with '{action}'"
    when = " at the same time" if together else ""
    return f"{_NUMBERS.get(robots, robots)} robots with '{action}'{when}"


def why_nobody(
    floor: Floor, found: Settlement, gate: int, word: Word, out: Collection[str] = ()
) -> str | None:
    """Return why no robot is assigned to help with an obstacle now, although some could get there;
    None where the bids show it: no robot has the action, or none gets there. ``out``: robots out of
    service, which get no duty and act only where they stand."""
    problem, stage, obstacle = floor.problem, floor.stages[gate], floor.problem.gates[gate]
    able, missing = problem.able(gate, floor.stages), problem.missing(gate, floor.stages)
    if len(able) < missing:
        if loads := _loads(floor, gate, word):
            return loads
        out_of_reach = obstacle.cut_off_at(stage.need)
        strays = [floor.names[i] for i in problem.skilled(gate, floor.stages) if i in out_of_reach]
        if strays:
            return f"no path leads {listed(strays)} to where it is put down"
        need = obstacle.needs[stage.need]
        actions = need.action, *sorted(obstacle.skills[stage.need] - {need.action})
        takes = need_words("' and '".join(actions), need.robots, together=need.together)
        have = len(able) + len(stage.done)
        return f"it needs {takes}, this team has {_NUMBERS.get(have, have)}" if able else None
    idle = [floor.names[robot] for robot in able if floor.names[robot] in out]
    if len(able) - len(idle) < missing:
        return f"{listed(idle)} {'is' if len(idle) == 1 else 'are'} out of service"
    busy = {robot: duty.gate for robot, duty in found.duties.items() if duty.gate != gate}
    parts = [_doing(floor, "helps with", r, busy[r], word) for r in able if r in busy]
    for robot in able:
        first = next((step for step in found.plan if robot in step.group), None)
        if robot in found.reserved and first is not None and first.gate != gate:
            parts.append(_doing(floor, "is to help first with", robot, first.gate, word))
    if parts:
        return "; ".join(parts)
    if gate not in found.served:
        return None if _nobody_gets_there(floor, gate, able) else _UNSERVED
    earlier: Iterable[int] = (step.gate for step in found.plan if step.gate != gate)
    names = dict.fromkeys(obstacle_words(floor.gates[other], word) for other in earlier)
    return f"first {listed(names)} must be resolved" if names else None


def without_room(floor: Floor, word: Word) -> list[str]:
    """Return a sentence for each need to be fulfilled together for which enough robots reach the
    resolution regions, but not a region each."""
    problem, stages = floor.problem, floor.stages
    found = []
    for gate in problem.open(stages):
        need = problem.next_need(gate, stages)
        regions, names = 0, []
        for robot in problem.able(gate, stages):
            graph = problem.members[robot].graph
            if there := floor.reach(robot) & graph.poses_on(need.regions):
                regions |= graph.regions_of(there)
                names.append(floor.names[robot])
        if need.together and len(names) >= problem.missing(gate, stages):
            places = " and ".join(word(region) for region in bits(regions))
            takes = need_words(need.action, need.robots, together=True)
            found.append(
                f"{obstacle_words(floor.gates[gate], word)} needs {takes}; {listed(names)} "
                f"reach only {places} for it, where there is no room for all of them"
            )
    return found


def _loads(floor: Floor, gate: int, word: Word) -> str:
    """Describe the loads of robots that cannot take another one; empty if there are none."""
    problem, stages = floor.problem, floor.stages
    full = problem.full(stages) if problem.takes(gate, stages) else frozenset()
    loads = {
        robot: [
            obstacle_words(name, word)
            for name, each, stage in zip(floor.gates, problem.gates, stages, strict=True)
            if robot in each.carriers(stage)
        ]
        for robot in problem.skilled(gate, stages)
        if robot in full
    }
    return "; ".join(
        f"{floor.names[i]} carries {listed(each)}" for i, each in loads.items() if each
    )


_UNSERVED = "if a robot went there now, the team could not continue"


def _doing(floor: Floor, what: str, robot: int, gate: int, word: Word) -> str:
    return f"{floor.names[robot]} {what} {obstacle_words(floor.gates[gate], word)}"


def _nobody_gets_there(floor: Floor, gate: int, able: Collection[int]) -> bool:
    """Whether too few robots can reach the obstacle's resolution regions now."""
    problem, stages = floor.problem, floor.stages
    regions = problem.next_need(gate, stages).regions
    there = sum(
        bool(regions & problem.members[robot].graph.regions_of(floor.reach(robot)))
        for robot in able
    )
    return there < problem.missing(gate, stages)

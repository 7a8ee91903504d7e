"""Reasons why an obstacle is never resolved, as data and in words."""

from collections.abc import Collection, Mapping
from enum import Enum

from msgspec import Struct

from safenav.components import reached
from safenav.scenario.model import OPERATOR_ACTION
from safenav.scenario.objective import Word
from safenav.solve.solve import Closure, Sets
from safenav.team.floor import Floor
from safenav.team.team import Need
from safenav.trace.vocabulary import OperatorCause
from safenav.trace.words import listed, obstacle_words
from safenav.world.poses import Mask, bits, plain_graph


class Hindrance(Enum):
    """A reason why a robot that has the action of a need does not fulfil the need."""

    NOTHING = "can reach it"
    GATES = "obstacles are in the way"
    INSIDE = "one robot alone cannot enter that region; 'at' of the need can name other regions"
    WALLS = "no path leads there"
    RULES = "rules of the objective leave no path there"
    CUT_OFF = "no allowed path leads to where the load is put down"
    LADEN = "the load on board cannot be put down"
    OUT_OF_SERVICE = "it is out of service"
    FAILED = "too many attempts have failed"


class Helper(Struct, frozen=True):
    """A robot that has the action of a need. ``waits_for``: the obstacles in its way."""

    name: str
    hindrance: Hindrance
    waits_for: tuple[str, ...] = ()


class Shortfall(Struct, frozen=True):
    """A ``need`` of an obstacle that is never fulfilled. ``met``: the actions of earlier needs;
    ``done``: the robots that have done their part of this need; ``helpers``: the other robots with
    all its skills."""

    obstacle: str
    need: Need
    helpers: tuple[Helper, ...]
    met: tuple[str, ...] = ()
    done: tuple[str, ...] = ()

    @property
    def too_few(self) -> bool:
        """Whether the need requires more robots with its action than there are."""
        return len(self.helpers) + len(self.done) < self.need.robots


def shortfalls(now: Sets, closure: Closure) -> tuple[Shortfall, ...]:
    """Return a shortfall for each obstacle that the team can never resolve by this closure."""
    floor, left, found = now.floor, closure.left, list[Shortfall]()
    for g in closure.never:
        gate, stage = floor.gate(g), left[g]
        others = (i for i in floor.candidates(g, left) if i not in stage.done)
        helpers = tuple(_helper(now, closure, g, i) for i in others)
        met = tuple(former.action for former in gate.needs[: stage.need])
        done = tuple(floor.team.members[i].name for i in sorted(stage.done))
        found.append(Shortfall(gate.name, floor.need(g, left), helpers, met, done))
    return tuple(found)


def _helper(now: Sets, closure: Closure, g: int, i: int) -> Helper:
    floor, gate, name = now.floor, now.floor.gate(g), now.floor.team.members[i].name
    graph, need = floor.graphs[i], floor.need(g, closure.left)
    regions, reach = need.regions, closure.reach[i]
    if i not in floor.robots:
        return Helper(name, Hindrance.OUT_OF_SERVICE)
    if (i, floor.gates[g]) in floor.barred:
        return Helper(name, Hindrance.FAILED)
    if need.takes and i in floor.carriers(closure.left):
        return Helper(name, Hindrance.LADEN)
    if i in need.strays:
        return Helper(name, Hindrance.CUT_OFF)
    there = graph.poses_on(regions)
    if reach & there:
        return Helper(name, Hindrance.NOTHING)
    beyond = floor.floors[i] & ~reach
    border = graph.regions_of(graph.forward(reach) & beyond)
    waits_for = tuple(
        other.name
        for other, stage in ((floor.gate(o), closure.left[o]) for o in closure.never)
        if i in other.needs[stage.need].closed_to
        and border >> other.region & 1
        and graph.closure(graph.poses_on(1 << other.region), beyond) & there
    )
    if waits_for == (gate.name,) and regions == 1 << gate.region:
        return Helper(name, Hindrance.INSIDE, waits_for)
    hindrance = Hindrance.RULES if _ruled_out(now, closure, i, regions) else Hindrance.WALLS
    return Helper(name, Hindrance.GATES if waits_for else hindrance, waits_for)


def _ruled_out(now: Sets, closure: Closure, i: int, regions: Mask) -> bool:
    """Return whether only its objective's rules keep a robot out of regions."""
    floor, member, graph = now.floor, now.floor.team.members[i], now.floor.graphs[i]
    gates = ((floor.gate(g), closure.left[g]) for g in closure.never)
    closed = {gate.region for gate, stage in gates if i in gate.needs[stage.need].closed_to}
    sealed = graph.regions_of(member.floor & ~floor.floors[i])
    plain = plain_graph(graph.world, graph.mobility)
    free = plain.outside({*closed, *bits(sealed)})
    begin = sum(1 << p for p in {plain.number(graph.pose(p)) for p in bits(closure.reach[i])})
    inside = floor.inside and floor.inside[i]  # it must back out of an obstacle
    return not inside and bool(plain.closure(begin, free) & plain.poses_on(regions))


def cause_of(found: Collection[Shortfall]) -> OperatorCause:
    """Return the cause of needs that are never fulfilled: too few robots, robots that wait for each
    other's help, or neither."""
    if any(each.too_few for each in found):
        return OperatorCause.NO_CAPABLE_ROBOT
    waits = {
        each.obstacle: {gate for helper in each.helpers for gate in helper.waits_for}
        for each in found
    }
    if any(gate in reached(waits[gate], lambda one: waits.get(one, ())) for gate in waits):
        return OperatorCause.CYCLIC_REQUESTS
    return OperatorCause.NEVER_RESOLVABLE


def shortfall_words(found: Shortfall, word: Word, it: str | None = None) -> str:
    """Return a shortfall in words: ``crate@gate needs two robots with 'lift' at the same time; this
    team has one: ben``. ``it``: the words for the obstacle."""
    need, met = found.need, f" (after '{found.met[-1]}')" if found.met else ""
    actions = "' and '".join((need.action, *sorted(need.skills - {need.action})))
    takes = need_words(actions, need.robots, together=need.together)
    parts = [f"{it or obstacle_words(found.obstacle, word)} needs {takes}{met}"]
    names = [*found.done, *(helper.name for helper in found.helpers)]
    if not names and need.action == OPERATOR_ACTION:
        return f"{it or obstacle_words(found.obstacle, word)} needs an operator"
    if not names:
        return f"{parts[0]}, and no robot of this team has {_ALL.get(len(need.skills), 'all')}"
    if found.too_few:
        parts.append(f"this team has {number_words(len(names))}: {listed(names)}")
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
        parts += [f"{listed(ready)} can reach the obstacle"] if ready else []
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


_ALL = {1: "it", 2: "both"}
_NUMBERS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def number_words(number: int) -> str:
    return _NUMBERS.get(number, str(number))


def need_words(action: str, robots: int, *, together: bool) -> str:
    """Return ``two robots with 'lift' at the same time`` or ``a robot with 'push'``."""
    if robots == 1:
        return f"a robot with '{action}'"
    when = " at the same time" if together else ""
    return f"{number_words(robots)} robots with '{action}'{when}"


def without_room(now: Sets, word: Word) -> list[str]:
    """Return a sentence for each joint need whose resolution regions enough robots can reach, but
    not all in different regions."""
    floor, found = now.floor, []
    for g in floor.open(now.stages):
        need, able = floor.need(g, now.stages), floor.able(g, now.stages)
        near = {i: there for i in able if (there := now.spots(i, need.regions))}
        if need.together and len(near) >= floor.missing(g, now.stages):
            takes = need_words(need.action, need.robots, together=True)
            what = obstacle_words(floor.gate(g).name, word)
            found.append(f"{what} needs {takes}; {crowd_words(floor, near, word)}")
    return found


def crowd_words(floor: Floor, near: Mapping[int, Mask], word: Word) -> str:
    """Return a sentence: these robots cannot act together in the poses that each can reach."""
    names, regions = [floor.team.members[i].name for i in near], set[int]()
    for i, there in near.items():
        regions.update(bits(floor.graphs[i].regions_of(there)))
    places = " and ".join(map(word, sorted(regions)))
    return f"{listed(names)} can act only from {places}, where they cannot all be at the same time"

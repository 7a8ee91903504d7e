"""Full explanations of one robot (cause, core, losing play, repairs) or of a specification line by
line.

Graph search comes first; the game decides the rest. The core is a minimal set of conflicting
guarantees, in scenario terms. Graph search first omits walls (a robot never observes walls that it
cannot reach), then QuickXplain queries the synthesizer (Junker: Preferred explanations and
relaxations for over-constrained problems, AAAI 2004): about 2k log(n/k) + 2k queries for k of n
members. Assumptions are never omitted: without them a strategy is even less possible."""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import islice, product
from typing import TypeVar

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import UsageError, Verdict
from safenav.explain.explanation import (
    Core,
    CoreMember,
    Diagnosis,
    Dilemma,
    Explanation,
    LosingPlay,
    NoStrategyCause,
    PlayEnd,
    RepairProblem,
    Values,
    diagnose,
    is_guarantee,
    with_guarantees,
)
from safenav.explain.play import MOST_INPUTS, Questions, cooperative, losing_play
from safenav.explain.repair import Judge, find_repairs
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Ltl, Target
from safenav.spec.compile import compile_task
from safenav.spec.guarantees import values_of
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
    stepping,
)
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.automaton import clauses
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.poses import Pose, moves

Item = TypeVar("Item")

MOST_AT_ONCE = 64
"""Maximum number of members to omit one by one, in parallel, before any search."""
CORE_SHARE, REST_SHARE = 0.5, 0.65
"""Shares of the budget at which the search for the core and the other checks end."""


def find_core(
    spec: Specification, task: Task, world: RegionMap, found: Diagnosis, ask: Questions
) -> Core:
    """Return a minimal core of an unrealizable specification.

    If a query exceeds its limits, its members remain in the core, which may then not be minimal."""
    search = _Search(spec, ask)
    every = _members(spec, task, world)
    members = search.first_failing(_choices(every, task, world, found))
    walls = [m for m in members if _is_wall(m)]
    rest = search.minimal([m for m in members if not _is_wall(m)], walls)
    walls = search.minimal([part for m in walls for part in _split(m)], rest)
    return search.core([*rest, *walls], [part for m in every for part in _split(m)])


def find_line_core(spec: Specification, ask: Questions) -> Core:
    """Return a minimal core of an unrealizable specification. Each member is a line."""
    search = _Search(spec, ask)
    lines = [CoreMember(c.origin, (c,)) for c in spec.constraints if is_guarantee(c)]
    return search.core(search.minimal(lines, []), lines)


def _proven(verdict: Verdict) -> bool | None:
    """Return whether a specification is realizable; None if unknown."""
    return {Verdict.REALIZABLE: True, Verdict.UNREALIZABLE: False}.get(verdict)


class _Search:
    """A search for a core: queries on subsets of a specification's guarantees."""

    def __init__(self, spec: Specification, ask: Questions) -> None:
        self._spec = spec
        self._ask = ask
        self._unknown = False
        ask.spend(CORE_SHARE)

    def core(self, members: Sequence[CoreMember], every: Sequence[CoreMember]) -> Core:
        """Return the core with these members. ``every``: all members of the specification."""
        self._ask.spend(REST_SHARE)
        fairness = dict.fromkeys(c.origin for c in self._spec.section(Section.ENV_LIVENESS))
        together = self._ask.verdict(cooperative(self.with_only(members)))
        core = Core(tuple(members), _proven(together), tuple(fairness), not self._unknown)
        if core.together:
            all_together = self._ask.verdict(cooperative(self.with_only(every)))
            core = replace(core, all_together=bool(_proven(all_together)))
        if not core.minimal:
            return core
        without = [self.with_only(m for m in every if m != each) for each in members]
        self._ask.prepare(without)
        suffices = [_proven(self._ask.verdict(spec)) for spec in without]
        vain = tuple(m for m, good in zip(members, suffices, strict=True) if good is False)
        return replace(core, decisive=all(suffices), vain=vain)

    def with_only(self, members: Iterable[CoreMember]) -> Specification:
        return with_guarantees(self._spec, (c for m in members for c in m.constraints))

    def fails(self, members: Iterable[CoreMember]) -> bool:
        """Return whether the guarantees of these members are provably unrealizable."""
        verdict = self._ask.verdict(self.with_only(members))
        self._unknown = self._unknown or not verdict.proven
        return verdict is Verdict.UNREALIZABLE

    def first_failing(self, choices: Sequence[list[CoreMember]]) -> list[CoreMember]:
        """Return the first choice that fails; the last choice has all guarantees."""
        return next((few for few in choices[:-1] if self.fails(few)), choices[-1])

    def minimal(self, members: list[CoreMember], background: list[CoreMember]) -> list[CoreMember]:
        """Return a minimal set of members that is unrealizable together with ``background``."""
        without = [[*background, *members[:k], *members[k + 1 :]] for k in range(len(members))]
        if len(members) <= MOST_AT_ONCE:
            self._ask.prepare([self.with_only(some) for some in without])
            if not any(map(self.fails, without)):
                return members
        return minimal_subset(members, lambda some: self.fails([*background, *some]))


def _choices(
    every: list[CoreMember], task: Task, world: RegionMap, found: Diagnosis
) -> list[list[CoreMember]]:
    """Return probably unrealizable sets of guarantees, the smallest first. The last set consists of
    all guarantees."""
    around = {world.step(region, heading) for region in found.confined for heading in Heading}
    beside = world.walls & around
    choices = [[m for m in every if not _is_wall(m) or not beside.isdisjoint(m.regions)], every]
    if found.cause is NoStrategyCause.NO_WAY:
        dividing = _dividing(task, world, found.lost)
        parts = [part for m in every for part in _split(m)]
        choices.insert(0, [m for m in parts if not _is_wall(m) or m.regions[0] in dividing])
    return choices


def _members(spec: Specification, task: Task, world: RegionMap) -> list[CoreMember]:
    """Return the guarantees in groups that a user would name. A core prefers earlier groups: the
    objective is first, the map last."""
    together: dict[object, list[Constraint]] = {}
    for constraint in _with_all_edges(spec, task, world):
        if is_guarantee(constraint):
            origin = constraint.origin
            formula = origin.rule.startswith("ltl") or origin.item.endswith(".always")
            alone = formula or origin.item == "map" or constraint.section is Section.SYS_LIVENESS
            key = (constraint,) if alone else (constraint.origin, constraint.section)
            together.setdefault(key, []).append(constraint)
    members = [_member(constraints) for constraints in together.values()]
    return sorted(members, key=lambda m: (_is_wall(m), ".objective" not in m.origin.item))


def _with_all_edges(spec: Specification, task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the constraints, with the map's edge as a part of the mobility.

    A specification omits the edge along walls. Without those walls a robot could step from the end
    of a row to the beginning of the next one."""
    item = f"{task.item}.mobility"
    open_map = replace(world, walls=frozenset())
    rules = list(stepping(open_map, item))
    for constraint in spec.constraints:
        if constraint == rules[0]:
            yield from (replace(rule, origin=constraint.origin) for rule in rules)
        elif constraint.origin.item != item or not constraint.origin.rule.startswith("no step"):
            yield constraint


def _member(constraints: Sequence[Constraint]) -> CoreMember:
    regions = sorted({region for c in constraints for region in c.regions})
    return CoreMember(constraints[0].origin, tuple(constraints), tuple(regions))


def _is_wall(member: CoreMember) -> bool:
    return member.origin.item == "map"


def _split(member: CoreMember) -> list[CoreMember]:
    """Return a run of walls as single walls, and any other member unchanged, in a list."""
    if not _is_wall(member) or len(member.regions) == 1:
        return [member]
    section, origin = member.constraints[0].section, member.origin
    return [
        CoreMember(origin, (Constraint(section, f"region' != {r}", origin, (r,)),), (r,))
        for r in member.regions
    ]


def _dividing(task: Task, world: RegionMap, lost: Sequence[Target]) -> set[Region]:
    """Return walls that keep the robot from the first lost target. Each is beside a region that the
    robot reaches, and a path from it to the target crosses no other such wall."""
    room = world.distances([task.pose.region])
    walls = {wall for wall in world.walls if not room.keys().isdisjoint(world.neighbours(wall))}
    target = next((t for t in lost if room.keys().isdisjoint(t)), frozenset[Region]())
    opened = replace(world, walls=frozenset(walls))
    beyond = opened.distances(target)
    return {wall for wall in walls if not beyond.keys().isdisjoint(opened.neighbours(wall))}


def minimal_subset(items: Sequence[Item], fails: Callable[[Sequence[Item]], bool]) -> list[Item]:
    """Return a minimal failing subset. It prefers earlier items.

    ``fails`` must hold for ``items``, and for each set that contains a failing set."""
    if fails(()):
        return []
    return _explain([], False, list(items), fails)


def _explain(
    background: list[Item], grown: bool, items: list[Item], fails: Callable[[Sequence[Item]], bool]
) -> list[Item]:
    """Return a minimal set of items that fails together with ``background``. ``grown``: whether
    ``background`` has gained members since its last query."""
    if grown and fails(background):
        return []
    if len(items) == 1:
        return items
    half = (len(items) + 1) // 2
    first, second = items[:half], items[half:]
    late = _explain([*background, *first], True, second, fails)
    early = _explain([*background, *late], bool(late), first, fails)
    return [*early, *late]


# The whole explanation.


REPAIR_SECONDS = 2.0
_C = NoStrategyCause


def explain(scenario: Scenario, task: Task, synthesizer: Synthesizer, judge: Judge) -> Explanation:
    """Explain why an unrealizable ``task`` of a scenario's robot has no strategy.

    ``judge`` returns whether that robot has a strategy at the start of a changed scenario."""
    begun = time.monotonic()
    world = scenario.map
    spec = compile_task(task, world)
    ask = Questions(synthesizer)
    found = diagnose(task, world)
    core = find_core(spec, task, world, found, ask)
    ask.spend(1.0)
    part = with_guarantees(spec, core.constraints)
    play = confinement(found, core, task) or play_out(spec, part, task, world, ask)
    cause = found.cause or _cause(core, task)
    deadline = time.monotonic() + REPAIR_SECONDS
    problem = RepairProblem(scenario, task, cause, found, deadline)
    repairs = find_repairs(problem, judge)
    seconds = time.monotonic() - begun
    return Explanation(task.robot.name, task, cause, found, core, play, repairs, seconds)


def _cause(core: Core, task: Task) -> NoStrategyCause:
    """Return the cause that the core shows, if graph search has found none."""
    sections = {constraint.section for constraint in core.constraints}
    if sections == {Section.SYS_INIT}:
        return _C.IMPOSSIBLE_START
    if core.together is None:
        return _C.CONFLICT
    if core.together:
        return _C.KEPT_AWAY if Section.SYS_LIVENESS in sections else _C.CORNERED
    own = (f"{task.item}.objective", f"{task.item}.start")
    itself = all(member.origin.item in own for member in core.members)
    return _C.CONTRADICTION if isinstance(task.objective, Ltl) and itself else _C.FORBIDDEN_WAY


def confinement(found: Diagnosis, core: Core, task: Task) -> LosingPlay | None:
    """Return the losing play that graph search proves: the robot visits all regions that it can
    reach, none of them in the target. None unless the core concerns the robot's moves."""
    lost = found.lost or found.cause is NoStrategyCause.CROSSING
    moving = f"{task.item}.mobility" in {member.origin.item for member in core.members}
    if found.cause is None or not lost or not moving:
        return None
    return LosingPlay(PlayEnd.CONFINED)


def play_out(
    whole: Specification, core: Specification, task: Task, world: RegionMap, ask: Questions
) -> LosingPlay | None:
    """Return a losing play of the robot for the core; None if the limits allow none."""
    play = losing_play(whole, core, ask, partial(_nearness, core, world))
    if play is None or play.ending is not PlayEnd.STUCK:
        return play
    return replace(play, dilemmas=tuple(_dilemmas(core, play, task, world)))


def _nearness(core: Specification, world: RegionMap, goal: Constraint) -> Callable[[Values], int]:
    """Return a function from states to the robot's distance to a goal, without headings."""
    field = world.distances(goal.regions or _regions_of(goal, core, world))
    return lambda values: field.get(values["region"], world.size)


def _regions_of(goal: Constraint, core: Specification, world: RegionMap) -> list[Region]:
    """Return the regions in which the formula of a goal can hold."""
    (clause,) = clauses(replace(core, constraints=(goal,)), Section.SYS_LIVENESS)
    mentioned = {name for name, _ in clause.places} - {"region"}
    choices = [*_valuations([v for v in core.variables if v.name in mentioned])]
    known = ((region, {**values, "region": region}) for region in world.free for values in choices)
    return [region for region, values in known if clause.holds(values, values)]


def _dilemmas(
    core: Specification, play: LosingPlay, task: Task, world: RegionMap
) -> Iterator[Dilemma]:
    """Yield a dilemma for each move of the robot: a guarantee that the move would break."""
    now, inputs = play.walk[-1], dict(play.pressure)
    heading = Heading(now["heading"]) if "heading" in now else None
    promised = clauses(core, Section.SYS_TRANS)
    for after in moves(task.robot.model.mobility, Pose(now["region"], heading), world):
        later = {**inputs, **values_of(after)}
        free = [v for v in core.owned(Owner.OUTPUT) if v.name not in later]
        choices = ({**later, **values} for values in _valuations(free))
        broken = ([c.constraint for c in promised if not c.holds(now, then)] for then in choices)
        fewest = min(broken, key=len)
        if fewest:
            yield Dilemma(after.region, after.heading, fewest[0])


def _valuations(variables: Sequence[Variable]) -> Iterator[Values]:
    """Yield the joint values of these variables, at most MOST_INPUTS of them."""
    names = [variable.name for variable in variables]
    first = (variable.range[:MOST_INPUTS] for variable in variables)
    for choice in islice(product(*first), MOST_INPUTS):
        yield dict(zip(names, choice, strict=True))


PLAY_SHARE = 0.85
"""Share of the budget at which the play ends."""


class LineExplanation(Struct, frozen=True):
    """The explanation of an unrealizable specification.

    ``fairness``: its lines of ENV_LIVENESS. ``play``: a losing play of the core; None if the limits
    did not allow it. ``assumptions``: additional lines of ENV_LIVENESS that each make the
    specification realizable. ``undecided``: such lines without a verdict within the limits."""

    core: Core
    fairness: tuple[Constraint, ...]
    play: LosingPlay | None
    assumptions: tuple[str, ...]
    undecided: tuple[str, ...] = ()


def explain_lines(spec: Specification, synthesizer: Synthesizer) -> LineExplanation:
    """Explain why a specification is unrealizable, as far as the budget allows. Raises UsageError
    if it is realizable."""
    ask = Questions(synthesizer)
    if ask.verdict(spec) is Verdict.REALIZABLE:
        raise UsageError("the specification is realizable: nothing to explain")
    core = find_line_core(spec, ask)
    ask.spend(PLAY_SHARE)
    play = losing_play(spec, with_guarantees(spec, core.constraints), ask)
    ask.spend(1.0)
    helpful, undecided = ([], []) if core.alone else _helpful(spec, ask)
    fairness = spec.section(Section.ENV_LIVENESS)
    return LineExplanation(core, fairness, play, tuple(helpful), tuple(undecided))


def _helpful(spec: Specification, ask: Questions) -> tuple[list[str], list[str]]:
    """Return two lists of assumptions, each that one Boolean input is on or off infinitely often:
    those that make the specification realizable without a win by their violation, and those that
    the limits left undecided."""
    inputs = [v.name for v in spec.owned(Owner.INPUT) if v.bounds is None]
    lines = [line for name in inputs for line in (f"{name}'", f"!{name}'")]
    helpful, undecided = list[str](), list[str]()
    never = Constraint(Section.SYS_LIVENESS, "FALSE", _TRIED)
    for first in range(0, len(lines), MOST_AT_ONCE):
        fair = {
            line: spec.with_more(Constraint(Section.ENV_LIVENESS, line, _TRIED))
            for line in lines[first : first + MOST_AT_ONCE]
        }
        ask.prepare(list(fair.values()))
        for line, stronger in fair.items():
            verdict = ask.verdict(stronger)
            if verdict is Verdict.REALIZABLE:
                hopeless = stronger.without(spec.section(Section.SYS_LIVENESS)).with_more(never)
                verdict = ask.verdict(hopeless)
                helpful += [line] * (verdict is Verdict.UNREALIZABLE)
            undecided += [line] * (not verdict.proven)
    return helpful, undecided


_TRIED = Origin("explanation", "tried")

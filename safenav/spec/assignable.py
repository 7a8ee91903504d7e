"""Goals that are assigned at runtime: coordination without resynthesis (paper, Section V-D).

Three inputs let the coordination layer steer a robot whose strategy is never changed: ``wait``
keeps it where it is; ``request`` sends it to the region ``assigned``, and excuses its own goals
meanwhile. Only regions from which it can resume its own objective are assigned. Obstacles that turn
out to be permanent still require a new strategy.

While a robot must wait, an open request does not carry its region: an extra bit for every pair of a
region and a request would double the nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import starmap

from msgspec.structs import replace

from safenav.scenario.objective import Ltl
from safenav.spec.assignable_regions import AssignableRegions, Part, assignable_regions
from safenav.spec.movement import among, one_of
from safenav.spec.specification import Constraint, Origin, Owner, Section, Specification, Variable
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap

SOURCE = "paper, Section V-D, the runtime-assignable goal"
NEXT = "'"
ABLE = "it never loses a region that it is assigned"
HOME = "it does not leave permanently unless assigned elsewhere"


def inputs(world: RegionMap) -> tuple[Variable, ...]:
    """Return the inputs by which the coordination layer commands the robot."""
    return (
        Variable("request", Owner.INPUT, None, "the robot is assigned a region"),
        Variable("wait", Owner.INPUT, None, "the robot must stay where it is"),
        Variable("assigned", Owner.INPUT, (0, world.size - 1), "the region assigned to it"),
    )


def neutral(assignable: AssignableRegions) -> Region:
    """Return the value of ``assigned`` while there is no request."""
    return min(assignable.places)


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions: requests assign regions from which the robot can resume its objective,
    and do not change while open."""
    possible = assignable_regions(task, world)
    idle = neutral(possible)
    begin = _origin("no request before the first move")
    for formula in ("!request", f"assigned = {idle}", "!wait"):
        yield Constraint(Section.ENV_INIT, formula, begin)
    where = _origin("only regions from which it can resume its objective are assigned")
    allowed_next = one_of("assigned", possible.places, "'")
    yield Constraint(Section.ENV_TRANS, f"request' & !wait' -> {allowed_next}", where)
    for part in possible.parts:
        formula = f"{_asked(part)} -> {_in(part, task)}"
        yield Constraint(Section.ENV_TRANS, formula, where, tuple(sorted(part.regions)))
    yield Constraint(Section.ENV_TRANS, f"!request' | wait' -> assigned' = {idle}", where)
    still = _origin("an open request keeps its region until the robot must wait")
    same = "request & !wait & request' & !wait' -> assigned' = assigned"
    yield Constraint(Section.ENV_TRANS, same, still)
    fair = _origin("infinitely often, it need not wait")
    yield Constraint(Section.ENV_LIVENESS, "!wait'", fair)


def _origin(rule: str) -> Origin:
    return Origin("coordination", rule, SOURCE)


def guarantees(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the guarantees: the robot waits when commanded, and goes to the assigned region."""
    stay = _origin("it stays while it must wait")
    yield Constraint(Section.SYS_TRANS, "wait' -> region' = region", stay)
    possible = assignable_regions(task, world)
    able = _origin(ABLE)
    for part in possible.parts:
        formula = f"{_asked(part)} -> {_in(part, task, NEXT)}"
        yield Constraint(Section.SYS_TRANS, formula, able, tuple(sorted(part.regions)))
    home = _origin(HOME)
    for part in possible.homes:
        asked = "!request' | " + one_of("assigned", part.regions, "'")
        formula = f"{_in(part, task)} & ({asked}) -> {_in(part, task, NEXT)}"
        yield Constraint(Section.SYS_TRANS, formula, home)
    go = _origin("it reaches the assigned region")
    yield Constraint(Section.SYS_LIVENESS, "request' & !wait' -> region' = assigned'", go)


def may_leave(spec: Specification) -> Specification:
    """Return a specification (compiled, or read from its text) without the guarantees that the
    robot can return: the scenario does not require them."""
    guarantees_of = [c for c in spec.constraints if c.section is Section.SYS_TRANS]
    return spec.without(c for c in guarantees_of if ABLE in c.origin.rule or HOME in c.origin.rule)


def _in(part: Part, task: Task, mark: str = "") -> str:
    """Return the condition for the states of ``part``; ``mark``: suffix of the variables."""
    ranges = task.objective.memory if isinstance(task.objective, Ltl) else {}

    def has(name: str, value: int) -> str:
        truth = "" if value else "!"
        return f"{name}{mark} = {value}" if ranges[name] else f"{truth}{name}{mark}"

    states = part.poses().items()
    atoms = [" & ".join([*starmap(has, memory), among(poses, mark)]) for memory, poses in states]
    return f"({' | '.join(atoms)})"


def _asked(part: Part) -> str:
    """Return the condition that one of the regions of a part is assigned to the robot."""
    assigned = one_of("assigned", part.regions, "'")
    return f"request' & !wait' & {assigned}"


def excused(constraint: Constraint, holds: bool = False) -> Constraint:
    """Return a goal of the robot, excused while a request is open; if the objective ``holds``, also
    the guarantee to stay."""
    stays = holds and constraint.origin.rule.endswith(", stay")
    if constraint.section is not Section.SYS_LIVENESS and not stays:
        return constraint
    rule = f"{constraint.origin.rule}, unless it is assigned a region"
    origin, formula = replace(constraint.origin, rule=rule), f"request' | ({constraint.formula})"
    return replace(constraint, formula=formula, origin=origin)

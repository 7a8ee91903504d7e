"""Rules on the motion of robots: steps, other robots, obstacles, their own rules, charge."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.judge.effects import charge_after
from safenav.judge.lines import Line
from safenav.judge.rule import STEPS, rule
from safenav.judge.state import State
from safenav.judge.world import opposite


@rule(*STEPS)
def continuity(e: Line, s: State) -> Iterator[str]:
    """A robot departs from where it is, and arrives only if it has departed."""
    robot = s.robots[e.robot]
    if s.step(e).start != robot.pose[0]:
        yield f"{e.robot} is at {s.show(robot.pose[0])}, not at {s.show(s.step(e).start)}"
    if e.kind == "arrive" and robot.bound is None:
        yield f"{e.robot} arrives, but has not departed"
    if e.kind == "depart" and robot.bound is not None:
        yield f"{e.robot} departs before its last step has ended"
    if e.kind == "depart" and robot.acts is not None:
        yield f"{e.robot} departs while it takes part in an action"


@rule(*STEPS)
def mobility(e: Line, s: State) -> Iterator[str]:
    """A robot stays or steps to a free neighbouring region, with a heading never backwards, and a
    step ends where it leads; if it fails, at one of its ends, or elsewhere in a world of the
    user's."""
    robot, step = s.robots[e.robot], s.step(e)
    side, bound = s.world.side(step.start, step.to), robot.bound
    if e.result == "lost" and not e.regions:
        yield f"{e.robot} is lost, but its possible regions are missing"
    if step.to not in s.world.free:
        yield f"{e.robot} enters {s.show(step.to)}, which is not free"
    if step.strays:
        if not s.external and (not s.live or step.at not in (step.start, bound)):
            yield f"{e.robot} ends elsewhere than commanded, in a simulated world"
        return
    if step.to != step.start and side is None:
        where = f"from {s.show(step.start)} to {s.show(step.to)}"
        yield f"{e.robot} jumps {where}, which is not a neighbour"
    if bound is not None and step.to != bound:
        yield f"{e.robot} is in transit to {s.show(bound)}, not to {s.show(step.to)}"
    if step.bound is not None and (step.at != step.start or step.bound == step.start):
        yield f"{e.robot} moves while in transit"
    if not robot.faces:
        if step.heading is not None:
            yield f"{e.robot} has no heading, but then faces {step.heading}"
        return
    faced = robot.pose[1]
    if faced is not None and side == opposite(faced):
        yield f"{e.robot} faces {faced} and steps {side}, which is backwards"
    if step.bound is None and step.heading != (side or faced):
        yield f"{e.robot} faces {step.heading} after it faced {faced} and went {side or 'nowhere'}"


@rule("move")
def pace(e: Line, s: State) -> Iterator[str]:
    """In ticks a robot has one move each tick, and a step takes the ticks that its model states."""
    robot, takes = s.robots[e.robot], s.robots[e.robot].data.timing or 1
    if e.tick != robot.moved + 1:
        yield f"{e.robot} moves in tick {e.tick} after its move of tick {robot.moved}"
    begun = robot.began if robot.bound is not None else e.tick
    took, strays = e.tick - begun + 1, s.step(e).strays
    ends = e.to != e.start and e.toward is None
    if ends and not strays and took < takes:
        yield f"a step of {e.robot} takes {took} ticks, not {takes}"


def _holds(e: Line, s: State, other: str) -> tuple[frozenset[int], frozenset[int]]:
    """Return the regions that a robot occupies after a line, and those of another one. In ticks, if
    the first ends elsewhere than commanded, the unfinished step of the other does not count."""
    theirs = s.robots[other]
    if e.kind == "operator":
        return frozenset([e.region]), theirs.holds
    step = s.step(e)
    strays = step.strays and not s.live
    return step.holds, frozenset([theirs.pose[0]]) if strays else theirs.holds


@rule(*STEPS, "operator")
def collision(e: Line, s: State) -> Iterator[str]:
    """Robots in conflict never occupy the same region; a robot in transit occupies two, and a lost
    robot all regions in which it may be."""
    if e.kind == "operator" and (e.region is None or e.robot is None):
        return
    for other in s.rivals[e.robot]:
        mine, theirs = _holds(e, s, other)
        if both := mine & theirs:
            yield f"{e.robot} and {other} are both at {s.show(min(both))}"


@rule(*STEPS, "operator")
def never_together(e: Line, s: State) -> Iterator[str]:
    """At most one robot of an entry of `never_together` is in its regions."""
    if not s.zones or (e.kind == "operator" and (e.region is None or e.robot is None)):
        return
    for robots, regions in s.zones:
        for other in robots - {e.robot} if e.robot in robots else ():
            mine, theirs = _holds(e, s, other)
            if mine & regions and theirs & regions:
                yield f"{e.robot} and {other} are together in {sorted(regions)}"


@rule(*STEPS)
def unresolved_obstacle(e: Line, s: State) -> Iterator[str]:
    """A robot enters the region of an unresolved obstacle that blocks it only to resolve it so;
    the obstacle must be resolved in that turn, or else the robot leaves to where it came from."""
    robot, step = s.robots[e.robot], s.step(e)
    entered = step.holds - robot.holds
    if not entered or (step.strays and s.external):
        return
    acts = s.live and any(each.acts is not None for each in s.robots.values())
    for region in entered:
        for one in s.closing(e.robot, region):
            if one.shut or not acts:  # else it may be resolved in this tick
                yield f"{e.robot} enters {s.show(region)} with {one.name}, which is not resolved"
    for one in s.at.get(step.start, ()):
        inside = one.open and e.robot in one.blocks
        inside = inside and not (s.external and not one.known) and robot.came is not None
        if inside and not entered <= {robot.came, one.region}:
            yield f"{e.robot} passes {one.name}, which is not resolved"


@rule()
def in_time(e: Line, s: State) -> Iterator[str]:
    """A robot departs into the region of an obstacle that is being resolved only if that happens in
    the same moment."""
    for robot, name, tick in s.entering:
        if tick < e.tick:
            yield f"{robot} has departed into the region of {name}, which is not resolved"


@rule("move", "depart")
def own_rules(e: Line, s: State) -> Iterator[str]:
    """No robot enters a region that its own objective avoids, and each of its steps keeps the
    formulas of its `always` and of the `safety` of its `ltl`."""
    robot, step = s.robots[e.robot], s.step(e)
    if step.strays and s.external:
        return
    for region in (step.holds - robot.holds) & robot.own.avoid:
        yield f"{e.robot} enters {s.show(region)}, which it must avoid"
    formulas = robot.own.formulas
    if formulas is None or step.start == step.to or robot.bound is not None:
        return  # a step that was begun may be ended under other rules
    way = s.world.side(step.start, step.to) if robot.faces else None
    here = step.start, robot.pose[1]
    if not formulas.allows(here, (step.to, way)):
        yield f"{e.robot} steps from {s.show(here[0])} to {s.show(step.to)} against its formulas"


@rule("move", "depart")
def service(e: Line, s: State) -> Iterator[str]:
    """A robot out of service begins no step."""
    robot, step = s.robots[e.robot], s.step(e)
    begins = robot.bound is None and step.to != step.start and not step.strays
    if begins and robot.out:
        yield f"{e.robot} moves, but is out of service"


@rule("move", "depart", "service")
def charge(e: Line, s: State) -> Iterator[str]:
    """No robot takes a step for which its charge does not suffice, and a battery is replaced only
    by resolving the obstacle that appeared when it was used up."""
    robot = s.robots[e.robot]
    if e.kind == "service":
        if e.active and e.cause == "battery" and not robot.filled:
            yield f"the battery of {e.robot} was not replaced"
    elif robot.charge is not None and s.live:
        left = robot.charge_at(e.t or 0.0, s.scenario.chargers or ())
        if left < robot.data.battery.move:
            yield f"{e.robot} takes a step with a charge of {left:g}"
    elif robot.charge is not None and charge_after(e, robot, s) < 0:
        yield f"{e.robot} takes a step with a charge of {robot.charge:g}"

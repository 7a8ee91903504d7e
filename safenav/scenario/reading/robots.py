"""The ``robots:`` of a scenario, their objectives, and checks of reachable targets."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import combinations

from msgspec.structs import replace

from safenav.formula import syntax
from safenav.formula.parser import FormulaError, check, parse
from safenav.scenario import language
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import KINDS, Ltl, Objective, on_steps, ruled
from safenav.scenario.reading.regions import Reading, wall
from safenav.scenario.yaml.document import Node, Scalar, clipped, entries_of, items_of
from safenav.scenario.yaml.findings import suggestion
from safenav.strict_json import MOST_ROBOTS
from safenav.world.map import HEADINGS, Heading, Region, RegionMap
from safenav.world.poses import Mobility, Pose
from safenav.world.reachability import Reachability


def resolve_robots(
    team: Mapping[Scalar, language.RobotKeys] | None, node: Node | None, reading: Reading
) -> None:
    """Add the readable robots to ``reading``. Report errors in the other entries."""
    if team == {} and not entries_of(node):
        reading.add(node, "there are no robots", "write at least one robot")
    if len(team or ()) > MOST_ROBOTS:
        reading.add(node, f"{len(team or ())} robots; the maximum is {MOST_ROBOTS}")
    items = {key.text: item for key, item in (team or {}).items()}
    robots = [_robot(name, item, reading) for name, item in items.items()]
    reading.team = tuple(robot for robot in robots if robot is not None)
    for number, robot in enumerate(reading.team):
        _check_start(robot, items[robot.name], reading.team[:number], reading)
        _check_timing(robot, items[robot.name], reading)


def _robot(name: str, item: language.RobotKeys, reading: Reading) -> Robot | None:
    """Return a robot; None after a reported error."""
    before, model, start = len(reading), item.model_, item.start
    if item.at("vision") is not None:
        model = model and replace(model, vision=item.vision)
    heading = _heading(item, model, reading)
    avoids = None if item.avoids is None else frozenset(item.avoids)
    tracks = frozenset(item.tracks)
    for key, others in (("avoids", avoids), ("tracks", tracks)):
        if others and name in others:
            reading.add(item.at(key), f"{item.named(key)}: a robot cannot list itself")
    mobility = model.mobility if model else None
    objective = resolve_objective(item.objective, mobility, reading)
    waiting = resolve_objective(item.while_waiting, mobility, reading)
    for key in ("while_waiting", "when") if isinstance(objective, Ltl) else ():
        if item.at(key) is not None:
            hint = "an input belongs in the formulas; a robot with 'ltl' stays while it waits"
            reading.add(item.at(key), f"{item.named(key)} cannot be used with 'ltl'", hint)
    if model is None or start is None or objective is None:
        return None
    if mobility is Mobility.HEADING and heading is None:
        return None
    pose = Pose(start, heading if mobility is Mobility.HEADING else None)
    waiting = waiting and ruled(waiting, objective)
    within = None if item.objective is None else item.objective.within
    given = item.when or {}
    found = [(on, resolve_objective(o, mobility, reading)) for on, o in given.items()]
    when = tuple((on, each) for on, each in found if each is not None)
    robot = Robot(name, model, pose, objective, avoids, tracks, waiting, within, when)
    for each, there in ((objective, item.objective), *((o, given[on]) for on, o in when)):
        _check_reachable(robot, each, there, reading)
    misses_targets(robot, waiting, item.while_waiting, reading)
    return None if item.flawed or len(reading) > before else robot


def _heading(
    item: language.RobotKeys, model: RobotModel | None, reading: Reading
) -> Heading | None:
    """Return the initial heading. Report a missing one, and note one without effect."""
    missing = item.at("heading") is None
    if missing and model is not None and model.mobility is Mobility.HEADING:
        found = f"robot {item.of.removeprefix('of ')}: the key 'heading' is missing"
        hint = f"a {model.name} starts with a heading: {', '.join(HEADINGS)}"
        reading.add(item.node, found, hint)
    if item.heading and model is not None and model.mobility is Mobility.FREE and reading.world:
        note = f"'heading' {item.of} has no effect: a {model.name} has no heading"
        reading.world = replace(reading.world, notes=(*reading.world.notes, note))
    return HEADINGS[item.heading] if item.heading else None


def _check_start(
    robot: Robot, item: language.RobotKeys, others: Iterable[Robot], reading: Reading
) -> None:
    """Report a robot that starts in the region of a robot in conflict with it."""
    region = robot.start.region
    for other in others:
        if other.start.region == region and robot.conflicts(other):
            found = f"'start' of {robot.name}: {other.name} also starts in region {region}"
            reading.add(item.at("start"), found, _why_apart(other, robot))
            return


def _check_timing(robot: Robot, item: language.RobotKeys, reading: Reading) -> None:
    """Report a robot with beliefs if its steps, or those of tracked robots, take several ticks: the
    assumptions about the other robots would be false."""
    involved = {robot.name, *robot.tracks} if robot.tracks else set()
    slow = [o.name for o in reading.team if o.name in involved and o.model.timing > 1]
    if slow:
        what = f"'tracks' of {clipped(robot.name)}: beliefs require one-tick steps"
        found = f"{what}; those of {clipped(slow[0])} take longer"
        reading.add(item.at("tracks"), found, "leave out 'tracks', or the 'timing' of the model")


def _why_apart(one: Robot, other: Robot) -> str:
    for robot, rest in ((one, other), (other, one)):
        if robot.avoids is not None and rest.name in robot.avoids:
            return f"{clipped(robot.name)} avoids {clipped(rest.name)}"
    return f"robots of one layer ({clipped(one.model.layer)}) cannot share a region"


def _check_reachable(
    robot: Robot, objective: Objective, item: language.ObjectiveKeys | None, reading: Reading
) -> None:
    world = reading.world
    if not objective.targets or item is None or world is None or not reading.reachable:
        return
    reach = Reachability(robot.model.mobility, robot.start, world, objective.avoid)
    meets = reach.follows if objective.settles else reach.recurs
    if not misses_targets(robot, objective, item, reading) and not meets(objective.targets):
        pairs = (pair for pair in combinations(objective.targets, 2) if not meets(pair))
        few = [clipped(world.labels(target), 40) for target in next(pairs, objective.targets)]
        what = ", then ".join(few) if objective.settles else f"{' and '.join(few)} infinitely often"
        hint = "with heading mobility it cannot turn at its target"
        reading.add(item.node, f"objective of {robot.name}: it cannot visit {what}", hint)


def misses_targets(
    robot: Robot, objective: Objective | None, item: language.ObjectiveKeys | None, reading: Reading
) -> bool:
    """Report the targets of an objective that a robot cannot reach from its start. Return whether
    there are any."""
    world, before = reading.world, len(reading)
    if objective is None or item is None or world is None or not reading.reachable:
        return False
    start, listed = world.label(robot.start.region), item.at(objective.kind)
    reach = Reachability(robot.model.mobility, robot.start, world, objective.avoid)
    places = (listed,) if objective.one else items_of(listed)
    for target, place in zip(objective.targets, places, strict=True):
        if not reach.reaches(target):
            regions = clipped(world.labels(target), 80)
            found = f"objective of {robot.name}: {regions} cannot be reached from {start}"
            reading.add(place, found, _why(robot, target, world))
    return len(reading) > before


def _why(robot: Robot, target: frozenset[int], world: RegionMap) -> str:
    if Reachability(robot.model.mobility, robot.start, world).reaches(target):
        return "regions that it avoids are between them"
    if robot.model.mobility is Mobility.HEADING:
        on_foot = Reachability(Mobility.FREE, Pose(robot.start.region), world)
        if on_foot.reaches(target):
            return "with heading mobility it cannot turn around on the spot: check the heading"
    return "walls are between them"


Declared = Mapping[str, tuple[int, int] | None]
"""The variables that formulas may name, with their ranges (None: Booleans)."""


def resolve_objective(
    item: language.ObjectiveKeys | None, mobility: Mobility | None, reading: Reading
) -> Objective | None:
    """Return an objective with its form and the rules beside it; None if it is missing or was
    reported. ``mobility``: its robot's, if known."""
    if item is None:
        return None
    given = [key for key in (*KINDS, "ltl") if item.at(key) is not None]
    if len(given) != 1:
        return None
    (kind,) = given
    if kind == "ltl":
        return _ruled(_ltl(item.ltl, mobility, reading), item, mobility, reading)
    return _ruled(_about_targets(kind, item, reading), item, mobility, reading)


def _ruled(
    objective: Objective | None,
    item: language.ObjectiveKeys,
    mobility: Mobility | None,
    reading: Reading,
) -> Objective | None:
    """Return the objective with the rules beside it. Rules beside ``ltl`` become formulas."""
    avoid = item.avoid
    always = _lines("always", item, _pose(mobility, reading), reading)
    if objective is None or (avoid is None and item.at("avoid") is not None):
        return None
    avoid = avoid or frozenset[Region]()
    if isinstance(objective, Ltl):
        never = (f"region' != {region}" for region in sorted(avoid))
        return replace(objective, safety=(*objective.safety, *never, *map(on_steps, always)))
    if any(target <= avoid for target in objective.targets):
        found = f"{item.named('avoid')} covers a target of its objective"
        reading.add(item.at("avoid"), found, "leave one of the two out")
        return None
    return objective.changed(avoid=avoid, always=always)


def _about_targets(word: str, item: language.ObjectiveKeys, reading: Reading) -> Objective | None:
    kind, value, node = KINDS[word], getattr(item, word), item.at(word)
    if kind.one:
        return value and kind((value,))
    if not value or len(value) < len(items_of(node)):
        return None
    if (problem := kind.wrong(value)) is not None:
        found, hint = problem
        reading.add(node, f"{item.named(word)}{found}", hint)
        return None
    return kind(value, literal=item.form is not None)


def _ltl(item: language.LtlKeys | None, mobility: Mobility | None, reading: Reading) -> Ltl | None:
    if item is None:
        return None
    before = len(reading)
    memory = _memory(item, reading)
    if item.memory is None and item.at("memory") is not None:
        return None  # formulas cannot be checked without their declarations
    inputs: Declared = dict.fromkeys(sorted(reading.input_names))
    own = {**memory, **_pose(mobility, reading)}
    init = _lines("init", item, own, reading)
    safety = _lines("safety", item, {**own, **inputs}, reading)
    liveness = _lines("liveness", item, {**own, **inputs}, reading)
    if not (safety or liveness or item.flawed or len(reading) > before):
        key = "liveness" if item.at("liveness") else "safety"
        reading.add(item.at(key), f"{item.named(key)} has no formula", f"as in {item.example}")
    if item.flawed or len(reading) > before:
        return None
    named = set().union(*(syntax.variables(parse(line)) for line in (*init, *safety, *liveness)))
    return Ltl(init, safety, liveness, memory, tuple(name for name in inputs if name in named))


def _memory(item: language.LtlKeys, reading: Reading) -> dict[str, tuple[int, int] | None]:
    memory: dict[str, tuple[int, int] | None] = {}
    for key, value in (item.memory or {}).items():
        reading.check_variable(key)
        memory[key.text] = None if isinstance(value, str) else value
    reading.broken |= {key.text for key, _ in entries_of(item.at("memory"))} - memory.keys()
    return memory


def _pose(mobility: Mobility | None, reading: Reading) -> Declared:
    """Return the variables of a robot's own pose with their ranges."""
    heading = {} if mobility is Mobility.FREE else {"heading": (0, 3)}
    return {"region": (0, (reading.world.size if reading.world else 2**31) - 1), **heading}


def _lines(
    key: str, item: language.LtlKeys | language.ObjectiveKeys, declared: Declared, reading: Reading
) -> tuple[str, ...]:
    """Return the formulas of a key as text, with numbers instead of the names of regions and
    headings."""
    given: tuple[Scalar, ...] = getattr(item, key) or ()
    lines = (_line(node, item.named(key), declared, key != "init", reading) for node in given)
    return tuple(line for line in lines if line is not None)


def _line(
    node: Scalar, what: str, declared: Declared, next_allowed: bool, reading: Reading
) -> str | None:
    """Return a formula as text, with numbers instead of names; None after an error."""
    try:
        formula = parse(node.text)
    except FormulaError as error:
        reading.add(node, f"{what}: {error.found}", error.hint, error.column)
        return None

    def meaning(name: syntax.Name, within: syntax.Comparison) -> Collection[int] | None:
        if name.name in declared:
            return None
        terms = (within.left, within.right)
        of_heading = any(isinstance(t, syntax.Name) and t.name == "heading" for t in terms)
        if of_heading and name.name in HEADINGS:
            return (int(HEADINGS[name.name]),)
        region = reading.names.get(name.name)
        return reading.areas.get(name.name) if region is None else (region,)

    formula = syntax.resolve_constants(formula, meaning)
    for problem in check(formula, declared, next_allowed=next_allowed):
        hint = problem.hint
        if problem.unknown == "heading":
            hint = "only robots with heading mobility have one"
        elif problem.unknown in {*reading.names, *reading.areas}:
            hint = f"it names a region: write region = {problem.unknown}"
        elif problem.unknown in reading.broken or (problem.unknown and not reading.names_known):
            continue
        elif problem.unknown in reading.input_names:
            hint = "it names an input, which only 'safety' and 'liveness' of 'ltl' may read"
        elif (constant := problem.unknown.upper()) in ("TRUE", "FALSE"):
            hint = f"write {constant}"
        elif problem.unknown:
            known = {*declared, *reading.names, *reading.areas}
            hint = suggestion(problem.unknown, (word for word in known if "-" not in word))
        reading.add(node, f"{what}: {problem.found}", hint, problem.column)
    if (world := reading.world) is not None:
        for number in _walls(formula, world.walls):
            found, hint = wall(number.value, world)
            reading.add(node, f"{what}: {found}", hint, number.column)
    return syntax.to_text(formula)


def _walls(formula: syntax.Formula, walls: Collection[Region]) -> Iterator[syntax.Number]:
    """Yield the walls, as numbers, that a formula equates with its robot's region."""
    if isinstance(formula, syntax.Comparison) and formula.relation is syntax.Relation.EQUAL:
        sides = (formula.left, formula.right)
        if any(isinstance(side, syntax.Name) and side.name == "region" for side in sides):
            yield from (s for s in sides if isinstance(s, syntax.Number) and s.value in walls)
    for operand in syntax.operands_of(formula):
        yield from _walls(operand, walls)

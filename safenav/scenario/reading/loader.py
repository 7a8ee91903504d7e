"""Scenarios from YAML, with all errors that are detectable before a run.

One InputError contains all diagnostics. The readers beside this module read the items of the
format; docs/scenario.md is its reference.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

from safenav.errors import Diagnostic
from safenav.files import printable
from safenav.scenario import language, model
from safenav.scenario.objective import unordered
from safenav.scenario.reading import catalogue, events
from safenav.scenario.reading.map import resolve_map
from safenav.scenario.reading.regions import Reading, check_starts, resolve_areas
from safenav.scenario.reading.robots import resolve_robots
from safenav.scenario.yaml.document import Node, below, entries_of
from safenav.scenario.yaml.findings import Findings, parsed, read_source
from safenav.scenario.yaml.typed import Stages, read
from safenav.world.map import Region
from safenav.world.reachability import Reachability

Change = Callable[[Node, Findings], Node]
"""A function that changes a document before it is read, so that variations are checked."""


def load_scenario(path: str | Path) -> model.Scenario:
    """Return the scenario in a file.

    Raises InputError with every diagnostic, in file order, if the file is unreadable or not a valid
    scenario.
    """
    return load_scenario_text(scenario_text(Path(path)), str(path))


def scenario_text(path: Path) -> str:
    """Return the text of a scenario's file or of standard input. Raises InputError."""
    findings = Findings(str(path))
    text = read_source(path, findings)
    findings.raise_if_any()
    assert text is not None
    return text


def load_scenario_text(
    text: str,
    file: str = "<text>",
    change: Change | None = None,
    *,
    reachable: bool = True,
    reach: Path | None = None,
) -> model.Scenario:
    """Return the scenario in a text. ``file``: the text's name in messages and as the scenario's
    source; catalogue files are searched beside it. ``change`` is applied to the document first.
    ``reach``: the folder whose files the text may name (None: any).

    Raises InputError.
    """
    draft = load_draft(text, file, reach, change, reachable=reachable)
    draft.raise_if_any()
    assert draft.scenario is not None, "else something was reported"
    return draft.scenario


def load_draft(
    text: str,
    file: str,
    reach: Path | None = None,
    change: Change | None = None,
    *,
    reachable: bool = True,
) -> Reading:
    """Return the readable parts of a text that is being edited, and its diagnostics. It has a
    scenario only if there are no diagnostics. Never raises an exception."""
    reading = Reading(file, reach, reachable=reachable)
    reading.catalogue = catalogue.built_in()
    root = parsed(text, reading)
    if root is not None and change is not None:
        root = change(root, reading)
    scenario = None if root is None else _scenario(root, reading)
    reading.scenario = None if len(reading) else scenario
    return reading


def _resolve_catalogue(
    item: language.CatalogueKeys | str | None, node: Node | None, reading: Reading
) -> None:
    if isinstance(item, str):
        catalogue.read_catalogue_file(reading.folder / item, reading, node)
    elif node is not None:
        catalogue.resolve_catalogue(item, reading)


def _resolve_flat(kind: model.ObstacleType | None, _: Node | None, reading: Reading) -> None:
    reading.flat = kind


STAGES: Stages = {
    "map": resolve_map,
    "areas": resolve_areas,
    "catalogue": _resolve_catalogue,
    "inputs": events.resolve_inputs,
    "robots": resolve_robots,
    "obstacles": events.resolve_obstacles,
    "orders": events.resolve_orders,
    "flat": _resolve_flat,
}
"""The parts of a scenario to which others refer, in the order of reading."""


def _scenario(root: Node, reading: Reading) -> model.Scenario | None:
    """Return the scenario in a document. It is valid only if no error was reported."""
    reading.named = tuple(key.text for key, _ in entries_of(below(root, "robots")))
    reading.names_known = below(root, "names") is None  # else they are reported as misplaced
    item: language.ScenarioKeys | None = read(
        language.ScenarioKeys, root, "the scenario", reading, stages=STAGES
    )
    if item is None:
        return None
    changes = events.resolve_changes(item.changes, reading)
    if item.coordination is model.Coordination.ASSIGNABLE:
        check_assignable(reading.team, changes, item.at("coordination"), reading)
    requirements = events.resolve_requirements(item.requirements, reading)
    if reading.world is None:
        return None
    scenario = model.Scenario(
        name=printable(" ".join((item.name or Path(reading.file).stem).split())),
        map=reading.world,
        robots=reading.team,
        obstacles=reading.obstacles,
        until=item.until,
        limits=item.limits,
        seed=item.seed,
        coordination=item.coordination,
        expect=item.expect or model.Expect(),
        source=reading.file,
        tiles=item.partition.tiles if isinstance(item.partition, language.TileKeys) else None,
        changes=changes,
        requirements=requirements,
        catalogue=reading.catalogue,
        clock=item.clock,
        never_together=item.never_together,
        resolve_within=item.resolve_within,
        late=item.late,
        chargers=frozenset[Region]().union(*item.chargers),
        flat=reading.flat,
        inputs=reading.inputs,
    )
    check_combinations(scenario, item.node, reading)
    return scenario


def conflicts(scenario: model.Scenario) -> tuple[Diagnostic, ...]:
    """Return the errors of a scenario that was changed after reading, such as a robot with a
    battery that reaches no charger. They have no places in a file."""
    findings = Findings(scenario.source)
    check_combinations(scenario, None, findings)
    for robot in scenario.robots:
        reach = Reachability(robot.model.mobility, robot.start, scenario.map)
        if robot.model.battery is not None and not reach.reaches(scenario.chargers):
            findings.add(None, f"{robot.name} has a battery and reaches no charger")
        for each in scenario.obstacles:
            if each.shuts_in(robot):
                findings.add(None, f"{each.name} is where {robot.name} starts, and blocks it")
    for exclusion in scenario.never_together:
        check_starts(exclusion, scenario.robots, None, findings)
    return findings.diagnostics


def check_assignable(
    team: Sequence[model.Robot],
    changes: Sequence[model.RobotChange],
    node: Node | None,
    findings: Findings,
) -> None:
    """Report settings that 'coordination: assignable' (at ``node``) does not support. For example,
    a goal assigned at runtime could lie beyond a target of a literal patrol."""
    given = [(robot.name, robot.objective) for robot in team]
    given += [(robot.name, objective) for robot in team for _, objective in robot.when]
    given += [(change.robot, change.objective) for change in changes if change.objective]
    parts = [(robot.name, "'while_waiting'") for robot in team if robot.while_waiting is not None]
    parts += [(robot.name, "inputs in 'ltl'") for robot in team if robot.objective.inputs]
    parts += [(robot.name, "the battery") for robot in team if robot.model.battery is not None]
    parts += [(name, "'form: literal'") for name, objective in given if objective.literal]
    for name, part in dict.fromkeys(parts):
        found = f"'coordination: assignable' does not support {part} of {name}"
        findings.add(node, found, "leave it out, or use 'coordination: resynthesis'")


def check_combinations(scenario: model.Scenario, item: Node | None, findings: Findings) -> None:
    """Report values that contradict each other. ``item``: the document with their places."""
    if scenario.clock is model.Clock.LIVE and (refused := refused_by_clock(scenario)) is not None:
        findings.add(below(item, "clock") or item, refused)
    for robot in scenario.robots:
        node, start = below(item, "robots", robot.name), robot.start.region
        if start in robot.objective.avoid:
            found = f"'avoid' of {robot.name}: it starts in {scenario.map.label(start)}"
            where = below(node, "objective", "avoid")
            findings.add(where, f"{found}, which it must avoid", "let it start elsewhere")
        pursued = (robot.objective, robot.while_waiting, *(each for _, each in robot.when))
        for objective in pursued if robot.model.battery is not None else ():
            if (error := unordered(robot.name, objective)) is not None:
                findings.add(node, *error)


def refused_by_clock(scenario: model.Scenario) -> str | None:
    """Return the reason why a scenario cannot run on its clock: live runs have no deadlines in
    ticks, and lockstep runs no charge per second. None if it can run."""
    live = scenario.clock is model.Clock.LIVE
    if live and scenario.deadlines:
        return (
            f"a live run cannot keep deadlines in ticks ({', '.join(scenario.deadlines)}): its "
            "ticks have no fixed length; use 'clock: lockstep', or seconds: for the run 'limits: "
            "{seconds: 60}', for its motion "
            "'requirements: [\"always(requested_door@47 -> eventually[0,60] resolved_door@47)\"]'"
        )
    for robot in scenario.robots:
        battery = robot.model.battery
        if not live and battery is not None and battery.stay != int(battery.stay):
            return (
                f"'stay: {battery.stay:g}' of {robot.name} is a charge per second: use "
                "'clock: live', or a whole number per tick"
            )
    return None

"""Expected results of a run: the ``expect:`` of a scenario, and its ``requirements:``, formulas of
signal temporal logic over the motion."""

from __future__ import annotations

from collections.abc import Collection

from safenav.formula.parser import FormulaError
from safenav.outcome import Outcome
from safenav.scenario import language
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Expect
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, well_named
from safenav.scenario.yaml.typed import Raw, read, sequence

MISSION = "mission"


def resolve_expect(item: language.ExpectKeys | None, reading: Reading) -> Expect:
    """Return the expected result; errors are reported."""
    if item is None:
        return Expect()
    others = {*reading.named, MISSION}
    return Expect(
        outcome=Outcome(item.outcome) if item.outcome else None,
        resolved=_names(item.resolved, item.named("resolved"), reading),
        blocked=_names(item.blocked, item.named("blocked"), reading),
        helpers=_helpers(item, reading),
        ticks=item.ticks,
        rounds=_rounds(item, reading),
        late=_names(item.late, item.named("late"), reading, others),
    )


def _names(
    words: Collection[Scalar] | None, what: str, reading: Reading, others: Collection[str] = ()
) -> frozenset[str] | None:
    """Return names of obstacles, or of ``others``."""
    if words is None:
        return None
    found = (w.text if w.text in others else _obstacle(w, w.text, what, reading) for w in words)
    return frozenset(name for name in found if name is not None)


def _rounds(item: language.ExpectKeys, reading: Reading) -> dict[str, int] | None:
    """Return the rounds of each robot from one number for all, or one for each."""
    if not isinstance(item.rounds, dict):
        return None if item.rounds is None else dict.fromkeys(reading.named, item.rounds)
    what = item.named("rounds")
    found = item.rounds.items()
    return {key.text: n for key, n in found if reading.names_robot(key, key.text, what)}


def _helpers(item: language.ExpectKeys, reading: Reading) -> dict[str, str] | None:
    if item.helpers is None:
        return None
    what, helpers = item.named("helpers"), {}
    for key, robot in item.helpers.items():
        obstacle = _obstacle(key, key.text, what, reading)
        if reading.names_robot(robot, robot.text, what) and obstacle is not None:
            helpers[obstacle] = robot.text
    return helpers


def _obstacle(
    node: Node, written: str, what: str, reading: Reading, column: int | None = None
) -> str | None:
    """Return an obstacle's name with its region as a number: ``door@47`` for ``door@dock``. None if
    it was reported, or obstacles are not known. ``column``: that of the name in a text."""
    if reading.obstacles is None:
        return None
    if (name := reading.obstacle_named(written)) is None:
        names = [obstacle.name for obstacle in reading.obstacles]
        nothing = "the scenario has no obstacles"
        reading.unknown(node, f"{what}: there is no obstacle", written, names, nothing, column)
    return name


_WHAT = "requirements"


def resolve_requirements(value: Raw | None, reading: Reading) -> dict[str, str]:
    """Return the formulas by name; a formula without a name is its own."""
    found: dict[str, str] = {}
    cut = 0
    for name, item in _entries(value.node, reading) if value is not None else ():
        written = item.text if name is None and isinstance(item, Scalar) else name and name.text
        if cut and _open(written or "") < 0:
            cut += _open(written or "")
            continue  # the rest of a formula that was reported
        what = _WHAT if name is None else f"requirement {clipped(name.text)}"
        text = read(str, item, what, reading)
        if text is None or not isinstance(item, Scalar):
            continue
        if name is not None:
            well_named(name, "a requirement", reading)
        cut = 0 if item.style else max(0, _open(text))
        if cut:
            message = f"{what}: '{clipped(text)}' ends within parentheses"
            reading.add(item, message, "within brackets a comma ends a formula: put it in quotes")
            continue
        label = text if name is None else name.text
        if label in found:
            reading.add(name or item, f"{_WHAT}: '{clipped(label)}' already exists")
        formula = _formula(item, text, what, reading)
        found[formula if name is None else label] = formula
    return found


def _open(text: str) -> int:
    """Return the number of parentheses that a text leaves open."""
    return text.count("(") - text.count(")")


def _entries(node: Node, findings: Findings) -> list[tuple[Scalar | None, Node]]:
    if isinstance(node, Mapping):
        return list(node.entries)
    found: list[tuple[Scalar | None, Node]] = []
    for item in sequence(node, f"'{_WHAT}'", findings) or ():
        found += item.entries if isinstance(item, Mapping) else [(None, item)]
    return found


def _formula(node: Scalar, text: str, what: str, reading: Reading) -> str:
    """Return the text with the regions in its events as numbers."""
    # Imported here: few scenarios have requirements.
    from safenav.stl.parser import parse_requirement
    from safenav.stl.syntax import Happens, RobotSignal, nodes

    try:
        tree = parse_requirement(text)
    except FormulaError as error:
        reading.add_inside(node, error.column, f"{what}: {error.found}", error.hint)
        return text
    events = []
    for part in nodes(tree):
        if isinstance(part, RobotSignal):
            for robot, column in zip(part.robots, part.columns, strict=True):
                reading.names_robot(node, robot, what, column)
        elif isinstance(part, Happens):
            events.append(part)
    for event in sorted(events, key=lambda event: -event.column):
        begin = event.column + len(event.kind)
        name = _obstacle(node, event.obstacle, what, reading, begin + 1)
        text = f"{text[:begin]}{name or event.obstacle}{text[begin + len(event.obstacle) :]}"
    return text

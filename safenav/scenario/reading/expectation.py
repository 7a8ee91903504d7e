"""Expected results of a run: the ``expect:`` of a scenario, and its ``requirements:``, formulas of
signal temporal logic over the motion."""

from __future__ import annotations

from collections.abc import Collection

from safenav.formula.parser import FormulaError
from safenav.outcome import Outcome
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Expect
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.fields import NAME, well_named
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.shapes import Key, Shape, Table

MISSION = "mission"
OUTCOMES = [outcome for outcome in Outcome if outcome is not Outcome.ERROR]
"""The outcomes of a run without a defect of the program."""


def _names(
    node: Node | None, what: str, reading: Reading, others: Collection[str] = ()
) -> frozenset[str] | None:
    """Return names of obstacles, or of ``others``."""

    def reads(item: Node, label: str, _: Reading) -> str | None:
        name = read.text(item, label, reading)
        known = name is None or name in others
        return name if known else _obstacle(item, name or "", what, reading)

    found = read.values(node, what, reading, reads)
    return None if found is None else frozenset(found)


def _late(node: Node | None, what: str, reading: Reading) -> frozenset[str] | None:
    return _names(node, what, reading, {*reading.named, MISSION})


def _rounds(node: Node | None, what: str, reading: Reading) -> dict[str, int] | None:
    """Return the rounds of each robot from one number for all, or one for each."""
    if not isinstance(node, Mapping):
        rounds = read.integer(node, what, reading, least=1)
        return None if rounds is None else dict.fromkeys(reading.named, rounds)
    found = {}
    for key, value in node.entries:
        rounds = read.integer(value, f"{what}, {clipped(key.text)}", reading)
        if reading.names_robot(key, key.text, what) and rounds is not None:
            found[key.text] = rounds
    return found


def _helpers(node: Node | None, what: str, reading: Reading) -> dict[str, str] | None:
    item = read.mapping(node, what, reading)
    helpers = {}
    for key, value in item.entries if item else ():
        obstacle = _obstacle(key, key.text, what, reading)
        robot = read.text(value, f"helper for {clipped(key.text)}", reading)
        known = robot is not None and reading.names_robot(value, robot, what)
        if known and robot is not None and obstacle is not None:
            helpers[obstacle] = robot
    return None if item is None else helpers


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


_NAME = {"description": "An obstacle: type@region.", "type": "string", "pattern": "^.+@.+$"}
_OBSTACLES = Shape(shapes.many(_NAME), _names, "obstacleNames")


class ExpectKeys(Table):
    about = "The expected result of a run; only the keys that are given are checked."
    definition = "expect"
    example = "{outcome: completed}"
    outcome = Key(shapes.choice(OUTCOMES), "The outcome of the run.")
    late = Key(
        Shape(shapes.many(shapes.TEXT), _late),
        "Exactly the missed deadlines: robots, obstacles, mission.",
    )
    resolved = Key(_OBSTACLES, "Exactly the obstacles that are resolved.")
    blocked = Key(_OBSTACLES, "Exactly the obstacles that become permanent.")
    helpers = Key(
        Shape(shapes.named(shapes.TEXT, {"pattern": "^.+@.+$"}), _helpers),
        "The helper of each obstacle.",
    )
    ticks = Key(shapes.whole(1), "At most this many ticks.")
    rounds = Key(
        Shape(shapes.either(shapes.whole(1), shapes.named(shapes.whole())), _rounds),
        "At least this many rounds of every robot, or of each.",
    )


def _expect(node: Node | None, _what: str, reading: Reading) -> Expect:
    item = ExpectKeys.read(node, "expect", reading)
    return Expect(**({} if item is None else item.given(*item.known.values())))


EXPECT = Shape(ExpectKeys, _expect)

_WHAT = "requirements"
_NAMED = shapes.form(shapes.named(shapes.TEXT, shapes.matching(NAME)), "namedRequirements")


def _requirements(node: Node | None, _what: str, reading: Reading) -> dict[str, str]:
    """Return the formulas by name; a formula without a name is its own."""
    found: dict[str, str] = {}
    cut = 0
    for name, item in _entries(node, reading):
        written = item.text if name is None and isinstance(item, Scalar) else name and name.text
        if cut and _open(written or "") < 0:
            cut += _open(written or "")
            continue  # the rest of a formula that was reported
        what = _WHAT if name is None else f"requirement {clipped(name.text)}"
        text = read.text(item, what, reading)
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
        found[label] = _formula(item, text, what, reading)
    return found


def _open(text: str) -> int:
    """Return the number of parentheses that a text leaves open."""
    return text.count("(") - text.count(")")


def _entries(node: Node | None, findings: Findings) -> list[tuple[Scalar | None, Node]]:
    if isinstance(node, Mapping):
        return list(node.entries)
    found: list[tuple[Scalar | None, Node]] = []
    for item in read.sequence(node, f"'{_WHAT}'", findings) or ():
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


REQUIREMENTS = Shape(
    shapes.either(_NAMED, shapes.many(shapes.either(shapes.TEXT, _NAMED))), _requirements
)

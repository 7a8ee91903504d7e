"""The ``requirements:`` of a scenario: formulas of signal temporal logic over its motion."""

from __future__ import annotations

from safenav.formula.parser import FormulaError
from safenav.scenario.reading.naming import NAME, well_named
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import TEXT, Shape, either, form, many, matching, named

_WHAT = "requirements"
_NAMED = form(named(TEXT, matching(NAME)), "namedRequirements")


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
            told = f"{what}: '{clipped(text)}' ends within parentheses"
            reading.add(item, told, "within brackets a comma ends a formula: put it in quotes")
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
                if robot not in reading.named:
                    told = f"{what}: no robot is named '{clipped(robot)}'"
                    reading.add_inside(node, column, told, suggestion(robot, reading.named))
        elif isinstance(part, Happens):
            events.append(part)
    for event in sorted(events, key=lambda event: -event.column):
        name = reading.obstacle_named(event.obstacle)
        if reading.obstacles is not None and name is None:
            known = [obstacle.name for obstacle in reading.obstacles]
            told = f"{what}: there is no obstacle '{clipped(event.obstacle)}'"
            hint = suggestion(event.obstacle, known) or "the scenario has no obstacles"
            reading.add_inside(node, event.column + len(event.kind) + 1, told, hint)
        begin = event.column - 1
        end = begin + len(event.kind) + 1 + len(event.obstacle)
        text = f"{text[:begin]}{event.kind}_{name or event.obstacle}{text[end:]}"
    return text


REQUIREMENTS = Shape(either(_NAMED, many(either(TEXT, _NAMED))), _requirements)

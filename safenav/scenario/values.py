"""Forms of values in scenarios: names, regions and targets, formulas, actions, ticks.

The reading (``reading.regions``), which has the map, the catalogue and the names, looks up names
and regions. A value that also depends on a robot (a formula) is ``Raw``.
"""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from safenav.data import Count
from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.objective import Target
from safenav.scenario.yaml.document import Node, Scalar, plain
from safenav.scenario.yaml.keys import MOST, NAME, Item, Key, OneOf, Part, Raw, key, name_key
from safenav.world.map import Region

if TYPE_CHECKING:
    from safenav.scenario.yaml.findings import Findings

OWN_VARIABLES = frozenset({"region", "heading"})
RESERVED = RESERVED_WORDS | OWN_VARIABLES | {"move", "scout", "goal", "assigned"}
"""Words of formulas, and variables of specifications, also those with the following prefixes."""
PREFIXES = ("busy_", "at_")

RegionName = Annotated[Scalar, name_key("a region")]
AreaName = Annotated[Scalar, name_key("an area")]
ModelName = Annotated[Scalar, name_key("a robot model")]
RobotName = Annotated[
    Scalar,
    name_key(
        "a robot",
        identifier=True,
        taken=RESERVED_WORDS | OWN_VARIABLES | {"mission"},
        reserved="is reserved and cannot name a robot",
        why="use another name: this one has a meaning in formulas or deadlines",
    ),
]
_variable_key = partial(name_key, identifier=True, taken=RESERVED, prefixes=PREFIXES)
InputName = Annotated[Scalar, _variable_key("an input")]
Variable = Annotated[Scalar, _variable_key("a variable")]
RequirementName = Annotated[Scalar, name_key("a requirement")]


SPAN = r"(\d{1,9})(?:\s*-\s*(\d{1,9}))?"


def ends_of(node: Node) -> tuple[int, int] | None:
    """Return the first and last number of a span, ``12`` or a range such as ``20-30``; None for
    other values."""
    match = re.fullmatch(SPAN, str(plain(node)), re.ASCII)
    return match and (int(match[1]), int(match[2] or match[1]))


def matching(pattern: str) -> dict[str, object]:
    """Return the schema of texts that match a whole pattern."""
    return {"type": "string", "pattern": f"^(?:{pattern})$"}


_COUNT = {"type": "integer", "minimum": 0}
_CELL = {"type": "array", "prefixItems": [_COUNT, _COUNT], "items": False, "minItems": 2}
_NAMED = matching(NAME)
_GRID = r"\s*[#.]+[ \t]*(\r?\n[#.]+[ \t]*)*\s*"
_ROWS = {"type": "array", "minItems": 1, "items": matching(r"[#.]+\s*")}

Position = Annotated[Raw, Key(form={"anyOf": [_COUNT, _CELL]})]
"""The number of a region, in reading order from 0 in the north-west, or [row, column]."""
_REGION = {"anyOf": [_COUNT, _CELL, _NAMED]}
RegionValue = Annotated[Region, Key(form=_REGION, by="region")]
"""A region: its number, [row, column] or name."""
Regions = Annotated[Target, Key(form=_REGION, by="regions")]
"""A region, or the regions of an area."""


class AnyOf(Part, frozen=True):
    """Any one of several regions."""

    elsewhere: ClassVar = dict.fromkeys(
        ("rows", "columns"), "write the name of an area: 'areas: {lab: {rows: 1-4, columns: 1-6}}'"
    ) | dict.fromkeys(("row", "column", "col"), "a position is written in brackets: [row, column]")
    any: tuple[Regions, ...] = key(
        "Any one of these regions.",
        "a target of several regions is written {any: [47, [3, 8]]}",
        entries=1,
        why="name at least one region",
    )


def united(value: Any, *_: object) -> Any:
    """Return all regions of a target or a list of targets, and any other value unchanged."""
    listed = value.any if isinstance(value, AnyOf) else value
    return frozenset[Region]().union(*listed) if isinstance(listed, tuple) else value


TargetValue = Annotated[Target, Key(form=Regions | AnyOf, check=united)]
ZoneValue = Annotated[Target, Key(form=tuple[TargetValue, ...] | TargetValue, check=united)]
"""A target or a list of targets that all count."""
Span = Annotated[Raw, Key(form={"anyOf": [_COUNT, matching(SPAN)]})]
"""A row or column or a range of them."""
FormulaList = Annotated[
    tuple[Scalar, ...],
    Key(
        form=Scalar | tuple[Scalar, ...],
        check=lambda value, *_: value if isinstance(value, tuple) else (value,),
    ),
]
"""A formula or a list of formulas."""
GridRows = Annotated[Raw, Key(form={"anyOf": [matching(_GRID), _ROWS]})]
_Metres = Annotated[float, Key(why="write the metres of the corner as finite numbers")]
_Yaw = Annotated[float, Key(why="write 0: map_saver writes nan where SLAM gave no valid rotation")]
Corner = tuple[_Metres, _Metres] | tuple[_Metres, _Metres, _Yaw]
CORNER = "[x, y] or [x, y, yaw]"


Layer = Annotated[str, name_key("a layer")]
UNLIMITED = "unlimited"
Vision = Annotated[
    float | None,
    Key(
        "Radius of sight in regions (at least 1), or unlimited.",
        form=float | Literal["unlimited"],
        check=lambda value, *_: None if value == UNLIMITED else value,
        least=1,
        expected=f"a number of regions, or '{UNLIMITED}'",
        why="a robot sees at least the regions next to its own",
    ),
]
"""A radius of sight; None if it is unlimited."""
InputOn = Annotated[str, Key(by="input")]


def _ascending(value: Any, node: Node, what: str, findings: Findings) -> Any:
    if isinstance(value, tuple) and value[0] > value[1]:
        found = f"{what}: the range [{value[0]}, {value[1]}] is empty"
        findings.add(node, found, "the lowest value comes first")
        return None
    return value


Range = Annotated[
    Literal["bool"] | tuple[int, int],
    Key(expected="'bool' or a range [lowest, highest]", check=_ascending),
]


_AGAIN = {"off": (False,), "on": (True,), "both": (False, True), False: (False,), True: (True,)}
"""Values by word. Other YAML readers read two of the words as truth values."""
Again = Annotated[
    tuple[bool, ...],
    Key(
        form=Literal["off", "on", "both"] | bool,
        expected="off, on or both (the value that it has infinitely often)",
        check=lambda word, *_: _AGAIN.get(word, word),
    ),
]
"""The infinitely recurring values of an input."""


_TICK = {"type": "integer", "minimum": 1, "maximum": MOST}
_TICKS = {"anyOf": [_TICK, matching(SPAN)]}
_SPANS = {"anyOf": [_TICKS, {"type": "array", "items": _TICKS}]}
Spans = Annotated[tuple[tuple[Count, Count], ...], Key(form=_SPANS, by="spans")]
"""Ticks and ranges of ticks: ``12``, ``10-20``, or a list of both."""

_NamedFormulas = dict[RequirementName, Scalar]
Requirements = _NamedFormulas | tuple[_NamedFormulas | Scalar, ...]


class RectangleKeys(Item, frozen=True):
    """The free regions of these rows and columns, from 0 in the north-west."""

    rules: ClassVar = (OneOf(("rows", "columns"), "a rectangle has 'rows', 'columns' or both"),)
    elsewhere: ClassVar = {"any": "an area lists its regions: [[1, 1], [1, 2]]"}
    rows: Span | None = key("Default: all rows.")
    columns: Span | None = key("Default: all columns.")


AreaValue = Annotated[Raw, Key(form=RectangleKeys | tuple[Regions | RectangleKeys, ...], entries=1)]


LEAST_SIDE, MOST_SIDE = 0.001, 100_000
"""Limits of the metres of a region or pixel, which keep maps in metres within floating point."""


def charge(value: float, node: Node, what: str, findings: Findings) -> float | None:
    """Return a charge, an int if written as one; None if it has more than six decimals."""
    if value != round(value, 6):
        found = f"{what} is {value:g}, expected a number with at most six decimals"
        findings.add(node, found)
        return None
    return int(value) if isinstance(node, Scalar) and isinstance(node.value, int) else value

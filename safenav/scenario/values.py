"""Values of the scenario language: names, regions, formulas, ticks."""

from typing import Annotated, Any, Literal

from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.model import FAILURES, OPERATOR_ACTION, ResolveAt
from safenav.scenario.yaml.document import Node, Scalar
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.typed import MOST, Item, Key, NameForm, Raw, key

OWN_VARIABLES = frozenset({"region", "heading"})
RESERVED = RESERVED_WORDS | OWN_VARIABLES | {"move", "scout", "goal", "request", "wait", "assigned"}
"""Words of formulas, and variables that specifications declare themselves, with those of the
following prefixes."""
PREFIXES = ("busy_", "at_")

RegionName = Annotated[Scalar, NameForm("a region")]
AreaName = Annotated[Scalar, NameForm("an area")]
ModelName = Annotated[Scalar, NameForm("a robot model")]
_CLOSED = "is reserved for regions that robots report as closed"
TypeName = Annotated[Scalar, NameForm("an obstacle type", prefixes=FAILURES, reserved=_CLOSED)]
RobotName = Annotated[
    Scalar,
    NameForm(
        "a robot",
        identifier=True,
        taken=RESERVED_WORDS | OWN_VARIABLES,
        reserved="is reserved and cannot name a robot",
        why="use another name: robots become variables of specifications",
    ),
]
InputName = Annotated[Scalar, NameForm("an input", True, RESERVED, PREFIXES)]
Variable = Annotated[Scalar, NameForm("a variable", True, RESERVED, PREFIXES)]
RequirementName = Annotated[Scalar, NameForm("a requirement")]


def matching(pattern: str) -> dict[str, object]:
    """Return the schema of a text that matches a pattern as a whole."""
    return {"type": "string", "pattern": f"^(?:{pattern})$"}


_COUNT = {"type": "integer", "minimum": 0}
_CELL = {"type": "array", "prefixItems": [_COUNT, _COUNT], "items": False, "minItems": 2}
_NAMED = matching("[A-Za-z_][A-Za-z0-9_-]{0,99}")
_GRID = r"\s*[#.]+[ \t]*(\r?\n[#.]+[ \t]*)*\s*"
_ROWS = {"type": "array", "minItems": 1, "items": matching(r"[#.]+\s*")}

Position = Annotated[Raw, Key(form={"anyOf": [_COUNT, _CELL]})]
"""The number of a region, in reading order from 0 in the north-west, or [row, column]."""
RegionValue = Annotated[Raw, Key(form={"anyOf": [_COUNT, _CELL, _NAMED]})]
"""A region: its number, [row, column] or name; or an area, if several regions are allowed."""


class AnyOf(Item, frozen=True):
    """Any one of several regions."""

    any: tuple[RegionValue, ...] | None = key(
        "Any one of these regions.",
        "a target of several regions is written {any: [47, [3, 8]]}; rows and columns get "
        "a name under 'areas'",
        entries=1,
        why="name at least one region",
    )


TargetValue = Annotated[Raw, Key(form=RegionValue | AnyOf)]
TargetList = Annotated[Raw, Key(form=tuple[TargetValue, ...])]
ZoneValue = Annotated[Raw, Key(form=TargetValue | tuple[TargetValue, ...])]
"""A target, or a list of targets that all count."""
Span = Annotated[Raw, Key(form={"anyOf": [_COUNT, matching(r"(\d{1,9})\s*-\s*(\d{1,9})")]})]
"""A row or column, or a range of them."""
FormulaList = Annotated[Raw, Key(form=str | tuple[str, ...])]
"""A formula, or a list of formulas."""
GridRows = Annotated[Raw, Key(form={"anyOf": [matching(_GRID), _ROWS]})]
MapOrigin = Annotated[Raw, Key(form=tuple[float, ...], schema={"minItems": 2, "maxItems": 3})]


def _capability(word: Scalar, node: Node, what: str, findings: Findings) -> Scalar:
    if word.value == OPERATOR_ACTION:
        found = f"{what}: '{word.value}' is reserved for human operators"
        findings.add(node, found, "use another word")
    return word


Action = Annotated[Scalar, Key(check=_capability, schema={"not": {"const": OPERATOR_ACTION}})]
"""An action of robots: any word but that of the operator's."""

Where = Annotated[Raw, Key(form=ResolveAt | tuple[RegionValue, ...], entries=1)]


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


_TICK = {"type": "integer", "minimum": 1, "maximum": MOST}
_TICKS = {"anyOf": [_TICK, matching(r"(\d{1,9})(?:\s*-\s*(\d{1,9}))?")]}
Spans = Annotated[Raw, Key(form={"anyOf": [_TICKS, {"type": "array", "items": _TICKS}]})]
Recurrence = Annotated[Raw, Key(form={"enum": ["off", "on", "both", True, False]})]

_NAMED_FORMULAS = dict[RequirementName, str]
Requirements = Annotated[Raw, Key(form=_NAMED_FORMULAS | tuple[str | _NAMED_FORMULAS, ...])]

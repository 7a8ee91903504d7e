"""Objectives of robots: one kind, and rules beside it (``avoid``, ``always``)."""

from __future__ import annotations

from typing import ClassVar

from msgspec import Struct
from msgspec.structs import replace

from safenav.formula.checking import check
from safenav.formula.parser import FormulaError, parse
from safenav.formula.printer import to_text
from safenav.formula.syntax import RESERVED_WORDS, Comparison, Name, resolve_constants, variables
from safenav.scenario.objective import (
    EMPTY,
    EXAMPLE,
    KINDS,
    Ltl,
    Objective,
    TargetObjective,
    kinds_that,
    on_steps,
    one_of,
)
from safenav.scenario.reading.regions import TARGET, ZONE, Reading
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.fields import IDENTIFIER, well_named
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import Key, Shape, Table
from safenav.world.map import HEADINGS, Region
from safenav.world.moves import Mobility

OWN_VARIABLES = frozenset({"region", "heading"})
FORM = "form"
RULES = ("avoid", "always")
WITHIN = "within"
TIMED = kinds_that(lambda kind: kind.timed())
STRICT = kinds_that(lambda kind: kind.strict)

RESERVED = RESERVED_WORDS | OWN_VARIABLES | {"move", "scout", "goal", "request", "wait", "assigned"}
"""Words of formulas, and variables that specifications declare themselves, with those of the
following prefixes."""
_PREFIXES = ("busy_", "at_")
_TAKEN = shapes.either({"enum": sorted(RESERVED)}, {"pattern": f"^({'|'.join(_PREFIXES)})"})
VARIABLE = {**shapes.matching(IDENTIFIER), "not": _TAKEN}
"""Names of variables that a scenario declares."""
NAME_OF_ROBOT = {
    **shapes.matching(IDENTIFIER),
    "not": {"enum": sorted(RESERVED_WORDS | OWN_VARIABLES)},
}
"""Names of robots, which formulas contain."""


def is_reserved(name: str) -> bool:
    """Return whether specifications declare a variable of that name themselves, or may do so."""
    return name in RESERVED or name.startswith(_PREFIXES)


FORMULAS = shapes.form(shapes.either(shapes.TEXT, shapes.many(shapes.TEXT)), "formulas")


class LtlKeys(Table):
    about = "Guarantees in structured slugs over region, heading and memory."
    definition = "ltl"
    example = "{liveness: [region = 14, region = 20], safety: region' != 47}"
    rules: ClassVar = shapes.either({"required": ["safety"]}, {"required": ["liveness"]})
    init = Key(FORMULAS, "Conditions at the start (no next values).")
    safety = Key(FORMULAS, "Conditions on every step.")
    liveness = Key(FORMULAS, "Conditions met infinitely often.")
    memory = Key(
        shapes.form(
            shapes.named(
                shapes.either({"const": "bool"}, shapes.several(shapes.whole(), shapes.whole())),
                VARIABLE,
            )
        ),
        "Variables of its own: bool or [lowest, highest].",
    )


def _targets(kind: type[TargetObjective]) -> Key[Node]:
    most = {"maxItems": kind.most} if kind.most else {}
    shape = TARGET if kind.one else {**shapes.many(TARGET, kind.least), **most}
    about = f"{kind.meaning[0].upper()}{kind.meaning[1:]}."
    return Key(shapes.form(shape), about, name=kind.kind)


class ObjectiveKeys(Table, more=[_targets(kind) for kind in KINDS.values()]):
    about = "The task of a robot, repeated in rounds."
    definition = "objective"
    example = EXAMPLE
    rules: ClassVar = {
        "oneOf": [{"required": [kind]} for kind in (*KINDS, "ltl")],
        "dependentSchemas": {
            FORM: shapes.either(*({"required": [kind]} for kind in STRICT)),
            WITHIN: shapes.either(*({"required": [kind]} for kind in TIMED)),
        },
    }
    ltl = Key(shapes.form(LtlKeys))
    form = Key(
        Shape({"const": "literal"}, read.text),
        "literal: the exact formula, or unrealizable.",
    )
    within = Key(shapes.whole(1), f"Maximum number of ticks of each round of {one_of(TIMED)}.")
    avoid = Key(ZONE, "Regions that the robot never enters.")
    always = Key(FORMULAS, "Formulas over region and heading that each of its steps satisfies.")


def stated(node: Node | None) -> tuple[str, tuple[Node, ...]]:
    """Return the kind of an unchecked objective and the nodes of its targets."""
    for key, value in node.entries if isinstance(node, Mapping) else ():
        if key.text == "ltl":
            return key.text, ()
        if (kind := KINDS.get(key.text)) is not None:
            if isinstance(value, Sequence) and not kind.one:
                return key.text, value.items
            return key.text, (value,)
    return "", ()


Declared = dict[str, tuple[int, int] | None]
"""The variables that formulas may name, with their ranges (None: Booleans)."""


def read_objective(
    node: Node | None, robot: str, mobility: Mobility | None, reading: Reading
) -> Objective | None:
    """Return the objective of a robot; None if there is none or it was reported."""
    item = ObjectiveKeys.read(node, f"objective of {robot}", reading, f"of {robot}")
    return None if item is None else _Reader(item, robot, mobility, reading).objective()


def read_within(
    node: Node | None, robot: str, objective: Objective | None, findings: Findings
) -> int | None:
    """Return the most ticks of a round of an objective; None without such a limit."""
    at = node.get(WITHIN) if isinstance(node, Mapping) else None
    found = ObjectiveKeys.within.shape.read(at, f"'{WITHIN}' of {robot}", findings)
    if at is None or objective is None:
        return found
    kind = "ltl" if isinstance(objective, Ltl) else objective.kind
    if kind not in TIMED:
        message = f"'{WITHIN}' of {robot}: rounds of '{kind}' cannot have a deadline"
        findings.add(at, message, f"use it with {one_of(TIMED)}")
    return found


class _Reader(Struct, frozen=True):
    """Reads one objective of a robot."""

    item: ObjectiveKeys
    robot: str
    mobility: Mobility | None
    reading: Reading

    def objective(self) -> Objective | None:
        """The objective with its form and the rules beside it; None if it was reported."""
        what, entries = f"objective of {self.robot}", self.item.node.entries
        keys = [key.text for key, _ in entries]
        given = [(key.text, value) for key, value in entries if key.text in (*KINDS, "ltl")]
        if not given and (not keys or any(key in (FORM, *RULES) for key in keys)):
            self.reading.add(
                self.item.node, f"{what} is empty", f"give it one, for example {EXAMPLE}"
            )
        if len(given) > 1:
            kinds = " and ".join(f"'{kind}'" for kind, _ in given)
            self.reading.add(self.item.node, f"{what}: both {kinds}", "choose one of them")
        if len(given) != 1:
            return None
        ((kind, value),) = given
        what = f"'{kind}' of {self.robot}"
        if kind == "ltl":
            found: Objective | None = self._ltl(value, what)
        else:
            found = _about_targets(KINDS[kind], value, what, self.reading)
        return self._ruled(self._formed(found, kind))

    def _formed(self, objective: Objective | None, kind: str) -> Objective | None:
        """Return the objective, ``literal`` if its ``form`` requires that."""
        word, node = self.item.form, self.item.where(ObjectiveKeys.form)
        if word is None:
            return objective
        if word != "literal":
            found = f"'form' of {self.robot} is 'literal', not '{clipped(word)}'"
            self.reading.add(node, found, "leave it out to accept a weaker form")
        elif kind not in STRICT:
            found = f"'form' of {self.robot}: '{kind}' has one form only"
            self.reading.add(node, found, f"leave it out: it is for {one_of(STRICT, chr(39))}")
        elif isinstance(objective, TargetObjective):
            return replace(objective, literal=True)
        return objective

    def _ruled(self, objective: Objective | None) -> Objective | None:
        """Return the objective with the rules beside it; rules beside ``ltl`` become formulas."""
        item, avoid = self.item, frozenset[Region]()
        zone = self.reading.zone(item.avoid, f"'avoid' of {self.robot}")
        always = self._lines(item.always, f"'always' of {self.robot}", self._pose(), True)
        if objective is None or (item.avoid is not None and zone is None):
            return None
        avoid = zone or avoid
        if isinstance(objective, Ltl):
            never = (f"region' != {region}" for region in sorted(avoid))
            return replace(objective, safety=(*objective.safety, *never, *map(on_steps, always)))
        if any(target <= avoid for target in objective.targets):
            found = f"'avoid' of {self.robot} covers a target of its objective"
            self.reading.add(item.avoid, found, "leave one of the two out")
            return None
        return replace(objective, avoid=avoid, always=always)

    def _ltl(self, node: Node, what: str) -> Ltl | None:
        reading = self.reading
        before, item = len(reading), LtlKeys.read(node, what, reading)
        if item is None:
            return None
        memory = _memory(item.memory, what, reading)
        if item.memory is not None and not isinstance(item.memory, Mapping):
            return None  # without its declarations no formula can be checked
        declared = {**memory, **self._pose()}
        inputs: Declared = dict.fromkeys(sorted(reading.inputs))
        init = self._lines(item.init, f"'init' in {what}", declared, False)
        declared |= inputs
        safety = self._lines(item.safety, f"'safety' in {what}", declared, True)
        liveness = self._lines(item.liveness, f"'liveness' in {what}", declared, True)
        if _is_empty(item.safety) and _is_empty(item.liveness):
            hint = "give it 'liveness' (what to reach infinitely often) or 'safety' (always)"
            reading.add(node, f"{what} is empty", hint)
        if len(reading) > before:
            return None
        named = set().union(*(variables(parse(line)) for line in (*init, *safety, *liveness)))
        return Ltl(init, safety, liveness, memory, tuple(name for name in inputs if name in named))

    def _pose(self) -> Declared:
        """Return the variables of a robot's own pose."""
        world = self.reading.world
        heading = {} if self.mobility is Mobility.FREE else {"heading": (0, 3)}
        return {"region": (0, (world.size if world else 2**31) - 1), **heading}

    def _lines(
        self, node: Node | None, what: str, declared: Declared, next_allowed: bool
    ) -> tuple[str, ...]:
        """Return formulas as text with region and heading names replaced by their numbers."""
        reading = self.reading
        items = (node,) if isinstance(node, Scalar) else read.sequence(node, what, reading) or ()
        lines = (_line(item, what, declared, next_allowed, reading) for item in items)
        return tuple(line for line in lines if line is not None)


def _about_targets(
    kind: type[TargetObjective], node: Node, what: str, reading: Reading
) -> TargetObjective | None:
    if kind.one:
        target = reading.target(node, what)
        return None if target is None else kind((target,))
    listed = reading.targets(node, what, kind.least)
    if listed is None:
        return None
    # A reported target counts as one of its own, so that no second error follows from it.
    targets = [frozenset({-1 - k}) if t is None else t for k, t in enumerate(listed)]
    problem = kind.wrong(targets)
    if problem is not None:
        found, hint = problem
        reading.add(node, f"{what}{' ' if found == EMPTY else ': '}{found}", hint)
    return None if problem is not None or None in listed else kind(tuple(targets))


def _memory(node: Node | None, what: str, reading: Reading) -> Declared:
    memory: Declared = {}
    item = read.mapping(node, f"'memory' in {what}", reading)
    for key, value in item.entries if item else ():
        name = clipped(key.text)
        if not well_named(key, "a variable", reading, IDENTIFIER):
            pass
        elif is_reserved(key.text):
            reading.add(key, f"'{name}' is reserved", "use another name")
        elif key.text in (*reading.named, *reading.inputs):
            kind = "a robot" if key.text in reading.named else "an input"
            reading.add(key, f"'{name}' is the name of {kind}", "use another name")
        boolean = isinstance(value, Scalar) and value.value == "bool"
        memory[key.text] = None if boolean else _bounds(value, f"memory '{name}'", reading)
    return memory


def _bounds(node: Node, what: str, findings: Findings) -> tuple[int, int] | None:
    if not isinstance(node, Sequence) or len(node.items) != 2:
        read.wrong_type(node, what, "'bool' or a range [lowest, highest]", findings)
        return None
    low = read.integer(node.items[0], f"lowest value of {what}", findings)
    high = read.integer(node.items[1], f"highest value of {what}", findings)
    if low is None or high is None:
        return None
    if low > high:
        found = f"{what}: the range [{low}, {high}] is empty"
        findings.add(node, found, "the lowest value comes first")
        return None
    return low, high


def _line(
    node: Node, what: str, declared: Declared, next_allowed: bool, reading: Reading
) -> str | None:
    """Return the formula as text with region and heading names replaced by their numbers."""
    text = read.text(node, f"a formula of {what}", reading)
    if text is None or not isinstance(node, Scalar):
        return None
    try:
        formula = parse(text)
    except FormulaError as error:
        reading.add_inside(node, error.column, f"{what}: {error.found}", error.hint)
        return None

    def constant(name: Name, within: Comparison) -> int | None:
        if name.name in declared:
            return None
        terms = (within.left, within.right)
        of_heading = any(isinstance(t, Name) and t.name == "heading" for t in terms)
        if of_heading and name.name in HEADINGS:
            return int(HEADINGS[name.name])
        return reading.names.get(name.name)

    def members(name: Name) -> frozenset[int] | None:
        return None if name.name in declared else reading.areas.get(name.name)

    formula = resolve_constants(formula, constant, members)
    for problem in check(formula, declared, next_allowed=next_allowed):
        hint = problem.hint
        if problem.unknown == "heading":
            hint = "only robots with heading mobility have one"
        elif problem.unknown in {*reading.names, *reading.areas}:
            hint = f"it names a region: write region = {problem.unknown}"
        elif problem.unknown and not reading.names_known:
            continue
        elif problem.unknown:
            hint = suggestion(problem.unknown, {*declared, *reading.names, *reading.areas})
        reading.add_inside(node, problem.column, f"{what}: {problem.found}", hint)
    return to_text(formula)


def _is_empty(node: Node | None) -> bool:
    return node is None or (isinstance(node, Sequence) and not node.items)

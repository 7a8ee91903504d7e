"""Objectives of robots: one kind, and rules beside it (``avoid``, ``always``)."""

from __future__ import annotations

from collections.abc import Collection
from typing import ClassVar

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
    Target,
    TargetObjective,
    kinds_that,
    on_steps,
    one_of,
    targets_of,
)
from safenav.scenario.reading.naming import IDENTIFIER
from safenav.scenario.reading.regions import TARGET, ZONE, RegionReader
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import (
    TEXT,
    Key,
    Shape,
    Table,
    either,
    form,
    many,
    matching,
    named,
    several,
    whole,
)
from safenav.world.map import Heading
from safenav.world.moves import Mobility

OWN_VARIABLES = frozenset({"region", "heading"})
FORM = "form"
RULES = ("avoid", "always")
WITHIN = "within"
TIMED = kinds_that(lambda kind: kind.timed())
STRICT = kinds_that(lambda kind: kind.strict)

VARIABLE = {**matching(IDENTIFIER), "not": {"enum": sorted(RESERVED_WORDS | OWN_VARIABLES)}}
"""Names of variables that a scenario declares."""

FORMULAS = form(either(TEXT, many(TEXT)), "formulas")


class LtlKeys(Table):
    about = "Guarantees in structured slugs over region, heading and memory."
    definition = "ltl"
    rules: ClassVar = either({"required": ["safety"]}, {"required": ["liveness"]})
    init = Key(FORMULAS, "What holds at the start (no next values).")
    safety = Key(FORMULAS, "What holds on every step.")
    liveness = Key(FORMULAS, "What is reached infinitely often.")
    memory = Key(
        form(named(either({"const": "bool"}, several(whole(), whole())), VARIABLE)),
        "Variables of its own: bool or [lowest, highest].",
    )


def _targets(kind: type[TargetObjective]) -> Key[Node]:
    most = {"maxItems": kind.most} if kind.most else {}
    shape = TARGET if kind.one else {**many(TARGET, kind.least), **most}
    about = f"{kind.meaning[0].upper()}{kind.meaning[1:]}."
    return Key(form(shape), about, name=kind.kind)


class ObjectiveKeys(Table, more=[_targets(kind) for kind in KINDS.values()]):
    about = "The task of a robot, round after round."
    definition = "objective"
    rules: ClassVar = {
        "oneOf": [{"required": [kind]} for kind in (*KINDS, "ltl")],
        "dependentSchemas": {
            FORM: either(*({"required": [kind]} for kind in STRICT)),
            WITHIN: either(*({"required": [kind]} for kind in TIMED)),
        },
    }
    ltl = Key(form(LtlKeys))
    form = Key(
        Shape({"const": "literal"}, read.text),
        "literal: it keeps its formula by the letter, or is unrealizable.",
    )
    within = Key(whole(1), f"The most ticks of each round of {one_of(TIMED)}.")
    avoid = Key(ZONE, "Regions that the robot never enters, whatever it does.")
    always = Key(FORMULAS, "Formulas over region and heading that each of its steps keeps.")


def stated(node: Node | None) -> tuple[str, tuple[Node, ...]]:
    """The kind of an objective as it is written, right or wrong, and the nodes of its targets."""
    for key, value in node.entries if isinstance(node, Mapping) else ():
        if key.text == "ltl":
            return key.text, ()
        if (kind := KINDS.get(key.text)) is not None:
            if isinstance(value, Sequence) and not kind.one:
                return key.text, value.items
            return key.text, (value,)
    return "", ()


class ObjectiveReader:
    """Reads the objectives of a scenario's robots, all over one map.

    ``robots`` are the names of all robots and ``inputs`` those of the environment: memory may not
    take them; formulas of ``ltl`` may name inputs.
    """

    def __init__(
        self,
        regions: RegionReader,
        robots: frozenset[str],
        findings: Findings,
        inputs: Collection[str] = (),
    ) -> None:
        self._regions = regions
        self._inputs = frozenset(inputs)
        self._robots = robots
        self._findings = findings

    def read(self, node: Node | None, robot: str, mobility: Mobility | None) -> Objective | None:
        """The objective, or None if there is none or it was reported."""
        what = f"objective of {robot}"
        item = ObjectiveKeys.read(node, what, self._findings, f"of {robot}")
        if item is None:
            return None
        entries = [(key.text, value) for key, value in item.node.entries]
        given = [(key, value) for key, value in entries if key in (*KINDS, "ltl")]
        if not given:
            hint = f"give it one, for example {EXAMPLE}"
            if not entries or any(key in (FORM, *RULES) for key, _ in entries):
                self._findings.add(node, f"{what} is empty", hint)
        if len(given) > 1:
            kinds = " and ".join(f"'{kind}'" for kind, _ in given)
            self._findings.add(node, f"{what}: both {kinds}", "choose one of them")
        if len(given) != 1:
            return None
        kind, value = given[0]
        what = f"'{kind}' of {robot}"
        found = (
            self._ltl(value, what, mobility)
            if kind == "ltl"
            else self._about_targets(KINDS[kind], value, what)
        )
        return self._ruled(self._formed(found, item, kind, robot), item, robot, mobility)

    def _ruled(
        self,
        objective: Objective | None,
        item: ObjectiveKeys,
        robot: str,
        mobility: Mobility | None,
    ) -> Objective | None:
        """The objective with the rules that stand beside it; those of ``ltl`` become formulas."""
        avoid = self._avoided(item.avoid, f"'avoid' of {robot}")
        what = f"'always' of {robot}"
        always = self._lines(item.always, what, self._declared(mobility), True)
        if objective is None or avoid is None:
            return None
        if isinstance(objective, Ltl):
            never = (f"region' != {region}" for region in sorted(avoid))
            return replace(objective, safety=(*objective.safety, *never, *map(on_steps, always)))
        for target in targets_of(objective):
            if target <= avoid:
                found = f"'avoid' of {robot} covers a target of its objective"
                self._findings.add(item.avoid, found, "leave one of the two out")
                return None
        return replace(objective, avoid=avoid, always=always)

    def _avoided(self, node: Node | None, what: str) -> Target | None:
        """A region, an area or a list of them; None if that was reported."""
        if node is None:
            return frozenset()
        if not isinstance(node, Sequence):
            return self._regions.target(node, what)
        found = self._regions.targets(node, what) or (None,)
        sets = [regions for regions in found if regions is not None]
        return frozenset().union(*sets) if len(sets) == len(found) else None

    def within(self, node: Node | None, robot: str, objective: Objective | None) -> int | None:
        """The most ticks of a round of an objective, if that says so."""
        at = node.get(WITHIN) if isinstance(node, Mapping) else None
        found = ObjectiveKeys.within.shape.read(at, f"'{WITHIN}' of {robot}", self._findings)
        if at is None or objective is None:
            return found
        kind = "ltl" if isinstance(objective, Ltl) else objective.kind
        if kind not in TIMED:
            said = f"'{WITHIN}' of {robot}: rounds of '{kind}' are not promised"
            self._findings.add(at, said, f"use it with {one_of(TIMED)}")
        return found

    def _formed(
        self, objective: Objective | None, item: ObjectiveKeys, kind: str, robot: str
    ) -> Objective | None:
        """The objective in the form that it must have."""
        word, node = item.form, item.where(ObjectiveKeys.form)
        if word is None:
            return objective
        if word != "literal":
            found = f"'form' of {robot} is 'literal', not '{clipped(word)}'"
            self._findings.add(node, found, "leave it out to accept a weaker form")
        elif kind not in STRICT:
            found = f"'form' of {robot}: '{kind}' has one form only"
            hint = f"leave it out: it is for {one_of(STRICT, chr(39))}"
            self._findings.add(node, found, hint)
        elif isinstance(objective, TargetObjective):
            return replace(objective, literal=True)
        return objective

    def _about_targets(
        self, kind: type[TargetObjective], node: Node, what: str
    ) -> TargetObjective | None:
        if kind.one:
            target = self._regions.target(node, what)
            return None if target is None else kind.made((target,))
        listed = self._regions.targets(node, what, kind.least)
        if listed is None:
            return None
        # What was reported already counts as a target of its own.
        told = [frozenset({-1 - k}) if t is None else t for k, t in enumerate(listed)]
        problem = kind.wrong(told)
        if problem is not None:
            found, hint = problem
            self._findings.add(node, f"{what}{' ' if found == EMPTY else ': '}{found}", hint)
        return None if problem is not None or None in listed else kind.made(told)

    def _ltl(self, node: Node, what: str, mobility: Mobility | None) -> Ltl | None:
        before = len(self._findings)
        item = LtlKeys.read(node, what, self._findings)
        if item is None:
            return None
        memory = self._memory(item.memory, what)
        declared = {**memory, **self._declared(mobility)}
        inputs: dict[str, tuple[int, int] | None] = dict.fromkeys(sorted(self._inputs))
        lines = {
            part: self._lines(
                item.node.get(part),
                f"'{part}' in {what}",
                declared if part == "init" else declared | inputs,
                part != "init",
            )
            for part in ("init", "safety", "liveness")
        }
        if _is_empty(item.safety) and _is_empty(item.liveness):
            hint = "give it 'liveness' (what to reach infinitely often) or 'safety' (always)"
            self._findings.add(node, f"{what} is empty", hint)
        if len(self._findings) > before:
            return None
        named = set().union(*(variables(parse(line)) for part in lines.values() for line in part))
        told = tuple(name for name in inputs if name in named)
        return Ltl(lines["init"], lines["safety"], lines["liveness"], memory, told)

    def _declared(self, mobility: Mobility | None) -> dict[str, tuple[int, int] | None]:
        """The variables of a robot's own pose, with their ranges."""
        size = self._regions.world.size if self._regions.world else 2**31
        heading = {} if mobility is Mobility.FREE else {"heading": (0, 3)}
        return {"region": (0, size - 1), **heading}

    def _memory(self, node: Node | None, what: str) -> dict[str, tuple[int, int] | None]:
        memory: dict[str, tuple[int, int] | None] = {}
        item = read.mapping(node, f"'memory' in {what}", self._findings)
        for key, value in item.entries if item else ():
            self._memory_name(key)
            bounds = None
            if not (isinstance(value, Scalar) and value.value == "bool"):
                bounds = self._bounds(value, f"memory '{clipped(key.text)}'")
            memory[key.text] = bounds
        return memory

    def _memory_name(self, key: Scalar) -> None:
        name = clipped(key.text)
        if not IDENTIFIER.fullmatch(key.text):
            hint = "use letters, digits and '_', beginning with a letter"
            self._findings.add(key, f"'{name}' cannot name a variable", hint)
        elif key.text in RESERVED_WORDS | OWN_VARIABLES:
            self._findings.add(key, f"'{name}' is reserved", "use another name")
        elif key.text in self._robots | self._inputs:
            kind = "a robot" if key.text in self._robots else "an input"
            self._findings.add(key, f"'{name}' is the name of {kind}", "use another name")

    def _bounds(self, node: Node, what: str) -> tuple[int, int] | None:
        if not isinstance(node, Sequence) or len(node.items) != 2:
            expected = "'bool' or a range [lowest, highest]"
            read.wrong_type(node, what, expected, self._findings)
            return None
        low = read.integer(node.items[0], f"lowest value of {what}", self._findings)
        high = read.integer(node.items[1], f"highest value of {what}", self._findings)
        if low is None or high is None:
            return None
        if low > high:
            found = f"{what}: the range [{low}, {high}] is empty"
            self._findings.add(node, found, "the lowest value comes first")
            return None
        return low, high

    def _lines(
        self,
        node: Node | None,
        what: str,
        declared: dict[str, tuple[int, int] | None],
        next_allowed: bool,
    ) -> tuple[str, ...]:
        if node is None:
            return ()
        items = (node,) if isinstance(node, Scalar) else read.sequence(node, what, self._findings)
        lines = [self._line(item, what, declared, next_allowed) for item in items or ()]
        return tuple(line for line in lines if line is not None)

    def _line(
        self, node: Node, what: str, declared: dict[str, tuple[int, int] | None], next_allowed: bool
    ) -> str | None:
        """The formula as text with region and heading names replaced by their numbers."""
        text = read.text(node, f"a formula of {what}", self._findings)
        if text is None or not isinstance(node, Scalar):
            return None
        try:
            formula = parse(text)
        except FormulaError as error:
            self._findings.add_inside(node, error.column, f"{what}: {error.found}", error.hint)
            return None

        def constant(name: Name, within: Comparison) -> int | None:
            return self._constant(name, within, declared)

        def members(name: Name) -> frozenset[int] | None:
            return None if name.name in declared else self._regions.areas.get(name.name)

        formula = resolve_constants(formula, constant, members)
        for problem in check(formula, declared, next_allowed=next_allowed):
            hint = problem.hint
            if problem.unknown == "heading":
                hint = "only robots with heading mobility have one"
            elif problem.unknown:
                names = {*declared, *self._regions.names, *self._regions.areas}
                hint = suggestion(problem.unknown, names)
            self._findings.add_inside(node, problem.column, f"{what}: {problem.found}", hint)
        return to_text(formula)

    def _constant(
        self, name: Name, within: Comparison, declared: dict[str, tuple[int, int] | None]
    ) -> int | None:
        if name.name in declared:
            return None
        of_heading = any(
            isinstance(term, Name) and term.name == "heading"
            for term in (within.left, within.right)
        )
        if of_heading and name.name in _HEADINGS:
            return _HEADINGS[name.name]
        return self._regions.names.get(name.name)


def _is_empty(node: Node | None) -> bool:
    return node is None or (isinstance(node, Sequence) and not node.items)


_HEADINGS = {heading.label: int(heading) for heading in Heading}

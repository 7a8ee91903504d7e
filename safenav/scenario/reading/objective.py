"""Objectives of robots: one kind, and rules beside it (``avoid``, ``always``)."""

from __future__ import annotations

from collections.abc import Mapping as Ranges

from msgspec.structs import replace

from safenav.formula.parser import FormulaError, check, parse
from safenav.formula.syntax import Comparison, Name, resolve_constants, to_text, variables
from safenav.scenario import language
from safenav.scenario.language import FORM, RULES, STRICT, TIMED, WITHIN
from safenav.scenario.objective import (
    EMPTY,
    EXAMPLE,
    KINDS,
    Ltl,
    Objective,
    TargetObjective,
    on_steps,
    one_of,
)
from safenav.scenario.reading.regions import Reading
from safenav.scenario.yaml.document import Mapping, Node, Scalar, Sequence, clipped, entries_of
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.typed import Raw, read, sequence
from safenav.world.map import HEADINGS, Region
from safenav.world.moves import Mobility


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


Declared = Ranges[str, tuple[int, int] | None]
"""The variables that formulas may name, with their ranges (None: Booleans)."""


def resolve_objective(
    item: language.ObjectiveKeys | None, mobility: Mobility | None, reading: Reading
) -> Objective | None:
    """Return an objective with its form and the rules beside it; None if there is none or it was
    reported. ``mobility``: of its robot, if that is known."""
    if item is None:
        return None
    what, given = f"objective {item.of}", [key for key in (*KINDS, "ltl") if item.at(key)]
    keys = {key.text for key, _ in item.node.entries}
    if not given and (not keys or keys & {FORM, *RULES}):
        reading.add(item.node, f"{what} is empty", f"give it one, for example {EXAMPLE}")
    if len(given) > 1:
        stated = [key.text for key, _ in item.node.entries if key.text in given]
        kinds = " and ".join(f"'{kind}'" for kind in stated)
        reading.add(item.node, f"{what}: both {kinds}", "choose one of them")
    if len(given) != 1:
        return None
    (kind,) = given
    if kind == "ltl":
        found: Objective | None = _ltl(item.ltl, mobility, reading)
    else:
        found = _about_targets(KINDS[kind], getattr(item, kind), reading)
    return _ruled(_formed(found, kind, item, reading), item, mobility, reading)


def within_of(
    item: language.ObjectiveKeys | None, objective: Objective | None, findings: Findings
) -> int | None:
    """Return the most ticks of a round of an objective; None without such a limit."""
    if item is None or objective is None or item.within is None:
        return None
    kind = "ltl" if isinstance(objective, Ltl) else objective.kind
    if kind not in TIMED:
        message = f"{item.named(WITHIN)}: rounds of '{kind}' cannot have a deadline"
        findings.add(item.at(WITHIN), message, f"use it with {one_of(TIMED)}")
    return item.within


def _formed(
    objective: Objective | None, kind: str, item: language.ObjectiveKeys, findings: Findings
) -> Objective | None:
    """Return the objective, ``literal`` if its ``form`` requires that."""
    if item.form is None:
        return objective
    if kind not in STRICT:
        found = f"{item.named(FORM)}: '{kind}' has one form only"
        findings.add(item.at(FORM), found, f"leave it out: it is for {one_of(STRICT, chr(39))}")
    elif isinstance(objective, TargetObjective):
        return replace(objective, literal=True)
    return objective


def _ruled(
    objective: Objective | None,
    item: language.ObjectiveKeys,
    mobility: Mobility | None,
    reading: Reading,
) -> Objective | None:
    """Return the objective with the rules beside it; rules beside ``ltl`` become formulas."""
    avoid = reading.zone(item.avoid)
    always = _lines(item.always, _pose(mobility, reading), True, reading)
    if objective is None or (item.avoid is not None and avoid is None):
        return None
    avoid = avoid or frozenset[Region]()
    if isinstance(objective, Ltl):
        never = (f"region' != {region}" for region in sorted(avoid))
        return replace(objective, safety=(*objective.safety, *never, *map(on_steps, always)))
    if any(target <= avoid for target in objective.targets):
        found = f"{item.named('avoid')} covers a target of its objective"
        reading.add(item.at("avoid"), found, "leave one of the two out")
        return None
    return replace(objective, avoid=avoid, always=always)


def _about_targets(
    kind: type[TargetObjective], value: Raw, reading: Reading
) -> TargetObjective | None:
    if kind.one:
        target = reading.target(value)
        return None if target is None else kind((target,))
    listed = reading.targets(value, least=kind.least)
    if listed is None:
        return None
    # A reported target counts as one of its own, so that no second error follows from it.
    targets = [frozenset({-1 - k}) if t is None else t for k, t in enumerate(listed)]
    problem = kind.wrong(targets)
    if problem is not None:
        found, hint = problem
        reading.add(value.node, f"{value.what}{' ' if found == EMPTY else ': '}{found}", hint)
    return None if problem is not None or None in listed else kind(tuple(targets))


def _ltl(item: language.LtlKeys | None, mobility: Mobility | None, reading: Reading) -> Ltl | None:
    if item is None:
        return None
    before, what = len(reading), item.of.removeprefix("in ")
    memory = _memory(item, reading)
    if item.memory is None and item.at("memory") is not None:
        return None  # without its declarations no formula can be checked
    inputs: Declared = dict.fromkeys(sorted(reading.inputs))
    own = {**memory, **_pose(mobility, reading)}
    init = _lines(item.init, own, False, reading)
    safety = _lines(item.safety, {**own, **inputs}, True, reading)
    liveness = _lines(item.liveness, {**own, **inputs}, True, reading)
    if all(v is None or v.node == Sequence(v.node.place, ()) for v in (item.safety, item.liveness)):
        hint = "give it 'liveness' (what to reach infinitely often) or 'safety' (always)"
        reading.add(item.node, f"{what} is empty", hint)
    if item.flawed or len(reading) > before:
        return None
    named = set().union(*(variables(parse(line)) for line in (*init, *safety, *liveness)))
    return Ltl(init, safety, liveness, memory, tuple(name for name in inputs if name in named))


def _memory(item: language.LtlKeys, reading: Reading) -> dict[str, tuple[int, int] | None]:
    listed = entries_of(item.at("memory"))
    memory: dict[str, tuple[int, int] | None] = {key.text: None for key, _ in listed}
    for key, value in (item.memory or {}).items():
        if key.text in (*reading.named, *reading.inputs):
            kind = "a robot" if key.text in reading.named else "an input"
            found = f"'{clipped(key.text)}' is the name of {kind}"
            reading.add(key, found, "use another name")
        memory[key.text] = None if isinstance(value, str) else value
    return memory


def _pose(mobility: Mobility | None, reading: Reading) -> Declared:
    """Return the variables of a robot's own pose."""
    world = reading.world
    heading = {} if mobility is Mobility.FREE else {"heading": (0, 3)}
    return {"region": (0, (world.size if world else 2**31) - 1), **heading}


def _lines(
    value: Raw | None, declared: Declared, next_allowed: bool, reading: Reading
) -> tuple[str, ...]:
    """Return formulas as text with region and heading names replaced by their numbers."""
    if value is None:
        return ()
    node, what = value.node, value.what
    items = (node,) if isinstance(node, Scalar) else sequence(node, what, reading) or ()
    lines = (_line(item, what, declared, next_allowed, reading) for item in items)
    return tuple(line for line in lines if line is not None)


def _line(
    node: Node, what: str, declared: Declared, next_allowed: bool, reading: Reading
) -> str | None:
    """Return the formula as text with region and heading names replaced by their numbers."""
    text = read(str, node, f"a formula of {what}", reading)
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

"""First half of the checker: does a strategy realize the text of its specification?

A specification is a text in structured slugs: variables that the environment chooses (INPUT) and
variables that the robot chooses (OUTPUT), and for each side formulas about how it begins (INIT),
about each of its steps (TRANS, x' is the next value of x), and about what happens again and again
(LIVENESS). A strategy is a graph. Each node holds a value of every variable.

It realizes the specification if
1. each input that ENV_INIT allows has a node that satisfies ENV_INIT and SYS_INIT;
2. each edge satisfies ENV_TRANS and SYS_TRANS;
3. from each node there is exactly one edge for each next input that ENV_TRANS allows;
4. each infinite path meets every goal of SYS_LIVENESS again and again, or misses an assumption of
   ENV_LIVENESS for ever. A *measure* shows that: see ``check_measure``.

A counterstrategy is the same with the roles exchanged, and shows that no strategy exists: see
``check_counterstrategy``.

Only Python's standard library is used. The one trick is that a formula is evaluated in many
cases at once: case number k is one digit of a long integer (``Cases``).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

MOST_EDGES = 500_000
MOST_CASES = 1 << 20

Key = tuple[str, bool]
"""A variable, and whether its next value is meant."""

Formula = tuple[Any, ...]
Row = tuple[int, ...]


class RefusedError(Exception):
    """The evidence does not prove the claim: why not."""


class TooLargeError(Exception):
    """The evidence is larger than this checker takes on."""


# ---------------------------------------------------------------- specifications


@dataclass(frozen=True)
class Variable:
    """A variable with the values ``least``...``most``. A Boolean one is 0...1 and ``truth``."""

    name: str
    least: int
    most: int
    truth: bool

    @property
    def bits(self) -> int:
        return (self.most - self.least).bit_length()

    def bit_names(self) -> list[str]:
        """Its bits, lowest first, as strategies name them. They hold value - least."""
        if self.truth:
            return [self.name]
        first = f"{self.name}@0.{self.least}.{self.most}"
        return [first, *(f"{self.name}@{bit}" for bit in range(1, self.bits))][: self.bits]


@dataclass(frozen=True)
class Clause:
    """One line of a section."""

    line: int
    text: str
    formula: Formula
    reads: frozenset[Key]


SECTIONS = ("ENV_INIT", "SYS_INIT", "ENV_TRANS", "SYS_TRANS", "ENV_LIVENESS", "SYS_LIVENESS")


@dataclass(frozen=True)
class Specification:
    inputs: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    sections: Mapping[str, tuple[Clause, ...]]

    @property
    def variables(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in (*self.inputs, *self.outputs)}


def read_specification(text: str) -> Specification:
    """Read a text in structured slugs; what is not understood is refused."""
    owners: dict[str, list[Variable]] = {"INPUT": [], "OUTPUT": []}
    lines: list[tuple[int, str, str]] = []
    section = ""
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("#"):
            continue
        if line.startswith("["):
            section = line.strip("[]")
            if section not in (*SECTIONS, *owners):
                raise RefusedError(f"line {number}: there is no section {line}")
        elif section in owners:
            owners[section].append(_variable(line, number))
        else:
            lines.append((number, section, line))
    variables = {v.name: v for v in chain(*owners.values())}
    if len(variables) != sum(map(len, owners.values())):
        raise RefusedError("a variable is declared twice")
    sections: dict[str, list[Clause]] = {name: [] for name in SECTIONS}
    given = {v.name for v in owners["INPUT"]}
    for number, section, line in lines:
        if section not in sections:
            raise RefusedError(f"line {number} stands in no section")
        formula = parse(line, number)
        keys = frozenset(reads(formula))
        for name, primed in keys:
            if name not in variables:
                raise RefusedError(f"line {number}: there is no variable {name}")
            future = section not in ("ENV_INIT", "SYS_INIT")
            mine = section != "ENV_TRANS" or name in given
            if (primed and not (future and mine)) or (section == "ENV_INIT" and name not in given):
                raise RefusedError(f"line {number}: {name} must not stand here")
        sections[section].append(Clause(number, line, formula, keys))
    return Specification(
        tuple(owners["INPUT"]),
        tuple(owners["OUTPUT"]),
        {name: tuple(clauses) for name, clauses in sections.items()},
    )


def _variable(line: str, number: int) -> Variable:
    match = re.fullmatch(r"(\w+)(?::(\d+)\.\.\.(\d+))?", line)
    if match is None:
        raise RefusedError(f"line {number}: '{line}' declares no variable")
    name, least, most = match.groups()
    if least is None:
        return Variable(name, 0, 1, True)
    if int(least) > int(most):
        raise RefusedError(f"line {number}: {name} has no values")
    return Variable(name, int(least), int(most), False)


# ---------------------------------------------------------------- formulas

_TOKEN = re.compile(
    r"\s*(\d+|[A-Za-z_]\w*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()'])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
_LEVELS = ("<->", "->", "^", "|", "&")
_COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")


def parse(text: str, line: int = 0) -> Formula:
    """A formula as nested tuples.

    ("var", name, primed), ("num", n), ("+", a, b), ("=", a, b) and other comparisons, ("!", a),
    ("->", a, b), ("<->", a, b), and with any number of parts ("&", ...), ("|", ...), ("^", ...).
    Operators from loosest to tightest: <-> -> ^ | & ! comparisons + prime.
    """
    tokens: list[str] = []
    at = 0
    text = text.rstrip()
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise RefusedError(f"line {line}: cannot read '{text[at : at + 20]}'")
        tokens.append(_SAME.get(match.group(1), match.group(1)))
        at = match.end()
    tokens.append("end of line")
    formula, rest = _level(tokens, 0, 0, line)
    if tokens[rest] != "end of line":
        raise RefusedError(f"line {line}: '{tokens[rest]}' is not expected here")
    return formula


def _level(tokens: list[str], at: int, level: int, line: int) -> tuple[Formula, int]:
    if level == len(_LEVELS):
        return _unary(tokens, at, line)
    formula, at = _level(tokens, at, level + 1, line)
    operator = _LEVELS[level]
    parts = [formula]
    while tokens[at] == operator:
        formula, at = _level(tokens, at + 1, level + 1, line)
        parts.append(formula)
    if len(parts) == 1:
        return parts[0], at
    if operator in ("->", "<->"):  # to the left
        formula = parts[0]
        for part in parts[1:]:
            formula = (operator, formula, part)
        return formula, at
    return (operator, *parts), at


def _unary(tokens: list[str], at: int, line: int) -> tuple[Formula, int]:
    if tokens[at] == "!":
        formula, at = _unary(tokens, at + 1, line)
        return ("!", formula), at
    left, at = _sum(tokens, at, line)
    if tokens[at] not in _COMPARISONS:
        return left, at
    right, after = _sum(tokens, at + 1, line)
    return (tokens[at], left, right), after


def _sum(tokens: list[str], at: int, line: int) -> tuple[Formula, int]:
    total, at = _atom(tokens, at, line)
    while tokens[at] == "+":
        part, at = _atom(tokens, at + 1, line)
        total = ("+", total, part)
    return total, at


def _atom(tokens: list[str], at: int, line: int) -> tuple[Formula, int]:
    token = tokens[at]
    if token in ("next", "X") and tokens[at + 1] == "(":
        formula, at = _atom(tokens, at + 1, line)
        return _primed(formula, line), at
    if token == "(":
        formula, at = _level(tokens, at + 1, 0, line)
        if tokens[at] != ")":
            raise RefusedError(f"line {line}: a bracket is open at '{tokens[at]}'")
    elif token in ("TRUE", "FALSE"):
        formula = ("const", token == "TRUE")
    elif token.isdigit():
        formula = ("num", int(token))
    elif re.fullmatch(r"[A-Za-z_]\w*", token):
        formula = ("var", token, False)
    else:
        raise RefusedError(f"line {line}: '{token}' is not expected here")
    at += 1
    while tokens[at] == "'":
        formula, at = _primed(formula, line), at + 1
    return formula, at


def _primed(formula: Formula, line: int) -> Formula:
    if formula[0] == "var":
        if formula[2]:
            raise RefusedError(f"line {line}: {formula[1]} is primed twice")
        return ("var", formula[1], True)
    return tuple(_primed(part, line) if isinstance(part, tuple) else part for part in formula)


def reads(formula: Formula) -> Iterator[Key]:
    """The variables of a formula."""
    if formula[0] == "var":
        yield formula[1], formula[2]
    for part in formula[1:]:
        if isinstance(part, tuple):
            yield from reads(part)


# ---------------------------------------------------------------- many cases at once


class Cases:
    """Values of variables in ``count`` cases. Everything is a string or an integer with one binary
    digit for each case, the first case leftmost."""

    def __init__(self, count: int, variables: Mapping[str, Variable]) -> None:
        self.count = count
        self.all = (1 << count) - 1
        self.variables = variables
        self.columns: dict[Key, list[int]] = {}

    def add(self, key: Key, columns: Iterable[str]) -> None:
        """The bits of a variable, lowest first; each is a string of digits, one a case."""
        self.columns[key] = [int(digits, 2) if digits else 0 for digits in columns]

    def where(self, formula: Formula) -> int:
        """The cases in which a formula holds."""
        kind, *parts = formula
        if kind == "const":
            return self.all if parts[0] else 0
        if kind == "var":
            if not self.variables[parts[0]].truth:
                raise RefusedError(f"the number {parts[0]} stands where a truth is needed")
            return self.columns[parts[0], parts[1]][0]
        if kind == "!":
            return self.all ^ self.where(parts[0])
        if kind in ("&", "|", "^", "->", "<->"):
            result = self.where(parts[0])
            for part in parts[1:]:
                other = self.where(part)
                if kind == "&":
                    result &= other
                elif kind == "|":
                    result |= other
                elif kind == "^":
                    result ^= other
                elif kind == "->":
                    result = self.all ^ result | other
                else:
                    result = self.all ^ result ^ other
            return result
        if kind in _COMPARISONS:
            return self._compare(kind, self._number(parts[0]), self._number(parts[1]))
        raise RefusedError("a number stands where a truth is needed")

    def digits(self, cases: int) -> str:
        """A set of cases as a string of digits, one a case."""
        return format(cases, f"0{self.count}b") if self.count else ""

    def _number(self, term: Formula) -> list[int]:
        kind, *parts = term
        if kind == "num":
            return [self.all * (parts[0] >> bit & 1) for bit in range(parts[0].bit_length())]
        if kind == "+":
            return self._plus(self._number(parts[0]), self._number(parts[1]))
        if kind != "var" or self.variables[parts[0]].truth:
            raise RefusedError("a truth stands where a number is needed")
        least = self.variables[parts[0]].least
        bits = self.columns[parts[0], parts[1]]
        return self._plus(bits, self._number(("num", least))) if least else bits

    def _plus(self, left: list[int], right: list[int]) -> list[int]:
        total, carry = [], 0
        for a, b in _aligned(left, right):
            total.append(a ^ b ^ carry)
            carry = a & b | a & carry | b & carry
        return [*total, carry]

    def _compare(self, kind: str, left: list[int], right: list[int]) -> int:
        if kind in ("=", "!="):
            unequal = 0
            for a, b in _aligned(left, right):
                unequal |= a ^ b
            return unequal if kind == "!=" else self.all ^ unequal
        if kind in (">", "<="):
            left, right = right, left
        less = 0  # left < right, decided by the highest digit in which they differ
        for a, b in _aligned(left, right):
            less = b & (self.all ^ a) | less & (self.all ^ a ^ b)
        return less if kind in ("<", ">") else self.all ^ less


def _aligned(left: list[int], right: list[int]) -> Iterator[tuple[int, int]]:
    for bit in range(max(len(left), len(right))):
        yield left[bit] if bit < len(left) else 0, right[bit] if bit < len(right) else 0


def count_completions(
    variables: Mapping[str, Variable],
    wanted: Sequence[Key],
    clauses: Sequence[Clause],
    known: Sequence[Key],
    rows: Sequence[Row],
) -> list[int]:
    """For each row of values of the ``known`` variables: in how many ways can the ``wanted``
    ones be chosen such that the clauses hold?

    Variables that no clause connects are counted apart and multiplied. Within such a component one
    variable after the other takes all its values, and a clause is evaluated as soon as all that
    it reads is there.
    """
    totals = [1] * len(rows)
    for component, about in _components(wanted, clauses):
        read = {key for clause in about for key in clause.reads} - set(component)
        if not read <= set(known):
            raise RefusedError(f"line {about[0].line} reads a value that is not known yet")
        at = [known.index(key) for key in sorted(read)]
        classes = [tuple(row[i] for i in at) for row in rows]
        counts: dict[Row, int] = dict.fromkeys(classes, 0)
        for row, _ in complete(variables, component, about, sorted(read), list(counts)):
            counts[row] += 1
        totals = [total * counts[which] for total, which in zip(totals, classes, strict=True)]
    return totals


def complete(
    variables: Mapping[str, Variable],
    wanted: Sequence[Key],
    clauses: Sequence[Clause],
    known: Sequence[Key],
    rows: Sequence[Row],
) -> Iterator[tuple[Row, Row]]:
    """All pairs of a row and values of the ``wanted`` variables that satisfy the clauses."""
    order = list(known)
    partial = list(dict.fromkeys(rows))
    left, waiting = list(wanted), list(clauses)
    while True:
        ready = [clause for clause in waiting if clause.reads <= set(order)]
        waiting = [clause for clause in waiting if clause not in ready]
        if ready:
            partial = list(_satisfying(variables, order, ready, partial))
        if not left:
            break
        # next the variable that makes most clauses ready
        ahead = {k: sum(c.reads <= {*order, k} for c in waiting) for k in left}
        key = max(left, key=lambda k: ahead[k])
        left.remove(key)
        order.append(key)
        variable = variables[key[0]]
        values = range(variable.least, variable.most + 1)
        now = [clause for clause in waiting if clause.reads <= set(order)]
        waiting = [clause for clause in waiting if clause not in now]
        step = max(1, MOST_CASES // len(values))
        partial = [
            row
            for first in range(0, len(partial), step)
            for row in _satisfying(variables, order, now, partial[first : first + step], values)
        ]
    places = [order.index(key) for key in wanted]
    for row in partial:
        yield row[: len(known)], tuple(row[place] for place in places)


def _satisfying(
    variables: Mapping[str, Variable],
    keys: Sequence[Key],
    clauses: Sequence[Clause],
    rows: Sequence[Row],
    values: Sequence[int] | None = None,
) -> Iterator[Row]:
    """The rows, each extended by each of ``values``, that satisfy the clauses."""
    times = 1 if values is None else len(values)
    cases = Cases(len(rows) * times, variables)
    needed = {key for clause in clauses for key in clause.reads}
    for place, key in enumerate(keys):
        if key not in needed:
            continue
        variable = variables[key[0]]
        last = values is not None and place == len(keys) - 1
        column = list(values or ()) if last else [row[place] for row in rows]
        digits = [
            ["01"[value - variable.least >> bit & 1] for value in column]
            for bit in range(variable.bits)
        ]
        if last:
            cases.add(key, ("".join(digit) * len(rows) for digit in digits))
        else:
            cases.add(key, ("".join(d * times for d in digit) for digit in digits))
    good = cases.all
    for clause in clauses:
        good &= cases.where(clause.formula)
    for match in re.finditer("1", cases.digits(good)):
        row, value = divmod(match.start(), times)
        yield rows[row] if values is None else (*rows[row], values[value])


def _components(
    wanted: Sequence[Key], clauses: Sequence[Clause]
) -> Iterator[tuple[list[Key], list[Clause]]]:
    """The wanted variables in groups that no clause connects, each with its clauses."""
    groups: list[tuple[set[Key], list[Clause]]] = [({key}, []) for key in wanted]
    for clause in clauses:
        touched = [group for group in groups if group[0] & clause.reads]
        groups = [group for group in groups if not group[0] & clause.reads]
        keys = set().union(*(group[0] for group in touched))
        groups.append((keys, [*chain(*(group[1] for group in touched)), clause]))
    for keys, about in groups:
        yield [key for key in wanted if key in keys], about


# ---------------------------------------------------------------- strategies


class Strategy:
    """A graph whose nodes hold values of all variables; ``edges`` in the order of sources."""

    def __init__(self, document: Any, spec: Specification) -> None:
        try:
            names = list(document["variables"])
            nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
            self.next: list[list[int]] = [node["trans"] for node in nodes]
            states = [node["state"] for node in nodes]
        except (KeyError, TypeError) as error:
            raise RefusedError(f"this is no strategy: {error!r} is missing or wrong") from None
        expected = [b for v in (*spec.inputs, *spec.outputs) for b in v.bit_names()]
        if names != expected:
            raise RefusedError("the strategy has other variables than the specification")
        numbers = set(range(len(nodes)))
        for node, (state, targets) in enumerate(zip(states, self.next, strict=True)):
            if len(state) != len(names) or not all(type(b) is int and b in (0, 1) for b in state):
                raise RefusedError(f"node {node} does not hold {len(names)} bits")
            if not all(type(t) is int and t in numbers for t in targets):
                raise RefusedError(f"node {node} has an edge to nowhere")
        self.spec = spec
        self.count = len(nodes)
        self.edges = sum(map(len, self.next))
        if self.edges > MOST_EDGES:
            raise TooLargeError(f"{self.edges} edges; this checker takes {MOST_EDGES}")
        self._bits = {name: "".join("01"[s[k]] for s in states) for k, name in enumerate(names)}
        self.inputs: list[Row] = self._rows(spec.inputs)
        self.outputs: list[Row] = self._rows(spec.outputs)

    def _rows(self, variables: Sequence[Variable]) -> list[Row]:
        """Each node's values of some variables."""
        columns = []
        for variable in variables:
            bits = [self._bits[name] for name in variable.bit_names()]
            values = [variable.least] * self.count
            for power, digits in enumerate(bits):
                values = [v + (int(d) << power) for v, d in zip(values, digits, strict=True)]
            if self.count and max(values) > variable.most:
                raise RefusedError(f"a node has {variable.name} = {max(values)}, beyond its range")
            columns.append(values)
        return list(zip(*columns, strict=True)) if columns else [()] * self.count

    def values(self, node: int) -> dict[str, int]:
        names = [variable.name for variable in (*self.spec.inputs, *self.spec.outputs)]
        return dict(zip(names, (*self.inputs[node], *self.outputs[node]), strict=True))

    def pairs(self) -> Iterator[tuple[int, int]]:
        """The edges."""
        for node, targets in enumerate(self.next):
            for target in targets:
                yield node, target

    def node_cases(self) -> Cases:
        """One case a node."""
        cases = Cases(self.count, self.spec.variables)
        for variable in self.spec.variables.values():
            cases.add((variable.name, False), [self._bits[b] for b in variable.bit_names()])
        return cases

    def edge_cases(self) -> Cases:
        """One case an edge: values before it and after it (primed)."""
        cases = Cases(self.edges, self.spec.variables)
        targets = list(chain.from_iterable(self.next))
        degrees = list(map(len, self.next))
        for variable in self.spec.variables.values():
            before, after = [], []
            for name in variable.bit_names():
                digits = self._bits[name]
                before.append("".join(d * n for d, n in zip(digits, degrees, strict=True)))
                after.append("".join(map(digits.__getitem__, targets)))
            cases.add((variable.name, False), before)
            cases.add((variable.name, True), after)
        return cases

    def initial(self) -> list[int]:
        """The nodes that satisfy ENV_INIT and SYS_INIT."""
        cases = self.node_cases()
        good = cases.all
        for clause in (*self.spec.sections["ENV_INIT"], *self.spec.sections["SYS_INIT"]):
            good &= cases.where(clause.formula)
        return [match.start() for match in re.finditer("1", cases.digits(good))]


def check_strategy(spec: Specification, strategy: Strategy, measures: Any) -> list[int]:
    """Refuse unless the strategy realizes the specification; returns its initial nodes."""
    variables = spec.variables
    now = [(variable.name, False) for variable in spec.inputs]
    initial = strategy.initial()
    allowed = count_completions(variables, now, spec.sections["ENV_INIT"], (), [()])[0]
    if len({strategy.inputs[node] for node in initial}) != allowed:
        raise RefusedError(f"{allowed} inputs are allowed to begin with, not all have a node")
    cases = strategy.edge_cases()
    _check_edges(strategy, cases, ("ENV_TRANS", "SYS_TRANS"))
    wanted = [(variable.name, True) for variable in spec.inputs]
    keys = [(variable.name, False) for variable in (*spec.inputs, *spec.outputs)]
    rows = [(*i, *o) for i, o in zip(strategy.inputs, strategy.outputs, strict=True)]
    counts = count_completions(variables, wanted, spec.sections["ENV_TRANS"], keys, rows)
    for node, (targets, count) in enumerate(zip(strategy.next, counts, strict=True)):
        answered = {strategy.inputs[target] for target in targets}
        if len(answered) != len(targets):
            raise RefusedError(f"node {node} has two answers to one input")
        if len(answered) != count:
            raise RefusedError(f"node {node} answers {len(answered)} of {count} allowed inputs")
    assumptions = [cases.digits(cases.where(c.formula)) for c in spec.sections["ENV_LIVENESS"]]
    goals = spec.sections["SYS_LIVENESS"]
    if not isinstance(measures, list) or len(measures) != len(goals):
        raise RefusedError(f"there are {len(goals)} goals, but not as many measures")
    for clause, measure in zip(goals, measures, strict=True):
        met = cases.digits(cases.where(clause.formula))
        try:
            check_measure(strategy, met, assumptions, measure)
        except RefusedError as reason:
            raise RefusedError(f"goal '{clause.text}' (line {clause.line}): {reason}") from None
    return initial


def _check_edges(strategy: Strategy, cases: Cases, sections: Iterable[str]) -> None:
    for section in sections:
        for clause in strategy.spec.sections[section]:
            good = cases.where(clause.formula)
            if good != cases.all:
                edge = cases.digits(good).index("0")
                source, target = next(p for k, p in enumerate(strategy.pairs()) if k == edge)
                where = f"the edge from node {source} to node {target}"
                raise RefusedError(f"{where} breaks '{clause.text}' (line {clause.line})")


def check_measure(
    strategy: Strategy, met: str, excuses: Sequence[str], measure: Any, *, always: bool = False
) -> None:
    """Refuse unless each infinite path meets the goal for ever, or one of the ``excuses`` never
    again from some point on.

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal n falls; or n and a stay the same, and a is not met on this edge. Why that is enough:
    take a path that does not meet the goal any more. Its n never rises and is never negative, so
    from some point on it stays. From there on a stays as well, and is not met.

    ``always``: there is no goal, all edges count.
    """
    try:
        numbers, which = measure["n"], measure["a"]
    except (KeyError, TypeError):
        raise RefusedError("the measure lacks 'n' or 'a'") from None
    if len(numbers) != strategy.count or len(which) != strategy.count:
        raise RefusedError("the measure is for another number of nodes")
    if not all(type(n) is int and n >= 0 for n in numbers):
        raise RefusedError("the measure has a number that is no natural number")
    if not all(a is None or (type(a) is int and 0 <= a < len(excuses)) for a in which):
        raise RefusedError("the measure names an assumption that does not exist")
    for edge, (source, target) in enumerate(strategy.pairs()):
        if not always and met[edge] == "1":
            continue
        if numbers[target] < numbers[source]:
            continue
        excuse = which[source]
        same = numbers[target] == numbers[source] and excuse == which[target]
        if not same or excuse is None or excuses[excuse][edge] == "1":
            raise RefusedError(f"the measure does not fall from node {source} to node {target}")


def check_counterstrategy(
    spec: Specification, strategy: Strategy, start: Any, chosen: Any, measures: Any
) -> None:
    """Refuse unless the graph shows that no strategy realizes the specification.

    The environment begins with the input ``start`` and continues from node v by ``chosen[v]``
    (values in the order of the inputs). ENV_INIT and ENV_TRANS allow that; the nodes hold all that
    the robot can answer within SYS_INIT and SYS_TRANS. Each infinite path meets every assumption
    again and again (a measure for each), and misses a goal for ever (one measure, whose excuses
    are the goals).
    """
    variables = spec.variables
    inputs, outputs = spec.inputs, spec.outputs
    now_in, now_out = [(v.name, False) for v in inputs], [(v.name, False) for v in outputs]
    next_in, next_out = [(v.name, True) for v in inputs], [(v.name, True) for v in outputs]
    first = _input_row(start, inputs)
    if not count_completions(variables, (), spec.sections["ENV_INIT"], now_in, [first])[0]:
        raise RefusedError("the initial input is not allowed")
    begin = [node for node in strategy.initial() if strategy.inputs[node] == first]
    every = spec.sections["SYS_INIT"]
    count = count_completions(variables, now_out, every, now_in, [first])[0]
    if len({strategy.outputs[node] for node in begin}) != count:
        raise RefusedError(f"{count} outputs answer the initial input, not all have a node")
    if not isinstance(chosen, list) or len(chosen) != strategy.count:
        raise RefusedError("there is not one chosen input for each node")
    rows = [
        (*i, *o, *_input_row(c, inputs))
        for i, o, c in zip(strategy.inputs, strategy.outputs, chosen, strict=True)
    ]
    keys = [*now_in, *now_out, *next_in]
    legal = count_completions(variables, (), spec.sections["ENV_TRANS"], keys, rows)
    answers = count_completions(variables, next_out, spec.sections["SYS_TRANS"], keys, rows)
    width = len(inputs) + len(outputs)
    for node, targets in enumerate(strategy.next):
        if not legal[node]:
            raise RefusedError(f"the input chosen in node {node} is not allowed")
        if any(strategy.inputs[target] != rows[node][width:] for target in targets):
            raise RefusedError(f"an edge from node {node} has another input than the chosen one")
        if not len({strategy.outputs[t] for t in targets}) == len(targets) == answers[node]:
            raise RefusedError(f"node {node} has {len(targets)} answers of {answers[node]}")
    cases = strategy.edge_cases()
    _check_edges(strategy, cases, ("SYS_TRANS",))
    assumed = [cases.digits(cases.where(c.formula)) for c in spec.sections["ENV_LIVENESS"]]
    goals = [cases.digits(cases.where(c.formula)) for c in spec.sections["SYS_LIVENESS"]]
    if not isinstance(measures, list) or len(measures) != len(assumed) + 1:
        raise RefusedError("there is not one measure for each assumption and one for the goals")
    for met, measure in zip(assumed, measures[:-1], strict=True):
        check_measure(strategy, met, (), measure)
    check_measure(strategy, "", goals, measures[-1], always=True)


def _input_row(values: Any, inputs: Sequence[Variable]) -> Row:
    if not isinstance(values, list) or len(values) != len(inputs):
        raise RefusedError("an input does not have one value for each input variable")
    for value, variable in zip(values, inputs, strict=True):
        if type(value) is not int or not variable.least <= value <= variable.most:
            raise RefusedError(f"an input has {variable.name} = {value}, beyond its range")
    return tuple(values)

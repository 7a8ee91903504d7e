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
A counterstrategy is the same with the roles exchanged: see ``check_counterstrategy``.

The one trick is that a formula is evaluated in many cases at once: case number k is one binary
digit of a long integer (``Cases``).
"""

from __future__ import annotations

import operator
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import chain, zip_longest
from typing import Any

MOST_EDGES = 500_000
MOST_CASES = 1 << 20
PASSING = re.compile(r"busy_\w+|wait")  # inputs that tell nothing of what can be observed next

Key = str  # a variable's name, followed by ' where its next value is meant
Formula = tuple[Any, ...]  # ("var", key), ("num", n), ("const", truth), or operator and operands
Row = tuple[int, ...]


class RefusedError(Exception):
    """The evidence does not prove the claim: why not."""


class TooLargeError(Exception):
    """The evidence is larger than this checker takes on."""


def require(holds: object, reason: str) -> None:
    if not holds:
        raise RefusedError(reason)


# ---------------------------------------------------------------- specifications


@dataclass(frozen=True)
class Variable:
    """A variable with the values ``least``...``most``, and the names of its bits as strategies
    have them, lowest first. They hold value - least. A Boolean one is 0...1 and ``truth``."""

    name: str
    least: int
    most: int
    bits: tuple[str, ...]
    truth: bool


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
    sections: Mapping[str, list[Clause]]

    @property
    def variables(self) -> dict[str, Variable]:
        return {variable.name: variable for variable in (*self.inputs, *self.outputs)}

    def keys(self, part: str) -> list[Key]:
        """The keys of ``inputs``, ``outputs``, or with a ' of their next values."""
        return [v.name + "'" * part.endswith("'") for v in getattr(self, part.rstrip("'"))]


def read_specification(text: str) -> Specification:
    """Read a text in structured slugs; what is not understood is refused."""
    sections: dict[str, list[tuple[int, str]]] = {s: [] for s in ("INPUT", "OUTPUT", *SECTIONS)}
    section = ""
    for number, line in enumerate(map(str.strip, text.splitlines()), 1):
        if line.startswith("["):
            section = line.strip("[]")
        elif line and not line.startswith("#"):
            require(section in sections, f"line {number} stands in no section that there is")
            sections[section].append((number, line))
    inputs = tuple(read_variable(line, number) for number, line in sections["INPUT"])
    outputs = tuple(read_variable(line, number) for number, line in sections["OUTPUT"])
    spec = Specification(inputs, outputs, {name: [] for name in SECTIONS})
    require(len(spec.variables) == len(inputs) + len(outputs), "a variable is declared twice")
    now, later = {*spec.keys("inputs")}, {*spec.keys("inputs'")}
    every = now | {*spec.keys("outputs")}
    allowed = {"ENV_INIT": now, "SYS_INIT": every, "ENV_TRANS": every | later}
    for name in SECTIONS:
        known = allowed.get(name, every | later | {*spec.keys("outputs'")})
        for number, line in sections[name]:
            clause = read_clause(line, number)
            for key in clause.reads - known:
                exists = key.rstrip("'") in spec.variables
                said = f"{key} must not stand here" if exists else f"there is no variable {key}"
                raise RefusedError(f"line {number}: {said}")
            spec.sections[name].append(clause)
    return spec


def read_clause(
    text: str, line: int = 0, rename: Callable[[Formula], Formula] | None = None
) -> Clause:
    try:
        formula = rename(parse(text)) if rename else parse(text)
    except RefusedError as reason:
        raise RefusedError(f"line {line}: {reason}") from None
    return Clause(line, text, formula, frozenset(reads(formula)))


def read_variable(line: str, number: int = 0) -> Variable:
    match = re.fullmatch(r"(\w+)(?::(\d+)\.\.\.(\d+))?", line)
    if match is None or int(match[2] or 0) > int(match[3] or 0):
        raise RefusedError(f"line {number}: '{line}' declares no variable")
    name, least, most = match[1], int(match[2] or 0), int(match[3] or 1)
    if match[2] is None:
        return Variable(name, 0, 1, (name,), truth=True)
    size = (most - least).bit_length()
    bits = [f"{name}@0.{least}.{most}", *(f"{name}@{bit}" for bit in range(1, size))]
    return Variable(name, least, most, tuple(bits[:size]), truth=False)


# ---------------------------------------------------------------- formulas

_TOKEN = re.compile(
    r"\s*(\d+|[A-Za-z_]\w*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()'])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
_COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")
# Operators, from the loosest to the tightest; equal ones are grouped to the left.
_LEVELS = (("<->",), ("->",), ("^",), ("|",), ("&",), ("!",), _COMPARISONS, ("+",))


def parse(text: str) -> Formula:
    """A formula as nested tuples."""
    rest = _TOKEN.sub("", text).strip()
    require(not rest, f"cannot read '{rest[:20]}'")
    tokens = ["the end", *(_SAME.get(token, token) for token in reversed(_TOKEN.findall(text)))]

    def level(number: int) -> Formula:
        if number == len(_LEVELS):
            return atom()
        if "!" in _LEVELS[number]:
            return (tokens.pop(), level(number)) if tokens[-1] == "!" else level(number + 1)
        parts, sign = [level(number + 1)], tokens[-1]
        while sign in _LEVELS[number] and tokens[-1] == sign:
            tokens.pop()
            parts.append(level(number + 1))
        return (sign, *parts) if len(parts) > 1 else parts[0]

    def atom() -> Formula:
        token = tokens.pop()
        if token in ("next", "X") and tokens[-1] == "(":
            formula = _next(atom())
        elif token == "(":
            formula = level(0)
            require(tokens.pop() == ")", "a bracket is open")
        elif token in ("TRUE", "FALSE"):
            formula = ("const", token == "TRUE")
        elif token.isdigit():
            formula = ("num", int(token))
        elif token.isidentifier():
            formula = ("var", token)
        else:
            raise RefusedError(f"'{token}' is not expected here")
        while tokens[-1] == "'":
            tokens.pop()
            formula = _next(formula)
        return formula

    formula = level(0)
    require(len(tokens) == 1, f"'{tokens[-1]}' is not expected here")
    return formula


def _next(formula: Formula) -> Formula:
    """The formula about the next values."""
    if formula[0] == "var":
        require(not formula[1].endswith("'"), f"{formula[1]} is primed twice")
        return ("var", f"{formula[1]}'")
    return tuple(_next(part) if isinstance(part, tuple) else part for part in formula)


def reads(formula: Formula) -> set[Key]:
    """The variables of a formula."""
    if formula[0] == "var":
        return {formula[1]}
    return set().union(*(reads(part) for part in formula[1:] if isinstance(part, tuple)))


# ---------------------------------------------------------------- many cases at once

_LOGIC: Mapping[str, Callable[[int, int], int]] = {
    "&": operator.and_,
    "|": operator.or_,
    "^": operator.xor,
    "->": lambda left, right: ~left | right,
    "<->": lambda left, right: ~(left ^ right),
}


class Cases:
    """Values of variables in ``count`` cases. Everything is a string or an integer with one binary
    digit for each case, the first case leftmost."""

    def __init__(self, count: int, variables: Mapping[str, Variable]) -> None:
        self.count, self.all, self.variables = count, (1 << count) - 1, variables
        self.columns: dict[Key, list[int]] = {}

    def add(self, key: Key, columns: Iterable[str]) -> None:
        """The bits of a variable, lowest first; each is a string of digits, one a case."""
        self.columns[key] = [int(digits, 2) if digits else 0 for digits in columns]

    def digits(self, *clauses: Clause) -> str:
        """For each case 1 where all clauses hold, else 0."""
        good = reduce(operator.and_, (self.where(c.formula) for c in clauses), self.all)
        return format(good, f"0{self.count}b") if self.count else ""

    def where(self, formula: Formula) -> int:
        """The cases in which a formula holds."""
        kind, *parts = formula
        if kind == "const":
            return self.all if parts[0] else 0
        if kind == "!":
            return self.all ^ self.where(parts[0])
        if kind in _LOGIC:
            return reduce(_LOGIC[kind], map(self.where, parts)) & self.all
        if kind in _COMPARISONS and len(parts) == 2:
            return self._compare(kind, *map(self._number, parts))
        truth = kind == "var" and self.variables[parts[0].rstrip("'")].truth
        require(truth, f"a number ({parts[0]}) stands where a truth is needed")
        return self.columns[parts[0]][0]

    def _number(self, term: Formula) -> list[int]:
        kind, *parts = term
        if kind == "num":
            return [self.all * (parts[0] >> bit & 1) for bit in range(parts[0].bit_length())]
        if kind == "+":
            return reduce(self._plus, map(self._number, parts))
        truth = kind != "var" or self.variables[parts[0].rstrip("'")].truth
        require(not truth, "a truth stands where a number is needed")
        least = self.variables[parts[0].rstrip("'")].least
        return self._plus(self.columns[parts[0]], self._number(("num", least)))

    def _plus(self, left: list[int], right: list[int]) -> list[int]:
        if not left or not right:
            return left or right
        total, carry = [], 0
        for a, b in zip_longest(left, right, fillvalue=0):
            total.append(a ^ b ^ carry)
            carry = a & b | a & carry | b & carry
        return [*total, carry]

    def _compare(self, kind: str, left: list[int], right: list[int]) -> int:
        if kind in (">", "<="):
            left, right = right, left
        unequal = less = 0  # less: left < right, decided by the highest digit that differs
        for a, b in zip_longest(left, right, fillvalue=0):
            unequal |= a ^ b
            less = b & ~a | less & ~(a ^ b)
        found = unequal if kind in ("=", "!=") else less
        return found if kind in ("!=", "<", ">") else self.all ^ found


Keys = Sequence[Key]
Clauses = Sequence[Clause]
Rows = Sequence[Row]


def count_completions(
    spec: Specification, wanted: Keys, clauses: Clauses, known: Keys, rows: Rows
) -> list[int]:
    """For each row of values of the ``known`` variables: in how many ways can the ``wanted``
    ones be chosen such that the clauses hold? Wanted variables that no clause connects are counted
    apart and multiplied."""
    groups: list[tuple[set[Key], list[Clause]]] = [({key}, []) for key in wanted]
    for clause in clauses:
        touched = [group for group in groups if group[0] & clause.reads]
        groups = [group for group in groups if not group[0] & clause.reads]
        keys = set().union(*(group[0] for group in touched))
        groups.append((keys, [*chain(*(group[1] for group in touched)), clause]))
    totals = [1] * len(rows)
    for keys, about in groups:
        read = sorted(set().union(*(clause.reads for clause in about)) - keys)
        places = [known.index(key) for key in read]
        classes = [tuple(row[place] for place in places) for row in rows]
        counts = Counter(row for row, _ in complete(spec, sorted(keys), about, read, classes))
        totals = [total * counts[which] for total, which in zip(totals, classes, strict=True)]
    return totals


def complete(
    spec: Specification, wanted: Keys, clauses: Clauses, known: Keys, rows: Iterable[Row]
) -> Iterator[tuple[Row, Row]]:
    """All pairs of a row and values of the ``wanted`` variables that satisfy the clauses. One
    variable after the other takes all its values, first the one by which most clauses can be
    evaluated, and of these the smallest; a clause is evaluated as soon as all that it reads is
    there."""

    def first(key: Key) -> tuple[int, int]:
        by_it = sum(clause.reads <= {*order, key} for clause in waiting)
        return by_it, -len(spec.variables[key.rstrip("'")].bits)

    order, left, waiting = list(known), list(wanted), list(clauses)
    partial = list(dict.fromkeys(rows))
    values: list[Row] = [()]
    while True:
        ready = [clause for clause in waiting if clause.reads <= {*order}]
        waiting = [clause for clause in waiting if clause not in ready]
        step = max(1, MOST_CASES // len(values))
        blocks = (partial[first : first + step] for first in range(0, len(partial), step))
        partial = [*chain(*(_extended(spec, order, ready, rows, values) for rows in blocks))]
        if not left:
            break
        key = max(left, key=first)
        left.remove(key)
        order.append(key)
        variable = spec.variables[key.rstrip("'")]
        values = [(value,) for value in range(variable.least, variable.most + 1)]
    places = [order.index(key) for key in wanted]
    for row in partial:
        yield row[: len(known)], tuple(row[place] for place in places)


def _extended(
    spec: Specification, keys: Keys, clauses: Clauses, rows: Rows, values: Rows
) -> Iterator[Row]:
    """The rows, each extended by each of ``values``, that satisfy the clauses."""
    times, width = len(values), len(keys) - len(values[0])
    cases = Cases(len(rows) * times, spec.variables)
    for key in set().union(*(clause.reads for clause in clauses)):
        place, variable = keys.index(key), spec.variables[key.rstrip("'")]
        given = place < width  # each of its values stands for as many cases as there are values
        column = [row[place] for row in rows] if given else [value for (value,) in values]
        each, whole = (times, 1) if given else (1, len(rows))
        bits = range(len(variable.bits))
        digits = (["01"[v - variable.least >> bit & 1] * each for v in column] for bit in bits)
        cases.add(key, ("".join(digit) * whole for digit in digits))
    for match in re.finditer("1", cases.digits(*clauses)):
        row, value = divmod(match.start(), times)
        yield rows[row] + values[value]


# ---------------------------------------------------------------- strategies


class Strategy:
    """A graph whose nodes hold values of all variables. ``next``: the nodes that follow each.

    *Twins* are followed by the same nodes, and differ only in passing inputs whose present value no
    formula reads. What holds of the edges of one holds of those of the others; so only the edges
    of the ``first`` of them are looked at, each as if it led to the first of the twins there. They
    are in the order of their sources.
    """

    def __init__(self, document: Any, spec: Specification) -> None:
        nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
        states = [node["state"] for node in nodes]
        self.spec, self.count = spec, len(nodes)
        self.next: list[list[int]] = [node["trans"] for node in nodes]
        self.variables = [*spec.inputs, *spec.outputs]
        names = [bit for variable in self.variables for bit in variable.bits]
        same = document["variables"] == names
        require(same, "the strategy has other variables than the specification")
        for node, (state, targets) in enumerate(zip(states, self.next, strict=True)):
            good = len(state) == len(names) and all(type(b) is int and b in (0, 1) for b in state)
            require(good, f"node {node} does not hold {len(names)} bits")
            good = all(type(t) is int and 0 <= t < self.count for t in targets)
            require(good, f"node {node} has an edge to nowhere")
        self._bits = {name: "".join("01"[s[k]] for s in states) for k, name in enumerate(names)}
        self.inputs, self.outputs = self._rows(spec.inputs), self._rows(spec.outputs)
        clauses = chain(*(spec.sections[name] for name in SECTIONS[2:]))
        read = set(spec.keys("outputs")).union(*(clause.reads for clause in clauses))
        kept = [v for v in self.variables if v.name in read or not PASSING.fullmatch(v.name)]
        known: dict[Any, int] = {}
        keys = zip(self._rows(kept), map(tuple, self.next), strict=True)
        self.first = [known.setdefault(key, node) for node, key in enumerate(keys)]
        self.next = [self.next[node] for node in self.first]  # twins share one list
        self.sources = list(known.values())
        self.degrees = [0] * self.count
        for node in self.sources:
            self.degrees[node] = len(self.next[node])
        if (edges := sum(self.degrees)) > MOST_EDGES:
            raise TooLargeError(f"{edges} edges; this checker takes {MOST_EDGES}")

    def _rows(self, variables: Sequence[Variable]) -> list[Row]:
        """Each node's values of some variables."""
        columns = []
        for variable in variables:
            values = [variable.least] * self.count
            for power, bit in enumerate(variable.bits):
                values = [v + (int(d) << power) for v, d in zip(values, self._bits[bit])]  # noqa: B905
            most = max(values, default=variable.least)
            require(most <= variable.most, f"a node has {variable.name} = {most}, beyond its range")
            columns.append(values)
        return list(zip(*columns, strict=True)) if columns else [()] * self.count

    def values(self, node: int) -> dict[str, int]:
        row = (*self.inputs[node], *self.outputs[node])
        return {variable.name: value for variable, value in zip(self.variables, row, strict=True)}

    def pairs(self) -> Iterator[tuple[int, int]]:
        """The edges."""
        return ((node, self.first[after]) for node in self.sources for after in self.next[node])

    def edge_cases(self) -> Cases:
        """One case an edge: values before it and after it (primed)."""
        targets = list(chain(*(self.next[node] for node in self.sources)))
        cases = Cases(len(targets), self.spec.variables)
        for variable in self.variables:
            digits = [self._bits[bit] for bit in variable.bits]
            before = (map(operator.mul, column, self.degrees) for column in digits)
            cases.add(variable.name, map("".join, before))
            after = (map(column.__getitem__, targets) for column in digits)
            cases.add(f"{variable.name}'", map("".join, after))
        return cases

    def initial(self) -> list[int]:
        """The nodes that satisfy ENV_INIT and SYS_INIT."""
        cases = Cases(self.count, self.spec.variables)
        for variable in self.variables:
            cases.add(variable.name, [self._bits[bit] for bit in variable.bits])
        clauses = (*self.spec.sections["ENV_INIT"], *self.spec.sections["SYS_INIT"])
        return [match.start() for match in re.finditer("1", cases.digits(*clauses))]

    def check_edges(self, cases: Cases, *sections: str) -> None:
        """Refuse unless all edges satisfy all formulas of some sections."""
        for clause in chain(*(self.spec.sections[section] for section in sections)):
            if cases.where(clause.formula) != cases.all:
                source, target = list(self.pairs())[cases.digits(clause).index("0")]
                where = f"the edge from node {source} to node {target}"
                raise RefusedError(f"{where} breaks '{clause.text}' (line {clause.line})")


def check_strategy(spec: Specification, graph: Strategy, measures: Any) -> list[int]:
    """Refuse unless the strategy realizes the specification; returns its initial nodes."""
    initial = graph.initial()
    opening = (spec.keys("inputs"), spec.sections["ENV_INIT"])
    (allowed,) = count_completions(spec, *opening, (), [()])
    complete = len({graph.inputs[node] for node in initial}) == allowed
    require(complete, f"{allowed} inputs are allowed to begin with, not all have a node")
    cases = graph.edge_cases()
    graph.check_edges(cases, "ENV_TRANS", "SYS_TRANS")
    now = [*spec.keys("inputs"), *spec.keys("outputs")]
    rows = [(*graph.inputs[node], *graph.outputs[node]) for node in graph.sources]
    counts = count_completions(spec, spec.keys("inputs'"), spec.sections["ENV_TRANS"], now, rows)
    for node, count in zip(graph.sources, counts, strict=True):
        targets = graph.next[node]
        answered = len({graph.inputs[target] for target in targets})
        require(answered == len(targets), f"node {node} has two answers to one input")
        require(answered == count, f"node {node} answers {answered} of {count} allowed inputs")
    assumptions = [cases.digits(clause) for clause in spec.sections["ENV_LIVENESS"]]
    for goal, measure in pairs_of(spec.sections["SYS_LIVENESS"], measures):
        what = f"goal '{goal.text}' (line {goal.line})"
        check_measure(graph, what, cases.digits(goal), assumptions, measure)
    return initial


def check_counterstrategy(spec: Specification, graph: Strategy, evidence: Any) -> None:
    """Refuse unless the graph shows that no strategy realizes the specification.

    The environment begins with the input ``start`` and continues from node v by ``chosen[v]``
    (values in the order of the inputs). ENV_INIT and ENV_TRANS allow that; the nodes hold all that
    the robot can answer within SYS_INIT and SYS_TRANS. Each infinite path meets every assumption
    again and again (a measure for each), and misses a goal for ever (one measure, whose excuses
    are the goals).
    """
    first, chosen = tuple(evidence["start"]), [tuple(values) for values in evidence["chosen"]]
    now, later = spec.keys("inputs"), spec.keys("inputs'")
    for value, variable in chain(*(zip(v, spec.inputs, strict=True) for v in (first, *chosen))):
        good = type(value) is int and variable.least <= value <= variable.most
        require(good, f"an input has {variable.name} = {value}, beyond its range")
    begins = count_completions(spec, (), spec.sections["ENV_INIT"], now, [first])[0]
    require(begins, "the initial input is not allowed")
    begun = {graph.outputs[n] for n in graph.initial() if graph.inputs[n] == first}
    opening = (spec.keys("outputs"), spec.sections["SYS_INIT"])
    good = count_completions(spec, *opening, now, [first])[0] == len(begun)
    require(good, "not all outputs that answer the initial input have a node")
    rows = [(*i, *o, *c) for i, o, c in zip(graph.inputs, graph.outputs, chosen, strict=True)]
    keys = [*now, *spec.keys("outputs"), *later]
    legal = count_completions(spec, (), spec.sections["ENV_TRANS"], keys, rows)
    answers = count_completions(spec, spec.keys("outputs'"), spec.sections["SYS_TRANS"], keys, rows)
    for node, targets in enumerate(graph.next):
        require(legal[node], f"the input chosen in node {node} is not allowed")
        good = all(graph.inputs[target] == chosen[node] for target in targets)
        require(good, f"an edge from node {node} has another input than the chosen one")
        good = len({graph.outputs[t] for t in targets}) == len(targets) == answers[node]
        require(good, f"node {node} has {len(targets)} answers of {answers[node]}")
    cases = graph.edge_cases()
    graph.check_edges(cases, "SYS_TRANS")
    assumed = [cases.digits(clause) for clause in spec.sections["ENV_LIVENESS"]]
    goals = [cases.digits(clause) for clause in spec.sections["SYS_LIVENESS"]]
    check_beaten(graph, assumed, goals, "0" * cases.count, evidence["measures"])


def check_beaten(
    graph: Strategy, assumed: list[str], goals: list[str], there: str, given: Any
) -> None:
    """Refuse unless measures show that each infinite path meets all assumptions again and again,
    and from some point on no longer one of the goals. ``there``: 0 on the edges that are meant."""
    for k, (met, measure) in enumerate(pairs_of([*assumed, there], given)):
        last = k == len(assumed)
        what = "a goal is missed for ever" if last else f"assumption {k} is met again and again"
        check_measure(graph, what, met, goals if last else (), measure)


def pairs_of(aims: Sequence[Any], measures: Any) -> Iterator[tuple[Any, Any]]:
    matching = isinstance(measures, list) and len(measures) == len(aims)
    require(matching, f"there are {len(aims)} goals, but not as many measures")
    return zip(aims, measures, strict=True)


def check_measure(graph: Strategy, goal: str, met: str, excuses: Sequence[str], given: Any) -> None:
    """Refuse unless each infinite path meets the goal for ever, or one of the ``excuses`` never
    again from some point on. ``met`` and each excuse: a digit an edge, 0 where they are missed
    (and - on edges that no path in question takes).

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal n falls; or n and a stay the same, and a is not met on this edge. Why that is enough:
    take a path that does not meet the goal any more. Its n never rises and is never negative, so
    from some point on it stays. From there on a stays as well, and is not met.
    """
    numbers, which = given["n"], given["a"]
    sized = len(numbers) == len(which) == graph.count
    require(sized, f"{goal}: the measure is for another number of nodes")
    natural = all(type(n) is int and n >= 0 for n in numbers)
    require(natural, f"{goal}: the measure has a number that is no natural number")
    known = all(a is None or (type(a) is int and 0 <= a < len(excuses)) for a in which)
    require(known, f"{goal}: the measure names an assumption that does not exist")
    for edge, (source, target) in enumerate(graph.pairs()):
        if met[edge] != "0" or numbers[target] < numbers[source]:
            continue
        excuse = which[source]
        same = numbers[target] == numbers[source] and excuse == which[target]
        if not same or excuse is None or excuses[excuse][edge] != "0":
            falls = f"the measure does not fall from node {source} to node {target}"
            raise RefusedError(f"{goal}: {falls}")

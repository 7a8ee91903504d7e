"""First half of the checker: does a strategy realize the text of its specification, and does it
keep the rules of the scenario (``Task``)?

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

import json
import operator
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate, chain, combinations, product, zip_longest
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


# ---------------------------------------------------------------- the world

HEADINGS = ("north", "east", "south", "west")
TOLD = ("request", "wait", "assigned")
Json = Mapping[str, Any]
Pose = tuple[int, str | None]  # a region, and the heading of robots that have one
Assumption = tuple[str, str, frozenset[int]]  # what happens again and again, of whom, and where
# Digits of edges, 1 where something is met, 0 where it is missed, - where no run goes: of nothing,
# of each wish, of each assumption.
Digits = tuple[str, list[str], list[str]]


class World:
    """The map of the scenario: which regions are free, and which lie next to each other."""

    def __init__(self, data: Json) -> None:
        cells = "".join(data["grid"])
        self.rows, self.cols, self.size = data["rows"], data["cols"], len(cells)
        sized = [len(line) for line in data["grid"]] == [self.cols] * self.rows
        fits = sized and set(cells) <= {*"#."}
        require(fits, "the map is not as large as it says, or has other cells than # and .")
        self.free = frozenset(region for region, cell in enumerate(cells) if cell == ".")
        tall, wide = self.rows > 1, self.cols > 1
        self.sides = [h for h in HEADINGS if (tall if h in ("north", "south") else wide)]
        self._sight: dict[Any, bool] = {}

    def step(self, region: int, heading: str) -> int | None:
        """The free region on that side, or None."""
        row, col = divmod(region, self.cols)
        row += {"north": -1, "south": 1}.get(heading, 0)
        col += {"west": -1, "east": 1}.get(heading, 0)
        beyond = row * self.cols + col
        inside = 0 <= row < self.rows and 0 <= col < self.cols
        return beyond if inside and beyond in self.free else None

    def around(self, regions: Iterable[int]) -> set[int]:
        """The regions and their free neighbours."""
        near = ((r, *(self.step(r, heading) for heading in HEADINGS)) for r in regions)
        return {r for r in chain(*near) if r is not None}

    def moves(self, mobility: str, pose: Pose) -> set[Pose]:
        """The poses after one step or none. With heading mobility a robot never goes backwards,
        faces the way of its step, and keeps its heading while it stays."""
        found = {pose}
        for k, heading in enumerate(HEADINGS):
            beyond = self.step(pose[0], heading)
            if beyond is not None and mobility == "free":
                found.add((beyond, None))
            elif beyond is not None and (k - HEADINGS.index(str(pose[1]))) % 4 != 2:
                found.add((beyond, heading))
        return found

    def sees(self, a: int, b: int, radius: float | None, closed: frozenset[int]) -> bool:
        """Whether region b is in sight from a. The distance of the centres is at most the
        radius; the segment between them passes through the interior of no wall or closed region,
        and not between two of them that touch at a corner."""
        key = (min(a, b), max(a, b), radius, closed)
        if key not in self._sight:
            (row, col), (row_b, col_b) = divmod(a, self.cols), divmod(b, self.cols)
            down, right = row_b - row, col_b - col
            near = radius is None or down * down + right * right <= radius * radius
            self._sight[key] = near and self._line(row, col, down, right, closed - {a, b})
        return self._sight[key]

    def _line(self, row: int, col: int, down: int, right: int, closed: frozenset[int]) -> bool:
        touched = set()
        for r in range(min(0, down), max(0, down) + 1):
            for c in range(min(0, right), max(0, right) + 1):
                region = (row + r) * self.cols + col + c
                if region in self.free and region not in closed:
                    continue
                apart = 2 * abs(down * c - right * r)  # twice the distance, times the length
                if apart < abs(down) + abs(right):
                    return False
                if apart == abs(down) + abs(right):
                    touched.add((r, c))
        across = (1 if down > 0 else -1, 1 if right > 0 else -1)
        return not any((r + across[0], c - across[1]) in touched for r, c in touched)


def poses_of(listed: Iterable[Sequence[Any]], mobility: str) -> frozenset[Pose]:
    """Places ``[region, heading]``; null stands for any heading."""
    every = HEADINGS if mobility == "heading" else (None,)
    return frozenset((r, h) for r, given in listed for h in ((given,) if given else every))


def coordinates(pose: Pose) -> Row:
    """The pose as variables have it: region, and heading if any."""
    return (pose[0],) if pose[1] is None else (pose[0], HEADINGS.index(pose[1]))


def named_coordinates(pose: Pose) -> dict[str, int]:
    return dict(zip(("region", "heading"), coordinates(pose), strict=False))


def as_bits(truths: Iterable[bool]) -> int:
    """Truths as a number, the first one as its lowest binary digit."""
    return sum(1 << k for k, truth in enumerate(truths) if truth)


# An objective is data: {kind: value}, with targets, or for the kind ``ltl`` with formulas.


def targets_of(objective: Json) -> list[frozenset[int]]:
    """The targets of an objective: sets of regions of which any one counts."""
    ((kind, value),) = objective.items()
    listed = [value] if kind == "hold" else value if kind != "ltl" else []
    return [frozenset([t] if isinstance(t, int) else t) for t in listed]


def is_ordered(objective: Json) -> bool:
    return "patrol" in objective or "visit" in objective


def formulas_of(objective: Json, part: str) -> list[str]:
    """The objective's own formulas: ``init``, ``safety`` or ``liveness``."""
    found = objective.get("ltl", {}).get(part, ())
    return [found] if isinstance(found, str) else list(found)


def clauses_of(texts: Iterable[str]) -> list[Any]:
    """Formulas of an objective, with headings as numbers."""

    def named(formula: Formula) -> Formula:
        if formula[0] == "var" and formula[1] in HEADINGS:
            return ("num", HEADINGS.index(formula[1]))
        return tuple(named(part) if isinstance(part, tuple) else part for part in formula)

    return [read_clause(text, rename=named) for text in texts]


def same_objective(given: Json, wanted: Json) -> bool:
    """Whether an objective is the wanted one, or asks for its targets in turn."""
    return given == wanted or ("patrol" in wanted and given == {"visit": wanted["patrol"]})


def in_words(objective: Json) -> str:
    ((kind, value),) = objective.items()
    return f"{kind} {json.dumps(value)}"


# ---------------------------------------------------------------- scenario -> strategy


class Task:
    """What a robot is synthesized for, and the strategy or counterstrategy for it, by the scenario
    itself and without the formulas of the specification (an objective in formulas brings its own).
    ``line``: the ``synthesis`` line of the trace; ``robot``: its entry in the scenario; ``cells``:
    of which beliefs are made."""

    def __init__(self, world: World, robot: Json, line: Json, cells: Any, graph: Strategy) -> None:
        self.world, self.robot, self.line, self.graph = world, robot, line, graph
        self.pose: Pose = (line["region"], line.get("heading"))
        self.objective: Json = line["objective"]
        if line.get("form") == "alternation" and "patrol" in self.objective:
            self.objective = {"visit": self.objective["patrol"]}
        self.kind, self.ordered = next(iter(self.objective)), is_ordered(self.objective)
        self.targets = targets_of(self.objective)
        self.memory: dict[str, int] = dict(line.get("memory") or {})
        self.closed = {region for region, _ in line.get("closed") or ()}
        self.forbidden = poses_of(line.get("forbidden") or (), robot["mobility"])
        self.moving = list(line.get("moving") or ())
        self.places = line.get("places")  # where it can be sent (``assignable``), or None
        self.places_from = [  # from where, if not from everywhere
            (set(part["places"]), poses_of(part["from"], robot["mobility"]))
            for part in line.get("places_from") or ()
        ]
        self.nearby = robot["tracking"] == "nearby"
        self.sight_closed = frozenset(line.get("sight_closed") or ())
        self._read_beliefs(cells or ())
        self._read_nodes()
        self._read_formulas()
        goals = range(len(self.recurring) or len(self.targets))
        self.wishes = ["the next target"] if self.ordered else [f"goal {k}" for k in goals]
        self.wishes += ["the place that it is sent to"] if self.places is not None else []
        self.assumptions = self._assumptions(line["fairness"])

    def _read_beliefs(self, cells: Iterable[Sequence[int]]) -> None:
        """Values of the variables ``at_NAME``: a region, or beyond them the number of a belief,
        which is a set of cells."""
        self.cells = [frozenset(cell) for cell in cells]
        self.numbers: dict[str, dict[frozenset[int], int]] = {}  # the values of beliefs
        self.regions: dict[str, dict[int, frozenset[int]]] = {}  # and where the other one is then
        for name, known in (self.line.get("beliefs") or {}).items():
            values = {frozenset(belief): k for k, belief in enumerate(known, self.world.size)}
            self.numbers[name] = values
            union = {k: [self.cells[cell] for cell in belief] for belief, k in values.items()}
            self.regions[name] = {k: frozenset().union(*parts) for k, parts in union.items()}
        self.knowledge = {
            name: self.numbers[name][frozenset(known)] if isinstance(known, list) else known
            for name, known in (self.line.get("knowledge") or {}).items()
        }
        self.tracked = [] if self.nearby else list(self.knowledge)

    def _read_nodes(self) -> None:
        self.inputs = [variable.name for variable in self.graph.spec.inputs]
        self.values = [self.graph.values(node) for node in range(self.graph.count)]
        turns = self.robot["mobility"] == "heading"
        self.poses: list[Pose] = [
            (values["region"], HEADINGS[values["heading"]] if turns else None)
            for values in self.values
        ]
        self.remembered = [max((v.get(m, 0) for m in self.memory), default=0) for v in self.values]
        self.offsets = [0, *accumulate(self.graph.degrees)]  # the number of each node's first edge
        self.of_pose: dict[Pose, set[int]] = {}  # the nodes that a run can come to, by their pose
        self._expected: dict[Any, frozenset[Row]] = {}

    def _read_formulas(self) -> None:
        """The objective's own formulas: on edges, those that are to hold always and the digits of
        those that are to hold again and again."""
        declared = self.objective.get("ltl", {}).get("memory", {})
        known = {v.name: [v.least, v.most] for v in self.graph.spec.outputs}
        for name, bounds in declared.items():
            same = known.get(name) == ([0, 1] if bounds == "bool" else list(bounds))
            require(same, "the memory of the objective is not that of the strategy")
        self.own = list(declared)
        parts = (formulas_of(self.objective, part) for part in ("init", "safety", "liveness"))
        self.init, self.safety, liveness = map(clauses_of, parts)
        about = set().union(*(clause.reads for clause in (*self.init, *self.safety, *liveness)))
        good = {key.rstrip("'") for key in about} <= {*known}
        require(good, "the objective's formulas speak of more than the robot")
        cases = self.graph.edge_cases() if self.kind == "ltl" else None
        self.always = cases.digits(*self.safety) if cases else ""
        self.recurring = [cases.digits(clause) for clause in liveness] if cases else []

    # what can be observed

    def expected(self, node: int) -> frozenset[Row]:
        """All inputs that can occur after a node."""
        pose, values = self.poses[node], self.values[node]
        told = tuple(values[name] for name in TOLD) if self.places is not None else ()
        key = (pose, told, tuple(values[f"at_{name}"] for name in self.tracked))
        if key not in self._expected:
            groups = list(self._groups(pose, values))
            names = [name for group, _ in groups for name in group]
            same = sorted(names) == sorted(self.inputs)
            require(same, f"the inputs are {self.inputs}, but should be {names}")
            order = [names.index(name) for name in self.inputs]
            rows = (tuple(chain(*row)) for row in product(*(after for _, after in groups)))
            self._expected[key] = frozenset(tuple(row[i] for i in order) for row in rows)
        return self._expected[key]

    def _groups(self, pose: Pose, values: Json) -> Iterator[tuple[list[str], Iterable[Row]]]:
        """Inputs that do not depend on each other, with the values that can occur."""
        region = pose[0]
        if self.places is not None:
            again = values["request"] and not values["wait"]
            places = {values["assigned"]} if again else set(self.places)
            places = places.difference(*(to for to, of in self.places_from if pose not in of))
            rows = [(1, 0, place) for place in places]
            rows += [(*told, self.line["neutral"]) for told in ((0, 0), (0, 1), (1, 1))]
            yield [*TOLD], rows
        if self.nearby and self.moving:
            sides = self.world.sides
            open_ = [side for side in sides if self.world.step(region, side) is not None]
            most = min(len(open_), len(self.moving))
            some = chain(*(combinations(open_, count) for count in range(most + 1)))
            busy = [tuple(int(side in taken) for side in sides) for taken in some]
            yield [f"busy_{side}" for side in sides], busy
        for name in self.tracked:
            after = self.after(name, region, values[f"at_{name}"])
            yield [f"at_{name}"], [(value,) for value in after]

    def after(self, name: str, region: int, value: int) -> set[int]:
        """What may be known of another robot next, if ``value`` is known of it now. The other one
        stays or steps, not onto this robot if they are in conflict; then this robot looks."""
        reach = self.world.around(self.whereabouts(name, value))
        reach -= {region} if name in self.moving else set()
        seen = {r for r in reach if self.sees(region, r)}
        if seen == reach:
            return seen
        belief = frozenset(k for k, cell in enumerate(self.cells) if cell & (reach - seen))
        known = belief in self.numbers[name]
        require(known, f"{name} may be in the cells {sorted(belief)}: there is no input")
        return seen | {self.numbers[name][belief]}

    def sees(self, here: int, there: int) -> bool:
        radius, closed = self.robot.get("vision"), self.sight_closed
        return self.robot["tracking"] == "exact" or self.world.sees(here, there, radius, closed)

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """The regions where another robot may be if that is known of it."""
        return frozenset({value}) if value < self.world.size else self.regions[name][value]

    def taken(self, region: int, seen: Json) -> set[int | None]:
        """The regions observed as taken, from where the robot stands before its move."""
        if not self.nearby:
            return {seen[f"at_{name}"] for name in self.moving}
        sides = self.world.sides if self.moving else ()
        return {self.world.step(region, side) for side in sides if seen[f"busy_{side}"]}

    # what is to be done, and what is assumed

    def awaited(self, node: int) -> int:
        """The target whose turn it is in a node: the one that it remembers, or the one after it if
        that is reached there."""
        index = self.remembered[node]
        reached = self.ordered and self.poses[node][0] in self.targets[index]
        return (index + 1) % len(self.targets) if reached else index

    def legal(self, here: Pose, awaited: int, seen: Json) -> set[Pose]:
        """The poses that the rules leave after an observation, while a target is awaited."""
        moves = self.world.moves(self.robot["mobility"], here)
        if self.kind == "hold" and here[0] in self.targets[0] and not seen.get("request"):
            moves = {here}
        if self.places is not None and seen["wait"]:
            moves &= {here}
        shut = self.taken(here[0], seen) | self.closed
        if self.kind == "patrol":
            shut |= self.targets[1 - awaited]  # the one whose turn it is not
        return {pose for pose in moves if pose[0] not in shut} - self.forbidden

    def _met(self, awaited: int, node: int, edge: int) -> list[bool]:
        """Which wishes are met by a step into a node while a target is awaited."""
        region, values = self.poses[node][0], self.values[node]
        if self.ordered:
            met = [region in self.targets[awaited]]
        elif self.recurring:
            met = [digits[edge] == "1" for digits in self.recurring]
        else:
            met = [region in target for target in self.targets]
        if self.places is None:
            return met
        if not values["request"]:
            return [*met, True]  # while it is sent somewhere its own goals can wait
        return [True] * len(met) + [bool(values["wait"]) or values["assigned"] == region]

    def _assumptions(self, fairness: str) -> list[Assumption]:
        """What is assumed to happen again and again: what, of whom, and where."""
        found: list[Assumption] = []
        if self.places is not None:
            found.append(("no wait", "", frozenset()))
        if fairness == "out_of_my_way":
            found.append(("nobody near", "", frozenset()))
        for name in self.moving:
            if fairness == "out_of_my_sight" and self.numbers[name]:
                found.append(("unseen", name, frozenset()))
            if fairness == "off_my_targets":
                found += [("off", name, aim) for aim in self.targets]
            if fairness == "at_its_targets":
                aims = targets_of({"visit": self.line["others_targets"][name]})
                found += [("at", name, aim) for aim in aims]
        return found

    def _holds(self, assumption: Assumption, region: int, seen: Json) -> bool:
        """Whether it is so at a step from a region with what is observed then. What is only
        believed counts if it may be so."""
        kind, about, aim = assumption
        if self.places is not None and seen["wait"]:
            return False  # what others do while the robot must stay where it is helps nobody
        if kind == "no wait":
            return True
        if kind == "nobody near":
            return not self.world.around([region]) & self.taken(region, seen)
        value = seen[f"at_{about}"]
        where = self.whereabouts(about, value)
        return (
            value >= self.world.size
            if kind == "unseen"
            else bool(where - aim if kind == "off" else where & aim)
        )

    def explore(self, starts: Iterable[int], judge: Callable[[int], None]) -> Digits:
        """The edges that runs from the start nodes can take, and where wishes and assumptions are
        met on them. ``judge`` is asked about each node."""
        graph, count = self.graph, len(self.wishes)
        wished, assumed = dict[tuple[int, int], int](), dict[tuple[int, Row], int]()
        seen, bits = dict.fromkeys(graph.first[node] for node in starts), [-1] * self.offsets[-1]
        queue = list(seen)
        for source in queue:
            judge(source)
            region, awaited = self.poses[source][0], self.awaited(source)
            for edge, target in enumerate(graph.next[source], self.offsets[source]):
                if self.always and self.always[edge] == "0":
                    said = f"the edge from node {source} to {target}"
                    raise RefusedError(f"{said} breaks the objective")
                if self.ordered and self.remembered[target] != awaited:
                    raise RefusedError(f"node {target} forgets whose turn it is: target {awaited}")
                what, when = (awaited, target), (region, graph.inputs[target])
                if what not in wished or self.recurring:
                    wished[what] = as_bits(self._met(awaited, target, edge))
                if when not in assumed:
                    values = self.values[target]
                    holds = (self._holds(a, region, values) for a in self.assumptions)
                    assumed[when] = as_bits(holds) << count
                bits[edge] = wished[what] | assumed[when]
                if (first := graph.first[target]) not in seen:
                    seen[first] = None
                    queue.append(first)
        for node in queue:
            self.of_pose.setdefault(self.poses[node], set()).add(node)
        total, kinds = count + len(self.assumptions), set(bits)
        digits = [{b: "-" if b < 0 else "01"[b >> k & 1] for b in kinds} for k in range(total + 1)]
        met = ["".join(map(digit.__getitem__, bits)) for digit in digits]
        return met[total], met[:count], met[count:total]

    def explore_strategy(self, start: int) -> Digits:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules. That
        none misses a wish for ever is for measures to show, of the digits that this returns."""
        values, graph, inputs = self.values[start], self.graph, self.graph.inputs
        same = self.poses[start] == self.pose
        require(same, f"it begins at {self.poses[start]}, but the robot is at {self.pose}")
        for name, value in (self.memory | self._positions()).items():
            given = values.get(name)
            require(given == value, f"it begins with {name} = {given}, not {value}")
        if self.own and not self.memory:
            begun = self.completed("init", (), values)
            require(begun, "it begins as the objective forbids")
        allowed: dict[Any, set[Pose]] = {}

        def judge(node: int) -> None:
            targets, here, awaited = graph.next[node], self.poses[node], self.awaited(node)
            for row in sorted(self.expected(node) - {inputs[target] for target in targets}):
                said = dict(zip(self.inputs, row, strict=True))
                raise RefusedError(f"node {node} has no answer to {said}, which can occur")
            for target in targets:
                key = (here, awaited, inputs[target])
                if key not in allowed:
                    allowed[key] = self.legal(here, awaited, self.values[target])
                if self.poses[target] not in allowed[key]:
                    edge = f"the edge from node {node} to {target}, {here} to {self.poses[target]},"
                    raise RefusedError(f"{edge} is no legal move")

        return self.explore(self.begins(start), judge)

    def begins(self, start: int) -> list[int]:
        """Where a run can come to its strategy: where it begins, and where it is put (told to wait
        at first, with assignable goals)."""
        return [start, *self.graph.initial()] if self.places is not None else [start]

    def _positions(self) -> dict[str, int]:
        return {f"at_{name}": self.knowledge[name] for name in self.tracked}

    def first(self) -> dict[str, int]:
        """The inputs with which everything begins."""
        told = {"assigned": self.line["neutral"]} if self.places is not None else {}
        return dict.fromkeys(self.inputs, 0) | self._positions() | told

    def completed(self, part: str, wanted: Sequence[str], values: Json) -> set[Row]:
        """The values of ``wanted`` (primed for the part ``safety``) under the own formulas."""
        clauses = self.init if part == "init" else self.safety
        known = [name for name in values if name not in wanted]
        row = tuple(values[name] for name in known)
        return {after for _, after in complete(self.graph.spec, wanted, clauses, known, [row])}

    def follows(self, objective: Json, before: Pose, after: Pose) -> bool:
        """Whether an objective's own safety lines allow a step, for some values of the memory
        (lines about a memory that this strategy does not have are left out)."""
        after_ = {f"{name}'": value for name, value in named_coordinates(after).items()}
        values = named_coordinates(before) | after_
        wanted = [*self.own, *(f"{name}'" for name in self.own)]
        lines = clauses_of(formulas_of(objective, "safety"))
        clauses = [clause for clause in lines if clause.reads <= {*values, *wanted}]
        row = tuple(values.values())
        return any(complete(self.graph.spec, wanted, clauses, list(values), [row]))

    def explore_counterstrategy(self, proof: Json) -> Digits:
        """Refuse unless no way to keep the scenario's rules can be kept against it: each chosen
        input can occur, and each move that the rules leave has a successor. Measures have to show,
        of the digits that this returns, that endless runs meet every assumption again and again
        and miss a wish for ever."""
        graph, start, chosen = self.graph, tuple(proof["start"]), proof["chosen"]
        same = dict(zip(self.inputs, start, strict=True)) == self.first()
        require(same, "the initial input is not what the robot knows at the start")
        begin = [
            n
            for n in graph.initial()
            if graph.inputs[n] == start and self.poses[n] == self.pose
            if self.memory.items() <= self.values[n].items()
        ]
        values = self.first() | named_coordinates(self.pose)
        ways = self.completed("init", [] if self.memory else self.own, values | self.memory)
        begun = {tuple(self.values[n][name] for name in self.own) for n in begin}
        listed = begin and (not self.own or self.memory or ways <= begun)
        require(listed or not (begin or ways), "not all ways to begin have a node")
        place = list(named_coordinates(self.pose))
        names = place + self.own if self.kind == "ltl" else place

        def judge(node: int) -> None:
            row, here = tuple(chosen[node]), self.poses[node]
            can = row in self.expected(node)
            require(can, f"the input chosen in node {node} cannot occur")
            seen = dict(zip(self.inputs, row, strict=True))
            answers = {coordinates(pose) for pose in self.legal(here, self.awaited(node), seen)}
            if self.kind == "ltl":
                own = {name: self.values[node][name] for name in names}
                allowed = self.completed("safety", [f"{name}'" for name in names], own)
                answers = {row for row in allowed if row[: len(place)] in answers}
            answers -= {tuple(self.values[t][name] for name in names) for t in graph.next[node]}
            for row in sorted(answers):
                raise RefusedError(f"in node {node} the robot could go on to {row}")

        return self.explore(begin, judge)

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
HEADINGS = ("north", "east", "south", "west")
TOLD = ("request", "wait", "assigned")

Key = str  # a variable's name, followed by ' where its next value is meant
Formula = tuple[Any, ...]  # ("var", key), ("num", n), ("const", truth), or operator and operands
Row = tuple[int, ...]
Json = Mapping[str, Any]


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
    """Values ``least``...``most``; or a truth, 0 or 1. ``bits``: the names of its bits as
    strategies have them, lowest first. They hold value - least."""

    name: str
    least: int
    most: int
    bits: tuple[str, ...]
    truth: bool

    @property
    def values(self) -> range:
        return range(self.least, self.most + 1)


@dataclass(frozen=True)
class Clause:
    """One line of a section, and the variables that it reads."""

    line: int
    text: str
    formula: Formula
    reads: frozenset[Key]


Variables = Mapping[str, Variable]
SECTIONS = ("ENV_INIT", "SYS_INIT", "ENV_TRANS", "SYS_TRANS", "ENV_LIVENESS", "SYS_LIVENESS")


@dataclass(frozen=True)
class Specification:
    inputs: Variables
    outputs: Variables
    sections: Mapping[str, list[Clause]]

    @property
    def variables(self) -> Variables:
        return {**self.inputs, **self.outputs}


def primed(names: Iterable[str]) -> list[Key]:
    return [f"{name}'" for name in names]


def read_specification(text: str) -> Specification:
    """Read a text in structured slugs; what is not understood is refused."""
    lines: dict[str, list[tuple[int, str]]] = {s: [] for s in ("INPUT", "OUTPUT", *SECTIONS)}
    section = ""
    for number, line in enumerate(map(str.strip, text.splitlines()), 1):
        if line.startswith("["):
            section = line.strip("[]")
        elif line and not line.startswith("#"):
            require(section in lines, f"line {number} stands in no section that there is")
            lines[section].append((number, line))
    inputs, outputs = ([read_variable(line) for _, line in lines[s]] for s in ("INPUT", "OUTPUT"))
    sections = {s: [read_clause(line, number) for number, line in lines[s]] for s in SECTIONS}
    spec = Specification({v.name: v for v in inputs}, {v.name: v for v in outputs}, sections)
    twice = len(spec.variables) < len(inputs) + len(outputs)
    require(not twice, "a variable is declared twice")
    now, later = {*spec.variables}, {*primed(spec.inputs)}
    known = {"ENV_INIT": {*spec.inputs}, "SYS_INIT": now, "ENV_TRANS": now | later}
    for name, clauses in sections.items():
        for clause in clauses:
            unknown = clause.reads - known.get(name, now | {*primed(now)})
            said = " and ".join(sorted(unknown))
            require(not unknown, f"line {clause.line}: {said} must not stand here")
    return spec


def read_variable(line: str) -> Variable:
    match = re.fullmatch(r"(\w+)(?::(\d+)\.\.\.(\d+))?", line)
    if match is None:
        raise RefusedError(f"'{line}' declares no variable")
    name, least, most = match[1], int(match[2] or 0), int(match[3] or 1)
    if match[2] is None:
        return Variable(name, 0, 1, (name,), truth=True)
    bits = [f"{name}@0.{least}.{most}", *(f"{name}@{bit}" for bit in range(1, most.bit_length()))]
    size = (most - least).bit_length()
    return Variable(name, least, most, tuple(bits[:size]), truth=False)


# ---------------------------------------------------------------- formulas

_TOKEN = re.compile(
    r"\s*(\d+|[A-Za-z_]\w*'*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
_COMPARISONS = ("=", "!=", "<", "<=", ">", ">=")
# How tightly operators bind. Equal ones are grouped to the left.
_BINDS = {"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5, "!": 6, "+": 8}
_BINDS |= dict.fromkeys(_COMPARISONS, 7)


def read_clause(text: str, line: int = 0) -> Clause:
    """A formula as nested tuples; headings are numbers."""
    rest = _TOKEN.sub("", text).strip()
    require(not rest, f"cannot read '{rest[:20]}'")
    tokens = ["the end", *(_SAME.get(token, token) for token in reversed(_TOKEN.findall(text)))]
    found: set[Key] = set()

    def read(least: int, prime: str) -> Formula:
        """What binds at least so tightly. Within next(...) each variable gets a prime."""
        token = tokens.pop()
        formula: Formula = ("const", token == "TRUE")
        if token in ("next", "X") and tokens[-1] == "(":
            formula = read(9, f"{prime}'")
        elif token == "(":
            formula = read(0, prime)
            require(tokens.pop() == ")", f"a bracket is open in '{text}'")
        elif token == "!":
            formula = ("!", read(_BINDS["!"], prime))
        elif token.isdigit() or token in HEADINGS:
            formula = ("num", int(token) if token.isdigit() else HEADINGS.index(token))
        elif token not in ("TRUE", "FALSE"):
            good = re.fullmatch(r"\w+'*", token + prime)
            require(good, f"'{token}{prime}' is not expected in '{text}'")
            formula = ("var", token + prime)
            found.add(token + prime)
        while (sign := tokens[-1]) in _BINDS and _BINDS[sign] >= least:
            parts = [formula]
            while tokens[-1] == sign:
                tokens.pop()
                parts.append(read(_BINDS[sign] + 1, prime))
            formula = (sign, *parts)
        return formula

    formula = read(0, "")
    require(len(tokens) == 1, f"'{tokens[-1]}' is not expected in '{text}'")
    return Clause(line, text, formula, frozenset(found))


# ---------------------------------------------------------------- many cases at once

_LOGIC: Mapping[str, Callable[[int, int], int]] = {
    "&": operator.and_,
    "|": operator.or_,
    "^": operator.xor,
    "->": lambda left, right: ~left | right,
    "<->": lambda left, right: ~(left ^ right),
}


_DIGIT = [bytes(b"01"[byte >> bit & 1] for byte in range(256)) for bit in range(8)]
Column = Callable[[Key], list[int]]


class Cases:
    """Values of variables in ``count`` cases. A truth is an integer with one binary digit for each
    case, the first case leftmost; a number is a list of these, its lowest bit first."""

    def __init__(self, variables: Variables, column: Column, count: int) -> None:
        """``column``: of a variable its value in each case."""
        self.variables, self.column, self.count = variables, column, count
        self.all = (1 << count) - 1
        self._bits: dict[Key, list[int]] = {}

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
        return self._given(parts[0])[0]

    def _given(self, key: Key) -> list[int]:
        """The bits of a variable's value - least."""
        if key not in self._bits:
            variable, digits = self.variables[key.rstrip("'")], list[bytes]()
            values = [value - variable.least for value in self.column(key)]
            while len(digits) < len(variable.bits):
                byte = bytes(map((255).__and__, values))
                digits += [byte.translate(table) for table in _DIGIT]
                values = [value >> 8 for value in values]
            bits = digits[: len(variable.bits)]
            self._bits[key] = [int(digit or b"0", 2) for digit in bits]
        return self._bits[key]

    def _number(self, term: Formula) -> list[int]:
        kind, *parts = term
        if kind == "num":
            return [self.all * (parts[0] >> bit & 1) for bit in range(parts[0].bit_length())]
        if kind == "+":
            return reduce(self._plus, map(self._number, parts))
        variable = self.variables[parts[0].rstrip("'")] if kind == "var" else None
        if variable is None or variable.truth:
            raise RefusedError("a truth stands where a number is needed")
        return self._plus(self._given(parts[0]), self._number(("num", variable.least)))

    def _plus(self, left: list[int], right: list[int]) -> list[int]:
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


def complete(
    variables: Variables, wanted: Keys, clauses: Clauses, known: Keys, rows: Iterable[Row]
) -> Iterator[tuple[Row, Row]]:
    """All pairs of a row of values of the ``known`` variables and one of the ``wanted`` ones that
    satisfy the clauses. One variable after the other takes all its values, first the one by which
    most clauses can be evaluated, and of these the smallest; a clause is evaluated as soon as all
    that it reads is there."""

    def rank(key: Key) -> tuple[int, int]:
        by_it = sum(clause.reads <= {*order, key} for clause in waiting)
        return by_it, -len(variables[key.rstrip("'")].bits)

    order, left, waiting, partial = list(known), list(wanted), clauses, [*dict.fromkeys(rows)]
    fresh: list[Key] = []  # the variable that takes all its values; at first there is none

    def column(key: Key) -> list[int]:
        if key in fresh:
            return [value for (value,) in values] * len(block)
        place = order.index(key)
        return [row[place] for row in block for _ in values]

    while True:
        values = [*product(*(variables[key.rstrip("'")].values for key in fresh))]
        ready = [clause for clause in waiting if clause.reads <= {*order, *fresh}]
        waiting = [clause for clause in waiting if not clause.reads <= {*order, *fresh}]
        found, step = list[Row](), max(1, MOST_CASES // len(values))
        for block in (partial[at : at + step] for at in range(0, len(partial), step)):
            cases = Cases(variables, column, len(block) * len(values))
            extended = zip(product(block, values), cases.digits(*ready), strict=True)
            found += [row + value for (row, value), good in extended if good == "1"]
        order, partial = [*order, *fresh], found
        if not left:
            break
        fresh = [max(left, key=rank)]
        left.remove(fresh[0])
    require(not waiting, "a formula reads what is not there")
    places = [order.index(key) for key in wanted]
    for row in partial:
        yield row[: len(known)], tuple(row[place] for place in places)


def count_completions(
    variables: Variables, wanted: Keys, clauses: Clauses, known: Keys, rows: Sequence[Row]
) -> list[int]:
    """For each row: the number of its completions. Wanted variables that no clause connects are
    counted apart and multiplied."""
    groups: list[tuple[set[Key], list[Clause]]] = [({key}, []) for key in wanted]
    for clause in clauses:
        touched = [group for group in groups if group[0] & clause.reads]
        groups = [group for group in groups if group not in touched]
        keys = set().union(*(group[0] for group in touched))
        groups.append((keys, [*chain(*(group[1] for group in touched)), clause]))
    totals = [1] * len(rows)
    for keys, about in groups:
        places = [k for k, key in enumerate(known) if any(key in c.reads for c in about)]
        classes = [tuple(row[place] for place in places) for row in rows]
        read = [known[place] for place in places]
        counts = Counter(row for row, _ in complete(variables, sorted(keys), about, read, classes))
        totals = [total * counts[which] for total, which in zip(totals, classes, strict=True)]
    return totals


# ---------------------------------------------------------------- strategies


class Strategy:
    """A graph whose nodes hold values of all variables. ``next``: the nodes that follow each.

    *Twins* are followed by the same nodes, and differ only in passing inputs whose present value no
    formula reads. What holds of the edges of one holds of those of the others; so only the edges
    of the ``first`` of them are looked at, each as if it led to the first of the twins there. They
    are numbered in the order of their ``sources``; ``offset``: the number of a source's first one.
    """

    def __init__(self, document: Any, spec: Specification) -> None:
        nodes = [document["nodes"][str(k)] for k in range(len(document["nodes"]))]
        self.spec, self.count, self.columns = spec, len(nodes), dict[str, list[int]]()
        names = [bit for variable in spec.variables.values() for bit in variable.bits]
        same = document["variables"] == names
        require(same, "the strategy has other variables than the specification")
        for node, given in enumerate(nodes):
            good = len(given["state"]) == len(names) and {*given["state"]} <= {0, 1}
            require(good, f"node {node} does not hold {len(names)} bits")
            good = all(0 <= target < self.count for target in given["trans"])
            require(good, f"node {node} has an edge to nowhere")
        at = 0
        for name, variable in spec.variables.items():
            bits = [given["state"][at : at + len(variable.bits)] for given in nodes]
            column = [variable.least + sum(b << k for k, b in enumerate(each)) for each in bits]
            good = max(column, default=0) <= variable.most
            require(good, f"a node has a value of {name} beyond its range")
            self.columns[name], at = column, at + len(variable.bits)
        self.inputs, self.outputs = self._rows(spec.inputs), self._rows(spec.outputs)
        clauses = chain(*(spec.sections[name] for name in SECTIONS[2:]))
        read = {*spec.outputs}.union(*(clause.reads for clause in clauses))
        kept = self._rows(v for v in spec.variables if v in read or not PASSING.fullmatch(v))
        known: dict[Any, int] = {}
        keys = ((row, *given["trans"]) for row, given in zip(kept, nodes, strict=True))
        self.first = [known.setdefault(key, node) for node, key in enumerate(keys)]
        self.next: list[list[int]] = [nodes[node]["trans"] for node in self.first]  # one list each
        self.sources = list(known.values())
        sizes = [len(self.next[node]) for node in self.sources]
        self.offset = dict(zip(self.sources, accumulate(sizes, initial=0), strict=False))
        self.size = sum(sizes)
        if self.size > MOST_EDGES:
            raise TooLargeError(f"{self.size} edges; this checker takes {MOST_EDGES}")

    def _rows(self, names: Iterable[str]) -> list[Row]:
        """Each node's values of some variables."""
        columns = [self.columns[name] for name in names]
        return [*zip(*columns, strict=True)] if columns else [()] * self.count

    def values(self, node: int) -> dict[str, int]:
        return {name: column[node] for name, column in self.columns.items()}

    def pairs(self) -> Iterator[tuple[int, int]]:
        """The edges."""
        return ((node, self.first[after]) for node in self.sources for after in self.next[node])

    def edge_cases(self) -> Cases:
        """One case an edge: values before it and after it (primed)."""
        sources = [node for node in self.sources for _ in self.next[node]]
        targets = [after for node in self.sources for after in self.next[node]]

        def column(key: Key) -> list[int]:
            values = self.columns[key.rstrip("'")]
            return [values[node] for node in (targets if key.endswith("'") else sources)]

        return Cases(self.spec.variables, column, self.size)

    def initial(self) -> list[int]:
        """The nodes that satisfy ENV_INIT and SYS_INIT."""
        clauses = (*self.spec.sections["ENV_INIT"], *self.spec.sections["SYS_INIT"])
        digits = Cases(self.spec.variables, self.columns.__getitem__, self.count).digits(*clauses)
        return [node for node, good in enumerate(digits) if good == "1"]

    def of_input(self, row: Row) -> list[int]:
        """The initial nodes with that input."""
        return [node for node in self.initial() if self.inputs[node] == row]

    def check_edges(self, cases: Cases, *sections: str) -> None:
        """Refuse unless all edges satisfy all formulas of some sections."""
        for clause in chain(*(self.spec.sections[section] for section in sections)):
            if cases.where(clause.formula) != cases.all:
                source, target = list(self.pairs())[cases.digits(clause).index("0")]
                where = f"the edge from node {source} to node {target}"
                raise RefusedError(f"{where} breaks '{clause.text}' (line {clause.line})")


def check_strategy(spec: Specification, graph: Strategy, measures: Any) -> list[int]:
    """Refuse unless the strategy realizes the specification; returns its initial nodes."""
    variables, sections, initial = spec.variables, spec.sections, graph.initial()
    (allowed,) = count_completions(variables, [*spec.inputs], sections["ENV_INIT"], (), [()])
    whole = len({graph.inputs[node] for node in initial}) == allowed
    require(whole, f"{allowed} inputs are allowed to begin with, not all have a node")
    cases = graph.edge_cases()
    graph.check_edges(cases, "ENV_TRANS", "SYS_TRANS")
    rows = [graph.inputs[node] + graph.outputs[node] for node in graph.sources]
    about = (primed(spec.inputs), sections["ENV_TRANS"], [*variables])
    for node, count in zip(graph.sources, count_completions(variables, *about, rows), strict=True):
        answered = len({graph.inputs[target] for target in graph.next[node]})
        require(answered == len(graph.next[node]), f"node {node} has two answers to one input")
        require(answered == count, f"node {node} answers {answered} of {count} allowed inputs")
    assumptions = [cases.digits(clause) for clause in sections["ENV_LIVENESS"]]
    for goal, measure in zip(sections["SYS_LIVENESS"], measures, strict=True):
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
    inputs, outputs, later = [*spec.inputs], [*spec.outputs], primed(spec.inputs)

    def count(wanted: Keys, section: str, known: Keys, rows: Sequence[Row]) -> list[int]:
        return count_completions(spec.variables, wanted, spec.sections[section], known, rows)

    require(count((), "ENV_INIT", inputs, [first])[0], "the initial input is not allowed")
    begun = {graph.outputs[node] for node in graph.of_input(first)}
    good = count(outputs, "SYS_INIT", inputs, [first])[0] == len(begun)
    require(good, "not all outputs that answer the initial input have a node")
    rows = [(*i, *o, *c) for i, o, c in zip(graph.inputs, graph.outputs, chosen, strict=True)]
    known = [*inputs, *outputs, *later]
    legal = count((), "ENV_TRANS", known, rows)
    answers = count(primed(outputs), "SYS_TRANS", known, rows)
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
    graph: Strategy, assumed: list[str], goals: list[str], there: str, measures: Any
) -> None:
    """Refuse unless measures show that each infinite path meets all assumptions again and again,
    and from some point on no longer one of the goals. ``there``: 0 on the edges that are meant."""
    *each, last = measures
    for k, (met, measure) in enumerate(zip(assumed, each, strict=True)):
        check_measure(graph, f"assumption {k} is met again and again", met, (), measure)
    check_measure(graph, "a goal is missed for ever", there, goals, last)


def check_measure(graph: Strategy, what: str, met: str, excuses: Sequence[str], given: Any) -> None:
    """Refuse unless each infinite path meets the goal for ever, or one of the ``excuses`` never
    again from some point on. ``met`` and each excuse: a digit an edge, 0 where they are missed
    (and - on edges that no path in question takes).

    A measure gives each node a number n and perhaps an excuse a. On each edge that does not meet
    the goal n falls; or n and a stay the same, and a is not met on this edge. Why that is enough:
    take a path that does not meet the goal any more. Its n never rises, and there are no more
    numbers than nodes, so from some point on it stays. From there on a stays as well, and is not
    met.
    """
    numbers, which = given["n"], given["a"]
    good = min(numbers, default=0) >= 0 and all(a is None or 0 <= a < len(excuses) for a in which)
    require(good, f"{what}: the measure has a number below 0 or names an excuse that is not there")
    for edge, (source, target) in enumerate(graph.pairs()):
        if met[edge] != "0" or numbers[target] < numbers[source]:
            continue
        excuse = which[source]
        same = numbers[target] == numbers[source] and excuse == which[target]
        if not same or excuse is None or excuses[excuse][edge] != "0":
            falls = f"the measure does not fall from node {source} to node {target}"
            raise RefusedError(f"{what}: {falls}")


# ---------------------------------------------------------------- the world

Pose = tuple[int, str | None]  # a region, and the heading of robots that have one


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
        (row, col), (row_b, col_b), touched = divmod(a, self.cols), divmod(b, self.cols), set()
        down, right = row_b - row, col_b - col
        if radius is not None and down * down + right * right > radius * radius:
            return False
        rows, cols = ({*range(min(0, far), max(0, far) + 1)} for far in (down, right))
        for r, c in product(rows, cols):
            region = (row + r) * self.cols + col + c
            apart = 2 * abs(down * c - right * r)  # twice the distance, times the length
            free = region in self.free and (region not in closed or region in (a, b))
            if not free and apart < abs(down) + abs(right):
                return False
            if not free and apart == abs(down) + abs(right):
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


# An objective is data: {kind: value}, with targets, or for the kind ``ltl`` with formulas.


def targets_of(objective: Json) -> list[frozenset[int]]:
    """The targets of an objective: sets of regions of which any one counts."""
    ((kind, value),) = objective.items()
    listed = [value] if kind == "hold" else value if kind != "ltl" else []
    return [frozenset([t] if isinstance(t, int) else t) for t in listed]


def is_ordered(objective: Json) -> bool:
    return "patrol" in objective or "visit" in objective


def formulas_of(objective: Json, part: str) -> list[Clause]:
    """The objective's own formulas: ``init``, ``safety`` or ``liveness``."""
    found = objective.get("ltl", {}).get(part, ())
    return [read_clause(text) for text in ([found] if isinstance(found, str) else found)]


def same_objective(given: Json, wanted: Json) -> bool:
    """Whether an objective is the wanted one, or asks for its targets in turn."""
    return given == wanted or ("patrol" in wanted and given == {"visit": wanted["patrol"]})


def in_words(objective: Json) -> str:
    ((kind, value),) = objective.items()
    return f"{kind} {json.dumps(value)}"


# ---------------------------------------------------------------- scenario -> strategy

# Digits of edges, 1 where something is met, 0 where it is missed, - where no run goes: of nothing,
# of each wish, of each assumption.
Digits = tuple[str, list[str], list[str]]
Condition = Callable[[int, Json], object]  # of a step from a region, and what is observed then


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
        listed = line.get("places_from") or ()  # from where, if not from everywhere
        self.places_from = [
            (p["places"], p.get("memory") or {}, poses_of(p["from"], robot["mobility"]))
            for p in listed
        ]
        self.sight_closed = frozenset(line.get("sight_closed") or ())
        # What is known of another robot is a region, or a belief: a set of cells, numbered from
        # the number of regions on.
        self.cells = [frozenset(cell) for cell in cells or ()]
        listed = (line.get("beliefs") or {}).items()
        self.beliefs = {name: [frozenset(belief) for belief in known] for name, known in listed}
        self.knowledge: dict[str, int] = {
            name: self._number(name, frozenset(known)) if isinstance(known, list) else known
            for name, known in (line.get("knowledge") or {}).items()
        }
        self.nearby = robot["tracking"] == "nearby"
        self.tracked = [] if self.nearby else list(self.knowledge)
        self.positions = {f"at_{name}": self.knowledge[name] for name in self.tracked}
        self._read_nodes()
        self._read_formulas()
        goals = range(len(self.recurring) or len(self.targets))
        self.wishes = ["the next target"] if self.ordered else [f"goal {k}" for k in goals]
        self.wishes += ["the place that it is sent to"] if self.places is not None else []
        self.assumptions = self._assumptions(line["fairness"])

    def _read_nodes(self) -> None:
        graph, turns = self.graph, self.robot["mobility"] == "heading"
        self.inputs = list(graph.spec.inputs)
        self.values = [graph.values(node) for node in range(graph.count)]
        headings = (HEADINGS[values["heading"]] if turns else None for values in self.values)
        self.poses: list[Pose] = [*zip(graph.columns["region"], headings, strict=True)]
        self.remembered = [max((v.get(m, 0) for m in self.memory), default=0) for v in self.values]
        self.of_pose: dict[Pose, set[int]] = {}  # the nodes that a run can come to, by their pose
        self._expected: dict[Any, frozenset[Row]] = {}
        self._facts: dict[Any, str] = {}

    def _read_formulas(self) -> None:
        """The objective's own formulas: on edges, those that are to hold always and the digits of
        those that are to hold again and again."""
        declared = self.objective.get("ltl", {}).get("memory", {})
        for name, bounds in declared.items():
            values, known = [0, 1] if bounds == "bool" else [*bounds], self.graph.spec.outputs[name]
            same = [known.least, known.most] == values
            require(same, "the memory of the objective is not that of the strategy")
        self.own = list(declared)
        parts = (formulas_of(self.objective, part) for part in ("init", "safety", "liveness"))
        self.init, self.safety, liveness = parts
        cases = self.graph.edge_cases() if self.kind == "ltl" else None
        self.always = cases.digits(*self.safety) if cases else ""
        self.recurring = [cases.digits(clause) for clause in liveness] if cases else []

    # what can be observed

    def expected(self, node: int) -> frozenset[Row]:
        """All inputs that can occur after a node."""
        pose, values = self.poses[node], self.values[node]
        told = [values[name] for name in TOLD] if self.places is not None else []
        known = [*self.own, *(f"at_{name}" for name in self.tracked)]
        key = (pose, *told, *(values[name] for name in known))
        if key not in self._expected:
            groups = list(self._groups(pose, values))
            names = [name for group, _ in groups for name in group]
            require(names == self.inputs, f"the inputs are {self.inputs}, but should be {names}")
            rows = product(*(after for _, after in groups))
            self._expected[key] = frozenset(tuple(chain(*row)) for row in rows)
        return self._expected[key]

    def _groups(self, pose: Pose, values: Json) -> Iterator[tuple[list[str], Iterable[Row]]]:
        """Inputs that do not depend on each other, with the values that can occur."""
        region = pose[0]
        if self.places is not None:
            again = values["request"] and not values["wait"]
            places = {values["assigned"]} if again else self.places
            rows = [(1, 0, place) for place in places if self.is_sent(pose, values, place)]
            rows += [(*told, self.line["neutral"]) for told in ((0, 0), (0, 1), (1, 1))]
            yield [*TOLD], rows
        if self.nearby and self.moving:
            sides = self.world.sides
            open_ = [side for side in sides if self.world.step(region, side) is not None]
            counts = range(min(len(open_), len(self.moving)) + 1)
            some = chain(*(combinations(open_, count) for count in counts))
            busy = [tuple(int(side in taken) for side in sides) for taken in some]
            yield [f"busy_{side}" for side in sides], busy
        for name in self.tracked:
            after = self.after(name, region, values[f"at_{name}"])
            yield [f"at_{name}"], [(value,) for value in after]

    def is_sent(self, pose: Pose, values: Json, place: int) -> bool:
        """Whether the robot may be sent to a place from a pose, with what it remembers."""
        ways = [(known, poses) for to, known, poses in self.places_from if place in to]
        here = (known for known, poses in ways if pose in poses)
        return not ways or any(known.items() <= values.items() for known in here)

    def after(self, name: str, region: int, value: int) -> set[int]:
        """What may be known of another robot next, if ``value`` is known of it now. The other one
        stays or steps, not onto this robot if they are in conflict; then this robot looks."""
        reach = self.world.around(self.whereabouts(name, value))
        reach -= {region} if name in self.moving else set()
        seen = {r for r in reach if self.sees(region, r)}
        hidden = frozenset(k for k, cell in enumerate(self.cells) if cell & (reach - seen))
        return seen | ({self._number(name, hidden)} if seen != reach else set())

    def sees(self, here: int, there: int) -> bool:
        radius, closed = self.robot.get("vision"), self.sight_closed
        return self.robot["tracking"] == "exact" or self.world.sees(here, there, radius, closed)

    def _number(self, name: str, belief: frozenset[int]) -> int:
        known = self.beliefs.get(name, ())
        require(belief in known, f"no input says that {name} may be in the cells {sorted(belief)}")
        return self.world.size + known.index(belief)

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """The regions where another robot may be if that is known of it."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

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
        held = self.kind == "hold" and here[0] in self.targets[0] and not seen.get("request")
        if held or (self.places is not None and seen["wait"]):
            moves = {here}
        shut = self.taken(here[0], seen) | self.closed
        if self.kind == "patrol":
            shut |= self.targets[1 - awaited]  # the one whose turn it is not
        return {pose for pose in moves if pose[0] not in shut} - self.forbidden

    def _met(self, awaited: int, node: int, edge: int) -> list[bool]:
        """Which wishes are met by a step into a node while a target is awaited. While the robot is
        sent somewhere its own goals can wait."""
        region, values = self.poses[node][0], self.values[node]
        met = [region in target for target in self.targets]
        if self.ordered:
            met = [met[awaited]]
        elif self.recurring:
            met = [digits[edge] == "1" for digits in self.recurring]
        if self.places is None:
            return met
        sent = bool(values["request"])
        there = not sent or bool(values["wait"]) or values["assigned"] == region
        return [*(sent or goal for goal in met), there]

    def _assumptions(self, fairness: str) -> list[Condition]:
        """What is assumed to be so again and again, at a step from a region with what is observed
        then. What is only believed counts if it may be so. While the robot must stay where it is,
        which is assumed to end, it does not help what the others do."""
        near, size = self.world.around, self.world.size

        def may_be(name: str, aim: Iterable[int]) -> Condition:
            return lambda _, seen: self.whereabouts(name, seen[f"at_{name}"]).intersection(aim)

        def unseen(name: str) -> Condition:
            return lambda _, seen: seen[f"at_{name}"] >= size

        found: list[Condition] = [lambda *_: True] if self.places is not None else []
        if fairness == "out_of_my_way":
            found.append(lambda region, seen: not near([region]) & self.taken(region, seen))
        for name in self.moving:
            if fairness == "out_of_my_sight" and self.beliefs.get(name):
                found.append(unseen(name))
            if fairness == "off_my_targets":
                found += [may_be(name, {*range(size)} - target) for target in self.targets]
            if fairness == "at_its_targets":
                aims = targets_of({"visit": self.line["others_targets"][name]})
                found += [may_be(name, aim) for aim in aims]
        return found

    def explore(self, starts: Iterable[int], judge: Callable[[int], None]) -> Digits:
        """The edges that runs from the start nodes can take, and where wishes and assumptions are
        met on them. ``judge`` is asked about each node."""
        graph, count = self.graph, len(self.wishes)
        total = count + len(self.assumptions)
        rows = ["-" * (total + 1)] * graph.size
        seen = dict.fromkeys(graph.first[node] for node in starts)
        queue = list(seen)
        for source in queue:
            judge(source)
            region, awaited = self.poses[source][0], self.awaited(source)
            self.of_pose.setdefault(self.poses[source], set()).add(source)
            for edge, target in enumerate(graph.next[source], graph.offset[source]):
                said = f"the edge from node {source} to {target}"
                require(self.always[edge : edge + 1] != "0", f"{said} breaks the objective")
                same = not self.ordered or self.remembered[target] == awaited
                require(same, f"node {target} forgets whose turn it is: target {awaited}")
                key = (region, awaited, target, edge if self.recurring else 0)
                if key not in self._facts:
                    values = self.values[target]
                    stays = self.places is not None and values["wait"]
                    holds = (not stays and assumed(region, values) for assumed in self.assumptions)
                    truths = (*self._met(awaited, target, edge), *holds, False)
                    self._facts[key] = "".join("01"[bool(truth)] for truth in truths)
                rows[edge] = self._facts[key]
                if (first := graph.first[target]) not in seen:
                    seen[first] = None
                    queue.append(first)
        digits = ["".join(map(operator.itemgetter(k), rows)) for k in range(total + 1)]
        return digits[total], digits[:count], digits[count:total]

    def explore_strategy(self, start: int) -> Digits:
        """Refuse unless every run of the strategy from ``start`` keeps the scenario's rules. That
        none misses a wish for ever is for measures to show, of the digits that this returns."""
        values, graph, inputs = self.values[start], self.graph, self.graph.inputs
        known = named_coordinates(self.pose) | self.memory | self.positions
        for name, value in known.items():
            given = values.get(name)
            require(given == value, f"it begins with {name} = {given}, not {value}")
        begun = not self.own or self._memory(start) in self._openings()
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

    def explore_counterstrategy(self, proof: Json) -> Digits:
        """Refuse unless no way to keep the scenario's rules can be kept against it: each chosen
        input can occur, and each move that the rules leave has a successor. Measures have to show,
        of the digits that this returns, that endless runs meet every assumption again and again
        and miss a wish for ever."""
        graph, start, chosen = self.graph, tuple(proof["start"]), proof["chosen"]
        told = {"assigned": self.line["neutral"]} if self.places is not None else {}
        first = dict.fromkeys(self.inputs, 0) | told | self.positions
        known = start == tuple(first.values())
        require(known, "the initial input is not what the robot knows at the start")
        begin = [node for node in graph.of_input(start) if self.poses[node] == self.pose]
        listed = self._openings() <= {self._memory(node) for node in begin}
        require(listed, "not all ways to begin have a node")

        def judge(node: int) -> None:
            row, here, own = tuple(chosen[node]), self.poses[node], self._memory(node)
            can = row in self.expected(node)
            require(can, f"the input chosen in node {node} cannot occur")
            answers = {(self.poses[after], self._memory(after)) for after in graph.next[node]}
            now = dict(zip(self.own, own, strict=True))
            seen = dict(zip(self.inputs, row, strict=True))
            for pose in self.legal(here, self.awaited(node), seen):
                known = now | self._step(here, pose)
                ways = self._ways(primed(self.own), self.safety, known)
                missing = {(pose, way) for way in ways} - answers
                require(not missing, f"in node {node} the robot could go on to {missing}")

        return self.explore(begin, judge)

    # the memory of an objective in formulas

    def _memory(self, node: int) -> Row:
        return tuple(self.values[node][name] for name in self.own)

    def _ways(self, wanted: Keys, clauses: Clauses, known: Mapping[Key, int]) -> set[Row]:
        """The values of the memory, now or next, that formulas allow."""
        if not wanted and not clauses:
            return {()}
        rows, variables = [tuple(known.values())], self.graph.spec.variables
        return {row for _, row in complete(variables, wanted, clauses, list(known), rows)}

    def _openings(self) -> set[Row]:
        """The values of the memory to begin with."""
        if self.memory:
            return {tuple(self.memory[name] for name in self.own)}
        return self._ways(self.own, self.init, named_coordinates(self.pose))

    def _step(self, before: Pose, after: Pose) -> dict[Key, int]:
        later = {f"{name}'": value for name, value in named_coordinates(after).items()}
        return named_coordinates(before) | later

    def follows(self, objective: Json, before: Pose, after: Pose) -> bool:
        """Whether an objective's own safety lines allow a step, for some values of the memory
        (lines about a memory that this strategy does not have are left out)."""
        wanted, step = [*self.own, *primed(self.own)], self._step(before, after)
        lines = formulas_of(objective, "safety")
        clauses = [line for line in lines if line.reads <= {*step, *wanted}]
        return bool(self._ways(wanted, clauses, step))

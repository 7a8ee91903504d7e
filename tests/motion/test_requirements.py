"""Robustness of requirements on the motion, against its definition.

The oracle evaluates the definition of each operator at every point of a fine grid, without windows
that slide, tables or samples at jumps. rtamt would be another, but its antlr4 4.7 does not start
with Python 3.13.
"""

import math
import os
import random
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from safenav.stl import syntax as stl
from safenav.stl.robustness import robustness

FORMULAS = int(os.environ.get("SAFENAV_FUZZ", "150"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_SEED", "0"))

Array = NDArray[np.float64]


class Made(Struct, frozen=True):
    """Signals ``x(r0)``, ``x(r1)``: lines between ``values`` at the times 0, 1, 2, ...; events."""

    values: tuple[tuple[float, ...], ...]
    events: tuple[tuple[float, ...], ...]
    finished: bool = True
    rate: float = 1.0

    @property
    def end(self) -> float:
        return float(len(self.values[0]) - 1)

    def signal(self, which: stl.RobotSignal, times: Array) -> tuple[Array, float]:
        row = np.array(self.values[int(which.robots[0][1:])])
        slope = float(np.max(np.abs(np.diff(row)), initial=0.0))
        return np.interp(times, np.arange(len(row)), row), slope

    def instants(self, event: stl.Happens) -> tuple[float, ...]:
        return self.events[int(event.obstacle[1:])]


def made(chance: random.Random, length: int = 9, finished: bool = True) -> Made:
    values = tuple(tuple(chance.randint(-5, 5) for _ in range(length)) for _ in range(2))
    moments = [n / 2 for n in range(2 * length - 1)]
    return Made(values, tuple(tuple(chance.sample(moments, 2)) for _ in range(2)), finished)


def formula(chance: random.Random, depth: int, step: float, events: bool) -> stl.Requirement:
    """A formula whose windows end at multiples of ``step``. Without events it jumps only at such
    instants, and not just beside them, where a grid has no point: no until, no inner windows that
    begin later than now."""
    if depth == 0:
        if events and chance.random() < 0.5:
            return stl.Happens("requested", f"o{chance.randrange(2)}")
        signal = stl.RobotSignal("x", (f"r{chance.randrange(2)}",))
        return stl.Margin(
            stl.Arithmetic(chance.choice("+-"), signal, stl.Literal(chance.randint(-3, 3)))
        )

    def below() -> stl.Requirement:
        return formula(chance, chance.randrange(depth), step, events)

    begin = step * chance.randrange(4) if events or depth == 3 else 0.0
    end = math.inf if chance.random() < 0.2 else begin + step * chance.randrange(5)
    window = stl.Window(begin, end)
    kind = chance.choice((0, 1, 2, 3) if events else (0, 1, 3))
    if kind == 0:
        return stl.Compound("not", (below(),))
    if kind == 1:
        return stl.Compound(chance.choice(("and", "or")), (below(), below()))
    if kind == 2:
        return stl.Compound("until", (below(), below()), window)
    return stl.Compound(chance.choice(("always", "eventually")), (below(),), window)


def defined(
    tree: stl.Requirement, record: Made, grid: float
) -> Callable[[float], tuple[float, float]]:
    """[low, high] of a formula at a time, by definition over the points 0, grid, 2 grid, ..."""
    points = [n * grid for n in range(round(record.end / grid) + 1)]
    end = points[-1]

    def term(node: stl.Node, t: float) -> float:
        match node:
            case stl.Literal(value):
                return value
            case stl.RobotSignal():
                return float(record.signal(node, np.array([t]))[0][0])
            case stl.Arithmetic(operator, left, right):
                a, b = term(left, t), term(right, t)
                return a + b if operator == "+" else a - b
        raise AssertionError(node)

    def reach(window: stl.Window, t: float) -> tuple[list[float], bool]:
        """The points in the window, and whether it continues after the record."""
        inside = [p for p in points if window.begin <= p - t <= window.end]
        unknown = not record.finished if window.end == math.inf else t + window.end > end
        return inside, unknown

    @cache
    def at(node: stl.Requirement, t: float) -> tuple[float, float]:
        match node:
            case stl.Margin(inner):
                return (term(inner, t),) * 2
            case stl.Happens():
                return (1.0 if t in record.instants(node) else -1.0,) * 2
            case stl.Compound("not", (operand,)):
                low, high = at(operand, t)
                return -high, -low
            case stl.Compound("and" | "or" as operator, (left, right)):
                pick = min if operator == "and" else max
                return tuple(map(pick, at(left, t), at(right, t)))  # type: ignore[return-value]
            case stl.Compound("always", (operand,), window):
                inside, unknown = reach(window, t)
                found = [at(operand, p) for p in inside]
                high = min((high for _, high in found), default=math.inf)
                low = min((low for low, _ in found), default=math.inf)
                return (-math.inf if unknown else low), high
            case stl.Compound("eventually", (operand,), window):
                dual = stl.Compound("always", (stl.Compound("not", (operand,)),), window)
                return at(stl.Compound("not", (dual,)), t)
            case stl.Compound("until", (left, right), window):
                inside, unknown = reach(window, t)
                bounds = []
                for side in (0, 1):
                    best = -math.inf
                    for p in inside:
                        between = [q for q in points if t <= q < p]
                        held = min((at(left, q)[side] for q in between), default=math.inf)
                        best = max(best, min(held, at(right, p)[side]))
                    bounds.append(best)
                if unknown:
                    rest = min(at(left, q)[1] for q in points if q >= t)
                    bounds[1] = max(bounds[1], rest)
                return bounds[0], bounds[1]
        raise AssertionError(node)

    return lambda t: at(tree, t)


def slack(tree: stl.Node, record: Made, grid: float) -> float:
    """By how much the oracle's grid can be wrong: each temporal operator misses less than one
    step of the steepest signal."""
    if not isinstance(tree, stl.Compound):
        return 0.0
    missed = 0.0 if tree.operator in ("not", "and", "or") else 10 * grid
    return max(slack(operand, record, grid) for operand in tree.operands) + missed


def sharp(chance: random.Random) -> stl.Requirement:
    """A formula whose value by definition over quarters of seconds is exact: until of events, or
    one temporal operator over one signal."""
    words = ("always", "eventually")

    def window(begins: int, lasts: int, least: float = 0.0) -> stl.Window:
        begin = 0.5 * chance.randrange(begins)
        return stl.Window(begin, begin + least + 0.5 * chance.randrange(lasts))

    def event() -> stl.Requirement:
        found: stl.Requirement = stl.Happens("requested", f"o{chance.randrange(2)}")
        if chance.random() < 0.5:
            found = stl.Compound(chance.choice(words), (found,), window(3, 5, 1.0))
        return stl.Compound("not", (found,)) if chance.random() < 0.6 else found

    signal = stl.Margin(stl.RobotSignal("x", (f"r{chance.randrange(2)}",)))
    over = (
        window(6, 6) if chance.random() < 0.8 else stl.Window(0.5 * chance.randrange(6), math.inf)
    )
    match chance.randrange(4):
        case 0:
            return stl.Compound("until", (event(), event()), over)
        case 1:
            inner = stl.Compound("until", (event(), event()), over)
            return stl.Compound(chance.choice(words), (inner,), window(3, 4, 1.0))
        case 2:
            return stl.Compound("until", (stl.Margin(stl.Literal(50.0)), signal), over)
    return stl.Compound(chance.choice(words), (signal,), over)


def exact(tree: stl.Requirement, record: Made, grid: float) -> None:
    """Compare each second; only the microseconds around jumps may differ."""
    (times, found), oracle = robustness(tree, record), defined(tree, record, grid)
    for t in range(int(record.end) + 1):
        k = int(np.searchsorted(times, t - 1e-9))
        assert (found.low[k], found.high[k]) == pytest.approx(oracle(t), abs=1e-4), (tree, t)


@pytest.mark.parametrize("seed", range(FIRST, FIRST + FORMULAS, 10))
def test_robustness_agrees_with_its_definition(seed: int) -> None:
    for number in range(10):
        chance = random.Random(1000 * seed + number)
        record = made(chance, finished=chance.random() < 0.5)
        exact(formula(chance, 3, 1.0, events=False), record, 1.0)
        # Events and windows between samples: the verdict may not contradict the definition.
        tree = formula(chance, 3, 0.5, events=True)
        _, found = robustness(tree, record)
        low, high = defined(tree, record, 0.25)(0.0)
        allowed = found.error + slack(tree, record, 0.25) + 1e-4
        for ours, theirs in ((found.low[0], low), (found.high[0], high)):
            assert ours == theirs or abs(ours - theirs) <= allowed, tree
        # Events alone are exact: no grid is too coarse for them.
        if not any(isinstance(node, stl.Margin) for node in stl.nodes(tree)):
            assert found.error == 0
            assert (found.low[0], found.high[0]) == pytest.approx((low, high), abs=1e-6), tree


@pytest.mark.parametrize("seed", range(FIRST, FIRST + FORMULAS, 10))
def test_ends_of_windows_and_instants_of_events_are_exact(seed: int) -> None:
    for number in range(15):
        chance = random.Random(90_000 * (seed + 1) + number)
        exact(sharp(chance), made(chance, finished=chance.random() < 0.5), 0.25)


@pytest.mark.parametrize("seed", range(FIRST, FIRST + FORMULAS, 10))
def test_the_interval_contains_the_robustness_of_every_continuation(seed: int) -> None:
    for number in range(5):
        chance = random.Random(7000 * (seed + 1) + number)
        whole = made(chance, length=14)
        part = Made(
            tuple(row[:7] for row in whole.values),
            tuple(tuple(t for t in row if t <= 6) for row in whole.events),
            finished=False,
        )
        tree = formula(chance, 3, 1.0, events=True)
        (_, found), (_, later) = robustness(tree, part), robustness(tree, whole)
        error = found.error + later.error + 1e-4
        assert found.low[0] - error <= later.low[0], tree
        assert later.high[0] <= found.high[0] + error, tree


@pytest.mark.parametrize("seed", range(20))
def test_coarse_samples_err_by_at_most_their_bound(seed: int) -> None:
    for number in range(8):
        chance = random.Random(100 * seed + number)
        tree, record = formula(chance, 3, 0.7, events=True), made(chance, length=21)
        fine, coarse = (robustness(tree, replace(record, rate=rate))[1] for rate in (30.0, 0.7))
        for ours, theirs in ((coarse.low[0], fine.low[0]), (coarse.high[0], fine.high[0])):
            assert ours == theirs or abs(ours - theirs) <= coarse.error + fine.error + 1e-4, tree

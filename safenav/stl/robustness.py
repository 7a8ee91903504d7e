"""Robustness of signal temporal logic over sampled signals, as intervals with an error bound.

The semantics is the quantitative one of Donzé and Maler (FORMATS 2010): signals are linear between
samples, and a condition holds by a margin. Windows end at their exact times, not at samples. Events
are spikes of two microseconds at their instants, and each instant at which they can make a formula
jump is a sample. The future after the record is unknown, so each value is an interval [low, high].
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.stl import syntax

Array = NDArray[np.float64]

SPIKE = 1e-6
"""Half the duration of an event, in seconds."""

MOST_SAMPLES = 400_000
_NEAR = 1e-9


class Recording(Protocol):
    """The signals of a motion from 0 to ``end`` (seconds), with ``rate`` samples per second.
    ``finished``: whether the run, and so unbounded windows, end at ``end``."""

    end: float
    rate: float
    finished: bool

    def signal(self, which: syntax.RobotSignal, times: Array) -> tuple[Array, float]:
        """Return a signal's values at given times, and a bound of their change per second."""

    def instants(self, event: syntax.Happens) -> tuple[float, ...]:
        """Return the times at which an event occurs."""


class Robustness(Struct, frozen=True):
    """The robustness at given times: between ``low`` and ``high``, each up to the sampling
    ``error``. ``slope``: a bound of its change per second."""

    low: Array
    high: Array
    error: float
    slope: float


def robustness(formula: syntax.Requirement, recording: Recording) -> tuple[Array, Robustness]:
    """Return the times of all samples of a recording and the robustness of a formula at each.
    Raises UsageError if the rate, events and windows need more than MOST_SAMPLES."""
    count = int(np.floor(recording.end * recording.rate + _NEAR)) + 1
    # Parts are evaluated at samples, so all their jumps are samples.
    jumps = np.array(sorted({t for part in syntax.nodes(formula) for t in _jumps(part, recording)}))
    around = np.concatenate([jumps - SPIKE, jumps, jumps + SPIKE])
    inside = around[(around >= 0) & (around <= recording.end)]
    if count + len(inside) > MOST_SAMPLES:
        raise UsageError(f"the formula needs more than {MOST_SAMPLES} samples\n    lower --rate")
    grid = np.arange(count) / recording.rate
    times = np.unique(np.concatenate([grid, [recording.end], inside]))
    return times, _Evaluation(recording, times).of(formula)


def _jumps(tree: syntax.Node, recording: Recording) -> set[float]:
    """Return the instants at which a formula's value can jump: those of its events, shifted by the
    windows around them, and those from which windows reach the ends of the record."""
    match tree:
        case syntax.Happens():
            return set(recording.instants(tree))
        case syntax.Compound(operator, operands, window) if operator not in ("not", "and", "or"):
            inner = {
                moment for child in syntax.children(tree) for moment in _jumps(child, recording)
            }
            ends = [end for end in (window.begin, window.end) if end < np.inf]
            moved = {moment - end for moment in {*inner, recording.end} for end in ends}
            kept = {t for t in moved if -SPIKE <= t <= recording.end + SPIKE}
            return kept | inner if len(operands) == 2 else kept
        case _:
            return {t for child in syntax.children(tree) for t in _jumps(child, recording)}


class _Evaluation:
    def __init__(self, recording: Recording, times: Array) -> None:
        self._recording = recording
        self._times = times
        self._gap = float(np.max(np.diff(times), initial=0.0))

    def of(self, tree: syntax.Requirement) -> Robustness:
        match tree:
            case syntax.Margin(term):
                values, slope = self._term(term)
                return Robustness(values, values, 0.0, slope)
            case syntax.Happens():
                values = np.full(len(self._times), -1.0)
                for instant in self._recording.instants(tree):
                    values[np.abs(self._times - instant) < SPIKE / 2] = 1.0
                return Robustness(values, values, 0.0, 0.0)
            case syntax.Compound("not", (operand,)):
                inner = self.of(operand)
                return Robustness(-inner.high, -inner.low, inner.error, inner.slope)
            case syntax.Compound("or" | "eventually" as operator, operands, window):
                dual = "and" if operator == "or" else "always"
                negated = tuple(syntax.Compound("not", (part,)) for part in operands)
                return self.of(syntax.Compound("not", (syntax.Compound(dual, negated, window),)))
            case syntax.Compound("and", (left, right)):
                one, other = self.of(left), self.of(right)
                low, high = np.minimum(one.low, other.low), np.minimum(one.high, other.high)
                return Robustness(
                    low, high, max(one.error, other.error), max(one.slope, other.slope)
                )
            case syntax.Compound("always", (operand,), window):
                inner = self.of(operand)
                low, high = self._least(inner.low, window), self._least(inner.high, window)
                low[self._behind(window)] = -np.inf
                return Robustness(low, high, inner.error + inner.slope * self._gap / 2, inner.slope)
            case syntax.Compound("until", (left, right), window):
                return self._until(window, self.of(left), self.of(right))
        raise AssertionError(tree)

    def _term(self, tree: syntax.Node) -> tuple[Array, float]:
        match tree:
            case syntax.Literal(value):
                return np.full(len(self._times), value), 0.0
            case syntax.RobotSignal():
                return self._recording.signal(tree, self._times)
            case syntax.Arithmetic(operator, left, right):
                (a, slope), (b, other) = self._term(left), self._term(right)
                if operator == "*":
                    most = [float(np.max(np.abs(values), initial=0.0)) for values in (a, b)]
                    return a * b, slope * most[1] + other * most[0]
                return (a + b if operator == "+" else a - b), slope + other
        raise AssertionError(tree)

    def _behind(self, window: syntax.Window) -> NDArray[np.bool_]:
        """Return, for each sample, whether its window extends past the end of the record."""
        if window.end == np.inf:
            return np.full(len(self._times), not self._recording.finished)
        behind: NDArray[np.bool_] = self._times + window.end > self._times[-1] + _NEAR
        return behind

    def _least(self, values: Array, window: syntax.Window) -> Array:
        """Return the minimum over the recorded part of each sample's window; +inf if that is
        empty."""
        times = self._times
        begin, end, first, last = _bounds(times, window)
        found = _least_of(values, first, last)
        for edge in (begin, end):
            inside = (edge <= times[-1]) & (begin <= end)
            at = _between(times, values, edge[inside])
            found[inside] = np.minimum(found[inside], at)
        return found

    def _until(self, window: syntax.Window, left: Robustness, right: Robustness) -> Robustness:
        low = self._reached(left.low, right.low, window)
        high = self._reached(left.high, right.high, window)
        behind = self._behind(window)  # `right` may hold past the record if `left` holds to its end
        rest = np.minimum.accumulate(left.high[::-1])[::-1]
        high[behind] = np.maximum(high[behind], rest[behind])
        slope = max(left.slope, right.slope)
        error = max(left.error, right.error) + slope * self._gap
        return Robustness(low, high, error, slope)

    def _reached(self, holds: Array, then: Array, window: syntax.Window) -> Array:
        """Return, for each window, the maximum over its instants t' of the lesser of ``then`` at t'
        and the minimum of ``holds`` before t'."""
        times = self._times
        begin, end, first, last = _bounds(times, window)
        at_begin, at_end = (
            _between(times, then, np.minimum(edge, times[-1])) for edge in (begin, end)
        )
        here = np.arange(len(times))
        before, up_to_end = (_least_of(holds, here, until) for until in (first - 1, last))
        inside = _folded(np.array([holds, then]), _joined, first, last)[1]
        found = np.minimum(before, at_begin)
        later = np.maximum(np.minimum(before, inside), np.minimum(up_to_end, at_end))
        found = np.where(last >= first, np.maximum(found, later), found)
        return np.where(begin > end, -np.inf, found)


def _bounds(
    times: Array, window: syntax.Window
) -> tuple[Array, Array, NDArray[np.intp], NDArray[np.intp]]:
    """Return, for each sample's window, the start, the end (at most the end of the record), and the
    indices of its first and last sample. If no part of it is recorded, the start is later than the
    end."""
    begin, end = times + window.begin, np.minimum(times + window.end, times[-1])
    begin = np.where((begin > end) & (begin <= end + _NEAR), end, begin)
    first = np.searchsorted(times, begin, "left")
    return begin, end, first, np.searchsorted(times, end, "right") - 1


def _least_of(values: Array, first: NDArray[np.intp], last: NDArray[np.intp]) -> Array:
    """Return, for each pair of indices, the minimum of values[first..last] (+inf: none)."""
    least: Array = _folded(values[None], np.minimum, first, last)[0]
    return np.where(last >= first, least, np.inf)


def _joined(left: Array, right: Array) -> Array:
    """Return the join of two consecutive stretches. A stretch has two numbers, with ``holds`` and
    ``then`` as in ``_reached``: the minimum of ``holds``, and the reached value."""
    reached = np.maximum(left[1], np.minimum(left[0], right[1]))
    return np.array([np.minimum(left[0], right[0]), reached])


def _folded(
    row: Array,
    join: Callable[[Array, Array], Array],
    first: NDArray[np.intp],
    last: NDArray[np.intp],
) -> Array:
    """Return, for each pair (first, last), the columns first..last of ``row``, joined from two
    overlapping stretches of 1, 2, 4, ... columns. ``join`` must allow the overlap."""
    found = np.zeros((len(row), len(first)))
    level = np.frexp(np.maximum(last - first + 1, 0))[1] - 1
    for k in range(int(level.max(initial=-1)) + 1):
        width, chosen = 1 << k, np.flatnonzero(level == k)
        begins, ends = first[chosen], last[chosen] - width + 1
        found[:, chosen] = join(row[:, begins], row[:, ends])
        row = join(row[:, :-width], row[:, width:])
    return found


def _between(times: Array, values: Array, at: Array) -> Array:
    """Return interpolated values between samples. An infinite value fills the gaps beside it."""
    finite = np.interp(at, times, np.clip(values, -1e30, 1e30))
    return np.where(np.abs(finite) > 1e20, np.copysign(np.inf, finite), finite)

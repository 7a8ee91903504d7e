"""The requirements of a scenario, evaluated on the motion of a run (docs/motion.md)."""

from collections.abc import Mapping
from math import ceil, isfinite

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.formula.parser import FormulaError
from safenav.motion.columns import Columns, columns_at
from safenav.motion.file import Motion
from safenav.motion.timing import dated, paces_of
from safenav.scenario.yaml.findings import suggestion
from safenav.stl.robustness import robustness
from safenav.stl.syntax import Happens, Requirement, RobotSignal, nodes, parse_requirement
from safenav.trace.file import Trace
from safenav.trace.records import Request, Resolved

Array = NDArray[np.float64]

RATE = 50.0
"""Default number of samples per second."""

MOST_RATE = 10_000
FINISHED = ("completed", "operator_needed")
"""The outcomes after which unbounded windows end with the run."""

SATISFIED, VIOLATED, UNDECIDED = "satisfied", "violated", "undecided"


class Judgement(Struct, frozen=True):
    """The verdict on a requirement. Its initial robustness is between ``low`` and ``high``, each up
    to the sampling error ``error``. ``advice``: the remedy for an undecided verdict."""

    name: str
    formula: str
    verdict: str
    low: float
    high: float
    error: float
    advice: str = ""

    def data(self) -> dict[str, object]:
        """Return the verdict as JSON data, with None for an infinite bound."""
        bounds = [value if isfinite(value) else None for value in (self.low, self.high)]
        data: dict[str, object] = {"name": self.name, "formula": self.formula}
        data |= {"verdict": self.verdict, "robustness": bounds, "error": self.error}
        return data | ({"advice": self.advice} if self.advice else {})

    @property
    def complaint(self) -> str:
        """The error in a sentence; empty if the requirement is satisfied."""
        return "" if self.verdict == SATISFIED else f"requirement {self}"

    def __str__(self) -> str:
        if self.low == self.high:
            value = f"robustness {self.low:z.3f}"
        else:
            value = f"robustness between {self.low:z.3f} and {self.high:z.3f}"
        label = self.formula if self.name == self.formula else f"{self.name}: {self.formula}"
        error = f" +- {self.error:.3f}" if self.error else ""
        advice = f"; {self.advice}" if self.advice else ""
        return f"{label}: {self.verdict} ({value}{error}){advice}"


class MotionRecording:
    """The signals of a motion and its trace."""

    def __init__(self, motion: Motion, trace: Trace, rate: float = RATE) -> None:
        self.rate = rate
        self.end = motion.outcome.makespan
        outcome = trace.outcome
        self.finished = outcome is not None and outcome.outcome in FINISHED
        self._motion = motion
        self._events = _events(motion, trace)
        listed = {each.name for each in trace.header.scenario.obstacles}
        self.obstacles = frozenset(listed | {name for _, name in self._events})
        self._times: Array = np.zeros(0)
        self._bodies: dict[str, _Body] = {}
        """The bodies at the sampled times, shared by the signals of a formula."""

    @property
    def robots(self) -> Mapping[str, object]:
        return self._motion.header.robots

    def signal(self, which: RobotSignal, times: Array) -> tuple[Array, float]:
        """Return a signal's values at given times, and a bound of their change per second."""
        if times is not self._times:
            self._times, self._bodies = times, {}
        for robot in {*which.robots} - self._bodies.keys():
            self._bodies[robot] = _Body(columns_at(self._motion, robot, times), times)
        bodies = [self._bodies[robot] for robot in which.robots]
        first = bodies[0]
        match which.name:
            case "distance":
                apart = first.place - bodies[1].place
                return np.sqrt((apart**2).sum(axis=0)), sum(body.fastest for body in bodies)
            case "speed":
                return first.speed, first.pull
            case name:
                return first.place["xyz".index(_AXES[name])], first.fastest

    def instants(self, event: Happens) -> tuple[float, ...]:
        """Return the times at which an event occurs, in seconds of the motion."""
        return self._events.get((event.kind, event.obstacle), ())


_AXES = {"x": "x", "y": "y", "height": "z"}


class _Body:
    """The centre (3, times) and speed (times) of a body, and bounds of both changes."""

    def __init__(self, columns: Columns, times: Array) -> None:
        self.place = np.array([columns[axis] for axis in "xyz"])
        velocity = np.array([columns[f"vel_{axis}"] for axis in "xyz"])
        self.speed: Array = np.sqrt((velocity**2).sum(axis=0))
        gaps = np.diff(times)
        wide = gaps > 1e-5  # without the gaps around an event
        pulls = np.sqrt((np.diff(velocity)[:, wide] ** 2).sum(axis=0)) / gaps[wide]
        if "acc_x" in columns:
            given = np.array([columns[f"acc_{axis}"] for axis in "xyz"])
            pulls = np.append(pulls, np.sqrt((given**2).sum(axis=0)))
        self.pull = float(np.max(pulls, initial=0.0))
        gap = float(np.max(gaps, initial=0.0))
        self.fastest = float(np.max(self.speed, initial=0.0)) + self.pull * gap / 2


def _events(motion: Motion, trace: Trace) -> dict[tuple[str, str], tuple[float, ...]]:
    """Return the times of each kind of event of each obstacle, in seconds of the motion."""
    found: dict[tuple[str, str], set[float]] = {}
    for record in dated(trace, paces_of(trace, motion.header)):
        if isinstance(record, Request | Resolved) and record.t is not None:
            kind = "requested" if isinstance(record, Request) else "resolved"
            found.setdefault((kind, record.obstacle), set()).add(record.t)
    return {key: tuple(sorted(times)) for key, times in found.items()}


def judged(
    motion: Motion, trace: Trace, more: tuple[str, ...] = (), rate: float = RATE
) -> list[Judgement]:
    """Return the verdict on each requirement of a trace and on each of the formulas ``more``, named
    by its text. Raises UsageError for a formula that cannot be read or evaluated."""
    formulas = {**trace.header.scenario.requirements, **{text: text for text in more}}
    if not formulas:
        return []
    recording = MotionRecording(motion, trace, rate)
    return [_judged(recording, name, text) for name, text in formulas.items()]


def readable(recording: MotionRecording, text: str) -> Requirement:
    """Return the formula in a text about a motion's robots. Raises UsageError."""
    try:
        formula = parse_requirement(text)
    except FormulaError as error:
        raise UsageError(f"requirement '{text[:80]}': {error}") from error
    for node in nodes(formula):
        for robot in node.robots if isinstance(node, RobotSignal) else ():
            if robot not in recording.robots:
                known = ", ".join(recording.robots)
                found = f"requirement '{text[:80]}': '{robot}' is not a robot of this motion"
                raise UsageError(f"{found}\n    known: {known}")
        if isinstance(node, Happens) and node.obstacle not in recording.obstacles:
            found = f"requirement '{text[:80]}': there is no obstacle '{node.obstacle}'"
            hint = suggestion(node.obstacle, recording.obstacles) or "the scenario has no obstacles"
            raise UsageError(f"{found}\n    {hint}")
    return formula


def _judged(recording: MotionRecording, name: str, text: str) -> Judgement:
    _, found = robustness(readable(recording, text), recording)
    low, high, error = float(found.low[0]), float(found.high[0]), found.error
    verdict, advice = UNDECIDED, ""
    if low > error:
        verdict = SATISFIED
    elif high < -error:
        verdict = VIOLATED
    elif low < -error or high > error:
        advice = "its window extends past the end of the run"
    else:
        least, wanted = min(abs(low), abs(high)), recording.rate * error * 1.1
        near = wanted >= MOST_RATE * least
        rate = ", or change its bound a little" if near else f": --rate {ceil(wanted / least)}"
        advice = f"raise the sampling rate{rate}"
    return Judgement(name, text, verdict, low, high, error, advice)

"""Values of a run, at one moment or over time: knowledge, actions and words. Also the appearance of
each robot, the same in all pictures and pages."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import cycle, islice
from operator import itemgetter
from typing import TypeVar

from msgspec import Struct, field

from safenav.scenario.model import OPERATOR_ACTION
from safenav.trace import records
from safenav.world.map import Region

T = TypeVar("T")


class Changes(list[tuple[int, T]]):
    """A value over time, as pairs (tick, value) in order. Each value holds from its tick on. The
    last of several values of a tick counts."""

    @classmethod
    def of(cls, first: T) -> Changes[T]:
        """Return a history of one value that holds from the start."""
        return cls([(-1, first)])

    @property
    def now(self) -> T:
        """The present value: the last one."""
        return self[-1][1]

    def put(self, tick: int, value: T) -> None:
        """Add a value from a tick on, unless it equals the present one."""
        if value != self.now:
            self.append((tick, value))

    def after(self, tick: int) -> Iterator[tuple[int, T]]:
        """Yield the changes after a tick."""
        return islice(self, bisect_right(self, tick, key=itemgetter(0)), None)

    def at(self, tick: int) -> T:
        """Return the value after all events of a tick."""
        return self[max(0, bisect_right(self, tick, key=itemgetter(0)) - 1)][1]


class ObstacleStatus(StrEnum):
    """The team's knowledge of a hidden obstacle. ``ABSENT``: it has not appeared yet or has
    disappeared."""

    ABSENT = "absent"
    HIDDEN = "hidden"
    FOUND = "found"
    REQUESTED = "requested"
    RESOLVED = "resolved"
    BLOCKED = "blocked"

    @property
    def meaning(self) -> str:
        """A few words that explain the status, for legends."""
        longer = {"hidden": "still hidden", "requested": "help requested"}
        return longer.get(self.value, self.value)


class StoryKind(StrEnum):
    """The kinds of events; moves are not events."""

    SYNTHESIS = "synthesis"
    VIOLATION = "violation"
    REQUEST = "request"
    PUSH = "push"
    ACT = "act"
    """Used only in live runs; in lockstep an action takes no time."""
    RESOLVED = "resolved"
    BLOCKED = "blocked"
    POP = "pop"
    GOAL = "goal"
    ASSUMPTION = "assumption"
    APPEARED = "appeared"
    GONE = "gone"
    TRUTH = "truth"
    REOPENED = "reopened"
    WAITING = "waiting"
    """A wait for an operator; ``paused``: for a change of the scenario."""
    PAUSED = "paused"
    OPERATOR = "operator"
    FAILURE = "failure"
    DEADLINE = "deadline"
    """A deadline that is missed, or can no longer be met."""
    INPUTS = "inputs"
    OBJECTIVE = "objective"
    SERVICE = "service"
    PLAN = "plan"
    PLAN_END = "plan_end"
    OUTCOME = "outcome"
    NOTE = "note"
    """Used only while the run is read as it happens."""


class Event(Struct, frozen=True):
    """An event of a run. ``text`` describes it in scenario terms; ``robot``, ``region``: those that
    it concerns, if any; ``round``: the robot's round that a goal completes, or 0; ``synthesis``:
    the result of a synthesis."""

    tick: int
    kind: StoryKind
    text: str
    robot: str | None = None
    region: Region | None = None
    obstacle: str | None = None
    round: int = 0
    synthesis: records.Synthesis | None = None


class RobotBelief(Struct, frozen=True):
    """A robot's knowledge of another robot: ``seen`` in the only region of ``regions``, or believed
    to be in one of these."""

    seen: bool
    regions: frozenset[Region]


class RobotProgress(Struct, frozen=True):
    """A robot's progress with its present objective: rounds and the last reached target."""

    rounds: int = 0
    reached: Region | None = None


class Hidden(Struct):
    """A hidden obstacle and its history. ``actions``: the action of each need, in order; ``met``:
    the number of fulfilled needs; ``loads``: the robots that carry it. ``carried``: for each need
    except the last, whether the robots that fulfil it carry the obstacle to the next need."""

    name: str
    type: str
    region: Region
    actions: tuple[str, ...]
    status: Changes[ObstacleStatus]
    carried: tuple[bool, ...] = ()
    ordered: bool = False
    met: Changes[int] = field(default_factory=lambda: Changes.of(0))
    loads: Changes[tuple[str, ...]] = field(default_factory=lambda: Changes.of(()))

    def open_needs(self, met: int) -> str:
        """Return, in words, the actions of the needs after the first ``met`` ones."""
        named = ("an operator" if a == OPERATOR_ACTION else f"'{a}'" for a in self.actions[met:])
        return ", then ".join(named)


class StackRow(Struct, frozen=True):
    """An entry of the objective stack: an obstacle, its requester, and the helpers."""

    obstacle: str
    requester: str | None
    helpers: tuple[str, ...]


class Look(Struct, frozen=True):
    """The appearance of a robot: shape and colour of the body, and colour of the letters on it. The
    colours of Okabe and Ito (Color Universal Design, 2008) are distinct with every common kind of
    colour blindness; shapes repeat the information. Paths are SVG path data in a square from -1 to
    1.

    The ``size`` of the letters and the ``drop`` of their baseline are in radii of the body."""

    path: str
    colour: str
    ink: str
    letters: str
    size: float
    drop: float


_SHAPES = (
    ("circle", "M1,0A1,1 0 1 1 -1,0A1,1 0 1 1 1,0Z"),
    ("square", "M-0.86,-0.86H0.86V0.86H-0.86Z"),
    ("triangle", "M0,-1.2L1.12,0.82H-1.12Z"),
    ("diamond", "M0,-1.2L1.2,0L0,1.2L-1.2,0Z"),
    ("hexagon", "M-0.54,-0.94H0.54L1.08,0L0.54,0.94H-0.54L-1.08,0Z"),
    ("cross", "M-0.5,-1H0.5V-0.5H1V0.5H0.5V1H-0.5V0.5H-1V-0.5H-0.5Z"),
    ("pentagon", "M0,-1.1L1.05,-0.34L0.65,0.9H-0.65L-1.05,-0.34Z"),
)
_COLOURS = (
    ("#0072B2", "#FFFFFF"),  # blue
    ("#E69F00", "#000000"),  # orange
    ("#009E73", "#000000"),  # green
    ("#CC79A7", "#000000"),  # purple
    ("#56B4E9", "#000000"),  # sky
    ("#D55E00", "#000000"),  # vermillion
    ("#F0E442", "#000000"),  # yellow
    ("#7A7F87", "#000000"),  # grey
)
_SIGNS = "0123456789abcdefghijklmnopqrstuvwxyz"


def looks(names: Sequence[str]) -> tuple[Look, ...]:
    """Return the look of each robot: no two of the first 56 share both shape and colour."""
    found = []
    for letters, (shape, path), look in zip(labels(names), cycle(_SHAPES), cycle(_COLOURS)):
        size = (1.05 if len(letters) == 1 else 0.82) * (0.85 if shape == "triangle" else 1)
        drop = 0.36 * size + (0.22 if shape == "triangle" else 0)
        found.append(Look(path, *look, letters, round(size, 2), round(drop, 2)))
    return tuple(found)


def labels(names: Sequence[str]) -> list[str]:
    """Return a label for each robot: at most two characters, different for up to 36 robots with one
    initial. The terminal, the page and pictures use these labels.

    A robot with a unique initial gets that letter. Others add their number (``Q2``) or a letter of
    their name (``drone``, ``digit``: ``Dr``, ``Di``). Two-digit numbers stand alone (``robot_11``:
    ``11``)."""
    chosen: list[str] = []
    for name in names:
        free = (label for label in _candidates(name, names) if label not in chosen)
        chosen.append(next(free, str(len(chosen) + 1)))
    return chosen


def _candidates(name: str, names: Sequence[str]) -> Iterator[str]:
    """Yield possible labels of a name, the best first."""
    initial, number = name[:1].upper(), re.search(r"\d*$", name)
    if [other[:1].upper() for other in names].count(initial) == 1:
        yield initial
    if number is not None and 0 < len(number[0]) < 3:
        yield number[0] if len(number[0]) == 2 else initial + number[0]
    yield from (initial + letter.lower() for letter in (*name[1:], *_SIGNS) if letter.isalnum())

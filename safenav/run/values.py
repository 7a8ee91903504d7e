"""The values of a run: what the team knows, does and says, at one moment or over time; and the look
of each robot, the same in every picture and page."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import islice
from operator import itemgetter
from typing import TypeVar

from msgspec import Struct, field

from safenav.scenario.model import OPERATOR_ACTION, Exclusion
from safenav.scenario.objective import Objective, Word, number_word
from safenav.trace import records
from safenav.trace.words import listed, obstacle_words
from safenav.world.map import Heading, Region, RegionMap

T = TypeVar("T")


class Changes(list[tuple[int, T]]):
    """A value over time: pairs of the tick from which a value holds and the value, in order. The
    last of several in one tick counts."""

    @classmethod
    def of(cls, first: T) -> Changes[T]:
        """Return a value that holds from the start."""
        return cls([(-1, first)])

    @property
    def now(self) -> T:
        """The last value."""
        return self[-1][1]

    def put(self, tick: int, value: T) -> None:
        """Change the value, unless it is the same."""
        if value != self.now:
            self.append((tick, value))

    def after(self, tick: int) -> Iterator[tuple[int, T]]:
        """Yield the changes after that tick."""
        return islice(self, bisect_right(self, tick, key=itemgetter(0)), None)

    def at(self, tick: int) -> T:
        """Return the value after all events of that tick."""
        return self[max(0, bisect_right(self, tick, key=itemgetter(0)) - 1)][1]


class ObstacleStatus(StrEnum):
    """The team's knowledge of a hidden obstacle, in the order of its stages; ``ABSENT``: it has not
    appeared yet, or has disappeared."""

    ABSENT = "absent"
    HIDDEN = "hidden"
    FOUND = "found"
    REQUESTED = "requested"
    RESOLVED = "resolved"
    BLOCKED = "blocked"

    @property
    def meaning(self) -> str:
        """Return one phrase for legends."""
        longer = {"hidden": "still hidden", "requested": "help requested"}
        return longer.get(self.value, self.value)


class StoryKind(StrEnum):
    """The kinds of events (moves are not among them)."""

    SYNTHESIS = "synthesis"
    VIOLATION = "violation"
    REQUEST = "request"
    PUSH = "push"
    ACT = "act"
    """Only in a live run; in lockstep an action takes no time."""
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
    """For an operator; ``paused``: for a change of the scenario."""
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


SynthesisOutcome = records.Synthesis


class Event(Struct, frozen=True):
    """An event of a run. ``text`` describes it in scenario terms; ``robot`` is the robot concerned
    and ``region`` the place, if there is one. ``round``: the round of a robot that a goal
    completes, 0 for none. ``synthesis``: the result of one."""

    tick: int
    kind: StoryKind
    text: str
    robot: str | None = None
    region: Region | None = None
    obstacle: str | None = None
    round: int = 0
    synthesis: SynthesisOutcome | None = None


class LongStep(Struct, frozen=True):
    """A step that takes several ticks: after ``first`` to ``last`` the robot is between its region
    and ``toward``, and occupies both; it arrives in the next tick. ``begin`` and ``end``: times of
    departure and arrival in ticks, or in seconds if the run has a clock."""

    first: int
    last: int
    toward: Region
    begin: float
    end: float

    def part(self, time: float) -> float:
        """Return the completed part of the step at a time, from 0 to 1."""
        return min(1.0, max(0.0, (time - self.begin) / max(self.end - self.begin, 1e-9)))


class RobotTrack(Struct):
    """One robot and its poses: ``regions[t]`` and ``headings[t]`` after tick t; ``pose`` is the
    last one, also within a tick. ``vision``: its radius in regions, None if unlimited; ``steps``:
    its steps of more than one tick, in order."""

    name: str
    model: str
    layer: str
    capabilities: tuple[str, ...]
    regions: list[Region]
    headings: list[Heading | None]
    vision: float | None = None
    steps: list[LongStep] = field(default_factory=list)
    within: tuple[Region, Heading | None] | None = None
    """Its pose after its turn in the incomplete tick."""

    @property
    def pose(self) -> tuple[Region, Heading | None]:
        return self.within or (self.regions[-1], self.headings[-1])

    def transit(self, tick: int) -> LongStep | None:
        """Return the step that the robot is in after ``tick``; None if it is in one region."""
        i = bisect_right(self.steps, tick, key=lambda step: step.first) - 1
        return self.steps[i] if i >= 0 and tick <= self.steps[i].last else None

    def stand(self, pose: tuple[Region, Heading | None] | None = None) -> None:
        """Add a tick, with the same pose or another one."""
        region, heading = pose or (self.regions[-1], self.headings[-1])
        self.regions.append(region)
        self.headings.append(heading)


class RobotBelief(Struct, frozen=True):
    """Knowledge of a robot about another one: ``seen`` in the single region of ``regions``, or
    believed to be in any of them."""

    seen: bool
    regions: frozenset[Region]


class Hidden(Struct, frozen=True):
    """A hidden obstacle: the ``actions`` of its needs in order. ``carried``: for each need but the
    last, whether the robots that fulfilled it carry the obstacle to the next."""

    name: str
    type: str
    region: Region
    actions: tuple[str, ...]
    carried: tuple[bool, ...] = ()
    ordered: bool = False

    def state(self, status: ObstacleStatus, met: int) -> str:
        """Return its status and open needs in words: ``found, needs 'unlock', then 'push'``."""
        unknown = self.ordered and status is ObstacleStatus.HIDDEN
        words = "not ordered yet" if unknown else status.meaning
        needs = "" if status is ObstacleStatus.RESOLVED else self.open_needs(met)
        return f"{words}, needs {needs}" if needs else words

    def open_needs(self, met: int) -> str:
        """Return its needs after the first ``met`` in words."""
        named = ("an operator" if a == OPERATOR_ACTION else f"'{a}'" for a in self.actions[met:])
        return ", then ".join(named)

    def label(self, world: RegionMap) -> str:
        """``door@47``, or ``door@dock`` if the region has a name."""
        return obstacle_words(self.name, world.word)


class StackRow(Struct, frozen=True):
    """One entry of the objective stack: obstacle, requester and helpers."""

    obstacle: str
    requester: str | None
    helpers: tuple[str, ...]

    def about(self, word: Word = number_word) -> str:
        """``door@47``; ``word`` names regions."""
        return obstacle_words(self.obstacle, word)

    @property
    def roles(self) -> str:
        """``quad waits, digit helps``"""
        if self.helpers == (self.requester,):
            return f"{self.requester} resolves it itself"
        parts = [] if self.requester in (None, *self.helpers) else [f"{self.requester} waits"]
        if self.helpers:
            parts.append(f"{listed(self.helpers)} {'helps' if len(self.helpers) == 1 else 'help'}")
        return ", ".join(parts) or "no robot helps yet"


class RobotProgress(Struct, frozen=True):
    """Progress of a robot in its present objective: rounds, and the last reached target."""

    rounds: int = 0
    reached: Region | None = None


class Placed(Struct, frozen=True):
    """A robot in a scene. ``row`` and ``col`` are fractions between two ticks; ``heading`` is in
    degrees clockwise from north, None for robots without a heading. ``trail``: the regions of its
    past path, oldest first."""

    name: str
    model: str
    layer: str
    row: float
    col: float
    heading: float | None
    objective: Objective | None
    trail: tuple[Region, ...] = ()
    taken: tuple[Region, ...] = ()
    """The two regions that it occupies during a step of several ticks; else none."""
    loads: tuple[Hidden, ...] = ()
    """The obstacles that it carries."""
    charge: int | None = None
    """The charge of its battery in percent, if it has one."""
    doing: str = ""
    """Its objective in words."""
    aim: Region | None = None
    """The target that it reaches next, as far as that is known."""
    ahead: tuple[Region, ...] = ()
    """The regions on the way there, from its own."""

    def equipment(self, world: RegionMap) -> str:
        """Return its loads and its charge in words; empty if it has neither."""
        loads = f"carries {listed([load.label(world) for load in self.loads])}"
        charge = f"charge {self.charge} %"
        return "; ".join([loads] * bool(self.loads) + [charge] * (self.charge is not None))


class Scene(Struct, frozen=True):
    """One complete moment: everything a picture shows."""

    title: str
    moment: str
    map: RegionMap
    robots: tuple[Placed, ...]
    obstacles: tuple[tuple[Hidden, ObstacleStatus, int], ...]
    """Each present obstacle with its status and the number of its fulfilled needs."""
    stack: tuple[StackRow, ...] = ()
    happened: tuple[Event, ...] = ()
    chargers: tuple[Region, ...] = ()
    exclusions: tuple[Exclusion, ...] = ()


ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#7A7F87"


class Look(Struct, frozen=True):
    """Look of one robot: body, and the colours of the body and of the letters on it. Colours are
    those of Okabe and Ito (Color Universal Design, 2008), distinct with every common kind of colour
    blindness; shapes repeat what colours show. Paths are SVG path data in a square from -1 to 1.

    ``size`` of the letters and ``drop`` of their baseline are in radii of the body."""

    shape: str
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
    (BLUE, "#FFFFFF"),
    (ORANGE, "#000000"),
    (GREEN, "#000000"),
    (PURPLE, "#000000"),
    (SKY, "#000000"),
    (VERMILLION, "#000000"),
    (YELLOW, "#000000"),
    (GREY, "#000000"),
)
_SIGNS = "0123456789abcdefghijklmnopqrstuvwxyz"
_NUMBERED = re.compile(r"(.*?)[-_ ]?0*(\d{1,2})")


def looks(names: Sequence[str]) -> tuple[Look, ...]:
    """Return a look for each robot: no two of the first 56 share both shape and colour."""
    letters = [*labels(names).values()]
    found = []
    for i in range(len(names)):
        shape, path = _SHAPES[i % len(_SHAPES)]
        colour, ink = _COLOURS[i % len(_COLOURS)]
        size = (1.05 if len(letters[i]) == 1 else 0.82) * (0.85 if shape == "triangle" else 1)
        drop = 0.36 * size + (0.22 if shape == "triangle" else 0)
        found.append(Look(shape, path, colour, ink, letters[i], round(size, 2), round(drop, 2)))
    return tuple(found)


def labels(names: Sequence[str]) -> dict[str, str]:
    """Return a label of at most two characters for each of up to 36 robots of one initial, no two
    the same: those of the terminal, the page and pictures.

    A robot alone with its initial gets that letter. Of several robots, the one named in one plain
    word keeps it (``quad`` beside ``quad_2``); others add their number (``Q2``) or the first letter
    that tells them apart (``drone``, ``digit``: ``Dr``, ``Di``). Numbers of two figures stand alone
    (``robot_11``: ``11``)."""
    chosen: dict[str, str] = {}
    for name in names:
        for label in _candidates(name, names):
            if label not in chosen.values():
                chosen[name] = label
                break
        else:
            chosen[name] = str(len(chosen) + 1)
    return chosen


def _candidates(name: str, names: Sequence[str]) -> list[str]:
    """Return possible labels of a name, the best first."""
    initial = name[:1].upper()
    rivals = [other for other in names if other != name and other[:1].upper() == initial]
    if not rivals:
        return [initial, *(initial + sign for sign in _SIGNS)]
    found = []
    numbered = _NUMBERED.fullmatch(name)
    if numbered and numbered[1]:
        number = numbered[2]
        found.append(number if len(number) == 2 else initial + number)
    elif all(_NUMBERED.fullmatch(other) for other in rivals):
        found.append(initial)
    distinct = (
        letter
        for place, letter in enumerate(name)
        if place and all(letter != other[place : place + 1] for other in rivals)
    )
    found += [initial + letter.lower() for letter in distinct if letter.isalnum()]
    found += [initial + letter.lower() for letter in name[1:] if letter.isalnum()]
    return found + [initial + sign for sign in _SIGNS]

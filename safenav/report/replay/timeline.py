"""A run as a timeline: the robots' positions and the team's knowledge at each tick.

Built from a trace alone (docs/trace.md). A ``Replay`` holds the whole run, a ``Scene`` one moment
of it: the HTML page, the vector and pixel pictures are all drawn from these
two, so they cannot disagree."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from enum import StrEnum

from msgspec import Struct, field

from safenav.outcome import Outcome
from safenav.report.replay.changes import Changes
from safenav.scenario.model import OPERATOR_ACTION
from safenav.scenario.objective import Objective, Word, number_word, station
from safenav.scenario.settings import Exclusion
from safenav.trace.records import End
from safenav.trace.wording import objective_words
from safenav.trace.words import listed, obstacle_words
from safenav.world.map import Heading, Region, RegionMap


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


TURNED_BACK = 0.4
"""The part of a failed step after which a robot turns back to its region."""

_FAILURES = (Outcome.OPERATOR_NEEDED, Outcome.UNREALIZABLE, Outcome.ASSUMPTION_VIOLATED)


class StoryKind(StrEnum):
    """The trace lines that tell the story (moves are not among them)."""

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


class Event(Struct, frozen=True):
    """An event of a run. ``text`` describes it in scenario terms; ``robot`` is the robot concerned
    and ``region`` the place, if there is one."""

    tick: int
    kind: StoryKind
    text: str
    robot: str | None = None
    region: Region | None = None
    obstacle: str | None = None


class RobotTrack(Struct):
    """One robot and its poses: ``regions[t]`` and ``headings[t]`` after tick t. ``vision``: its
    radius in regions, None if unlimited; ``steps``: its steps of more than one tick, in order."""

    name: str
    model: str
    layer: str
    capabilities: tuple[str, ...]
    regions: list[Region]
    headings: list[Heading | None]
    vision: float | None = None
    steps: list[LongStep] = field(default_factory=list)

    def transit(self, tick: int) -> LongStep | None:
        """Return the step that the robot is in after ``tick``; None if it is in one region."""
        i = bisect_right(self.steps, tick, key=lambda step: step.first) - 1
        return self.steps[i] if i >= 0 and tick <= self.steps[i].last else None


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


class RobotBelief(Struct, frozen=True):
    """Knowledge of a robot about another one: ``seen`` in the single region of ``regions``, or
    believed to be in any of them."""

    seen: bool
    regions: frozenset[Region]


class Hidden(Struct, frozen=True):
    """A hidden obstacle as the trace describes it: the ``actions`` of its needs in order, the
    resolution regions of the first. ``carried``: for each need but the last, whether the robots
    that fulfilled it carry the obstacle to the next."""

    name: str
    type: str
    region: Region
    actions: tuple[str, ...]
    resolution_regions: tuple[Region, ...]
    blocks: tuple[str, ...]
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


class Slack(Struct, frozen=True):
    """A verdict on a deadline: ``of`` a robot (its round), an obstacle or the mission, from tick
    ``begin`` to ``due``; in ``tick``, ``left`` ticks before it is due, it is set, lost, kept, late
    or excused."""

    tick: int
    of: str
    begin: int
    due: int
    verdict: str
    left: int


class Replay(Struct):
    """A run up to the last complete tick of its trace. ``ending`` is None until it ends, and for a
    trace that was cut off. Obstacles are by name; ``loads``: the robots that carry one, ``met``:
    the number of its fulfilled needs."""

    name: str
    map: RegionMap
    robots: tuple[RobotTrack, ...]
    hidden: Mapping[str, Hidden]
    statuses: Mapping[str, Changes[ObstacleStatus]]
    loads: Mapping[str, Changes[tuple[str, ...]]]
    met: Mapping[str, Changes[int]]
    objectives: Mapping[str, Changes[Objective | None]]
    progress: dict[str, Changes[RobotProgress]]
    stack: Changes[tuple[StackRow, ...]] = field(default_factory=lambda: Changes.of(()))
    events: list[Event] = field(default_factory=list)
    ending: End | None = None
    version: str = ""
    within: bool = False
    """Whether the run ended within its last tick; robots without a turn in it have not moved."""
    times: list[float] | None = None
    """Seconds of each tick if the run has a clock; its ticks are then the instants of its events.
    None: time is in ticks only."""
    plans: Changes[Mapping[str, tuple[Region, ...]]] = field(default_factory=lambda: Changes.of({}))
    """The paths of the robots of a joint plan; none while there is no plan."""
    beliefs: dict[tuple[str, str], Changes[RobotBelief | None]] = field(default_factory=dict)
    """Knowledge of a robot (first name) about another one (second); None until recorded."""
    deadlines: list[Slack] = field(default_factory=list)
    charges: Mapping[str, Changes[int]] = field(default_factory=dict)
    """The charge of each robot with a battery, in percent of its capacity."""
    chargers: tuple[Region, ...] = ()
    """Regions where batteries are charged."""
    exclusions: tuple[Exclusion, ...] = ()
    _by_tick: dict[int, list[Event]] = field(default_factory=dict)

    @property
    def last(self) -> int:
        """The last complete tick."""
        return len(self.robots[0].regions) - 1 if self.robots else 0

    @property
    def failed(self) -> bool:
        """Whether the run could not continue: it was neither completed nor stopped by a user."""
        return self.ending is not None and self.ending.outcome in _FAILURES

    def time(self, tick: int) -> float:
        """Return the time of a tick: in seconds, or in ticks if the run has no clock."""
        return float(tick) if self.times is None else self.times[tick]

    def tick_at(self, time: float) -> int:
        """Return the last tick that is not after a time."""
        if self.times is None:
            return max(0, min(self.last, int(time)))
        return max(0, bisect_right(self.times, time + 1e-9) - 1)

    def moment(self, time: float) -> tuple[int, float]:
        """Return the last tick that is not after a time, and the elapsed part until the next."""
        tick = self.tick_at(time)
        span = self.time(min(tick + 1, self.last)) - self.time(tick)
        return tick, min(1.0, max(0.0, time - self.time(tick)) / span) if span > 0 else 0.0

    def when(self, tick: int) -> str:
        """Return a tick in words: ``tick 12``, or ``12.3 s`` if the run has a clock."""
        return f"tick {tick}" if self.times is None else f"{self.times[tick]:.1f} s"

    def happened(self, tick: int) -> tuple[Event, ...]:
        """Return the events of one tick, in the order of the trace."""
        if not self._by_tick:
            for event in self.events:
                self._by_tick.setdefault(event.tick, []).append(event)
        return tuple(self._by_tick.get(tick, ()))

    def track(self, name: str) -> RobotTrack:
        """Return the robot of that name. Raises KeyError if there is none."""
        return {track.name: track for track in self.robots}[name]

    def scene(self, tick: int, fraction: float = 0.0, trail: int = 24) -> Scene:
        """Return the moment after ``tick``, or at a ``fraction`` of the time to the next one.

        Knowledge is that of ``tick``; only positions are interpolated. ``trail``: the number of
        past ticks in the robots' paths."""
        robots = tuple(self._placed(track, tick, fraction, trail) for track in self.robots)
        known = ((o, self.statuses[o.name].at(tick)) for o in self.hidden.values())
        there = ((o, status) for o, status in known if status is not ObstacleStatus.ABSENT)
        obstacles = tuple((o, status, self.met[o.name].at(tick)) for o, status in there)
        moment = f"tick {tick} of {self.last}"
        if self.times is not None:
            moment = f"{self._moment(tick, fraction):.1f} of {self.times[-1]:.1f} s"
        if tick == self.last and self.ending is not None:
            when = ", ended within it" if self.within else ""
            moment += f"{when}: {self.ending.outcome.replace('_', ' ')}"
        stack = self.stack.at(tick)
        happenings = (stack, self.happened(tick), self.chargers, self.exclusions)
        return Scene(self.name, moment, self.map, robots, obstacles, *happenings)

    def _moment(self, tick: int, fraction: float) -> float:
        here = self.time(tick)
        return here + (self.time(min(tick + 1, self.last)) - here) * fraction

    def _placed(self, track: RobotTrack, tick: int, fraction: float, trail: int) -> Placed:
        taken = track.transit(tick)
        region, heading = track.regions[tick], track.headings[tick]
        goal, after, part = region, heading, 0.0
        step = taken
        if step is None and self.times is None and tick < self.last:
            step = track.transit(tick + 1)  # it departs in this tick
            goal, after, part = track.regions[tick + 1], track.headings[tick + 1], fraction
        if step is not None:
            there = min(step.last + 1, self.last)
            goal, after = step.toward, track.headings[there]
            part = step.part(self._moment(tick, fraction))
            if step.last < self.last and track.regions[there] != goal:
                part = TURNED_BACK * (1 - abs(2 * part - 1))
                after = heading
        (row, col), (to_row, to_col) = self.map.position(region), self.map.position(goal)
        place = (row + (to_row - row) * part, col + (to_col - col) * part)
        degrees = None if heading is None else heading * 90.0
        if degrees is not None and after is not None:
            turn = (after * 90.0 - degrees + 180.0) % 360.0 - 180.0
            degrees += turn * min(1.0, 2.0 * part)  # it has turned by half the step
        objective = self.objectives[track.name].at(tick)
        trail *= 1 if self.times is None else len(self.robots)
        passed = track.regions[max(0, tick - trail) : tick + 1]
        both = () if taken is None else (region, taken.toward)
        held = (n for n, carriers in self.loads.items() if track.name in carriers.at(tick))
        loads = tuple(self.hidden[name] for name in held)
        charge = self.charges[track.name].at(tick) if track.name in self.charges else None
        named, doing = (track.name, track.model, track.layer), self.doing(track.name, objective)
        return Placed(
            *named, *place, degrees, objective, tuple(passed), both, loads, charge, doing=doing
        )

    def doing(self, robot: str, objective: Objective | None) -> str:
        """Return an objective of a robot in words, and whether it only charges its battery."""
        place = None if objective is None else station(objective)
        charges = robot in self.charges and place is not None and place <= {*self.chargers}
        return objective_words(objective, self.map.word) + ", to charge" * charges

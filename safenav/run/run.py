"""A run: the robots' positions and the team's knowledge at each of its ticks.

``safenav.run.reading`` fills it from the lines of a trace. Pages, pictures, bags, tables and the
story on the terminal are all drawn from it, so they cannot disagree, and none knows the clock of
the run: a ``Run`` has an ordinal for each of its moments (the ticks of lockstep, the instants of
the events of a live run) and the time of each.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping

from msgspec import Struct, field

from safenav.data import cached_method
from safenav.errors import Outcome
from safenav.run.values import (
    Changes,
    Event,
    Hidden,
    ObstacleStatus,
    Placed,
    RobotBelief,
    RobotProgress,
    RobotTrack,
    Scene,
    StackRow,
    StoryKind,
)
from safenav.scenario.model import Exclusion
from safenav.scenario.objective import Objective, describe, station, target_regions
from safenav.trace.records import End
from safenav.world.map import Region, RegionMap
from safenav.world.poses import bits
from safenav.world.sight import Visibility, visible_from

AHEAD = 400
"""The most ticks of a way that is shown before it is gone."""
_FAILURES = (Outcome.OPERATOR_NEEDED, Outcome.UNREALIZABLE, Outcome.ASSUMPTION_VIOLATED)
TURNED_BACK = 0.4
"""The part of a failed step after which a robot turns back to its region."""


class RunClock(Struct, frozen=True):
    """The time of a run: its ``unit``, its ``column`` in tables, the speed of films in units per
    second."""

    unit: str
    column: str
    speed: float


TICKS, SECONDS = RunClock("tick", "tick", 4.0), RunClock("second", "t", 12.0)


class Run(Struct):
    """A run up to the last complete tick of its trace. ``ending`` is None until it ends, and for a
    trace that was cut off. Obstacles are by name; ``loads``: the robots that carry one, ``met``:
    the number of its fulfilled needs."""

    name: str
    map: RegionMap
    robots: tuple[RobotTrack, ...]
    objectives: Mapping[str, Changes[Objective | None]]
    progress: Mapping[str, Changes[RobotProgress]]
    hidden: dict[str, Hidden] = field(default_factory=dict)
    statuses: dict[str, Changes[ObstacleStatus]] = field(default_factory=dict)
    loads: dict[str, Changes[tuple[str, ...]]] = field(default_factory=dict)
    met: dict[str, Changes[int]] = field(default_factory=dict)
    stack: Changes[tuple[StackRow, ...]] = field(default_factory=lambda: Changes.of(()))
    events: list[Event] = field(default_factory=list)
    ending: End | None = None
    version: str = ""
    within: bool = False
    """Whether the run ended within its last tick; robots without a turn in it have not moved."""
    seconds: list[float] | None = None
    """Seconds of each tick if the run has a clock; its ticks are then the instants of its events.
    None: time is in ticks only."""
    plans: Changes[Mapping[str, tuple[Region, ...]]] = field(default_factory=lambda: Changes.of({}))
    """The paths of the robots of a joint plan; none while there is no plan."""
    driven: set[str] = field(default_factory=set)
    """The robots that joint plans have moved so far."""
    waits: dict[str, list[Objective | None]] = field(default_factory=dict)
    """The objectives with which robots have waited for help."""
    beliefs: dict[tuple[str, str], Changes[RobotBelief | None]] = field(default_factory=dict)
    """Knowledge of a robot (first name) about another one (second); None until recorded."""
    charges: Mapping[str, Changes[int]] = field(default_factory=dict)
    """The charge of each robot with a battery, in percent of its capacity."""
    inputs: dict[str, bool] = field(default_factory=dict)
    """The last values of the environment's inputs."""
    chargers: tuple[Region, ...] = ()
    """Regions where batteries are charged."""
    exclusions: tuple[Exclusion, ...] = ()
    interrupts: str | None = None
    """The type of obstacle whose resolution does not restart the rounds: a flat battery."""
    _by_tick: dict[int, list[Event]] = field(default_factory=dict)

    @property
    def last(self) -> int:
        """The last complete tick."""
        return len(self.robots[0].regions) - 1 if self.robots else 0

    @property
    def failed(self) -> bool:
        """Whether the run could not continue: it was neither completed nor stopped by a user."""
        return self.ending is not None and self.ending.outcome in _FAILURES

    @property
    def told(self) -> list[Event]:
        """The events, without notes."""
        return [event for event in self.events if event.kind is not StoryKind.NOTE]

    # Time.

    @property
    def clock(self) -> RunClock:
        return TICKS if self.seconds is None else SECONDS

    def time(self, tick: int) -> float:
        """Return the time of a tick: in seconds, or in ticks if the run has no clock."""
        return tick if self.seconds is None else self.seconds[tick]

    def tick_at(self, time: float) -> int:
        """Return the last tick that is not after a time."""
        if self.seconds is None:
            return max(0, min(self.last, int(time + 1e-9)))
        return max(0, bisect_right(self.seconds, time + 1e-9) - 1)

    def moment(self, time: float) -> tuple[int, float]:
        """Return the last tick that is not after a time, and the elapsed part until the next."""
        tick = self.tick_at(time)
        span = self.time(min(tick + 1, self.last)) - self.time(tick)
        return tick, min(1.0, max(0.0, time - self.time(tick)) / span) if span > 0 else 0.0

    def when(self, tick: int) -> str:
        """Return a tick in words: ``tick 12``, or ``12.3 s`` if the run has a clock."""
        return f"tick {tick}" if self.seconds is None else f"{self.seconds[tick]:.1f} s"

    def stamp(self, tick: int) -> str:
        """Return a tick as the start of a line of the story: ``tick 12  ``, ``   12.3 s``."""
        return f"tick {tick:<4}" if self.seconds is None else f"{self.seconds[tick]:>7.1f} s"

    # One moment.

    def happened(self, tick: int) -> tuple[Event, ...]:
        """Return the events of one tick, in the order of the trace."""
        if not self._by_tick:
            for event in self.told:
                self._by_tick.setdefault(event.tick, []).append(event)
        return tuple(self._by_tick.get(tick, ()))

    def track(self, name: str) -> RobotTrack:
        """Return the robot of that name. Raises KeyError if there is none."""
        return {track.name: track for track in self.robots}[name]

    def restarts_rounds(self, obstacle: str) -> bool:
        """Return whether resolving an obstacle restarts the rounds."""
        return self.interrupts is None or self.hidden[obstacle].type != self.interrupts

    def closed(self, tick: int) -> dict[str, ObstacleStatus]:
        """Return the known obstacles that are not resolved."""
        statuses = {name: changes.at(tick) for name, changes in self.statuses.items()}
        return {name: status for name, status in statuses.items() if status in CLOSED}

    def at(self, tick: int, fraction: float = 0.0, trail: int = 24) -> Scene:
        """Return the moment after ``tick``, or at a ``fraction`` of the time to the next one.

        Knowledge is that of ``tick``; only positions are interpolated. ``trail``: the number of
        past ticks in the robots' paths."""
        robots = tuple(self._placed(track, tick, fraction, trail) for track in self.robots)
        known = ((o, self.statuses[o.name].at(tick)) for o in self.hidden.values())
        there = ((o, status) for o, status in known if status is not ObstacleStatus.ABSENT)
        obstacles = tuple((o, status, self.met[o.name].at(tick)) for o, status in there)
        moment = f"tick {tick} of {self.last}"
        if self.seconds is not None:
            moment = f"{self._moment(tick, fraction):.1f} of {self.seconds[-1]:.1f} s"
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
        name, taken = track.name, track.transit(tick)
        row, col, heading = self.place(track, tick, fraction)
        objective = self.objectives[name].at(tick)
        aim, end = self._aim(track, objective, tick)
        trail *= 1 if self.seconds is None else len(self.robots)
        held = (n for n, carriers in self.loads.items() if name in carriers.at(tick))
        return Placed(
            name,
            track.model,
            track.layer,
            row,
            col,
            heading,
            objective,
            trail=tuple(track.regions[max(0, tick - trail) : tick + 1]),
            taken=() if taken is None else (track.regions[tick], taken.toward),
            loads=tuple(self.hidden[name] for name in held),
            charge=self.charges[name].at(tick) if name in self.charges else None,
            doing=self.doing(name, objective),
            aim=aim,
            ahead=tuple(track.regions[tick : min(end, tick + AHEAD) + 1]),
        )

    def _aim(
        self, track: RobotTrack, objective: Objective | None, tick: int
    ) -> tuple[Region | None, int]:
        """Return the target that a robot reaches next, if it reaches one before its objective
        changes, and when; else where it is then."""
        targets = target_regions(objective)
        changes = (at for at, _ in self.objectives[track.name].after(tick))
        until = min(next(changes, self.last), self.last)
        for at, progress in self.progress[track.name].after(tick):
            if at > until:
                break
            if progress.reached in targets:
                return progress.reached, at
        there = track.regions[until]
        only = next(iter(targets)) if len(targets) == 1 else None
        return there if there in targets and until > tick else only, until

    def place(
        self, track: RobotTrack, tick: int, fraction: float = 0.0
    ) -> tuple[float, float, float | None]:
        """Return the row, the column and the heading in degrees of a robot."""
        region, heading = track.regions[tick], track.headings[tick]
        goal, after, part = region, heading, 0.0
        step = track.transit(tick)
        if step is None and self.seconds is None and tick < self.last:
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
        degrees = None if heading is None else heading * 90.0
        if degrees is not None and after is not None:
            turn = (after * 90.0 - degrees + 180.0) % 360.0 - 180.0
            degrees += turn * min(1.0, 2.0 * part)  # it has turned by half the step
        return row + (to_row - row) * part, col + (to_col - col) * part, degrees

    def doing(self, robot: str, objective: Objective | None) -> str:
        """Return an objective of a robot in words; also whether it only charges its battery, or is
        moved by a joint plan while it waits."""
        place = None if objective is None else station(objective)
        words = "no objective" if objective is None else describe(objective, self.map.word)
        if place is None:
            return words
        if robot in self.charges and place <= {*self.chargers}:
            return f"{words}, to charge"
        waits = robot in self.driven and objective in self.waits.get(robot, ())
        return f"{words}, unless its joint plan moves it" if waits else words


CLOSED = {ObstacleStatus.FOUND, ObstacleStatus.REQUESTED, ObstacleStatus.BLOCKED}


class SightCache(Struct, frozen=True, dict=True):
    """The sight of robots on a map, cached by radius and blocking obstacles, so that a query for
    every tick is cheap."""

    map: RegionMap

    @cached_method
    def _view(self, vision: float, closed: frozenset[Region]) -> Visibility:
        return visible_from(self.map, vision, closed)

    def after(self, run: Run, robot: str, tick: int) -> list[Region] | None:
        """Return the regions, ascending, that a robot sees after ``tick``; None without a
        radius."""
        track = run.track(robot)
        if track.vision is None:
            return None
        closed = frozenset(run.hidden[name].region for name in run.closed(tick))
        return [*bits(self._view(track.vision, closed).mask(track.regions[tick]))]

"""A run: the robots' positions and the team's knowledge at each of its ticks.

``safenav.run.reading`` builds it from the lines of a trace. Pages, pictures, bags, tables and the
story on the terminal all use it, so they cannot disagree. None of them depends on the clock of the
run: each moment of a ``Run`` has an index and a time. It is a tick of lockstep, or the instant of
an event of a live run.
"""

from bisect import bisect_right

from msgspec import Struct, field

from safenav.errors import Outcome
from safenav.run.tracks import RobotTrack
from safenav.run.values import Changes, Event, Hidden, ObstacleStatus, StackRow, StoryKind
from safenav.scenario.model import Exclusion
from safenav.scenario.objective import Objective, describe, target_regions
from safenav.trace.records import End
from safenav.world.map import Region, RegionMap

AHEAD = 100
"""Maximum number of ticks for which the path ahead is shown."""
_FAILURES = (Outcome.OPERATOR_NEEDED, Outcome.UNREALIZABLE, Outcome.ASSUMPTION_VIOLATED)
TURNED_BACK = 0.4
"""The fraction of a failed step after which the robot turns back to its region."""


class Run(Struct):
    """A run up to the last complete tick of its trace. ``hidden``: obstacles by name; ``ending``:
    None until the run ends and in a cut-off trace."""

    name: str
    map: RegionMap
    robots: tuple[RobotTrack, ...]
    hidden: dict[str, Hidden] = field(default_factory=dict)
    stack: Changes[tuple[StackRow, ...]] = field(default_factory=lambda: Changes.of(()))
    events: list[Event] = field(default_factory=list)
    ending: End | None = None
    version: str = ""
    seconds: list[float] | None = None
    """The seconds of each tick if the run has a clock: its ticks are then the instants of its
    events. None: time is in ticks only."""
    inputs: dict[str, bool] = field(default_factory=dict)
    """The last values of the environment's inputs."""
    chargers: tuple[Region, ...] = ()
    """Regions where batteries are charged."""
    exclusions: tuple[Exclusion, ...] = ()
    interrupts: str | None = None
    """The type of the obstacles whose resolution does not restart rounds: flat batteries."""
    _by_tick: dict[int, list[Event]] = field(default_factory=dict)

    @property
    def last(self) -> int:
        """The last complete tick."""
        return min((len(track.regions) for track in self.robots), default=1) - 1

    @property
    def failed(self) -> bool:
        """Whether the run ended, but was neither completed nor stopped by a user."""
        return self.ending is not None and self.ending.outcome in _FAILURES

    @property
    def told(self) -> list[Event]:
        """The events of a story: all except notes."""
        return [event for event in self.events if event.kind is not StoryKind.NOTE]

    # Time.

    @property
    def unit(self) -> str:
        return "tick" if self.seconds is None else "second"

    @property
    def speed(self) -> float:
        """The speed of animations in ticks, or seconds of the run, per second."""
        return 4.0 if self.seconds is None else 12.0

    def time(self, tick: int) -> float:
        """Return the time of a tick: in seconds, or in ticks if the run has no clock."""
        return tick if self.seconds is None else self.seconds[tick]

    def tick_at(self, time: float) -> int:
        """Return the last tick at or before a time."""
        if self.seconds is None:
            return max(0, min(self.last, int(time + 1e-9)))
        return max(0, bisect_right(self.seconds, time + 1e-9) - 1)

    def moment(self, time: float) -> tuple[int, float]:
        """Return the last tick at or before a time, and the elapsed fraction until the next."""
        tick = self.tick_at(time)
        span = self.time(min(tick + 1, self.last)) - self.time(tick)
        return tick, min(1.0, max(0.0, time - self.time(tick)) / span) if span > 0 else 0.0

    def stamp(self, tick: int) -> str:
        """Return the time of a tick in the form of story lines: ``tick 12 ``, `` 12.3 s``."""
        return f"tick {tick:<4}" if self.seconds is None else f"{self.seconds[tick]:>7.1f} s"

    # One moment.

    def happened(self, tick: int) -> tuple[Event, ...]:
        """Return the events of one tick, in the order of the trace."""
        if not self._by_tick:
            for event in self.told:
                self._by_tick.setdefault(event.tick, []).append(event)
        return tuple(self._by_tick.get(tick, ()))

    def track(self, name: str) -> RobotTrack:
        """Return the robot with that name. Raises KeyError if there is none."""
        return {track.name: track for track in self.robots}[name]

    def restarts_rounds(self, obstacle: str) -> bool:
        """Return whether the resolution of an obstacle restarts the rounds."""
        return self.interrupts is None or self.hidden[obstacle].type != self.interrupts

    def present(self, tick: int) -> list[Hidden]:
        """Return the hidden obstacles that have appeared and are still present after a tick."""
        absent = ObstacleStatus.ABSENT
        return [each for each in self.hidden.values() if each.status.at(tick) is not absent]

    def stage(self, tick: int, fraction: float = 0.0) -> str:
        """Return a tick in words, the last one with the outcome: ``tick 46 of 46: completed``."""
        words = f"tick {tick} of {self.last}"
        if self.seconds is not None:
            words = f"{self._moment(tick, fraction):.1f} of {self.seconds[-1]:.1f} s"
        if tick == self.last and self.ending is not None:
            words += f": {self.ending.outcome.replace('_', ' ')}"
        return words

    def _moment(self, tick: int, fraction: float) -> float:
        here = self.time(tick)
        return here + (self.time(min(tick + 1, self.last)) - here) * fraction

    def loads(self, robot: str, tick: int) -> list[Hidden]:
        """Return the obstacles that a robot carries at a tick."""
        return [each for each in self.hidden.values() if robot in each.loads.at(tick)]

    def ahead(self, track: RobotTrack, tick: int) -> tuple[Region | None, list[Region]]:
        """Return the target that a robot reaches next (None: unknown), and the regions that it
        visits until then."""
        aim, end = self._aim(track, track.objectives.at(tick), tick)
        return aim, track.regions[tick : min(end, tick + AHEAD) + 1]

    def _aim(
        self, track: RobotTrack, objective: Objective | None, tick: int
    ) -> tuple[Region | None, int]:
        """Return the target that a robot reaches next before its objective changes, and the tick.
        If there is none, return the tick of the change and a guess: the robot's region then if it
        is a target, else the only target of the objective (None: it has several)."""
        targets = target_regions(objective)
        changes = (at for at, _ in track.objectives.after(tick))
        until = min(next(changes, self.last), self.last)
        for at, progress in track.progress.after(tick):
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
        """Return a robot's row, column and heading in degrees (None: it has no heading)."""
        region, heading = track.regions[tick], track.headings[tick]
        goal, after, part = region, heading, fraction
        step = track.transit(tick)
        if step is None and self.seconds is None and tick < self.last:
            step = track.transit(tick + 1)  # the robot departs in the next tick
            goal, after = track.regions[tick + 1], track.headings[tick + 1]
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
            degrees += turn * min(1.0, 2.0 * part)  # the turn is complete half-way
        return row + (to_row - row) * part, col + (to_col - col) * part, degrees

    def doing(self, objective: Objective | None) -> str:
        """Return an objective in words."""
        return "no objective" if objective is None else describe(objective, self.map.word)


CLOSED = {ObstacleStatus.FOUND, ObstacleStatus.REQUESTED, ObstacleStatus.BLOCKED}

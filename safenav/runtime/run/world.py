"""Worlds: what time is, how long steps take, what happens next. The loop knows one protocol only.

In ``Ticks`` a pass is a tick, in which each robot in turn moves or goes on; a step of one tick has
ended when ``start`` returns. In ``Seconds`` a pass is an instant at which something ends, after
which every idle robot has its turn. Both simulate the scenario's obstacles on the state itself: the
team reads of it only what is met.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from heapq import heappop, heappush
from typing import Protocol

from safenav.team.apply import acts_on, resolved
from safenav.team.floor import occupied, present, standing
from safenav.team.state import (
    Acted,
    Acts,
    Appeared,
    Arrived,
    Event,
    Goes,
    Gone,
    Is,
    State,
    Time,
    Turn,
)
from safenav.team.team import Team


class World(Protocol):
    moving: bool
    """Whether robots on their way still act in the region that they leave."""
    limit: tuple[float, str]
    """When the run ends at the latest, and with which outcome."""

    def wait(self, state: State) -> list[Event]:
        """What happens next; empty: nothing ever will."""

    def start(self, state: State, i: int, pose: int) -> Event | None:
        """Command a step; its end if it takes no time."""

    def act(self, state: State, i: int) -> Event:
        """Command an action: its end, or that it is under way."""

    def sense(self, state: State, region: int) -> int | None:
        """The obstacle that a robot beside a region notices there."""

    def coming(self, state: State) -> float | None:
        """When the scenario changes something next, within its limits."""


class Simulated:
    """The scenario's own obstacles, with truths drawn from its seed."""

    def __init__(self, team: Team) -> None:
        self.team = team
        draw = random.Random(team.scenario.seed)
        truths = [o.source.traversable for o in team.obstacles]
        self.truths = [draw.random() < t if isinstance(t, float) else t for t in truths]
        self.random = random.Random(f"durations {team.scenario.seed}")
        self.listed = {each.name: k for k, each in reversed([*enumerate(team.obstacles)])}

    def sense(self, state: State, region: int) -> int | None:
        for k, each in enumerate(self.team.obstacles):
            if each.region == region and present(state, k) and not each.ordered:
                return k
        return None

    def _acted(self, state: State, i: int, *, moving: bool) -> Acted:
        stages = acts_on(self.team, state, standing(self.team, state, moving=moving), i)
        over = tuple((k, self.truths[k]) for k, stage in stages if resolved(self.team, k, stage))
        return Acted(i, stages, over)

    def _changes(self, state: State, time: float) -> Iterator[Appeared | Gone]:
        """Obstacles go at their time, and appear at theirs, as soon as nobody is there."""
        regions = {
            self.team.obstacles[k].region for k in range(len(state.obstacles)) if present(state, k)
        }
        for k, each in enumerate(state.obstacles):
            source = self.team.obstacles[k].source
            gone = source.goes is not None and source.goes <= time
            if gone and (present(state, k) or each.state is Is.SEALED):
                regions.discard(source.region)
                yield Gone(k)
            elif (
                each.state is Is.AWAY
                and source.appears is not None
                and source.appears <= time
                and not gone
            ):
                taken = occupied(self.team, state) >> source.region & 1 or source.region in regions
                if source.ordered or not taken:
                    regions.add(source.region)
                    yield Appeared(k)

    def _times(self, state: State) -> Iterator[float]:
        for k, each in enumerate(state.obstacles):
            source = self.team.obstacles[k].source
            if each.state is Is.AWAY and source.appears is not None:
                yield source.appears
            if source.goes is not None and (
                each.state is Is.SEALED or each.state is Is.AWAY or present(state, k)
            ):
                yield source.goes

    def coming(self, state: State) -> float | None:
        times = (
            time
            for time in self._times(state)
            if state.time < time <= self.team.scenario.limits.ticks
        )
        return min(times, default=None)


class Ticks(Simulated):
    moving = True

    def __init__(self, team: Team) -> None:
        super().__init__(team)
        self.tick = 0
        self.limit: tuple[float, str] = (team.scenario.limits.ticks, "tick_limit")
        self._left: dict[int, int] = {}

    def wait(self, state: State) -> list[Event]:
        self.tick += 1
        found: list[Event] = [Time(self.tick), *self._changes(state, self.tick)]
        for i in range(len(state.robots)):
            if i in self._left:
                self._left[i] -= 1
                if self._left[i] == 0:
                    del self._left[i]
                    found.append(Arrived(i))
                else:
                    found.append(Goes(i))
            else:
                found.append(Turn(i))
        return found

    def start(self, state: State, i: int, pose: int) -> Event | None:  # noqa: ARG002
        timing = self.team.members[i].robot.model.timing
        ticks = self.random.randint(timing.least, timing.most)
        if ticks == 1:
            return Arrived(i)
        self._left[i] = ticks - 1
        return None

    def act(self, state: State, i: int) -> Event:
        return self._acted(state, i, moving=True)


class Seconds(Simulated):
    """``speeds``: moves a second of each robot, drawn; one move in ten takes five times as long."""

    moving = False

    def __init__(self, team: Team, seed: int = 0) -> None:
        super().__init__(team)
        self.random = random.Random(f"live {seed}")
        self.speeds = [self.random.uniform(0.5, 2) for _ in team.members]
        self.now = 0.0
        seconds = team.scenario.limits.seconds
        self.limit = (float("inf") if seconds is None else seconds, "time_limit")
        self.log: list[tuple[float, int, str, int, int]] = []
        """What the judge reads: (time, robot, "depart" or "arrive", region, region), and what
        becomes of obstacles: (time, obstacle, "appeared", "gone" or "met", needs met, whether it
        was found untraversable)."""
        self._ends: list[tuple[float, int, str, int]] = []
        self._count = 0
        self._last: State | None = None

    def wait(self, state: State) -> list[Event]:
        if state == self._last:  # nobody has anything more to do now
            times = [
                *(t for t in self._times(state) if t > self.now),
                *(end[0] for end in self._ends[:1]),
            ]
            if not times:
                return []
            self.now = min(times)
        self._last = state
        changes = [*self._changes(state, self.now)]
        found: list[Event] = [Time(self.now), *changes]
        for event in changes:
            what = "appeared" if isinstance(event, Appeared) else "gone"
            self.log.append((self.now, event.obstacle, what, 0, 0))
        while self._ends and self._ends[0][0] <= self.now:
            _, _, what, i = heappop(self._ends)
            if what == "step":
                self._note(state, i, "arrive", state.robots[i].next)
                found.append(Arrived(i))
            else:
                acted = self._acted(state, i, moving=False)
                truths = dict(acted.truths)
                self.log += [
                    (self.now, k, "met", stage.need, int(truths.get(k) is False))
                    for k, stage in acted.stages
                ]
                found.append(acted)
                break  # what others change where they act may depend on it
        return found + [Turn(i, None) for i in range(len(state.robots))]

    def start(self, state: State, i: int, pose: int) -> Event | None:
        self._note(state, i, "depart", pose)
        slow = 5 if self.random.random() < 0.1 else 1
        self._end(slow / self.speeds[i], "step", i)
        return None

    def act(self, state: State, i: int) -> Event:
        changes = acts_on(self.team, state, standing(self.team, state, moving=False), i)
        group = {i}
        for k, _ in changes:
            need = self.team.obstacles[k].needs[state.obstacles[k].stage.need]
            if need.together:
                group |= {
                    j
                    for j, r in enumerate(state.robots)
                    if r.idle
                    and need.regions >> r.pose % self.team.size & 1
                    and need.skills <= self.team.members[j].robot.capabilities
                }
        self._end(2 / self.speeds[i], "act", i)
        return Acts(i, tuple(sorted(group)))

    def _end(self, after: float, what: str, i: int) -> None:
        self._count += 1
        heappush(self._ends, (self.now + after, self._count, what, i))

    def _note(self, state: State, i: int, what: str, pose: int) -> None:
        size = self.team.size
        self.log.append((self.now, i, what, state.robots[i].pose % size, pose % size))


def judged(team: Team, world: Seconds) -> list[str]:
    """The problems of a live run, in seconds, from the world's log alone: rivals whose reservations
    overlap, robots in an unresolved obstacle that stops them."""
    held: dict[int, set[int]] = {i: {m.robot.start.region} for i, m in enumerate(team.members)}
    stages = {k: 0 for k, each in enumerate(team.obstacles) if each.source.appears is None}
    found, sealed = [], set[int]()
    for time, i, what, here, to in world.log:
        if what in ("appeared", "gone", "met"):
            stages.pop(i, None)
            if what != "gone":
                stages[i] = here
            sealed = sealed | {i} if what == "met" and to else sealed - {i}
            continue
        held[i] = {here, to} if what == "depart" else {to}
        for j in team.members[i].rivals:
            if held[i] & held[j]:
                names = team.members[i].name, team.members[j].name
                found.append(
                    f"{time:.2f} s: {names[0]} and {names[1]} both hold {held[i] & held[j]}"
                )
        for k, stage in stages.items() if what == "depart" else ():
            obstacle = team.obstacles[k]
            unmet = stage < len(obstacle.needs) and i in obstacle.closed_to[stage]
            if obstacle.region == to and (unmet or (k in sealed and i in obstacle.blocks)):
                found.append(f"{time:.2f} s: {team.members[i].name} enters {obstacle.name}")
    return found

"""A replay in the making, and how parts of it are added."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Self

from msgspec import Struct, field

from safenav.report.replay.charges import ChargeLevels
from safenav.report.replay.timeline import (
    Event,
    Hidden,
    LongStep,
    ObstacleStatus,
    RobotBelief,
    RobotProgress,
    RobotTrack,
    RunEnd,
    Slack,
    StackRow,
    StoryKind,
)
from safenav.scenario.objective import Objective
from safenav.trace import records, setting
from safenav.trace.objective import Objective as TracedObjective
from safenav.trace.trace import Trace
from safenav.trace.wording import Wording, objective_of
from safenav.world.map import Heading, Region, RegionMap

SAME = 1e-3
"""Seconds within which two instants are the same."""

HEADINGS = {heading.label: heading for heading in Heading}


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


def hidden_of(
    world: RegionMap, header: setting.ScenarioHeader, obstacle: setting.ObstacleHeader
) -> Hidden:
    return Hidden(
        obstacle.name,
        obstacle.type,
        on_map(world, obstacle.region),
        tuple(need.action for need in obstacle.all_needs),
        tuple(on_map(world, region) for region in obstacle.resolution_regions),
        tuple(robot for robot in header.robots if robot in obstacle.blocks),
        obstacle.from_ or 0,
        tuple(need.same is True for need in obstacle.all_needs[1:]),
    )


def on_map(world: RegionMap, region: Region) -> Region:
    if not 0 <= region < world.size:
        raise ContradictionError(f"{region} is not a region of the map (0 to {world.size - 1})")
    return region


class UnfinishedReplay(Struct):
    """A replay up to some instant."""

    header: setting.ScenarioHeader
    map: RegionMap
    tracks: dict[str, RobotTrack]
    hidden: dict[str, Hidden]
    regions: dict[str, list[Region]]
    headings: dict[str, list[Heading | None]]
    statuses: dict[str, list[tuple[int, ObstacleStatus]]]
    objectives: dict[str, list[tuple[int, Objective | None]]]
    progress: dict[str, list[tuple[int, RobotProgress]]]
    charges: ChargeLevels
    frames: list[StackRow] = field(default_factory=list)
    stack: list[tuple[int, tuple[StackRow, ...]]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    beliefs: dict[tuple[str, str], list[tuple[int, RobotBelief | None]]] = field(
        default_factory=dict
    )
    bound: dict[str, list[Region | None]] = field(default_factory=dict)
    times: list[float] | None = None
    """Seconds of each instant of a live run; None for a run in lockstep, which has ticks."""
    steps: dict[str, list[LongStep]] = field(default_factory=dict)
    """Steps of a live run."""
    plans: list[tuple[int, Mapping[str, tuple[Region, ...]]]] = field(default_factory=list)
    deadlines: list[Slack] = field(default_factory=list)
    loads: dict[str, list[tuple[int, tuple[str, ...]]]] = field(default_factory=dict)
    violation: records.Violation | None = None
    ending: RunEnd | None = None
    ended: int | None = None

    @classmethod
    def begin(cls, trace: Trace) -> Self:
        header = trace.header.scenario
        try:
            world = RegionMap.from_grid(header.map.grid, header.map.names, header.map.areas)
        except ValueError as error:
            raise ContradictionError(f"the map cannot be used: {error}") from error
        tracks, hidden = {}, {}
        for name, robot in header.robots.items():
            start = on_map(world, robot.start)
            heading = HEADINGS[robot.heading] if robot.heading is not None else None
            can = tuple(sorted(robot.capabilities))
            if robot.vision is not None and robot.vision < 1:
                raise ContradictionError(f"{name} does not even see the next region")
            place = ((start,), (heading,))
            tracks[name] = RobotTrack(name, robot.model, robot.layer, can, *place, robot.vision)
        for name, obstacle in trace.obstacles.items():
            hidden[name] = hidden_of(world, header, obstacle)
        return cls(
            header,
            world,
            tracks,
            hidden,
            {name: list(track.regions) for name, track in tracks.items()},
            {name: list(track.headings) for name, track in tracks.items()},
            {name: [] for name in hidden},
            {name: [(-1, objective_of(r.objective))] for name, r in header.robots.items()},
            {name: [] for name in tracks},
            ChargeLevels.begin(header),
            times=None if trace.header.clock is None else [0.0],
            steps={name: [] for name in tracks},
        )

    @property
    def wording(self) -> Wording:
        actions = {name: found.actions for name, found in self.hidden.items()}
        skills = {name: robot.capabilities for name, robot in self.header.robots.items()}
        return Wording(
            self.map.word,
            self.map.place,
            team=len(self.header.robots),
            actions=actions,
            skills=skills,
        )

    def _standing(self, robot: str) -> Region | None:
        """Return the region of a robot that is not on its way, in a live run."""
        steps, now = self.steps[robot], len(self.times or ()) - 1
        return None if steps and steps[-1].last == now else self.regions[robot][-1]

    def _objective(self, name: str) -> Objective | None:
        return self.objectives[name][-1][1]

    def _objectives(self, line: records.Push | records.Pop) -> None:
        self.stack.append((line.tick, tuple(self.frames)))
        for name, told in line.objectives.items():
            self._told(line.tick, name, told)

    def _told(self, tick: int, name: str, told: TracedObjective) -> None:
        self._known(name)
        objective = objective_of(told)
        if objective != self._objective(name):
            self.objectives[name].append((tick, objective))
            self.progress[name].append((tick, RobotProgress()))

    def _status(self, obstacle: str, tick: int, status: ObstacleStatus) -> None:
        if obstacle not in self.hidden:
            raise ContradictionError(f"the header has no obstacle {obstacle}")
        self.statuses[obstacle].append((tick, status))

    def _known(self, robot: str) -> None:
        if robot not in self.tracks:
            raise ContradictionError(f"the header has no robot {robot}")

    def _about(
        self, line: records.Record, kind: StoryKind, robot: str | None, obstacle: str | None
    ) -> None:
        known = self.hidden.get(obstacle or "")
        self._event(line, kind, robot, known.region if known is not None else None, obstacle)

    def _event(
        self,
        line: records.Record,
        kind: StoryKind,
        robot: str | None = None,
        region: Region | None = None,
        obstacle: str | None = None,
    ) -> None:
        if region is not None:
            on_map(self.map, region)
        if robot is not None:
            self._known(robot)
        text = self.wording.sentence(line)
        self.events.append(Event(line.tick, kind, text, robot, region, obstacle))

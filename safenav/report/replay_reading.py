"""From the lines of a trace to a ``Replay``.

Lines and fields that are not known are passed over, as docs/trace.md asks of every reader. A
trace without an ``outcome`` (crash, Ctrl-C) is shown up to its last complete tick.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from safenav.errors import Diagnostic, InputError
from safenav.report.replay import (
    Changes,
    Ending,
    Event,
    EventKind,
    Frame,
    Hidden,
    Progress,
    Replay,
    Status,
    Track,
)
from safenav.report.replay_wording import event_text, objective_from_data
from safenav.scenario.objective import Hold, Objective
from safenav.world.map import Heading, Region, RegionMap

Line = Mapping[str, Any]


def read_replay(path: Path) -> Replay:
    """The run that a trace file tells.

    Raises InputError, with file and line, for a file that is no trace.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise _bad(path, 0, f"cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise _bad(path, 0, "is not UTF-8 text", "a trace is JSON Lines") from error
    return replay_of(_parsed(path, text), path)


def _parsed(path: Path, text: str) -> Iterator[tuple[int, Line]]:
    lines = text.splitlines()
    for number, written in enumerate(lines, start=1):
        if not written.strip():
            continue
        try:
            line = json.loads(written)
        except (json.JSONDecodeError, RecursionError) as error:
            if number == len(lines) and not text.endswith("\n") and number > 1:
                return  # the run was cut off while it wrote this line
            raise _bad(path, number, "is not a line of JSON", "a trace is JSON Lines") from error
        if not isinstance(line, dict) or not isinstance(line.get("type"), str):
            raise _bad(path, number, "is no trace line: it has no `type`")
        yield number, line


def replay_of(lines: Iterable[tuple[int, Line]], path: Path) -> Replay:
    """The run that numbered trace lines tell; ``path`` is for messages."""
    numbered = iter(lines)
    number, header = next(numbered, (0, {}))
    if header.get("type") != "header":
        raise _bad(path, number, "the trace does not begin with its header")
    if header.get("trace") != 1:
        found = f"trace version {header.get('trace')!r} is not known"
        raise _bad(path, number, found, "this safenav reads version 1")
    try:
        telling = _Telling.begin(header)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _bad(path, number, f"the header is broken: {_what(error)}") from error
    for number, line in numbered:
        try:
            telling.tell(line)
        except (KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
            found = f"the `{line['type']}` line is broken: {_what(error)}"
            raise _bad(path, number, found, "docs/trace.md lists the fields") from error
    return telling.replay()


def _bad(path: Path, line: int, found: str, hint: str = "") -> InputError:
    return InputError([Diagnostic(str(path), line, 1, found, hint)])


def _what(error: Exception) -> str:
    return f"no field {error}" if isinstance(error, KeyError) else str(error)


@dataclass
class _Telling:
    """A replay in the making."""

    header: Line
    map: RegionMap
    tracks: dict[str, Track]
    hidden: dict[str, Hidden]
    regions: dict[str, list[Region]]
    headings: dict[str, list[Heading | None]]
    statuses: dict[str, list[tuple[int, Status]]]
    objectives: dict[str, list[tuple[int, Objective | None]]]
    progress: dict[str, list[tuple[int, Progress]]]
    frames: list[Frame] = field(default_factory=list)
    stack: list[tuple[int, tuple[Frame, ...]]] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    violation: Line | None = None
    ending: Ending | None = None

    @classmethod
    def begin(cls, header: Line) -> _Telling:
        scenario = header["scenario"]
        world = RegionMap.from_grid(scenario["map"]["grid"])
        tracks, hidden = {}, {}
        for name, robot in scenario["robots"].items():
            start = _region(world, robot["start"])
            tracks[name] = Track(
                name,
                str(robot["model"]),
                str(robot.get("layer", "")),
                tuple(map(str, robot.get("capabilities", ()))),
                (start,),
                (_heading(robot.get("heading")),),
            )
        for obstacle in scenario.get("obstacles", ()):
            region = _region(world, obstacle["region"])
            name = obstacle.get("name", f"{obstacle['type']}@{region}")
            hidden[name] = Hidden(
                name,
                str(obstacle["type"]),
                region,
                str(obstacle.get("action", "")),
                tuple(_region(world, r) for r in obstacle.get("resolution_regions", ())),
                tuple(map(str, obstacle.get("blocks", ()))),
            )
        first = {n: objective_from_data(r.get("objective")) for n, r in scenario["robots"].items()}
        return cls(
            header,
            world,
            tracks,
            hidden,
            {name: [track.regions[0]] for name, track in tracks.items()},
            {name: [track.headings[0]] for name, track in tracks.items()},
            {name: [] for name in hidden},
            {name: [(-1, objective)] for name, objective in first.items()},
            {name: [] for name in tracks},
        )

    def tell(self, line: Line) -> None:
        kind, tick = line["type"], line["tick"]
        if not isinstance(tick, int) or tick < 0:
            raise ValueError(f"tick {tick!r} is no number of a tick")
        if kind == "move":
            self._move(line, tick)
        elif kind == "violation":
            self.violation = line
            self._status(line["obstacle"], tick, Status.FOUND)
            self._event(line, tick, line["robot"], line["proposed"])
        elif kind == "backtrack" and self.violation is not None:
            text = event_text(self.violation, line["to"])
            self.events[-1] = replace(self.events[-1], text=text)
        elif kind == "request":
            if line.get("helper") is not None:
                self._status(line["obstacle"], tick, Status.REQUESTED)
            self._event(line, tick, line["requester"], self._place(line))
        elif kind == "resolved":
            untraversable = line.get("traversable") is False
            after = Status.BLOCKED if untraversable else Status.RESOLVED
            self._status(line["obstacle"], tick, after)
            self._event(line, tick, line["robot"], line["at"])
        elif kind == "blocked":
            self._status(line["obstacle"], tick, Status.BLOCKED)
            self._event(line, tick, None, self._place(line))
        elif kind in ("push", "pop"):
            self._stack(line, tick)
        elif kind == "goal":
            self._goal(line, tick)
        elif kind == "outcome":
            self.ending = Ending(
                str(line["outcome"]),
                str(line.get("explanation") or ""),
                float(line.get("seconds") or 0),
                int(line.get("syntheses") or 0),
                float(line.get("synthesis_seconds") or 0),
            )
            self._event(line, tick, None, None)
        elif kind in ("synthesis", "assumption"):
            self._event(line, tick, line["robot"], None)

    def _move(self, line: Line, tick: int) -> None:
        regions, headings = self.regions[line["robot"]], self.headings[line["robot"]]
        if tick != len(regions):
            name = line["robot"]
            raise ValueError(f"{name} has moved up to tick {len(regions) - 1}, not to {tick - 1}")
        regions.append(_region(self.map, line["to"]))
        headings.append(_heading(line.get("heading")))

    def _stack(self, line: Line, tick: int) -> None:
        if line["type"] == "push":
            self.frames.append(
                Frame(
                    str(line.get("obstacle") or "?"),
                    str(line.get("requester") or "?"),
                    str(line.get("helper") or "?"),
                )
            )
        elif self.frames:
            self.frames.pop()
        self.stack.append((tick, tuple(self.frames)))
        for name, data in line["objectives"].items():
            objective = objective_from_data(data)
            if objective != self.objectives[name][-1][1]:
                self.objectives[name].append((tick, objective))
                self.progress[name].append((tick, Progress()))
        self._event(line, tick, line.get("requester"), self._place(line))

    def _goal(self, line: Line, tick: int) -> None:
        name, region = line["robot"], _region(self.map, line["region"])
        before = self.progress[name][-1][1] if self.progress[name] else Progress()
        now = Progress(int(line.get("round") or 0), region)
        self.progress[name].append((tick, now))
        holding = isinstance(self.objectives[name][-1][1], Hold)
        if not (holding and before.reached == region):  # holding on is no news
            self._event(line, tick, name, region)

    def _status(self, obstacle: str, tick: int, status: Status) -> None:
        self.statuses[obstacle].append((tick, status))

    def _place(self, line: Line) -> Region | None:
        obstacle = self.hidden.get(line.get("obstacle") or "")
        return None if obstacle is None else obstacle.region

    def _event(self, line: Line, tick: int, robot: str | None, region: Region | None) -> None:
        kind = EventKind(line["type"])
        if region is not None:
            _region(self.map, region)
        if robot is not None and robot not in self.tracks:
            raise ValueError(f"the header has no robot {robot!r}")
        text = event_text(line)
        self.events.append(Event(tick, kind, text, robot, region, line.get("obstacle")))

    def replay(self) -> Replay:
        last = min((len(regions) for regions in self.regions.values()), default=1) - 1
        tracks = tuple(
            replace(
                track,
                regions=tuple(self.regions[name][: last + 1]),
                headings=tuple(self.headings[name][: last + 1]),
            )
            for name, track in self.tracks.items()
        )
        changing = {name: changes[0][1] for name, changes in self.objectives.items()}
        return Replay(
            name=str(self.header["scenario"].get("name") or "unnamed"),
            map=self.map,
            robots=tracks,
            hidden=tuple(self.hidden.values()),
            last=last,
            statuses={n: Changes.of(Status.HIDDEN, c) for n, c in self.statuses.items()},
            objectives={n: Changes.of(changing[n], c) for n, c in self.objectives.items()},
            progress={n: Changes.of(Progress(), c) for n, c in self.progress.items()},
            stack=Changes.of((), self.stack),
            events=tuple(replace(e, tick=min(e.tick, last)) for e in self.events),
            ending=self.ending,
            version=str(self.header.get("safenav", "")),
        )


def _region(world: RegionMap, written: object) -> Region:
    if isinstance(written, bool) or not isinstance(written, int) or not 0 <= written < world.size:
        raise ValueError(f"{written!r} is no region of the map (0 to {world.size - 1})")
    return written


def _heading(written: object) -> Heading | None:
    if written is None:
        return None
    for heading in Heading:
        if heading.label == written:
            return heading
    raise ValueError(f"{written!r} is no heading")

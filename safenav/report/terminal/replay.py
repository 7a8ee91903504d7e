"""A replay on the terminal: the map and the events of each tick.

On a terminal each frame overwrites the previous one; a file or a pipe receives only the ticks with
other events than moves, goals, plans and syntheses.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Iterator, Sequence

import click
from msgspec.structs import replace

from safenav.report.replay.perception import shading_lines, shading_of, viewers
from safenav.report.replay.timeline import ObstacleStatus, Replay, StoryKind
from safenav.report.terminal.fold import folded
from safenav.report.terminal.map import MapPicture, Marker, draw, legend
from safenav.scenario.objective import target_regions
from safenav.trace.looks import labels

_BEGIN, _FRAME, _REST, _END = "\x1b[?25l\x1b[2J", "\x1b[H", "\x1b[J", "\x1b[?25h"
_COLOURS = {
    StoryKind.VIOLATION: "red",
    StoryKind.REQUEST: "yellow",
    StoryKind.RESOLVED: "green",
    StoryKind.BLOCKED: "magenta",
    StoryKind.OUTCOME: "cyan",
}
_LOGGED = {
    *(*_COLOURS, StoryKind.APPEARED, StoryKind.GONE, StoryKind.REOPENED, StoryKind.FAILURE),
    *(StoryKind.WAITING, StoryKind.PAUSED, StoryKind.OPERATOR, StoryKind.INPUTS),
    *(StoryKind.OBJECTIVE, StoryKind.SERVICE, StoryKind.DEADLINE, StoryKind.ASSUMPTION),
}
"""All kinds of events but the regular ones, such as goals, plans and syntheses."""


def frame(replay: Replay, tick: int, recent: int = 6) -> list[str]:
    """Return one moment as lines of text, with the last ``recent`` events up to it."""
    scene = replay.scene(tick)
    names = [track.name for track in replay.robots]
    sign = labels(names)
    robots = [
        Marker(sign[track.name], track.regions[tick], track.headings[tick])
        for track in replay.robots
    ]
    known = {status: {} for status in ObstacleStatus}  # type: dict[ObstacleStatus, dict[int, str]]
    for obstacle, status, met in scene.obstacles:
        words = "" if status is ObstacleStatus.BLOCKED else f": {obstacle.state(status, met)}"
        known[status][obstacle.region] = obstacle.label(replay.map) + words
    targets = frozenset[int]().union(*(target_regions(robot.objective) for robot in scene.robots))
    closed = known[ObstacleStatus.FOUND] | known[ObstacleStatus.REQUESTED]
    picture = MapPicture(robots, closed, known[ObstacleStatus.BLOCKED], targets)
    lines = [click.style(scene.title, bold=True) + f"  {scene.moment}", ""]
    lines += draw(replay.map, picture)
    lines.append("")
    for track, robot in zip(replay.robots, scene.robots, strict=True):
        at = replay.map.stance(track.regions[tick], track.headings[tick])
        lines.append(f"{sign[track.name]:2} {track.name} at {at}: {robot.doing}")
        if robot.taken:
            lines[-1] += f" (in transit to {replay.map.label(robot.taken[1])})"
        if equipment := robot.equipment(replay.map):
            lines[-1] += f"; {equipment}"
    lines += legend(picture)
    lines += [
        line
        for viewer in viewers(replay)
        for line in shading_lines(replace(shading_of(replay, viewer, tick), sight=None))
    ]
    for depth, held in reversed(list(enumerate(scene.stack, start=1))):
        lines.append(f"stack {depth}: {held.about(scene.map.word)} ({held.roles})")
    lines.append("")
    events = [event for event in replay.events if event.tick <= tick][-recent:]
    for event in events:
        text = f"{_moment(replay, event.tick)}  {event.text}"
        new = event.tick == tick
        lines.append(click.style(text, fg=_COLOURS.get(event.kind), dim=None if new else True))
    return lines


def _middle(replay: Replay, tick: int) -> tuple[int, int]:
    """Return the row and column at the centre of the shown part of a large map: those of the robot
    of the last event, else of the first robot."""
    text = next((e.text for e in reversed(replay.events) if e.tick <= tick), "")
    named = (t for t in replay.robots if re.search(rf"\b{t.name}\b", text))
    track = next(named, replay.robots[0])
    return replay.map.position(track.regions[tick])


def _cut(cells: Sequence[str], middle: int, most: int) -> Sequence[str]:
    """Return at most ``most`` of the cells, around number ``middle``."""
    begin = max(0, min(middle - most // 2, len(cells) - most))
    return cells[begin : begin + most]


def _fitted(lines: list[str], map_ends: int, middle: tuple[int, int]) -> list[str]:
    """Return the lines of a frame that fit the terminal: the map cut around ``middle``, the rest
    folded; if room is short, the last events take precedence over the robots."""
    width, height = shutil.get_terminal_size()
    above = folded(lines[0], width, 2)
    room = height - 1 - len(above) - 3  # three empty lines
    end = len(lines) - lines[::-1].index("")
    status = [folded(line, width, 7) for line in lines[map_ends + 1 : end - 1]]
    paragraphs = [folded(line, width, 7) for line in lines[end:]]
    while len(paragraphs) > 1 and sum(map(len, paragraphs)) > room // 3:
        del paragraphs[0]
    story = [part for parts in paragraphs for part in parts]
    pairs = ([line[i : i + 2] for i in range(0, len(line), 2)] for line in lines[2:map_ends])
    drawn = ["".join(_cut(cells, middle[1], width // 2)) for cells in pairs]
    left = room - len(story)
    rows = _cut(drawn, middle[0], max(0, left // 2, left - sum(map(len, status))))
    below = _first(status, left - len(rows))
    return [*above, "", *rows, "", *below, "", *story][: height - 1]


def _first(items: Sequence[list[str]], room: int) -> list[str]:
    """Return the lines of as many first items as have ``room``, and the number of the others."""
    if sum(map(len, items)) <= room:
        return [line for item in items for line in item]
    shown: list[str] = []
    for number, item in enumerate(items):
        if len(shown) + len(item) >= room:
            return [*shown, f"... and {len(items) - number} more"]
        shown += item
    return shown


def _pause(replay: Replay, tick: int) -> float:
    return replay.time(min(tick + 1, replay.last)) - replay.time(tick)


def _moment(replay: Replay, tick: int) -> str:
    return f"{tick:5}" if replay.times is None else f"{replay.when(tick):>9}"


def log(replay: Replay, ticks: range) -> Iterator[str]:
    """Yield the first tick, and those with a discovery, request, resolution, end, or a user's
    change."""
    for tick in ticks:
        events = replay.happened(tick)
        if tick == ticks.start or any(event.kind in _LOGGED for event in events):
            yield from frame(replay, tick, recent=max(1, len(events)))
            yield ""


def play(
    replay: Replay,
    ticks: range,
    speed: float,
    write: Callable[[str], None],
    sleep: Callable[[float], None] = time.sleep,
) -> None:
    """Show each frame over the previous one; ``speed``: ticks per second, or a multiple of the
    speed of the run's clock. The cursor is restored also after Ctrl-C."""
    write(_BEGIN)
    try:
        for tick in ticks:
            lines = _fitted(frame(replay, tick), replay.map.rows + 2, _middle(replay, tick))
            write(_FRAME + "\n".join(f"{line}\x1b[K" for line in lines) + "\n" + _REST)
            pause = 1.0 if replay.times is None else _pause(replay, tick)
            sleep(pause / speed)
    finally:
        write(_END)

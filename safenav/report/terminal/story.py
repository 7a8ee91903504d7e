"""Runs as stories on the terminal: discoveries, helpers and costs.

This listener prints the events of a run, after a map of its start. The map is text with two
characters per region: robots as labels, obstacles as blocks. Two robots above each other (one
flies) share the two characters.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence

import click

from safenav.errors import Outcome
from safenav.run.reading import Line, RunReader, run_of
from safenav.run.run import Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Event, ObstacleStatus, StoryKind
from safenav.run.wording import scheduled_words, synthesis_words
from safenav.scenario.model import Scenario
from safenav.scenario.objective import describe, target_regions
from safenav.trace.file import unstarted
from safenav.trace.words import (
    MANY,
    counted,
    obstacle_words,
    regions_words,
    seconds_words,
    shortened,
)
from safenav.world.map import Heading, Region, RegionMap

Echo = Callable[[str], None]

_NAME = re.compile(r"(?<![\w@])[\w-]+(?:@[\w|#-]+)?")
"""The pattern of words that may name a robot or obstacle."""


class Story:
    """A listener that prints a run, line by line, with ``echo``."""

    def __init__(self, scenario: Scenario, echo: Echo = click.echo, maps: bool = True) -> None:
        self._write, self._maps = echo, maps
        self._reader = RunReader(unstarted(scenario).header, RegionMap.label)
        self._colours = {track.name: track.look.colour for track in self._run.robots}
        self._told = 0
        self._syntheses: list[Event] = []
        self._in_rounds = False
        self._stamp = ""

    @property
    def _run(self) -> Run:
        return self._reader.run

    def __call__(self, line: Line) -> None:
        """Print the events of a line of the run."""
        if header := self._reader.beginning(line):
            self._reader, self._told = RunReader(header, RegionMap.label), 0
            return self._begin()
        self._reader.append(line)
        new, self._told = self._run.events[self._told :], len(self._run.events)
        if not all(event.synthesis for event in new) or not new:
            self._print_syntheses()
        for event in new:
            self._event(event)
        return None

    def _begin(self) -> None:
        run = self._run
        self._echo(click.style(run.name, bold=True))
        for track in run.robots:
            doing = run.doing(track.objectives.now)
            start = f"{track.name} ({track.model}) from {run.map.stance(*track.pose)}"
            self._echo(f"  {track.look.letters:2} {start}: {doing}")
        if self._maps:
            objectives = (track.objectives.now for track in run.robots)
            targets = frozenset[Region]().union(*map(target_regions, objectives))
            rows = draw(run.map, dict.fromkeys(targets, TARGET) | signs_of(run.robots))
            for row in ("", *rows, ""):
                self._write(f"           {row}".rstrip())

    def _event(self, event: Event) -> None:
        if event.kind is StoryKind.SYNTHESIS:
            self._syntheses.append(event)
        elif event.kind is StoryKind.GOAL:
            if event.round and not self._run.stack.now:  # each completed round once
                self._line(event.tick, event.text)
                self._in_rounds = True
        elif event.kind is StoryKind.OUTCOME:
            self._end(event)
        else:
            self._line(event.tick, event.text)
            self._changed(event)

    def _changed(self, event: Event) -> None:
        """Report that rounds restart if an event resolves an obstacle and progress is lost."""
        status = self._run.hidden[event.obstacle].status.now if event.obstacle else None
        over = event.kind is StoryKind.RESOLVED and status in _OVER
        if over and self._in_rounds and self._run.restarts_rounds(event.obstacle or ""):
            self._line(event.tick, "rounds restart")
            self._in_rounds = False

    def _end(self, event: Event) -> None:
        ending, word, why = self._run.ending, *event.text.partition(":")[::2]
        if ending is None or ending.outcome is Outcome.ERROR:  # the caller reports an error
            return
        colour = "green" if ending.outcome is Outcome.COMPLETED else "red"
        self._line(event.tick, f"{click.style(word, fg=colour, bold=True)}:{why}")
        took = counted(ending.ticks, "tick")
        if ending.makespan is not None:  # the run may wait after the last command
            over = max(ending.makespan, self._run.time(event.tick))
            took = f"{seconds_words(over)} on the clock of the run"
        syntheses = counted(ending.syntheses, "synthesis", "syntheses")
        spent, whole = map(seconds_words, (ending.synthesis_seconds, ending.seconds))
        self._echo(f"           {took}, {syntheses} ({spent} summed), {whole} total")

    def _print_syntheses(self) -> None:
        """Print successive syntheses on one line."""
        events, self._syntheses = self._syntheses, []
        found = [event.synthesis for event in events if event.synthesis is not None]
        if not found:
            return
        together = len(found) > MANY and all(each.verified for each in found)
        words = f"{len(found)} strategies, verified"
        if not together:
            words = ", ".join(f"{each.robot} ({synthesis_words(each)})" for each in found)
        verb = "resynthesized" if found[0].tick else "synthesized"
        self._line(events[0].tick, f"{verb} {words}")
        for each in found:
            if each.allows:
                doing = self._run.doing(each.objective)
                self._echo(f"             {each.robot}: {doing} ({each.allows})")
            for assumption in map(shortened, () if together else each.assumptions):
                self._echo(f"             {each.robot} assumes: {assumption}")

    def _line(self, tick: int, text: str) -> None:
        at = self._run.stamp(tick)
        stamp = at if at != self._stamp else " " * 9
        self._stamp = at
        self._echo(f"{click.style(stamp, dim=True)}  {text}")

    def _echo(self, line: str) -> None:
        self._write(self._painted(line))

    def _painted(self, line: str) -> str:
        """Return a line with robots' names in their colours, and obstacles' names in bold."""
        return _NAME.sub(lambda name: self._styled(name[0]), line)

    def _styled(self, name: str) -> str:
        colour = self._colours.get(name)
        if colour is None:
            return click.style(name, bold=True) if "@" in name else name
        red, green, blue = bytes.fromhex(colour[1:])
        return click.style(name, fg=(red, green, blue))


_OVER = {ObstacleStatus.RESOLVED, ObstacleStatus.BLOCKED}


ARROWS = {Heading.NORTH: "^", Heading.EAST: ">", Heading.SOUTH: "v", Heading.WEST: "<"}
WALL, FREE, TARGET, CLOSED = "██", " ·", " o", "▒▒"


def signs_of(robots: Iterable[RobotTrack]) -> dict[Region, str]:
    """Return two characters for each occupied region: a robot's label, with its heading if the
    label has one character; for several robots, the last characters of two labels."""
    found: dict[Region, list[RobotTrack]] = {}
    for track in robots:
        found.setdefault(track.pose[0], []).append(track)
    return {region: _sign(here) for region, here in found.items()}


def _sign(here: Sequence[RobotTrack]) -> str:
    letters, heading = [track.look.letters for track in here], here[0].pose[1]
    if len(here) > 1:
        return "".join(each[-1] for each in letters)[:2]
    arrow = "" if heading is None else ARROWS[heading]
    return f"{letters[0]}{arrow}"[:2] if len(letters[0]) < 2 else letters[0]


def draw(world: RegionMap, signs: Mapping[Region, str]) -> list[str]:
    """Return the map as lines of text, row 0 first; ``signs``: two characters for each occupied
    region."""
    regions = range(world.size)
    cells = [f"{signs.get(each, WALL if each in world.walls else FREE):2}" for each in regions]
    return ["".join(cells[i : i + world.cols]) for i in range(0, world.size, world.cols)]


def scenario_text(scenario: Scenario) -> list[str]:
    """Return the scenario as lines of text: the map with its rows and columns, then the meanings of
    its marks."""
    world, robots = scenario.map, run_of(unstarted(scenario)).robots
    targets = frozenset[Region]().union(*(target_regions(r.objective) for r in scenario.robots))
    signs = dict.fromkeys(targets, TARGET)
    signs |= {obstacle.region: CLOSED for obstacle in scenario.obstacles} | signs_of(robots)
    beside, every = len(str(world.rows - 1)), 1 if world.cols < 10 else 5
    columns = "".join(f"{col:<{2 * every}}" for col in range(0, world.cols, every))
    lines = [scenario.name, "", f"{' ' * beside} {columns.rstrip()}"]
    lines += [f"{row:>{beside}} {line}" for row, line in enumerate(draw(world, signs))]
    lines.append("")
    for track in robots:
        doing = describe(track.objectives.now, world.word) if track.objectives.now else ""
        where = f"{track.name} ({track.model}) at {world.stance(*track.pose)}"
        lines.append(f"  {track.look.letters:2} {where}: {doing}")
    lines += _obstacles(scenario)
    lines += ["  o  target of an objective"] * bool(targets)
    return lines + _names(world)


def _names(world: RegionMap) -> list[str]:
    places = ", ".join(world.label(region) for region in world.names.values())
    named = (f"  {name}: {regions_words(area)}" for name, area in world.areas.items())
    return [*([f"  names: {places}"] if places else []), *named]


def _obstacles(scenario: Scenario) -> list[str]:
    lines = []
    for obstacle in scenario.obstacles:
        status, since = ("ordered", "at") if obstacle.ordered else ("hidden", "from")
        for word, at in ((since, obstacle.appears), ("until", obstacle.goes)):
            status += "" if at is None else f" {word} {scheduled_words(scenario.clock, at)}"
        needs = ", then ".join(need.action for need in obstacle.needs)
        name = obstacle_words(obstacle.name, scenario.map.word)
        where = scenario.map.label(obstacle.region)
        lines.append(f"  {CLOSED} {name}: {status} at {where}, needs {needs}")
    return lines

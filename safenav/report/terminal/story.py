"""The run as a story on the terminal: discoveries, helpers and cost.

A listener of the mission's events; it draws the map at the start, at requests, at resolutions
and at the end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import zip_longest

import click
from msgspec.structs import replace

from safenav.outcome import Outcome, Verdict
from safenav.report.terminal.fold import folded
from safenav.report.terminal.map import MapPicture, Marker, draw
from safenav.report.terminal.map import legend as marks
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Ltl, target_regions
from safenav.scenario.objective_text import describe
from safenav.trace import records, vocabulary
from safenav.trace.looks import labels
from safenav.trace.told_objective import objective_of
from safenav.trace.wording import Wording, syntheses_words, synthesis_words
from safenav.trace.words import counted, seconds_words, shortened
from safenav.world.map import HEADINGS, Heading, Region

Echo = Callable[[str], None]
ObstacleLine = (
    records.Violation | records.Resolved | records.Gone | records.KnownObstacle | records.Reopened
)

LARGE = 2500
"""Most regions of a map that is drawn more than once."""
_COLOURS = ("cyan", "yellow", "magenta", "green", "blue", "bright_red")


class Story:
    """Listener that prints a run, line by line by ``echo``; ``width``: of the terminal, if any."""

    def __init__(
        self,
        scenario: Scenario,
        echo: Echo = click.echo,
        maps: bool = True,
        width: int | None = None,
    ) -> None:
        self._scenario = scenario
        self._write = echo
        self._width = width
        self._maps = maps
        names = [robot.name for robot in scenario.robots]
        self._letters = labels(names)
        self._colours = {n: _COLOURS[i % len(_COLOURS)] for i, n in enumerate(names)}
        self._poses: dict[str, tuple[Region, Heading | None]] = {
            r.name: (r.start.region, r.start.heading) for r in scenario.robots
        }
        self._obstacles = {o.name: o.region for o in scenario.obstacles}
        self._actions = {o.name: [n.action for n in o.needs] for o in scenario.obstacles}
        self._wording = Wording(
            scenario.map.word,
            scenario.map.label,
            self._name,
            lambda word: click.style(word, bold=True),
            len(names),
            self._actions,
            {robot.name: robot.capabilities for robot in scenario.robots},
        )
        self._closed: dict[int, str] = {}
        self._barred: dict[int, str] = {}
        self._syntheses: list[records.Synthesis] = []
        self._rounds: dict[str, int] = {}
        self._in_rounds = False
        self._doing = {r.name: describe(r.objective, scenario.map.word) for r in scenario.robots}
        self._own = {r.name: r.objective for r in scenario.robots}
        self._modes: frozenset[str] = frozenset()
        self._depth = 0
        self._now: float | None = None
        self._stamp = ""
        self._drawn: tuple[object, ...] | None = None

    def __call__(self, event: records.Record) -> None:
        """Print one event."""
        if isinstance(event, records.Checkpoint):
            return
        self._now = event.t
        if not isinstance(event, records.Synthesis):
            self._flush_syntheses()
        match event:
            case records.Header():
                self._begin()
            case records.Synthesis():
                self._syntheses.append(event)
            case records.Move():
                self._moved(event, event.to)
            case records.Arrive():
                self._moved(event, event.at)
                if event.result is not vocabulary.MoveEnd.ARRIVED or event.reason:
                    self._say(event)
            case records.Discovered():
                self._obstacles[event.obstacle.name] = event.obstacle.region
                self._actions[event.obstacle.name] = [n.action for n in event.obstacle.all_needs]
            case records.Request():
                self._say(event)
                self._map()
            case records.Push() | records.Pop():
                self._depth = event.depth
                self._say(event)
                for name, objective in event.objectives.items():
                    words = self._wording.objective(objective)
                    if self._doing.get(name) != words:
                        self._echo(f"             {self._name(name)}: {words}")
                    self._doing[name] = words
            case records.NewObjective() | records.Told():
                if not isinstance(event, records.NewObjective) or event.at_once:
                    self._doing[event.robot] = self._wording.objective(event.objective)
                self._say(event)
            case records.Goal():
                self._goal(event)
            case records.Inputs():
                self._inputs(event)
            case records.End():
                self._ended(event)
            case records.Depart() | records.Held() | records.Backtrack() | records.Belief():
                pass
            case records.Act(obstacles=()) | records.ActionEnd(reason=None | ""):
                pass
            case _ if isinstance(event, ObstacleLine):
                self._obstacle(event)
            case _:
                self._say(event)

    def _begin(self) -> None:
        self._echo(click.style(self._scenario.name, bold=True))
        for robot in self._scenario.robots:
            world, start = self._scenario.map, robot.start
            self._echo(
                f"  {self._letters[robot.name]:2} {self._name(robot.name)} ({robot.model.name}) "
                f"from {world.stance(start.region, start.heading)}: "
                f"{describe(robot.objective, world.word)}",
                indent=7,
            )
        self._map()

    def _moved(self, event: records.Move | records.Arrive, region: Region) -> None:
        facing = None if event.heading is None else HEADINGS[event.heading]
        self._poses[event.robot] = (region, facing)

    def _obstacle(self, event: ObstacleLine) -> None:
        """Print an event of an obstacle, and update the regions that it closes until its
        resolution, or permanently."""
        if isinstance(event, records.Violation):
            self._closed[event.proposed] = self._wording.obstacle(event.obstacle)
            return self._say(event)
        region = self._obstacles[event.obstacle]
        if not isinstance(event, records.Reopened):
            self._closed.pop(region, None)
        if isinstance(event, records.KnownObstacle):
            self._barred[region] = self._wording.obstacle(event.obstacle)
        else:
            self._barred.pop(region, None)
        self._say(event)
        if isinstance(event, records.Resolved):
            self._restart(event)
        if isinstance(event, records.Resolved | records.Gone):
            self._map()

    def _restart(self, event: records.Resolved) -> None:
        """Restart the rounds, which count from the last resolution."""
        if self._scenario.restarts_rounds(event.obstacle):
            if self._in_rounds:
                self._line(event.tick, "rounds restart")
            self._rounds.clear()
            self._in_rounds = False

    def _goal(self, event: records.Goal) -> None:
        """Print each completed round once, but none of robots that wait or help."""
        if self._depth == 0 and event.round > self._rounds.get(event.robot, 0):
            formulas, shown = isinstance(self._own[event.robot], Ltl), event
            if event.robot in self._modes:  # rounds of an objective under ``when`` do not count
                formulas, shown = False, replace(event, round=0)
            self._line(event.tick, self._wording.goal(shown, formulas=formulas))
            self._in_rounds = True
        self._rounds[event.robot] = event.round

    def _inputs(self, event: records.Inputs) -> None:
        """Print changed inputs; they restart the rounds of robots whose objective they change."""
        of = ((robot.name, name) for robot in self._scenario.robots for name, _ in robot.when)
        modes = frozenset(robot for robot, name in of if event.values.get(name))
        for robot in modes ^ self._modes:
            self._rounds.pop(robot, None)
        self._modes = modes
        self._say(event)

    def _ended(self, event: records.End) -> None:
        self._map()
        if event.outcome is Outcome.ERROR:  # the caller reports it
            return
        word, _, why = self._wording.sentence(event).partition(":")
        good = event.outcome is Outcome.COMPLETED
        word = click.style(word, fg="green" if good else "red", bold=True)
        self._line(event.tick, f"{word}:{why}")
        spent = seconds_words(event.synthesis_seconds)
        took = counted(event.ticks, "tick")
        if event.makespan is not None:
            over = max(event.makespan, event.t or 0.0)  # it may wait after the last command
            took = f"{seconds_words(over)} on the clock of the run"
        self._echo(
            f"           {took}, "
            f"{counted(event.syntheses, 'synthesis', 'syntheses')} "
            f"({spent} summed), {seconds_words(event.seconds)} total"
        )

    def _flush_syntheses(self) -> None:
        """Print successive syntheses on one line."""
        if not self._syntheses:
            return
        events, self._syntheses = self._syntheses, []
        names = [f"{self._name(event.robot)} ({synthesis_words(event)})" for event in events]
        first = events[0].reason is vocabulary.Reason.INITIAL
        verb = "synthesized" if first else "resynthesized"
        together = syntheses_words(events)
        self._line(events[0].tick, f"{verb} {together or ', '.join(names)}")
        assumed = (rule.rpartition(" (")[0] or rule for e in events for rule in e.assumptions)
        for rule, count in Counter(assumed).items() if together else ():
            self._echo(f"             {count} robots assume: {rule}")
        for event in events:
            objective = objective_of(event.objective)
            words = self._wording.objective(event.objective)
            if objective is not None:
                self._own[event.robot] = objective
            allows = f" ({shortened(event.allows)})" if event.allows else ""
            another = self._doing.get(event.robot) != words
            if event.verdict is Verdict.REALIZABLE:
                self._doing[event.robot] = words
            if allows or (another and event.verdict is Verdict.REALIZABLE):
                self._echo(f"             {self._name(event.robot)}: {words}{allows}")
            for assumption in map(shortened, () if together else event.assumptions):
                self._echo(f"             {self._name(event.robot)} assumes: {assumption}")

    def _say(self, event: records.Record) -> None:
        self._line(event.tick, self._wording.sentence(event))

    def _line(self, tick: int, text: str) -> None:
        at = f"tick {tick:<4}" if self._now is None else f"{self._now:>7.1f} s"
        stamp = at if at != self._stamp else " " * 9
        self._stamp = at
        self._echo(f"{click.style(stamp, dim=True)}  {text}")

    def _map(self) -> None:
        """Draw the map, unless it is the same as the last one; a large one only at the start."""
        if not self._maps or (self._drawn and self._scenario.map.size > LARGE):
            return
        scene = (dict(self._poses), dict(self._closed), dict(self._barred))
        if scene == self._drawn:
            return
        self._drawn = scene
        markers = [
            Marker(self._letters[name], region, heading)
            for name, (region, heading) in self._poses.items()
        ]
        objectives = (robot.objective for robot in self._scenario.robots)
        targets = frozenset[Region]().union(*map(target_regions, objectives))
        picture = MapPicture(markers, self._closed, self._barred, targets)
        self._write("")
        rows, legend = draw(self._scenario.map, picture), [*self._robots(), *marks(picture)]
        longest = max(len(click.unstyle(note)) for note in legend)
        beside = self._width is None or 14 + len(rows[0]) + longest <= self._width
        for line, note in zip_longest(rows, legend if beside else (), fillvalue=""):
            self._write(f"           {line:{len(rows[0])}}   {note}".rstrip())
        for note in () if beside else legend:
            self._echo(f"           {note}", 15)
        self._write("")

    def _robots(self) -> list[str]:
        return [
            f"{self._letters[name]:2} {self._name(name)} at {self._scenario.map.stance(*pose)}"
            for name, pose in self._poses.items()
        ]

    def _echo(self, line: str, indent: int = 13) -> None:
        for part in folded(line, self._width, indent):
            self._write(part)

    def _name(self, robot: str) -> str:
        return click.style(robot, fg=self._colours.get(robot))

"""The run as a story on the terminal: what was found where, who helps, what it took.

A listener of the mission's events; the map is drawn at the moments that matter (start,
request, resolution, end).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import click

from safenav.report.replay.wording import Word, obstacle_words
from safenav.report.terminal.map import MapPicture, Marker, draw, letters
from safenav.report.words import counted, with_article
from safenav.scenario.model import Scenario
from safenav.scenario.objective import describe, targets_of
from safenav.trace import records
from safenav.world.map import Heading, Region

Echo = Callable[[str], None]

_COLOURS = ("cyan", "yellow", "magenta", "green", "blue", "bright_red")
_REASONS = {
    "untraversable": "turns out not to be traversable",
    "no_capable_robot": "cannot be removed by anybody in the team",
    "no_helper": "cannot be reached by anybody who could remove it",
}


class Story:
    """Tells a run line by line through ``echo``."""

    def __init__(self, scenario: Scenario, echo: Echo = click.echo, maps: bool = True) -> None:
        self._scenario = scenario
        self._echo = echo
        self._maps = maps
        names = [robot.name for robot in scenario.robots]
        self._letters = letters(names)
        self._colours = {n: _COLOURS[i % len(_COLOURS)] for i, n in enumerate(names)}
        self._poses: dict[str, tuple[Region, Heading | None]] = {
            r.name: (r.start.region, r.start.heading) for r in scenario.robots
        }
        self._obstacles = {o.name: (o.region, o.type.action) for o in scenario.obstacles}
        self._closed: dict[Region, str] = {}
        self._barred: dict[Region, str] = {}
        self._syntheses: list[records.Synthesis] = []
        self._rounds: dict[str, int] = {}
        self._depth = 0
        self._tick = -1
        self._drawn: tuple[object, ...] | None = None

    def __call__(self, event: records.Record) -> None:
        """Hear one event."""
        if not isinstance(event, records.Synthesis):
            self._flush_syntheses()
        match event:
            case records.Header():
                self._begin()
            case records.Synthesis():
                self._syntheses.append(event)
            case records.Move():
                facing = Heading[event.heading.upper()] if event.heading else None
                self._poses[event.robot] = (event.to, facing)
            case records.Discovered():
                place = (event.obstacle.region, event.obstacle.action)
                self._obstacles[event.obstacle.name] = place
            case records.Violation():
                self._violated(event)
            case records.Request():
                self._requested(event)
            case records.Push():
                self._depth = event.depth
                if event.reason == "yield":
                    self._say(
                        event.tick,
                        f"{self._name(event.requester)} cannot get on; "
                        f"{self._name(event.helper or 'somebody')} gives way",
                    )
                self._say(event.tick, f"objectives pushed, depth {event.depth}")
                self._objectives(event.objectives)
            case records.Pop():
                self._depth = event.depth
                self._say(event.tick, f"objectives popped, depth {event.depth}")
                self._objectives(event.objectives)
            case records.Resolved():
                self._resolved(event)
            case records.Blocked():
                self._blocked(event)
            case records.Goal():
                self._goal(event)
            case records.Assumption():
                self._say(event.tick, f"{self._name(event.robot)}: assumption broken: {event.name}")
            case records.Outcome():
                self._ended(event)

    def _begin(self) -> None:
        self._echo(click.style(self._scenario.name, bold=True))
        for robot in self._scenario.robots:
            facing = f" facing {robot.start.heading.label}" if robot.start.heading else ""
            self._echo(
                f"  {self._letters[robot.name]}  {self._name(robot.name)} ({robot.model.name}) "
                f"from {self._region(robot.start.region)}{facing}: "
                f"{describe(robot.objective, self._word)}"
            )
        self._map()

    def _violated(self, event: records.Violation) -> None:
        kind = self._kind(event.obstacle)
        self._closed[event.proposed] = self._obstacle(event.obstacle)
        self._say(
            event.tick,
            f"{self._name(event.robot)} at {self._region(event.at)} finds "
            f"{click.style(kind, bold=True)} at {self._region(event.proposed)} and keeps out: "
            f"it lacks '{event.action}'",
        )

    def _requested(self, event: records.Request) -> None:
        offers = ", ".join(
            f"{name} " + ("cannot get there" if d is None else f"in {counted(d, 'step')}")
            for name, d in event.bids.items()
        )
        asks = f"{self._name(event.requester)} asks for help with {self._obstacle(event.obstacle)}"
        if event.helper is None:
            self._say(event.tick, f"{asks}: {offers or 'nobody has the capability'}; nobody helps")
        else:
            self._say(event.tick, f"{asks}: {offers}; {self._name(event.helper)} helps")
        self._map()

    def _resolved(self, event: records.Resolved) -> None:
        region, action = self._obstacles[event.obstacle]
        obstacle = click.style(self._obstacle(event.obstacle), bold=True)
        self._closed.pop(region, None)
        found = {True: ", it is traversable", False: ", it is not traversable", None: ""}
        unasked = "" if event.requested else " without being asked"
        self._rounds.clear()  # they are counted from the last resolution on
        self._say(
            event.tick,
            f"{self._name(event.robot)} at {self._region(event.at)} performs '{action}'{unasked}: "
            f"{obstacle} is resolved{found[event.traversable]}",
        )
        self._map()

    def _blocked(self, event: records.Blocked) -> None:
        region, _ = self._obstacles[event.obstacle]
        self._closed.pop(region, None)
        self._barred[region] = self._obstacle(event.obstacle)
        robots = ", ".join(self._name(name) for name in event.robots)
        obstacle = self._obstacle(event.obstacle)
        self._say(
            event.tick,
            f"{obstacle} {_REASONS[event.reason]}; from now on an obstacle for {robots}",
        )

    def _goal(self, event: records.Goal) -> None:
        """Tell each completed round once, and nothing of those who wait or help."""
        if self._depth == 0 and event.round > self._rounds.get(event.robot, 0):
            at = self._region(event.region)
            done = f"round {event.round} done"
            self._say(event.tick, f"{self._name(event.robot)} reaches {at}, {done}")
        self._rounds[event.robot] = event.round

    def _ended(self, event: records.Outcome) -> None:
        self._map()
        good = event.outcome == "completed"
        word = click.style(event.outcome, fg="green" if good else "red", bold=True)
        if event.outcome == "error":  # whoever started the run reports it
            return
        self._say(event.tick, f"{word}: {event.explanation}")
        self._echo(
            f"           {counted(event.ticks, 'tick')}, "
            f"{counted(event.syntheses, 'synthesis', 'syntheses')} "
            f"({_duration(event.synthesis_seconds)} of work), {_duration(event.seconds)} in all"
        )

    def _objectives(self, objectives: Mapping[str, records.Objective]) -> None:
        for name, objective in objectives.items():
            self._echo(
                f"             {self._name(name)}: {_objective_words(objective, self._word)}"
            )

    def _flush_syntheses(self) -> None:
        if not self._syntheses:
            return
        events, self._syntheses = self._syntheses, []
        told = []
        for event in events:
            if event.verdict == "realizable":
                cached = ", cached" if event.cached else ""
                proof = ", verified" if event.verified else ""
                states = counted(event.states or 0, "state")
                size = f"{states} in {_duration(event.seconds)}{cached}{proof}"
                told.append(f"{self._name(event.robot)} ({size})")
            else:
                told.append(f"{self._name(event.robot)} ({event.verdict})")
        verb = "synthesized" if events[0].reason == "initial" else "resynthesized"
        self._say(events[0].tick, f"{verb} {', '.join(told)}")
        for event in events:
            for assumption in event.assumptions:
                self._echo(f"             {self._name(event.robot)} assumes: {assumption}")

    def _say(self, tick: int, text: str) -> None:
        stamp = f"tick {tick:<4}" if tick != self._tick else " " * 9
        self._tick = tick
        self._echo(f"{click.style(stamp, dim=True)}  {text}")

    def _map(self) -> None:
        """Draw the map, unless it would be the one just drawn."""
        if not self._maps:
            return
        scene = (dict(self._poses), dict(self._closed), dict(self._barred))
        if scene == self._drawn:
            return
        self._drawn = scene
        markers = [
            Marker(self._letters[name], region, heading)
            for name, (region, heading) in self._poses.items()
        ]
        targets = [
            region
            for robot in self._scenario.robots
            for target in targets_of(robot.objective)
            for region in target
        ]
        picture = MapPicture(markers, self._closed, self._barred, targets)
        self._echo("")
        legend = self._legend()
        for row, line in enumerate(draw(self._scenario.map, picture)):
            note = f"   {legend[row]}" if row < len(legend) else ""
            self._echo(f"           {line}{note}")
        self._echo("")

    def _legend(self) -> list[str]:
        lines = [
            f"{self._letters[name]}  {self._name(name)} at {self._region(region)}"
            for name, (region, _) in self._poses.items()
        ]
        lines += [f"▒▒ {name}" for name in self._closed.values()]
        lines += [f"XX {name}, barred" for name in self._barred.values()]
        lines.append(" o target of an objective")
        return lines

    def _kind(self, obstacle: str) -> str:
        return with_article(obstacle.split("@", 1)[0])

    def _obstacle(self, name: str) -> str:
        return obstacle_words(name, self._word)

    def _word(self, region: Region) -> str:
        return self._scenario.map.word(region)

    def _name(self, robot: str) -> str:
        return click.style(robot, fg=self._colours.get(robot))

    def _region(self, region: Region) -> str:
        return self._scenario.map.label(region)


def _objective_words(objective: records.Objective, word: Word) -> str:
    """An objective as in a trace, in a few words."""
    kind = objective.kind
    if kind == "ltl":
        return "ltl"
    words = ["|".join(map(word, sorted(target))) for target in objective.targets]
    return f"{kind} {(' <-> ' if kind == 'patrol' else ', ').join(words)}"


def _duration(seconds: float) -> str:
    return f"{seconds * 1000:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"

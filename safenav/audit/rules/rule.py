"""Base class of rules, and their findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import ClassVar, cast

from safenav.audit.lines import Line
from safenav.audit.run.situation import Situation


@dataclass(frozen=True)
class Finding:
    """A broken rule: its tick, the robot (None: no robot in particular), the line of the trace that
    shows it, and what is wrong in the words of the scenario. ``unknown``: what cannot be judged,
    since it is larger than this check accepts. ``note``: no rule is broken as far as is known, but
    this part of the line was not judged."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str
    unknown: bool = False
    note: bool = False

    def __str__(self) -> str:
        whom = f", {self.robot}" if self.robot else ""
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


Wrong = tuple[str | None, str, Line]
"""The robot, what is wrong, and the line (or turn) that shows it."""
Said = str | tuple[str | None, str] | Wrong | Finding
"""Words of a rule: what is wrong, with a robot or a line if not those that it judges."""


class Postponed:
    """Lines missing in a turn of a live run, which may follow when the strategies for them arrive:
    they are missing permanently if no robot waits for a strategy, or acts. A robot that was busy
    as they were due may wait for one as well: it shows that once it stands still, and has not
    waited if it departs again."""

    def __init__(self) -> None:
        self._open: list[tuple[Wrong, Callable[[], bool], dict[str, int | None]]] = []

    @property
    def is_empty(self) -> bool:
        """Return whether no earlier turn lacks a line."""
        return not self._open

    def judge(
        self, found: Iterable[tuple[Wrong, Callable[[], bool]]], now: Situation
    ) -> Iterator[Wrong]:
        """Yield what is missing, of what was ``found`` in this turn and before. Each has a function
        that tells whether that has come."""
        if not now.live:
            yield from (wrong for wrong, _ in found)
            return
        busy = {*now.under_way, *now.acting}
        commands = {n: now.under_way[n].command if n in now.under_way else None for n in busy}
        fresh = [(*one, dict(commands)) for one in found]
        self._open = [one for one in (*self._open, *fresh) if not one[1]()]
        for _, _, waits in self._open:
            for name, command in [*waits.items()]:
                if _has_not_waited(name, command, now):
                    del waits[name]
        if now.awaiting or now.acting:  # who acts may wait for a strategy as well
            return
        late = [one for one in self._open if not one[2] and now.turn.tick > one[0][2].tick + 1]
        self._open = [one for one in self._open if one not in late]
        yield from (wrong for wrong, _, _ in late)


def _has_not_waited(name: str, command: int | None, now: Situation) -> bool:
    """Return whether a robot that was busy, with that command if it was in transit, has begun
    another step since, or stands still without waiting for a strategy."""
    if name in now.under_way:
        return bool(now.under_way[name].command != command)
    if name in now.acting or name in now.awaiting or now.turn.robot != name:
        return False
    return not now.turn.on_the_way and now.turn.first("acted") is None


class Rule:
    """A condition that must hold for every run. One object checks one trace, and may keep state.

    ``name`` is the rule's name in reports; ``kinds``: the types of the lines that it judges (none:
    all). The docstring states its demand and the source (D: the design's section, T:
    docs/trace.md)."""

    name: ClassVar[str]
    kinds: ClassVar[tuple[str, ...]] = ()

    def opening(self, now: Situation) -> Iterable[Said]:
        """Check the header alone; called once."""
        return ()

    def line(self, record: Line, now: Situation) -> Iterable[Said]:
        """Check a line before it takes effect."""
        return ()

    def turn(self, now: Situation) -> Iterable[Said]:
        """Check a turn that is over (``now.turn``)."""
        return ()

    def ending(self, now: Situation) -> Iterable[Said]:
        """Check the whole run by its last line; called once."""
        return ()

    def not_judged(self, record: Line, robot: str | None, what: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, f"not judged: {what}", note=True)

    def finding(self, said: Said, about: Line, robot: str | None) -> Finding:
        """Words of a rule about a line or turn, and a robot, unless others are named."""
        if isinstance(said, Finding):
            return said
        whom, text, *other = (robot, said) if isinstance(said, str) else said
        at = other[0] if other else about
        return Finding(self.name, at.tick, whom, at.line, text)


def judges(moment: str, *kinds: str) -> Callable[[Callable[..., Iterable[Said]]], type[Rule]]:
    """Make a rule without a state of a function, whose name it has. ``moment``: the method of Rule
    that the function stands for."""

    def made(judge: Callable[..., Iterable[Said]]) -> type[Rule]:
        name = judge.__name__.strip("_").replace("_", "-")
        about = {"name": name, "kinds": kinds, moment: staticmethod(judge)}
        about |= {"__doc__": judge.__doc__, "__module__": judge.__module__}
        return cast("type[Rule]", type(name, (Rule,), about))

    return made

"""Base class of rules, and their findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, cast

from safenav.audit.lines import Line
from safenav.audit.run.situation import Situation


@dataclass(frozen=True)
class Finding:
    """A broken rule: its tick, the robot (None: no robot in particular), the line of the trace that
    shows it, and an explanation in the words of the scenario. ``unknown``: the condition cannot be
    judged, because it exceeds the limits of this check. ``note``: no rule is known to be broken,
    but a part of the line was not judged."""

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


UNREAD = "formulas that this check does not read"
"""Why a part is not judged; the words of the formulas never become part of a report."""

Wrong = tuple[str | None, str, Line]
"""The robot, the error, and the line (or turn) that shows it."""
Message = str | tuple[str | None, str] | Wrong | Finding
"""Result of a rule: the error, with a robot or a line if they differ from those it judges."""


_REGIONS = ("at", "from_", "proposed", "region")


def differences(record: Line, now: Situation, **derived: object) -> Iterator[str]:
    """Yield the fields of a line that differ from their values derived from the lines before it."""
    for name, truth in derived.items():
        stated = getattr(record, name)
        if stated != truth:
            here, there = (_shown(name, value, now) for value in (stated, truth))
            yield f"'{name.rstrip('_')}' of this {record.type} line is {here}, not {there}"


def _shown(field: str, value: Any, now: Situation) -> str:
    if field in _REGIONS and isinstance(value, int):
        return now.show(value)
    return names(value) if isinstance(value, set | frozenset) else str(value)


def names(robots: Iterable[str]) -> str:
    """Return names of robots, in alphabetical order, for a finding."""
    return ", ".join(sorted(robots)) or "no robot"


class Postponed:
    """Lines missing in a turn of a live run that may follow when their strategies arrive. They are
    missing permanently once no robot waits for a strategy or acts. A robot that was busy when they
    were due may also wait for one: this shows only when it stands still; if it departs again, it
    has not waited."""

    def __init__(self) -> None:
        self._open: list[tuple[Wrong, Callable[[], bool], dict[str, int | None]]] = []

    def judge(
        self, found: Iterable[tuple[Wrong, Callable[[], bool]]], now: Situation
    ) -> Iterator[Wrong]:
        """Yield the errors of this turn (``found``) and of earlier turns that have become
        permanent. Each error has a function that returns whether the missing line has followed."""
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
        if now.awaiting or now.acting:  # a robot that acts may also wait for a strategy
            return
        late = [one for one in self._open if not one[2] and now.turn.tick > one[0][2].tick + 1]
        self._open = [one for one in self._open if one not in late]
        yield from (wrong for wrong, _, _ in late)


def _has_not_waited(name: str, command: int | None, now: Situation) -> bool:
    """Return whether a robot that was busy (``command``: its step, if it was in transit) has begun
    another step since, or stands still without waiting for a strategy."""
    if name in now.under_way:
        return bool(now.under_way[name].command != command)
    if name in now.acting or name in now.awaiting or now.turn.robot != name:
        return False
    return not now.turn.on_the_way and now.turn.first("acted") is None


class Rule:
    """A condition that must hold for every run. One object checks one trace, and may keep state.
    ``name``: name of the rule in reports; ``kinds``: the types of lines that it judges (empty:
    all). The docstring states the condition and its source (D: section of the design, T:
    docs/trace.md)."""

    name: ClassVar[str]
    kinds: ClassVar[tuple[str, ...]] = ()

    def opening(self, now: Situation) -> Iterable[Message]:
        """Check the header alone; called once."""
        return ()

    def line(self, record: Line, now: Situation) -> Iterable[Message]:
        """Check a line before it takes effect."""
        return ()

    def turn(self, now: Situation) -> Iterable[Message]:
        """Check a turn that has ended (``now.turn``)."""
        return ()

    def ending(self, now: Situation) -> Iterable[Message]:
        """Check the whole run by its last line; called once."""
        return ()

    def not_judged(self, record: Line, robot: str | None, what: str) -> Finding:
        return Finding(self.name, record.tick, robot, record.line, f"not judged: {what}", note=True)

    def finding(self, message: Message, about: Line, robot: str | None) -> Finding:
        """Return the finding about a line or turn and a robot, unless it names others."""
        if isinstance(message, Finding):
            return message
        whom, text, *other = (robot, message) if isinstance(message, str) else message
        at = other[0] if other else about
        return Finding(self.name, at.tick, whom, at.line, text)


def judges(moment: str, *kinds: str) -> Callable[[Callable[..., Iterable[Message]]], type[Rule]]:
    """Return a decorator that turns a function into a rule without state and with its name.
    ``moment``: the method of Rule that the function implements."""

    def made(judge: Callable[..., Iterable[Message]]) -> type[Rule]:
        name = judge.__name__.strip("_").replace("_", "-")
        about = {"name": name, "kinds": kinds, moment: staticmethod(judge)}
        about |= {"__doc__": judge.__doc__, "__module__": judge.__module__}
        return cast("type[Rule]", type(name, (Rule,), about))

    return made

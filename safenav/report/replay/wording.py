"""How the lines of a trace are told to people, in scenario terms.

One sentence a line; the page, the pictures and the terminal replay all use these.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from functools import singledispatch

from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Patrol, Visit, describe
from safenav.trace import records
from safenav.world.map import Region


def objective_of(told: records.Objective) -> Objective | None:
    """The objective that a trace names; None for a kind that is not known here."""
    match told.kind, told.targets:
        case "patrol", (first, second):
            return Patrol(first, second)
        case "visit", targets:
            return Visit(targets)
        case "cover", targets:
            return Cover(targets)
        case "hold", (target,):
            return Hold(target)
        case "ltl", _:
            return _ltl(told.body)
    return None


def _ltl(spelled: str) -> Ltl:
    """Only how much there is of each part: no picture shows more."""
    try:
        parts = json.loads(spelled)
        safety, liveness = (tuple(map(str, parts.get(k, ()))) for k in ("safety", "liveness"))
        return Ltl(safety=safety, liveness=liveness)
    except (ValueError, TypeError, AttributeError):
        return Ltl()


Word = Callable[[Region], str]
"""What a region is called: its name or its number."""


def objective_words(objective: Objective | None, word: Word = str) -> str:
    return "no objective" if objective is None else describe(objective, word)


def obstacle_words(name: str, word: Word = str) -> str:
    """``door@47``, or ``door@dock`` where the region has a name."""
    kind, at, region = name.partition("@")
    return f"{kind}@{word(int(region))}" if at and region.isdecimal() else name


def seconds_words(seconds: float) -> str:
    """A duration in the unit that fits: ``12 ms``, ``3.4 s``, ``2 min 5 s``."""
    if seconds < 0.0005:
        return "under 1 ms"
    if seconds < 0.9995:
        return f"{seconds * 1000:.0f} ms"
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    return f"{round(seconds) // 60} min {round(seconds) % 60} s"


@singledispatch
def event_text(line: records.Record, word: Word = str) -> str:
    """One trace line as a sentence, without its full stop; ``word`` names regions."""
    del word
    raise TypeError(f"{type(line).__name__} is no event")


def backtrack_text(
    violation: records.Violation, backtrack: records.Backtrack, word: Word = str
) -> str:
    """A violation and the safe action that was taken instead, as one sentence."""
    stays = backtrack.to == violation.at
    way = "it stays" if stays else f"it goes to {word(backtrack.to)}"
    return f"{event_text(violation, word)}; {way}"


_REASONS = {
    records.Reason.INITIAL: "before the start",
    records.Reason.REQUEST: "to meet a request",
    records.Reason.RESOLVED: "after a resolution",
    records.Reason.BLOCKED: "around a blocked region",
    records.Reason.YIELD: "to make way",
}

_BLOCK_REASONS = {
    records.BlockReason.UNTRAVERSABLE: "it is not traversable",
    records.BlockReason.NO_CAPABLE_ROBOT: "no robot has the action it needs",
    records.BlockReason.NO_HELPER: "no robot can help",
}


@event_text.register
def _(line: records.Synthesis, word: Word = str) -> str:
    del word
    realizable = line.verdict is records.Verdict.REALIZABLE
    found = line.verdict.value.replace("_", " ")
    if realizable and line.states is not None:
        found = _counted(line.states, "state")
    spent = "from the cache" if line.cached else seconds_words(line.seconds)
    text = f"synthesis for {line.robot} {_REASONS[line.reason]}: {found}, {spent}"
    if line.verified is not None:
        text += ", verified" if line.verified else ", verification failed"
    return text


@event_text.register
def _(line: records.Violation, word: Word = str) -> str:
    place = f"{line.robot} at {word(line.at)} would enter {word(line.proposed)}"
    return f"{place}: {obstacle_words(line.obstacle, word)} is there and it cannot {line.action}"


@event_text.register
def _(line: records.Request, word: Word = str) -> str:
    bids = [
        f"{name} cannot get there" if bid is None else f"{name} is {_counted(bid, 'step')} away"
        for name, bid in line.bids.items()
    ]
    text = f"{line.requester} asks for help with {obstacle_words(line.obstacle, word)}"
    text += f" ({', '.join(bids)})" if bids else ""
    return text + (f": {line.helper} helps" if line.helper else ": nobody can help")


@event_text.register
def _(line: records.Push, word: Word = str) -> str:
    tasks = [
        f"{name}: {objective_words(objective_of(line.objectives[name]), word)}"
        for name in (line.requester, line.helper)
        if name is not None and name in line.objectives
    ]
    text = f"objectives pushed, depth {line.depth}"
    return text + (f" ({'; '.join(tasks)})" if tasks else "")


def yielding_text(line: records.Push, about: str, yielding: Iterable[str], word: Word = str) -> str:
    """A push by which robots give way; ``about`` says who to whom."""
    tasks = [
        f"{name}: {objective_words(objective_of(line.objectives[name]), word)}"
        for name in yielding
        if name in line.objectives
    ]
    return about + (f" ({'; '.join(tasks)})" if tasks else "")


def yielded_text(line: records.Pop, yielding: Sequence[str], word: Word = str) -> str:
    """The pop after robots have given way."""
    verb = "has" if len(yielding) == 1 else "have"
    done = f"{listed(yielding)} {verb} given way to {line.requester or 'the others'}"
    return f"{done}: {event_text(line, word)}"


@event_text.register
def _(line: records.Resolved, word: Word = str) -> str:
    text = f"{line.robot} at {word(line.at)} resolves {obstacle_words(line.obstacle, word)}"
    if line.traversable is not None:
        text += ", which is traversable" if line.traversable else ", which is not traversable"
    return text if line.requested else text + " (nobody had asked)"


@event_text.register
def _(line: records.Blocked, word: Word = str) -> str:
    whom = listed(sorted(line.robots))
    obstacle = obstacle_words(line.obstacle, word)
    return f"{obstacle} stays blocked for {whom}: {_BLOCK_REASONS[line.reason]}"


@event_text.register
def _(line: records.Pop, word: Word = str) -> str:
    obstacle = f" ({obstacle_words(line.obstacle, word)})" if line.obstacle else ""
    return f"objectives restored, depth {line.depth}{obstacle}"


@event_text.register
def _(line: records.Goal, word: Word = str) -> str:
    done = f", {_counted(line.round, 'round')} done" if line.round else ""
    return f"{line.robot} reaches {word(line.region)}{done}"


def holding_text(line: records.Goal, word: Word = str) -> str:
    """The goal of a robot that is to stay where it is."""
    return f"{line.robot} holds {word(line.region)}"


@event_text.register
def _(line: records.Assumption, word: Word = str) -> str:
    del word
    return f"{line.robot}: the assumption {line.name} was violated"


@event_text.register
def _(line: records.Outcome, word: Word = str) -> str:
    del word
    text = line.outcome.value.replace("_", " ")
    return f"{text}: {line.explanation}" if line.explanation else text


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def regions_words(regions: Iterable[Region], word: Word = str) -> str:
    """Regions in short: ``22-24, 35``; a region alone by its name."""
    runs: list[tuple[int, int]] = []
    for region in sorted(regions):
        if runs and region == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], region)
        else:
            runs.append((region, region))
    return ", ".join(word(a) if a == b else f"{a}-{b}" for a, b in runs)


def listed(names: Iterable[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``; ``nobody`` without any."""
    words = list(names)
    if len(words) < 2:
        return words[0] if words else "nobody"
    return ", ".join(words[:-1]) + " and " + words[-1]

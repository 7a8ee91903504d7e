"""How the lines of a trace are told to people, in scenario terms.

One sentence a line; the page, the pictures and the terminal replay all use these.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import singledispatch

from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Patrol, Visit, describe
from safenav.trace import records


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


def objective_words(objective: Objective | None) -> str:
    return "no objective" if objective is None else describe(objective)


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
def event_text(line: records.Record) -> str:
    """One trace line as a sentence, without its full stop."""
    raise TypeError(f"{type(line).__name__} is no event")


def backtrack_text(violation: records.Violation, backtrack: records.Backtrack) -> str:
    """A violation and the safe action that was taken instead, as one sentence."""
    stays = backtrack.to == violation.at
    return event_text(violation) + ("; it stays" if stays else f"; it goes to {backtrack.to}")


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
def _(line: records.Synthesis) -> str:
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
def _(line: records.Violation) -> str:
    place = f"{line.robot} at {line.at} would enter {line.proposed}"
    return f"{place}: {line.obstacle} is there and it cannot {line.action}"


@event_text.register
def _(line: records.Request) -> str:
    bids = [
        f"{name} cannot get there" if bid is None else f"{name} is {_counted(bid, 'step')} away"
        for name, bid in line.bids.items()
    ]
    text = f"{line.requester} asks for help with {line.obstacle}"
    text += f" ({', '.join(bids)})" if bids else ""
    return text + (f": {line.helper} helps" if line.helper else ": nobody can help")


@event_text.register
def _(line: records.Push) -> str:
    tasks = [
        f"{name}: {objective_words(objective_of(line.objectives[name]))}"
        for name in (line.requester, line.helper)
        if name is not None and name in line.objectives
    ]
    text = f"objectives pushed, depth {line.depth}"
    return text + (f" ({'; '.join(tasks)})" if tasks else "")


def yielding_text(line: records.Push, about: str, yielding: Iterable[str]) -> str:
    """A push by which robots give way; ``about`` says who to whom."""
    tasks = [
        f"{name}: {objective_words(objective_of(line.objectives[name]))}"
        for name in yielding
        if name in line.objectives
    ]
    return about + (f" ({'; '.join(tasks)})" if tasks else "")


def yielded_text(line: records.Pop, yielding: Sequence[str]) -> str:
    """The pop after robots have given way."""
    verb = "has" if len(yielding) == 1 else "have"
    done = f"{listed(yielding)} {verb} given way to {line.requester or 'the others'}"
    return f"{done}: {event_text(line)}"


@event_text.register
def _(line: records.Resolved) -> str:
    text = f"{line.robot} at {line.at} resolves {line.obstacle}"
    if line.traversable is not None:
        text += ", which is traversable" if line.traversable else ", which is not traversable"
    return text if line.requested else text + " (nobody had asked)"


@event_text.register
def _(line: records.Blocked) -> str:
    whom = listed(sorted(line.robots))
    return f"{line.obstacle} stays blocked for {whom}: {_BLOCK_REASONS[line.reason]}"


@event_text.register
def _(line: records.Pop) -> str:
    obstacle = f" ({line.obstacle})" if line.obstacle else ""
    return f"objectives restored, depth {line.depth}{obstacle}"


@event_text.register
def _(line: records.Goal) -> str:
    done = f", {_counted(line.round, 'round')} done" if line.round else ""
    return f"{line.robot} reaches {line.region}{done}"


def holding_text(line: records.Goal) -> str:
    """The goal of a robot that is to stay where it is."""
    return f"{line.robot} holds {line.region}"


@event_text.register
def _(line: records.Assumption) -> str:
    return f"{line.robot}: the assumption {line.name} was violated"


@event_text.register
def _(line: records.Outcome) -> str:
    text = line.outcome.value.replace("_", " ")
    return f"{text}: {line.explanation}" if line.explanation else text


def _counted(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("" if number == 1 else "s")


def regions_words(regions: Iterable[int]) -> str:
    """Regions in short: ``22-24, 35``."""
    runs: list[tuple[int, int]] = []
    for region in sorted(regions):
        if runs and region == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], region)
        else:
            runs.append((region, region))
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)


def listed(names: Iterable[str]) -> str:
    """``a``, ``a and b``, ``a, b and c``; ``nobody`` without any."""
    words = list(names)
    if len(words) < 2:
        return words[0] if words else "nobody"
    return ", ".join(words[:-1]) + " and " + words[-1]

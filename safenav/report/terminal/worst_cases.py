"""The best and the worst times of resolutions, for people and as data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from safenav.runtime.deadlines.worst import Times, Worst
from safenav.scenario.objective import Word
from safenav.trace.words import obstacle_words
from safenav.world.moves import Pose


def worst_lines(cases: Sequence[Worst], word: Word) -> Iterator[str]:
    """``door@47: at best 2, at worst 9 ticks from request to resolution (digit at 28 ...)``."""
    for case in cases:
        name, alone, around = obstacle_words(case.obstacle.name, word), case.alone, case.surrounded
        times = "never resolved" if alone.best is None else f"at best {alone.best}, {_worst(alone)}"
        yield f"{name}: {times} ({_moment(alone.moment, word)})"
        if around is not None and around.worst != alone.worst:
            at = _moment(around.moment, word)
            yield f"    with the other obstacles standing: {_worst(around)} ({at})"
        if case.limit is not None:
            late = [t for t in (alone, around) if t and (t.worst is None or t.worst > case.limit)]
            if late:
                at = _moment(late[0].moment, word)
                yield f"    resolve_within {case.limit}: not with {at}"


def worst_data(case: Worst) -> dict[str, Any]:
    return {
        "obstacle": case.obstacle.name,
        "resolve_within": case.limit,
        "alone": _data(case.alone),
        "with_others": None if case.surrounded is None else _data(case.surrounded),
    }


def _data(times: Times) -> dict[str, Any]:
    at = {
        name: [pose.region, None if pose.heading is None else pose.heading.label]
        for name, pose in times.moment.items()
    }
    return {"best": times.best, "worst": times.worst, "moment": at, "all_moments": times.whole}


def _worst(times: Times) -> str:
    if times.worst is None:
        return "at worst never"
    most = f"{times.worst}" if times.whole else f"{times.worst} or more"
    return f"at worst {most} ticks from request to resolution"


def _moment(moment: Mapping[str, Pose], word: Word) -> str:
    told = [
        f"{name} at {word(pose.region)}"
        + ("" if pose.heading is None else f" facing {pose.heading.label}")
        for name, pose in moment.items()
    ]
    return ", ".join(told)

"""How the lines of a trace are told to people, in scenario terms.

One sentence a line; the page, the pictures and the terminal replay all use these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Patrol, Target, Visit, describe


def objective_from_data(data: object) -> Objective | None:
    """The objective that a trace line writes; None for a kind that is not known here.

    The inverse of ``safenav.scenario.objective.to_data`` (``ltl`` without its text, which no
    picture shows).
    """
    if not isinstance(data, Mapping) or len(data) != 1:
        return None
    kind, written = next(iter(data.items()))
    if kind == "hold":
        target = _target(written)
        return Hold(target) if target else None
    if kind == "ltl" and isinstance(written, Mapping):
        return Ltl(
            init=_texts(written.get("init")),
            safety=_texts(written.get("safety")),
            liveness=_texts(written.get("liveness")),
        )
    if not isinstance(written, list):
        return None
    targets = tuple(_target(item) for item in written)
    if not targets or not all(targets):
        return None
    if kind == "patrol" and len(targets) == 2:
        return Patrol(targets[0], targets[1])
    if kind == "visit":
        return Visit(targets)
    return Cover(targets) if kind == "cover" else None


def _target(written: object) -> Target:
    regions = written if isinstance(written, list) else [written]
    return frozenset(r for r in regions if isinstance(r, int))


def _texts(written: object) -> tuple[str, ...]:
    return tuple(str(text) for text in written) if isinstance(written, list) else ()


def objective_words(objective: Objective | None) -> str:
    return "no objective" if objective is None else describe(objective)


def seconds_words(seconds: float) -> str:
    """A duration in the unit that fits: ``12 ms``, ``3.4 s``, ``2 min 5 s``."""
    if seconds < 0.0005:
        return "under 1 ms"
    if seconds < 1:
        return f"{seconds * 1000:.0f} ms"
    if seconds < 60:
        return f"{seconds:.1f} s"
    return f"{int(seconds) // 60} min {int(seconds) % 60} s"


def event_text(line: Mapping[str, Any], backtracked: object = None) -> str:
    """One trace line as a sentence. ``backtracked``: where the ``backtrack`` line that goes
    with a violation leads."""
    return _SENTENCES[line["type"]]({**line, "backtracked": backtracked})


def _synthesis(line: Mapping[str, Any]) -> str:
    why = {
        "initial": "before the start",
        "request": "to meet a request",
        "resolved": "after a resolution",
        "blocked": "around a blocked region",
        "yield": "to make way",
    }.get(str(line.get("reason")), str(line.get("reason")))
    text = f"synthesis for {line['robot']} {why}: "
    verdict = str(line.get("verdict")).replace("_", " ")
    states = line.get("states")
    text += f"{states} states" if verdict == "realizable" and states is not None else verdict
    if line.get("cached"):
        text += ", from the cache"
    elif isinstance(line.get("seconds"), int | float):
        text += f", {seconds_words(line['seconds'])}"
    if line.get("verified") is not None:
        text += ", verified" if line["verified"] else ", verification failed"
    return text


def _violation(line: Mapping[str, Any]) -> str:
    text = (
        f"{line['robot']} at {line['at']} would enter {line['proposed']}: {line['obstacle']} is "
        f"there and it cannot {line.get('action')}"
    )
    to = line["backtracked"]
    if to is None:
        return text
    return text + ("; it stays" if to == line["at"] else f"; it goes to {to} instead")


def _request(line: Mapping[str, Any]) -> str:
    bids = line.get("bids")
    bids = bids if isinstance(bids, Mapping) else {}
    steps = [
        f"{name} cannot get there" if bid is None else f"{name} is {bid} steps away"
        for name, bid in bids.items()
    ]
    text = f"{line['requester']} asks for help with {line['obstacle']}"
    text += f" ({', '.join(steps)})" if steps else ""
    helper = line.get("helper")
    return text + (f": {helper} helps" if helper else ": nobody can help")


def _push(line: Mapping[str, Any]) -> str:
    robots = [line.get("requester"), line.get("helper")]
    objectives = line["objectives"]
    tasks = [
        f"{name}: {objective_words(objective_from_data(objectives[name]))}"
        for name in dict.fromkeys(robots)
        if name in objectives
    ]
    return f"objectives pushed, depth {line['depth']}" + (f" ({'; '.join(tasks)})" if tasks else "")


def _resolved(line: Mapping[str, Any]) -> str:
    text = f"{line['robot']} at {line['at']} resolves {line['obstacle']}"
    truth = line.get("traversable")
    if truth is not None:
        text += ", which is traversable" if truth else ", which is not traversable"
    return text if line.get("requested", True) else text + " (nobody had asked)"


def _blocked(line: Mapping[str, Any]) -> str:
    why = {
        "untraversable": "it is not traversable",
        "no_capable_robot": "no robot has the action it needs",
        "no_helper": "no robot can get there",
    }.get(str(line.get("reason")), str(line.get("reason")))
    return f"{line['obstacle']} stays blocked for {_listed(line.get('robots') or [])}: {why}"


def _pop(line: Mapping[str, Any]) -> str:
    obstacle = line.get("obstacle")
    return f"objectives restored, depth {line['depth']}" + (f" ({obstacle})" if obstacle else "")


def _goal(line: Mapping[str, Any]) -> str:
    rounds = line.get("round")
    done = f", {rounds} round{'s' * (rounds != 1)} done" if rounds else ""
    return f"{line['robot']} reaches {line['region']}{done}"


def _assumption(line: Mapping[str, Any]) -> str:
    return f"{line['robot']}: the assumption {line.get('name')} was violated"


def _outcome(line: Mapping[str, Any]) -> str:
    text = str(line["outcome"]).replace("_", " ")
    explanation = line.get("explanation")
    return f"{text}: {explanation}" if explanation else text


def _listed(names: Sequence[object]) -> str:
    words = [str(name) for name in names]
    return " and ".join([", ".join(words[:-1])] * (len(words) > 1) + words[-1:]) or "nobody"


_SENTENCES = {
    "synthesis": _synthesis,
    "violation": _violation,
    "request": _request,
    "push": _push,
    "resolved": _resolved,
    "blocked": _blocked,
    "pop": _pop,
    "goal": _goal,
    "assumption": _assumption,
    "outcome": _outcome,
}

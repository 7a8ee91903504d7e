"""Claims about the end of a run, permanent obstacles and lost deadlines."""

from __future__ import annotations

from typing import Any

from safenav.audit.language import TooLargeError, require
from safenav.audit.lines import Line, proof_of
from safenav.audit.possibilities.deriving import team_of
from safenav.audit.run.situation import Situation
from safenav.certify.checker.check_strategies import Json


def conclude(run: Any, record: Line, now: Situation) -> None:
    """Add the claims of a line that the rules have judged. ``run``: its Evidence."""
    proof = proof_of(record)
    if proof is not None and team_of(now) is None:
        raise TooLargeError("formulas that this checker does not read; not certified")
    if record.type == "blocked" and record.reason == "operator":
        run.claim("operator", f"An operator has declared {record.obstacle} permanent.")
    elif record.type == "blocked" and record.reason != "untraversable":
        kind, _, _ = record.obstacle.rpartition("@")
        what = f"{kind}@{run.world.word([now.obstacles[record.obstacle].region])}"
        run.claim("never", f"No robot can ever resolve {what}.")
    elif record.type == "deadline" and record.verdict == "lost" and record.of in now.obstacles:
        least = record.earliest
        when = "ever" if least is None else f"before tick {least}"
        message = f"{record.of} cannot be resolved {when}, whatever the robots do"
        run.claim("lost", f"{message}; it is due at tick {record.due}.")
    elif record.type == "outcome":
        run.claim("outcome", outcome(run, record, now))


def outcome(run: Any, record: Line, now: Situation) -> str:
    """Return the claim about the end of the run. Raises RefusedError if it is not proven."""
    what, rounds = record.outcome, now.header.until.rounds or 0
    if what == "completed":
        for name, robot in run.robots.items():
            goals = [line.goal for line in now.progress[name].goals]
            met = min(map(goals.count, robot.own.goals))
            own = robot.own  # without goals, or at its last target, each tick counts
            lasts = own.shape.settles or (own.kind == "ltl" and not own.liveness)
            require(lasts or met >= rounds, f"{name} has met its objective only {met} times")
        often = "once" if rounds == 1 else f"{rounds} times"
        message = f"every robot has met its objective {often} after the last resolution"
        if stay := [name for name, robot in run.robots.items() if robot.own.shape.settles]:
            at = "is at its last target" if len(stay) == 1 else "are at their last targets"
            message += f", and {' and '.join(stay)} {at}"
        return f"The mission is completed: {message}."
    if what == "tick_limit":
        return f"The run ended at its limit of {now.header.limits.ticks} ticks."
    if what == "unrealizable" and run.hopeless and not run.turns:
        return "The mission never began: a robot has no strategy."
    if what != "operator_needed":
        what = what.replace("_", " ")
        return f"The run ended early ({what}); no claim about its goal."
    proof, specs = proof_of(record), record.unrealizable or {}
    if record.cause == "out_of_service":
        out = [name for name in run.robots if name in now.out]
        return f"An operator is needed: {' and '.join(out)} out of service."
    if proof is None:
        require(specs and specs.items() <= run.hopeless, "a negative without a proof")
        message = f"there is no strategy for {' and '.join(specs)}"
    elif record.cause == "deadlock":
        some = [name for name in run.robots if name in proof["robots"]]
        message = f"no order of moves of {' and '.join(some)} completes the mission"
    else:
        stuck = " and ".join(sorted(_stuck(proof))) or "in each case some robot"
        message = f"{stuck} cannot continue, whatever the robots in service with strategies do"
    return f"An operator is needed: {message}."


def _stuck(proof: Json) -> set[str]:
    """Return the robots that cannot continue in any case of a proof."""
    if proof["kind"] == "closure":
        return {name for name, table in proof["robots"].items() if not table["live"]}
    cases = [_stuck(choice["proof"]) for choice in proof["choices"]]
    return set.intersection(*cases) if cases else set()

"""Plays a mission and judges its end.

``completed`` must be accepted by ``safenav check`` and follow from the moves alone;
``operator_needed`` must be accepted with its proof, and the judge's own search must find the
mission infeasible from the run's end and (if nothing was hidden) from its start. Everything else is
a finding.
"""

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from campaigns.command import Command, Ended
from campaigns.judge import independent, joint
from campaigns.judge.literal import can_patrol
from campaigns.judge.mission import Mission, NotJudgedError, read_mission
from campaigns.judge.replay import Ending, replay, rounds_done
from campaigns.judge.situation import Answer, Situation, at_start

GOOD = ("completed", "proven", "refused literally")
UNDECIDED = "over budget"


@dataclass(frozen=True)
class Judgement:
    """``kind``: ``completed``, ``proven`` (the operator is needed), ``refused literally`` (before
    the start, for want of a way to patrol by the letter of the formula), ``over budget`` (the run
    says so, and the judge could not finish its search), or what is wrong."""

    kind: str
    detail: str
    seconds: float
    lines: tuple[Mapping[str, Any], ...] = ()

    @property
    def is_finding(self) -> bool:
        return self.kind not in (*GOOD, UNDECIDED)


def judge(
    data: Mapping[str, Any], command: Command, seconds: float = 60.0, budget: int = 200_000
) -> Judgement:
    """Play the mission of a scenario's data through the command line and judge it."""
    with tempfile.TemporaryDirectory() as folder:
        file, trace = Path(folder) / "mission.yaml", Path(folder) / "mission.jsonl"
        file.write_text(yaml.safe_dump(dict(data), sort_keys=False), encoding="utf-8")
        run = command.call(["run", file, "--no-map", "--trace", trace], seconds)
        lines = read_lines(trace)
        early = _broken_off(run, lines)
        if early is not None:
            return Judgement(*early, run.seconds, lines)
        outcome = lines[-1]
        try:
            mission = read_mission(data)
        except NotJudgedError as error:
            kind, detail = _by_its_word(outcome, str(error))
        else:
            kind, detail = _judge_outcome(mission, replay(mission, lines), outcome, run, budget)
        if data.get("coordination") == "assignable":
            kind, detail = _told_by_signals(lines) or (kind, detail)
        if kind in (*GOOD, UNDECIDED):
            checked = command.call(["check", trace], max(seconds, 60.0))
            if checked.exit != 0:
                kind, detail = "refused by check", (checked.output + checked.errors)[-600:]
        return Judgement(kind, detail, run.seconds, lines)


def judge_interrupted(
    data: Mapping[str, Any], command: Command, after: float, patience: float = 300.0
) -> Judgement:
    """Interrupt the mission after so many seconds: it ends by itself, as ``interrupted`` if it
    had not ended before or in that turn, and leaves a trace that is right as far as it goes."""
    with tempfile.TemporaryDirectory() as folder:
        file, trace = Path(folder) / "mission.yaml", Path(folder) / "mission.jsonl"
        file.write_text(yaml.safe_dump(dict(data), sort_keys=False), encoding="utf-8")
        run = command.call(
            ["run", file, "--no-map", "--trace", trace],
            after,
            patience,
            look=lambda: trace.read_bytes() if trace.exists() else b"",
        )
        lines = read_lines(trace)
        if run.exit is None:
            return Judgement("deaf", f"SIGINT did not end it in {patience:.0f} s", run.seconds)
        if not run.interrupted or not lines or b'"type":"outcome"' in run.seen:
            return Judgement("completed", "it ended, or was ended, before it began", run.deaf)
        told = (run.output[-300:] + run.errors[-900:]).strip()
        ended = lines[-1].get("outcome")
        in_its_turn = run.exit in (0, 1) and lines[-1]["tick"] <= _last_tick(run.seen) + 1
        if not (run.exit == 130 or in_its_turn) or "Traceback" in run.errors:
            return Judgement("exit status", f"{run.exit} after SIGINT: {told}", run.deaf)
        if (ended == "interrupted") != (run.exit == 130) or ended is None:
            return Judgement("no outcome", f"the trace ends with {lines[-1]}", run.deaf)
        checked = command.call(["check", trace], 60.0)
        if checked.exit != 0:
            return Judgement("refused by check", checked.output[-600:], run.deaf)
        return Judgement("completed", "", run.deaf, lines)


def _last_tick(seen: bytes) -> int:
    """The tick of the last whole line that had been written."""
    whole = seen[: seen.rfind(b"\n") + 1].splitlines()
    return json.loads(whole[-1])["tick"] if whole else 0


def read_lines(trace: Path) -> tuple[Mapping[str, Any], ...]:
    """The whole lines of a trace."""
    if not trace.exists():
        return ()
    text = trace.read_text(encoding="utf-8")
    return tuple(json.loads(line) for line in text.splitlines(keepends=True) if line[-1] == "\n")


def can_complete(mission: Mission, begin: Situation, budget: int) -> Answer:
    """The answer of the search that suits the mission."""
    if mission.crowded or any(robot.stays and robot.targets[1:] for robot in mission.robots):
        return joint.can_complete(mission, begin, budget)
    return independent.can_complete(mission, begin, budget)


def _broken_off(run: Ended, lines: tuple[Mapping[str, Any], ...]) -> tuple[str, str] | None:
    told = (run.output[-300:] + run.errors[-900:]).strip()
    if run.exit is None:
        return "hang", f"not even SIGINT ended it after {run.seconds:.0f} s"
    if run.interrupted:
        return "slow", f"no end after {run.seconds:.0f} s; SIGINT took {run.deaf:.1f} s"
    if run.exit == 2:
        return "refused", told
    if run.exit not in (0, 1, 3) or "Traceback" in run.errors:
        return "crash", told
    if not lines or lines[-1]["type"] != "outcome":
        return "no outcome", told
    return None


def _told_by_signals(lines: tuple[Mapping[str, Any], ...]) -> tuple[str, str] | None:
    """With signals a team is synthesized once, and robots for which the known map has changed."""
    blocked: set[str] = set()  # with a new permanent obstacle since their last strategy
    for line in lines:
        if line["type"] == "blocked":
            blocked.update(line["robots"])
        if line["type"] != "synthesis" or line["reason"] == "initial":
            continue
        changed, blocked = line["robot"] in blocked, blocked - {line["robot"]}
        if not changed:
            return "synthesized again", f"tick {line['tick']}, {line['robot']}: {line['reason']}"
    return None


def _by_its_word(outcome: Mapping[str, Any], unread: str) -> tuple[str, str]:
    """What a run says whose formulas the judge does not read: only safenav check judges that."""
    proven = outcome["outcome"] == "operator_needed"
    kind = "proven" if proven else str(outcome["outcome"])
    return kind, f"the judge does not read {unread}"


def _judge_outcome(
    mission: Mission, ending: Ending, outcome: Mapping[str, Any], run: Ended, budget: int
) -> tuple[str, str]:
    if ending.problems:
        return "inconsistent", "; ".join(ending.problems)
    match outcome["outcome"]:
        case "completed":
            return _completed(mission, ending, run, 1 if "t" in outcome else mission.rounds)
        case "operator_needed":
            return _operator_needed(mission, ending, outcome, run, budget)
        case "unrealizable" if _asks_for_a_literal_patrol(mission) and run.exit == 1:
            return "refused literally", str(outcome["explanation"])
        case other:
            answer = can_complete(mission, ending.situation, budget)
            return other, f"exit {run.exit}; the judge: {answer.value}; {outcome['explanation']}"


def _asks_for_a_literal_patrol(mission: Mission) -> bool:
    """Whether some robot that shares its floor with nobody cannot patrol by the letter."""
    return any(
        robot.literal and not mission.conflicts[robot.name] and not can_patrol(mission, robot)
        for robot in mission.robots
    )


def _completed(mission: Mission, ending: Ending, run: Ended, rounds: int) -> tuple[str, str]:
    """``rounds``: those that the moves must show. Live, a robot that stays makes none."""
    for robot in mission.robots:
        done = rounds_done(robot, ending.visits[robot.name])
        if done < rounds:
            return "not completed", f"{robot.name} has done {done} rounds of {rounds}"
    if ending.away:
        return "not completed", f"{' and '.join(ending.away)} not at the last target"
    if run.exit != 0:
        return "exit status", f"completed with {run.exit}"
    return "completed", ""


def _operator_needed(
    mission: Mission, ending: Ending, outcome: Mapping[str, Any], run: Ended, budget: int
) -> tuple[str, str]:
    cause = str(outcome.get("cause"))
    if run.exit != 1:
        return "exit status", f"operator_needed with {run.exit}"
    begins = [("from its end", ending.situation)]
    if not mission.obstacles:
        begins.append(("from its start", at_start(mission)))
    answers = []
    for where, begin in begins:
        answer = can_complete(mission, begin, budget)
        if answer is Answer.YES:
            return f"given up: {cause}", f"it can be completed {where}: {outcome['explanation']}"
        answers.append(answer)
    if Answer.OVER_BUDGET in answers:
        return UNDECIDED, cause
    return "proven", cause

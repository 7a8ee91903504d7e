"""The judge of a trace: every line is judged by its rules, and then takes effect."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from safenav.judge.effects import after
from safenav.judge.lines import Line, Reader
from safenav.judge.rule import RULES, NotJudged, Rule
from safenav.judge.rules import changes, ends, motion
from safenav.judge.state import State

FACTS: tuple[Rule, ...] = tuple(RULES)
assert {rule.judge.__module__ for rule in FACTS} == {m.__name__ for m in (motion, changes, ends)}


@dataclass(frozen=True)
class Finding:
    """A broken rule, or something that is not judged, at a line."""

    rule: str
    tick: int
    robot: str | None
    line: int
    explanation: str

    def __str__(self) -> str:
        whom = "" if self.robot is None else f", {self.robot}"
        return f"line {self.line}: {self.rule} (tick {self.tick}{whom}): {self.explanation}"


@dataclass
class Judgement:
    """``findings``: broken rules; ``notes``: parts that are not judged; ``outcome``: None if the
    trace ends before it; ``strays``: steps that ended elsewhere than commanded; ``hands``: changes
    by a user, an operator or the world."""

    findings: list[Finding] = field(default_factory=list)
    notes: list[Finding] = field(default_factory=list)
    outcome: str | None = None
    strays: int = 0
    hands: int = 0
    lines: int = 0

    @property
    def ok(self) -> bool:
        return not self.findings


def judge(texts: Iterable[str | bytes], rules: Iterable[Rule] = FACTS) -> Judgement:
    """Judge the lines of a trace. Raises NotATraceError."""
    found, by_kind, reader = Judgement(), dict[str, list[Rule]](), Reader()
    rules, state = [*rules], None
    for line in reader.lines(texts):
        state = state or State(line)
        if line.kind not in by_kind:
            by_kind[line.kind] = [r for r in rules if not r.kinds or line.kind in r.kinds]
        for rule in by_kind[line.kind]:
            for text in rule.judge(line, state):
                _add(found, rule, line, text)
        after(line, state)
    assert state is not None, "a reader yields a header"
    found.outcome, found.lines = state.ended, reader.read
    found.strays, found.hands = state.strays, state.hands
    return found


def _add(found: Judgement, rule: Rule, line: Line, text: str) -> None:
    robot = line.robot if isinstance(line.robot, str) else None
    noted = isinstance(text, NotJudged)
    said = f"not judged: {text}" if noted else text
    finding = Finding(rule.name, line.tick, robot, line.number, str(said))
    (found.notes if noted else found.findings).append(finding)

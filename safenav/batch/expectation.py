"""Compare the results of a run with its scenario's expectations."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.scenario.objective import Word, number_word
from safenav.scenario.settings import Expect
from safenav.trace import records
from safenav.trace.words import obstacle_words


class Ledger(Struct):
    """A listener that keeps the data for expectations. ``live``: ticks are passes, not times."""

    resolved: list[str] = field(default_factory=list)
    blocked: list[str] = field(default_factory=list)
    helpers: dict[str, str] = field(default_factory=dict)
    outcome: str | None = None
    ticks: int = 0
    rounds: dict[str, int] = field(default_factory=dict)
    late: tuple[str, ...] = ()
    live: bool = False

    def __call__(self, event: records.Record) -> None:
        match event:
            case records.Header():
                self.live = event.clock is not None
            case records.Resolved():
                self.resolved.append(event.obstacle)
            case records.KnownObstacle():
                self.blocked.append(event.obstacle)
            case records.Request(helper=str() as helper):
                self.helpers[event.obstacle] = helper
            case records.End():
                self.outcome = event.outcome
                self.rounds = dict(event.rounds)
                self.late = tuple(dict.fromkeys((*self.late, *(event.late or ()))))
        self.ticks = event.tick


def differences(expect: Expect, ledger: Ledger, word: Word = number_word) -> list[str]:
    """Return the differences from ``expect``, one sentence each; empty if there are none. ``word``:
    the name of a region."""
    found = []
    if expect.outcome is not None and ledger.outcome != expect.outcome.value:
        found.append(f"outcome: expected {expect.outcome.value}, got {ledger.outcome}")
    for kind, wanted, got in (
        ("resolved", expect.resolved, ledger.resolved),
        ("blocked", expect.blocked, ledger.blocked),
    ):
        if wanted is not None and set(got) != wanted:
            found.append(f"{kind}: expected {_names(wanted, word)}, got {_names(got, word)}")
    if (expect.late or frozenset()) != set(ledger.late) and (ledger.late or expect.late):
        wanted_late, late = _names(expect.late or frozenset(), word), _names([*ledger.late], word)
        found.append(f"late: expected {wanted_late}, got {late}")
    for obstacle, robot in (expect.helpers or {}).items():
        helper = ledger.helpers.get(obstacle)
        if helper != robot:
            asked = f"{helper} was" if helper else "no robot was"
            what = obstacle_words(obstacle, word)
            found.append(f"helpers: expected {robot} to be requested for {what}, {asked}")
    if expect.ticks is not None and ledger.ticks > expect.ticks and not ledger.live:
        found.append(f"ticks: expected at most {expect.ticks}, got {ledger.ticks}")
    for robot, wanted_rounds in (expect.rounds or {}).items():
        rounds = ledger.rounds.get(robot, 0)
        if rounds < wanted_rounds:
            found.append(f"rounds: expected at least {wanted_rounds} of {robot}, got {rounds}")
    return found


def _names(obstacles: frozenset[str] | list[str], word: Word) -> str:
    return "[" + ", ".join(obstacle_words(obstacle, word) for obstacle in sorted(obstacles)) + "]"

"""Compare what a run gave with what its scenario expects."""

from __future__ import annotations

from dataclasses import dataclass, field

from safenav.runtime.events import Blocked, Ended, Event, Requested, Resolved
from safenav.scenario.model import Expect


@dataclass
class Ledger:
    """A listener that keeps what an expectation can be about."""

    resolved: list[str] = field(default_factory=list)
    blocked: list[str] = field(default_factory=list)
    helpers: dict[str, str] = field(default_factory=dict)
    outcome: str | None = None
    ticks: int = 0

    def __call__(self, event: Event) -> None:
        match event:
            case Resolved():
                self.resolved.append(event.obstacle)
            case Blocked():
                self.blocked.append(event.obstacle)
            case Requested(helper=str() as helper):
                self.helpers[event.obstacle] = helper
            case Ended():
                self.outcome = event.outcome
                self.ticks = event.ticks


def differences(expect: Expect, ledger: Ledger) -> list[str]:
    """What is not as expected, one sentence each; empty if all is."""
    found = []
    if expect.outcome is not None and ledger.outcome != expect.outcome.value:
        found.append(f"outcome: expected {expect.outcome.value}, got {ledger.outcome}")
    for word, wanted, got in (
        ("resolved", expect.resolved, ledger.resolved),
        ("blocked", expect.blocked, ledger.blocked),
    ):
        if wanted is not None and set(got) != wanted:
            found.append(f"{word}: expected {_names(wanted)}, got {_names(got)}")
    for obstacle, robot in (expect.helpers or {}).items():
        helper = ledger.helpers.get(obstacle)
        if helper != robot:
            asked = f"{helper} was" if helper else "nobody was"
            found.append(f"helpers: expected {robot} to be asked for {obstacle}, {asked}")
    if expect.ticks is not None and ledger.ticks > expect.ticks:
        found.append(f"ticks: expected at most {expect.ticks}, got {ledger.ticks}")
    return found


def _names(obstacles: frozenset[str] | list[str]) -> str:
    return "[" + ", ".join(sorted(obstacles)) + "]"

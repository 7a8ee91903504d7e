"""The possible verdicts of a synthesis. A proven negative is not a timeout is not a crash."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from safenav.outcome import Verdict

if TYPE_CHECKING:
    from safenav.synthesis.serving.served import ServedStrategy
    from safenav.synthesis.strategy import Strategy


class SynthesisResult(Struct, frozen=True):
    """One answer of the synthesizer.

    ``strategy`` is there exactly when the verdict is realizable and a strategy was asked
    for, or unrealizable and a counterstrategy was; instead of it ``served`` if its moves are
    given on demand. ``seconds``: wall time of the subprocess
    (of the original one if ``cached``). ``spec_sha256`` and ``strategy_sha256``: hex digests
    of the structured-slugs text and of the JSON that the synthesizer printed. ``detail``: its
    last words beyond the verdict, such as how far it got before a limit. ``verified``: True if
    an independent check accepted the strategy, None if nobody checked (a strategy that the
    check rejects is an error, never a result).
    """

    robot: str
    verdict: Verdict
    seconds: float
    cached: bool
    spec_sha256: str
    strategy: Strategy | None = None
    strategy_json: bytes | None = None
    strategy_sha256: str | None = None
    detail: str = ""
    verified: bool | None = None
    served: ServedStrategy | None = None

    @property
    def states(self) -> int | None:
        """Nodes of the strategy, None without one that is listed."""
        return len(self.strategy.states) if self.strategy is not None else None

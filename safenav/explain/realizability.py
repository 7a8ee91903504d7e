"""Synthesis requests about variants of one specification, within a budget; none is repeated."""

from __future__ import annotations

import time
from collections.abc import Sequence
from copy import copy

from msgspec.structs import replace

from safenav.errors import SafenavError
from safenav.outcome import Verdict
from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.strategy import Strategy

BUDGET_SECONDS = 60.0
"""Wall time of one explanation, in seconds, without its repairs."""
LISTED_MB = 64
"""Memory limit of a counterstrategy that is shown as a play; its text is as large at most."""

_COOPERATIVE = {
    Section.ENV_INIT: Section.SYS_INIT,
    Section.ENV_TRANS: Section.SYS_TRANS,
    Section.ENV_LIVENESS: Section.SYS_LIVENESS,
}


class Questions:
    """Cached results of the synthesizer; TIMEOUT for each new request after the budget's end."""

    def __init__(self, synthesizer: Synthesizer) -> None:
        self._synthesizer = synthesizer
        self._known: dict[str, Verdict] = {}
        self._begun = time.monotonic()
        self._share = 1.0

    def spend(self, share: float) -> None:
        """Let further requests end by this share of the budget."""
        self._share = share

    @property
    def late(self) -> bool:
        """Return whether this part of the budget is exhausted."""
        return self._left() <= 0

    def _left(self) -> float:
        return self._begun + self._share * BUDGET_SECONDS - time.monotonic()

    def _limited(self) -> Synthesizer:
        """Return the synthesizer with the limits of the next request."""
        limited = copy(self._synthesizer)
        limited.seconds = max(0.01, min(limited.seconds or BUDGET_SECONDS, self._left()))
        return limited

    def prepare(self, specs: Sequence[Specification]) -> None:
        """Request several verdicts in parallel, on all processors."""
        texts = {spec.to_structuredslugs(): spec for spec in specs}
        left = [text for text in texts if text not in self._known]
        while left and not self.late:
            some, left = left[: self._synthesizer.at_once], left[self._synthesizer.at_once :]
            wanted = [texts[text] for text in some]
            results = self._limited().synthesize_all(wanted, strategy=False)
            self._known.update(zip(some, (result.verdict for result in results), strict=True))

    def verdict(self, spec: Specification) -> Verdict:
        """Return the verdict, or the limit that was reached."""
        self.prepare([spec])
        return self._known.get(spec.to_structuredslugs(), Verdict.TIMEOUT)

    def counterstrategy(self, spec: Specification) -> Strategy | None:
        """Return the environment's strategy; None if there is none within the limits."""
        limited = self._limited()
        limited.cache, limited.memory_mb = Cache(None), LISTED_MB
        try:
            return None if self.late else limited.counterstrategy(spec).strategy
        except SafenavError:
            return None


def cooperative(spec: Specification) -> Specification:
    """Return the specification with all variables controlled by the system: realizable iff
    assumptions and guarantees can be satisfied together."""
    turned = [(c, _COOPERATIVE.get(c.section, c.section)) for c in spec.constraints]
    return replace(
        spec,
        variables=tuple(replace(v, owner=Owner.OUTPUT) for v in spec.variables),
        constraints=tuple(replace(c, section=section) for c, section in turned),
    )

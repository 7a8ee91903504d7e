"""Realizability queries on variants of one specification; no query is repeated."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from safenav.outcome import Verdict
from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.slugs import Synthesizer

_COOPERATIVE = {
    Section.ENV_INIT: Section.SYS_INIT,
    Section.ENV_TRANS: Section.SYS_TRANS,
    Section.ENV_LIVENESS: Section.SYS_LIVENESS,
}


class Questions:
    """Cached results of the synthesizer. ``asked``: number of queries to it."""

    def __init__(self, synthesizer: Synthesizer) -> None:
        self._synthesizer = synthesizer
        self._known: dict[str, Verdict] = {}
        self.asked = 0

    def prepare(self, specs: Sequence[Specification]) -> None:
        """Query several specifications in parallel, on all processors."""
        texts = {spec.to_structuredslugs(): spec for spec in specs}
        open_ = {text: spec for text, spec in texts.items() if text not in self._known}
        results = self._synthesizer.synthesize_all(list(open_.values()), strategy=False)
        self.asked += len(open_)
        self._known.update(zip(open_, (result.verdict for result in results), strict=True))

    def verdict(self, spec: Specification) -> Verdict:
        """Return the verdict, or the limit that was reached."""
        text = spec.to_structuredslugs()
        if text not in self._known:
            self.asked += 1
            self._known[text] = self._synthesizer.synthesize(spec, strategy=False).verdict
        return self._known[text]


def cooperative(spec: Specification) -> Specification:
    """Return the specification with all variables controlled by the system: realizable iff
    assumptions and guarantees can be satisfied together."""
    turned = [(c, _COOPERATIVE.get(c.section, c.section)) for c in spec.constraints]
    return replace(
        spec,
        variables=tuple(replace(v, owner=Owner.OUTPUT) for v in spec.variables),
        constraints=tuple(replace(c, section=section) for c, section in turned),
    )

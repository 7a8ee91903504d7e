"""Results of a run that a bundle needs: trace lines, specifications, strategies."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct, field

from safenav.errors import UsageError
from safenav.spec.parsing import read_specification
from safenav.synthesis.cache import Cache
from safenav.synthesis.request import SynthesisProgress
from safenav.synthesis.slugs import Synthesizer
from safenav.trace.records import VERSION


class Kept(Struct):
    """Strategies, and the specifications that need a counterstrategy, by the sha256 in the trace.

    ``__call__`` receives the synthesizer's progress reports and stores its results.
    """

    texts: dict[str, str] = field(default_factory=dict)
    strategies: dict[str, bytes] = field(default_factory=dict)

    def __call__(self, progress: SynthesisProgress) -> None:
        result = progress.result
        if result is None:
            return
        if result.strategy_json is not None and result.strategy_sha256 is not None:
            self.strategies[result.strategy_sha256] = result.strategy_json

    def complete(
        self, lines: Sequence[Mapping[str, Any]], cache: Cache, synthesizer: Synthesizer
    ) -> None:
        """Add the missing strategies of a trace's ``synthesis`` lines, by repeated synthesis, and
        the specifications without a strategy, from the cache.

        Raises UsageError, which states what is missing, if that is not possible.
        """
        for line in lines:
            strategy = line.get("strategy") if line.get("node") is not None else None
            missing = strategy is not None and strategy not in self.strategies
            if missing or line["verdict"] == "unrealizable":
                text = cache.load_text(line["spec"])
                if text is None:
                    raise UsageError(
                        f"the specification of {line['robot']} at tick {line['tick']} "
                        f"({line['spec'][:12]}) is no longer in the cache; run the scenario again "
                        "with `safenav certify`"
                    )
                self.texts[line["spec"]] = text
            if missing:
                self.strategies[str(strategy)] = self._again(line, synthesizer)

    def _again(self, line: Mapping[str, Any], synthesizer: Synthesizer) -> bytes:
        spec = read_specification(self.texts[line["spec"]], robot=line["robot"])
        data = synthesizer.synthesize(spec).strategy_json
        if data is None or hashlib.sha256(data).hexdigest() != line["strategy"]:
            raise UsageError(
                f"the strategy of {line['robot']} at tick {line['tick']} "
                f"({line['strategy'][:12]}) is no longer in the cache, and the installed "
                "synthesizer gives another one; run the scenario again with `safenav certify`"
            )
        return data


def read_lines(trace: bytes, name: str) -> list[dict[str, Any]]:
    """Return the lines of a trace, its header first. Raises UsageError if it is not a trace."""
    try:
        lines = [json.loads(line) for line in trace.splitlines()]
        if lines[0]["type"] != "header" or lines[0]["trace"] != VERSION:
            raise UsageError(
                f"{name}: certificates need a trace of version {VERSION}; this one is of version "
                f"{lines[0].get('trace')}"
            )
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise UsageError(f"{name} is not a complete trace: {error}") from error
    return lines

"""Synthesis of specification files, for ``safenav synth`` and ``safenav explain``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from safenav.cli import warn
from safenav.errors import ResourceLimitError
from safenav.explain.vacuity import vacuous_wins
from safenav.file_kind import kind_of
from safenav.outcome import Verdict
from safenav.report.terminal.specification_text import win_lines
from safenav.scenario.yaml import source
from safenav.spec.specification import Owner, Specification
from safenav.synthesis.request import SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.counterstrategy import lost_opening


def is_specification(file: Path) -> bool:
    """Return whether a file contains a specification; False if it cannot be read."""
    try:
        with file.open(encoding="utf-8", errors="replace") as text:
            return kind_of(text.read(source.MAX_BYTES)) == "specification"
    except OSError:
        return False


def opening_words(spec: Specification) -> str:
    """Return in words how the environment wins immediately, where its strategy has no node."""
    row = lost_opening(spec) or ()
    named = zip(spec.owned(Owner.INPUT), row, strict=False)
    inputs = " ".join(f"{variable.name}={value}" for variable, value in named)
    return f"the initial inputs {inputs} leave no output" if inputs else "no output may begin"


def decided(file: Path, result: SynthesisResult) -> SynthesisResult:
    if is_proven(result):
        return result
    raise ResourceLimitError(f"{file}: {result.verdict.value}: nothing is proven")


def listed(ask: Callable[[Specification], SynthesisResult], spec: Specification) -> SynthesisResult:
    """Return the result of a synthesis request; OUT_OF_MEMORY if its output exceeds a limit."""
    try:
        return ask(spec)
    except ResourceLimitError as error:
        nothing = Verdict.OUT_OF_MEMORY
        return SynthesisResult(spec.robot, nothing, 0.0, False, "", detail=str(error))


def is_proven(result: SynthesisResult) -> bool:
    return result.verdict in (Verdict.REALIZABLE, Verdict.UNREALIZABLE)


def too_large(file: Path, what: str, result: SynthesisResult) -> ResourceLimitError:
    limit = (result.detail.splitlines() or [result.verdict.value.replace("_", " ")])[0]
    hint = "`slugs --explicitStrategy FILE` has no limits; `safenav verify` checks what it prints"
    return ResourceLimitError(f"{file}: {what} is too large to list ({limit})\n    {hint}")


def warn_of_vacuity(file: Path, result: SynthesisResult, synthesizer: Synthesizer) -> bool:
    """Warn about a system that wins by breaking its assumptions; return whether it does. A strategy
    that is too large to list is not examined."""
    if result.strategy is None:
        return False
    found = vacuous_wins(result.strategy, synthesizer)
    for vacuity in found:
        warn(*win_lines(vacuity, result.strategy, str(file)))
    return bool(found)

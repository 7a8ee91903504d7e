"""Kinds of files that commands read, recognized by how they begin."""

import re

_SECTION = r"\[(?:INPUT|OUTPUT|(?:ENV|SYS)_(?:INIT|TRANS|LIVENESS))\]"
_KINDS = {
    "specification": (
        rf"\A(?:\s|#[^\n]*\n)*{_SECTION}",
        "its strategy: safenav synth {0}; why not: safenav explain",
    ),
    "motion file": (
        r'\A\s*\{"type"\s*:\s*"header"\s*,\s*"motion"',
        "check it with: safenav check-motion {0} TRACE",
    ),
    "trace": (r'\A\s*\{"type"\s*:\s*"header"', "show it with: safenav replay {0}"),
    "scenario": (r"(?m)^safenav[ \t]*:", "run it with: safenav run {0} --trace run.jsonl"),
    "fleet file": (r"(?m)^safenav-fleet[ \t]*:", "use it with: safenav drive SCENARIO --fleet {0}"),
}
_PATTERNS = {kind: re.compile(pattern) for kind, (pattern, _) in _KINDS.items()}


def kind_of(text: str) -> str | None:
    """Return the kind of a file with this text; None if it begins like none of them."""
    return next((kind for kind, begins in _PATTERNS.items() if begins.search(text)), None)


def another_kind(text: str, expected: str, file: str) -> tuple[str, str] | None:
    """Return the error, and a hint, if a file is of another kind than expected."""
    kind = kind_of(text)
    if kind is None or kind == expected:
        return None
    return f"this is a {kind}, not a {expected}", _KINDS[kind][1].format(file)

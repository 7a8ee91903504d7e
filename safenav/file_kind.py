"""Kinds of files that commands read, recognized by how they begin or by lines in them."""

import re

_SECTION = r"\[[A-Z_]+\]"
_DRAW = "draw it with: safenav draw {0}; begin a scenario on it: safenav new FILE --map {0}"
ROS_MAP = "map of ROS map_server"
_KINDS: dict[str, tuple[tuple[str, ...], str]] = {
    "specification": (
        (rf"\A(?:\s|#[^\n]*\n)*{_SECTION}",),
        "its strategy: safenav synth {0}; why not: safenav explain",
    ),
    "motion file": (
        (r'\A\s*\{"type"\s*:\s*"header"\s*,\s*"motion"',),
        "check it with: safenav check {0} TRACE",
    ),
    "trace": ((r'\A\s*\{"type"\s*:\s*"header"',), "show it with: safenav replay {0}"),
    "scenario": (
        (r'(?m)^(?:\{\s*)?"?safenav"?[ \t]*:',),
        "run it with: safenav run {0} --trace run.jsonl",
    ),
    "strategy of slugs": (
        (r'\A\s*\{\s*"version"\s*:', r'"slugs"\s*:', r'"variables"\s*:'),
        "check it with: safenav verify SPECIFICATION {0}",
    ),
    "matrix file": ((r"(?m)^batch[ \t]*:",), "run it with: safenav batch {0}"),
    "web page": (
        (r"(?i)\A\s*<(?:!doctype html|html)",),
        "open it in a browser; name the trace or the scenario that it shows",
    ),
    "fleet file": (
        (r"(?m)^safenav-fleet[ \t]*:",),
        "use it with: safenav drive SCENARIO --fleet {0}",
    ),
    "map of the MovingAI benchmarks": (
        (r"\Atype[ \t]+\w+[ \t]*\r?\n", r"(?m)^height[ \t]", r"(?m)^map[ \t]*\r?$"),
        _DRAW,
    ),
    ROS_MAP: (
        (
            r"(?m)^[ \t]*image[ \t]*:",
            r"(?m)^[ \t]*(?:negate|occupied_thresh|free_thresh)[ \t]*:",
        ),
        _DRAW,
    ),
    "building file of RMF": (
        (r"(?m)^levels[ \t]*:", r"(?m)^[ \t]+(?:vertices|drawing|walls)[ \t]*:"),
        "save its floor as an occupancy map (ROS map_server): safenav new FILE --map MAP.yaml",
    ),
    "specification in TLSF": (
        (r"(?m)^[ \t]*INFO[ \t]*\{", r"(?m)^[ \t]*MAIN[ \t]*\{"),
        "convert it to structured slugs: syfco -f slugs {0}",
    ),
    "specification of gr1c": (
        (r"(?m)^[ \t]*(?:ENV|SYS)[ \t]*:", r"(?m)^[ \t]*(?:ENV|SYS)(?:INIT|TRANS|GOAL)[ \t]*:"),
        "write it as structured slugs: [INPUT], [OUTPUT], [SYS_TRANS], ... "
        "(docs/specifications.md)",
    ),
}
"""For each kind, the patterns of which a text contains all, and what to do with such a file."""


def kind_of(text: str) -> str | None:
    """Return the kind of a file with this text; None if it looks like none of them."""
    for kind, (patterns, _) in _KINDS.items():
        if all(re.search(pattern, text) for pattern in patterns):
            return kind
    return None


def another_kind(text: str, expected: str, file: str) -> tuple[str, str] | None:
    """Return the error, and a hint, if a file is of another kind than expected."""
    kind = kind_of(text)
    if kind is None or kind == expected:
        return None
    return f"this is a {kind}, not a {expected}", _KINDS[kind][1].format(file)

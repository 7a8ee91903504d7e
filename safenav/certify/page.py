"""The page of a bundle: what its checker established, and where the evidence is.

It is outside the proof, and states that: it renders the output of ``check.py --json``. The replay
of the trace shows the mission and its events.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from safenav.certify.check import BundleVerdict
from safenav.trace.reading import Trace

_GROUPS = (
    ("Run", ("outcome", "moves", "apart")),
    ("Strategies", ("keeps",)),
    ("Proven impossible", ("unrealizable", "never", "lost", "operator")),
    ("Changes and failed assumptions", ("changed", "broken")),
)
"""Groups of claims: heading, kinds."""
_LIMITS = (
    "The truth of the trace: the program that ran wrote it.",
    "The world model: robots move as specified, detect obstacles before entering them, and their "
    "actions succeed.",
    "Time: no claim states when a goal is met, only that it is met infinitely often.",
    "The checker and Python itself.",
)
_CHECK = (
    "<h2>Check it yourself</h2><p>This page is outside the proof: no checker reads it. Run "
    "<code>python3 -I -S check.py .</code> in this folder. check.py, which shares no code with the "
    "program that made this run, establishes the claims and prints them. "
    "<code>safenav replay trace.jsonl</code> shows the map, the robots and each event.</p>"
)
_STYLE = Path(__file__).with_suffix(".css")


def page_of(trace: Trace, verdict: BundleVerdict, files: Mapping[str, bytes]) -> str:
    """Return the page of a bundle with these files, of its trace and the checker's verdict."""
    name, end = escape(trace.header.scenario.name), trace.outcome
    outcome = "unfinished" if end is None else end.outcome.value
    why = "the trace ends before the run does" if end is None else end.explanation
    parts = [
        f'<h1>{name}</h1><p>Outcome: <strong class="{outcome}">{outcome.replace("_", " ")}'
        f"</strong>. {escape(why[:1].upper() + why[1:].rstrip('.'))}.</p><h2>Guaranteed</h2>"
    ]
    for heading, kinds in _GROUPS:
        if some := [claim for claim in verdict.claims if claim["kind"] in kinds]:
            parts.append(f"<h3>{heading}</h3>{_list(map(_claim, some))}")
    left = [*_LIMITS, *(f"Not compared: {what}." for what in verdict.not_compared)]
    parts += [f"<h2>Not covered</h2>{_list(map(escape, left))}", _CHECK]
    parts += [_evidence(verdict.claims, files)]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Assurance: {name}</title><style>\n{_STYLE.read_text()}</style></head>"
        f"<body>{''.join(parts)}</body></html>\n"
    )


def _list(items: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{item}</li>' for item in items)}</ul>"


def _claim(claim: Mapping[str, Any]) -> str:
    links = ", ".join(
        f'<a href="#{_anchor(path, line)}">{_short(path)}{f", line {line}" if line else ""}</a>'
        for path, line in claim["evidence"]
    )
    return f'<span id="{escape(claim["id"])}">{escape(claim["text"])}</span> <small>{links}</small>'


def _anchor(path: str, line: int | None) -> str:
    return f"line-{line}" if line else f"file-{hashlib.sha256(path.encode()).hexdigest()[:10]}"


def _short(path: str) -> str:
    """Return a file's name with its checksum shortened."""
    folder, _, name = path.rpartition("/")
    return f"{folder}/{name[:12]}&hellip;" if len(name) > 40 else escape(path)


def _evidence(claims: Sequence[Mapping[str, Any]], files: Mapping[str, bytes]) -> str:
    """Return the table of files, and the lines of the trace that claims name."""
    lines = files["trace.jsonl"].splitlines()
    named = sorted({line for claim in claims for _, line in claim["evidence"] if line})
    rows = [
        f'<tr id="{_anchor(path, None)}"><td><a href="{escape(path)}">{_short(path)}</a></td>'
        f"<td><code>{hashlib.sha256(data).hexdigest()}</code></td><td>{len(data)}</td></tr>"
        for path, data in sorted(files.items())
        if path.partition("/")[0] != "judge"
    ]
    shown = [
        f'<h3 id="line-{number}">trace.jsonl, line {number}</h3>'
        f"<pre>{escape(json.dumps(json.loads(lines[number - 1])))}</pre>"
        for number in named
    ]
    return (
        "<h2>Evidence</h2><table><tr><th>file</th><th>sha256</th><th>bytes</th></tr>"
        f'{"".join(rows)}</table><section id="lines">{"".join(shown)}</section>'
    )

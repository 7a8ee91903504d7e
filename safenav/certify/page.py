"""The page of a bundle: what its checker established, for a safety reviewer, on screen and paper.

It is outside the proof, and says so: it renders what ``check.py --json`` says, and the trace.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from safenav.certify.check import BundleVerdict
from safenav.certify.map_picture import glyph, map_svg
from safenav.run.looks import looks
from safenav.run.wording import Wording
from safenav.trace.reading import read_lines
from safenav.trace.records import KINDS
from safenav.trace.words import counted
from safenav.world.map import RegionMap

Data = Mapping[str, Any]

_GROUPS = (
    ("Run", ("outcome", "moves", "apart")),
    ("Strategies", ("keeps",)),
    ("Proven impossible", ("unrealizable", "never", "lost", "operator")),
    ("Changes and failed assumptions", ("changed", "broken")),
)
"""Groups of claims: heading, kinds."""

_EVENTS = (
    *("violation", "request", "met", "resolved", "blocked", "appeared", "gone", "truth"),
    *("objective", "service", "told", "assumption", "plan"),
)
_LIMITS = (
    "The truth of the trace: the program that ran wrote it.",
    "The world model: robots move as specified, detect obstacles before entering them, and their "
    "actions succeed.",
    "Time: no claim says when a goal is met, only that it is met infinitely often.",
    "The checker and Python itself.",
)
_STYLE = Path(__file__).with_suffix(".css")


def page_of(lines: Sequence[Data], verdict: BundleVerdict, files: Mapping[str, bytes]) -> str:
    """Return the page of a bundle with these files and a verdict of its checker."""
    scenario = lines[0]["scenario"]
    body = [
        f'<section id="summary">{_summary(scenario, lines, verdict)}</section>',
        _mission(scenario),
        _claims(verdict.claims),
        _happened(lines),
        _evidence(verdict.claims, lines, files),
    ]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Assurance: {escape(scenario['name'])}</title>"
        f"<style>\n{_STYLE.read_text()}</style></head><body>{''.join(body)}</body></html>\n"
    )


def _summary(scenario: Data, lines: Sequence[Data], verdict: BundleVerdict) -> str:
    ends = [line for line in lines if line["type"] == "outcome"]
    outcome = ends[-1]["outcome"] if ends else "unfinished"
    why = ends[-1]["explanation"] if ends else "the trace ends before the run does"
    colour = "good" if outcome == "completed" else "bad"
    texts = {kind: [] for _, kinds in _GROUPS for kind in kinds}  # type: dict[str, list[str]]
    for claim in verdict.claims:
        texts[claim["kind"]].append(re.sub(r"^Tick \d+: ", "", claim["text"]))
    kept = texts["keeps"]
    under = sorted({text.rpartition(", ")[2].rstrip(".") for text in kept})
    promises = [*texts["outcome"], *texts["moves"], *texts["apart"]]
    if kept:
        promises.append(
            f"{counted(len(kept), 'proof')} that a strategy obeys the scenario and meets its "
            f"objective infinitely often: {'; '.join(under)}."
        )
    rest = [text for kind in (*_GROUPS[2][1], *_GROUPS[3][1]) for text in texts[kind]]
    left = [f"Not compared: {what}." for what in verdict.not_compared]
    return (
        f"<header><h1>{escape(scenario['name'])}</h1></header>"
        f'<p>Outcome: <strong class="{colour}">{escape(outcome.replace("_", " "))}</strong>. '
        f"{escape(why[:1].upper() + why[1:].rstrip('.'))}.</p>"
        f"<h2>Guaranteed</h2>{_list([*promises, *rest[:6]])}"
        f"<h2>Not covered</h2>{_list([*_LIMITS, *left])}"
        "<h2>Check it yourself</h2><p>This page is outside the proof: no checker reads "
        "it. Run <code>python3 -I -S check.py .</code> in this folder. check.py, which shares no "
        f"code with the program that made this run, establishes the {len(verdict.claims)} claims "
        "below and prints them.</p>"
    )


def _list(texts: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def _mission(scenario: Data) -> str:
    known = scenario["map"]
    world = RegionMap.from_grid(known["grid"], known.get("names"), known.get("areas"))
    rows = [
        '<tr><td><svg class="who" viewBox="-1.4 -1.4 2.8 2.8" aria-hidden="true">'
        f"{glyph(look)}</svg>{escape(name)}</td><td>{escape(r['model'])}</td>"
        f"<td>{escape(world.place(r['start']))}</td>"
        f"<td><code>{escape(json.dumps(r['objective']))}</code></td>"
        f"<td>{escape(', '.join(r['capabilities']).replace('_', ' ') or 'none')}</td></tr>"
        for (name, r), look in zip(
            scenario["robots"].items(), looks([*scenario["robots"]]), strict=True
        )
    ]
    named = ", ".join(f"{name} is {region}" for name, region in world.names.items())
    return (
        f"<h2>Mission</h2>{map_svg(scenario, world)}"
        '<p class="soft">Robots are drawn where they start, in the shapes, colours and letters of '
        "the replay; squares in their colours are their targets, crosses are hidden obstacles. "
        "Regions are numbered from the north-west, row by row"
        f"{f': {escape(named)}' if named else ''}.</p>"
        '<table class="words"><tr><th>robot</th><th>model</th><th>start</th><th>objective</th>'
        f"<th>capabilities</th></tr>{''.join(rows)}</table>"
    )


def _claims(claims: Sequence[Data]) -> str:
    parts = ["<h2>Claims</h2>"]
    for heading, kinds in _GROUPS:
        if some := [claim for kind in kinds for claim in claims if claim["kind"] == kind]:
            parts.append(f"<h3>{heading}</h3><ul>{''.join(map(_claim, some))}</ul>")
    return "".join(parts)


def _claim(claim: Data) -> str:
    links = ", ".join(_link(path, line) for path, line in claim["evidence"])
    return (
        f'<li id="{escape(claim["id"])}">{escape(claim["text"])}<br><details><summary>evidence'
        f"</summary>{links}</details></li>"
    )


def _link(path: str, line: int | None) -> str:
    if line is not None:
        return f'<a href="#line-{line}">{escape(path)}, line {line}</a>'
    return f'<a href="#{_anchor(path)}">{_short(path)}</a>'


def _short(path: str) -> str:
    """Return a file's name with its checksum shortened."""
    folder, _, name = path.rpartition("/")
    return f"{folder}/{name[:12]}&hellip;" if len(name) > 40 else escape(path)


def _anchor(path: str) -> str:
    return f"file-{hashlib.sha256(path.encode()).hexdigest()[:10]}"


def _happened(lines: Sequence[Data]) -> str:
    trace = read_lines(map(json.dumps, lines))
    known = trace.header.scenario
    world = RegionMap.from_grid(known.map.grid, known.map.names, known.map.areas)
    wording = Wording(
        world.word,
        world.place,
        actions={o.name: [n.action for n in o.all_needs] for o in trace.obstacles.values()},
        skills={name: robot.capabilities for name, robot in known.robots.items()},
    )
    numbers = (number for number, line in enumerate(lines[1:], 2) if line["type"] in KINDS)
    rows = [
        f"<tr><td>{record.tick}</td><td>{escape(wording.sentence(record))}</td>"
        f"<td>line {number}</td></tr>"
        for number, record in zip(numbers, trace.records, strict=True)
        if record.type in _EVENTS
    ]
    if not rows:
        return "<h2>Events</h2><p>No unexpected events.</p>"
    head = "<tr><th>tick</th><th>event</th><th>trace</th></tr>"
    return f"<h2>Events</h2><table>{head}{''.join(rows)}</table>"


def _evidence(claims: Sequence[Data], lines: Sequence[Data], files: Mapping[str, bytes]) -> str:
    named = {line for claim in claims for _, line in claim["evidence"] if line}
    shown = [
        f'<h3 id="line-{number}">trace.jsonl, line {number}</h3>'
        f"<pre>{escape(json.dumps(lines[number - 1]))}</pre>"
        for number in sorted(named)
    ]
    rows = [
        f'<tr id="{_anchor(path)}"><td>'
        f'<a href="{escape(path)}" title="{escape(path)}">{_short(path)}</a></td>'
        f"<td><code>{hashlib.sha256(data).hexdigest()}</code></td><td>{len(data)}</td></tr>"
        for path, data in sorted(files.items())
        if path.partition("/")[0] != "judge"
    ]
    return (
        '<h2>Evidence</h2><table class="files"><tr><th>file</th><th>sha256</th><th>bytes</th></tr>'
        f"{''.join(rows)}</table>"
        f'<section id="lines"><h2>Lines of the trace</h2>{"".join(shown)}</section>'
    )

"""The assurance page of a bundle: for a safety reviewer, on the screen and on paper."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from safenav.certify.facts import Claim, facts_of
from safenav.certify.map_picture import COLOURS, map_svg
from safenav.certify.proved import PROVED, Proof

_KINDS = {
    "realizes": "Specification to strategy: proven",
    "keeps": "Scenario to strategy: validated",
    "unrealizable": "No strategy exists: proven",
    "weakest": "Nothing less was enough: proven",
    "broken": "An assumption failed",
    "form": "The form of an objective that was proven",
    "changed": "The mission was changed while it ran",
    "never": "What can never be resolved: worked out again",
    "motion": "Moves to metres: named, not checked here",
    "moves": "Strategy to moves: replayed",
    "outcome": "Moves to outcome: audited",
}

_STYLE = """
:root { --ink: #1c2024; --soft: #5a6068; --line: #d5d8dc; --good: #1d6b3c; --bad: #b3261e; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 60rem; padding: 2rem 1.5rem 4rem; color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; } h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem;
  border-bottom: 1px solid var(--line); padding-bottom: .2rem; }
h3 { font-size: 1rem; margin: 1.2rem 0 .3rem; }
p, ul, table { margin: .4rem 0; } a { color: #0b57a4; }
.soft { color: var(--soft); } .good { color: var(--good); } .bad { color: var(--bad); }
svg { width: 100%; max-height: 24rem; display: block; margin: .8rem 0; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .6rem .3rem 0;
  border-bottom: 1px solid var(--line); overflow-wrap: anywhere; }
code { font: .82rem/1.4 ui-monospace, monospace; overflow-wrap: anywhere; }
.words th, .words td { overflow-wrap: normal; } .words td:first-child { white-space: nowrap; }
.files { table-layout: fixed; } .files th:first-child { width: 34%; }
.files th:last-child { width: 11%; } .files td:last-child { overflow-wrap: normal; }
li { margin: .35rem 0; } .evidence { font-size: .85rem; }
pre { white-space: pre-wrap; overflow-wrap: anywhere; font-size: .78rem; background: #f4f5f6;
  padding: .5rem; margin: .3rem 0; } .dot { display: inline-block; width: .7rem; height: .7rem;
  border-radius: 50%; margin-right: .4rem; }
:target { background: #fff3c4; }
@media print { body { max-width: none; padding: 0; font-size: 10.5pt; } a { color: inherit; }
  h2, h3 { break-after: avoid; } li, tr, svg { break-inside: avoid; } pre { font-size: 7.5pt; }
  @page { margin: 16mm; } }
"""


def page_of(
    lines: Sequence[Mapping[str, Any]],
    claims: Sequence[Claim],
    files: Mapping[str, bytes],
    proofs: Sequence[Proof] = (),
) -> tuple[str, bytes]:
    """The page of a bundle with these files, and the same facts as JSON. ``proofs``: what the
    verified checker said, if it was asked."""
    facts = facts_of(lines, claims, files, proofs)
    body = [
        _head(facts),
        _asked(facts, lines[0]["scenario"]),
        _guaranteed(facts),
        _assumed(facts),
        _happened(facts),
        _open(facts),
        _evidence(facts, lines),
    ]
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Assurance: {escape(facts['name'])}</title><style>{_STYLE}</style></head>"
        f"<body>{''.join(body)}</body></html>\n"
    )
    return page, json.dumps(facts, indent=1).encode() + b"\n"


def _head(facts: Mapping[str, Any]) -> str:
    colour = "good" if facts["outcome"] == "completed" else "bad"
    count = len(facts["claims"])
    return (
        f"<h1>{escape(facts['name'])}</h1>"
        f'<p>Outcome: <strong class="{colour}">{escape(facts["outcome"].replace("_", " "))}'
        f"</strong>. {escape(_sentence(facts['explanation']))}</p>"
        f'<p class="soft">This bundle makes {count} claims. Each was established from the files '
        "named with it by <code>check.py</code>, a program that knows nothing of the one that "
        "ran. Check it yourself: <code>python3 -I -S check.py .</code> in this folder.</p>"
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."


def _asked(facts: Mapping[str, Any], scenario: Mapping[str, Any]) -> str:
    rows = [
        "<tr>"
        f'<td><span class="dot" style="background:{COLOURS[k % len(COLOURS)]}"></span>'
        f"{escape(r['robot'])}</td><td>{escape(r['model'])}, {escape(r['mobility'])} mobility"
        f'</td><td>{r["start"]}</td><td class="shall">{escape(r["objective"])}</td>'
        f"<td>{escape(', '.join(r['capabilities']) or 'none')}</td></tr>"
        for k, r in enumerate(facts["asked"])
    ]
    obstacles = [
        f"<li>{escape(o['name'])}: {escape(o['action'])} resolves it</li>"
        for o in facts["obstacles"]
    ]
    hidden = (
        "<p>Obstacles that nobody knows before they are met (crosses):</p>"
        f"<ul>{''.join(obstacles)}</ul>"
        if obstacles
        else "<p>There are no hidden obstacles.</p>"
    )
    return (
        "<h2>What the team was asked to do</h2>"
        f"{map_svg(scenario)}"
        '<p class="soft">Discs: where robots start. Squares: their targets, with the '
        "region's number. Regions are numbered from the north-west, row by row.</p>"
        '<table class="words"><tr><th>robot</th><th>kind</th><th>start</th><th>shall</th>'
        "<th>can</th></tr>"
        f"{''.join(rows)}</table>{hidden}"
    )


def _guaranteed(facts: Mapping[str, Any]) -> str:
    parts = ["<h2>What is guaranteed</h2>"]
    made = dict.fromkeys(claim["kind"] for claim in facts["claims"])
    for kind in (*(k for k in _KINDS if k in made), *(k for k in made if k not in _KINDS)):
        parts.append(f"<h3>{escape(_KINDS.get(kind, kind))}</h3><ul>")
        for claim in facts["claims"]:
            if claim["kind"] != kind:
                continue
            links = ", ".join(_link(path, line) for path, line in claim["evidence"])
            name = escape(claim["id"])
            parts.append(
                f'<li id="{name}">{escape(claim["text"])}<br><span class="evidence soft">{name}; '
                f"{escape(facts['rests_on'][claim['id']])}; evidence: {links}</span></li>"
            )
        parts.append("</ul>")
    if facts["proved_of_the_team"]:
        listed = "".join(f"<li>{escape(text)}</li>" for text in facts["proved_of_the_team"])
        parts.append(f"<h3>The team: {escape(PROVED.partition(' and ')[2])}</h3><ul>{listed}</ul>")
    return "".join(parts)


def _link(path: str, line: int | None) -> str:
    if line is not None:
        return f'<a href="#line-{line}">{escape(path)}, line {line}</a>'
    return f'<a href="#{_anchor(path)}">{_short(path)}</a>'


def _short(path: str) -> str:
    """A file's name, without the end of a sum in it."""
    folder, _, name = path.rpartition("/")
    return f"{folder}/{name[:12]}&hellip;" if len(name) > 40 else escape(path)


def _anchor(path: str) -> str:
    return f"file-{hashlib.sha256(path.encode()).hexdigest()[:10]}"


def _assumed(facts: Mapping[str, Any]) -> str:
    rows = []
    for assumption in facts["assumptions"]:
        failed = assumption["failed"]
        said = "; ".join(f"tick {f['tick']}, {f['robot']}: {f['what']}" for f in failed) or "never"
        rows.append(
            f"<tr><td>{escape(_sentence(assumption['text']))}</td>"
            f"<td>{escape(', '.join(assumption['robots']))}</td>"
            f"<td>{escape(_sentence(assumption['checked_by']))}</td>"
            f'<td class="{"bad" if failed else "good"}">{escape(said)}</td></tr>'
        )
    if not rows:
        return "<h2>Under which assumptions</h2><p>None: no robot can run into another one.</p>"
    return (
        "<h2>Under which assumptions</h2><table><tr><th>assumption</th><th>of or by</th>"
        f"<th>who checks it</th><th>failed in this run</th></tr>{''.join(rows)}</table>"
    )


def _happened(facts: Mapping[str, Any]) -> str:
    rows = [
        f"<tr><td>{event['tick']}</td><td>{escape(event['what'])}</td>"
        f'<td><a href="#line-{event["line"]}">line {event["line"]}</a></td></tr>'
        for event in facts["happened"]
    ]
    if not rows:
        return "<h2>What happened</h2><p>Nothing that was not planned for.</p>"
    return (
        "<h2>What happened</h2><table><tr><th>tick</th><th>event</th><th>trace</th></tr>"
        f"{''.join(rows)}</table>"
    )


def _open(facts: Mapping[str, Any]) -> str:
    told = [re.sub("`(.*?)`", r"<code>\1</code>", escape(text)) for text in facts["not_covered"]]
    items = "".join(f"<li>{text}</li>" for text in told)
    return f"<h2>What is not covered</h2><ul>{items}</ul>"


def _evidence(facts: Mapping[str, Any], lines: Sequence[Mapping[str, Any]]) -> str:
    named = {line for claim in facts["claims"] for _, line in claim["evidence"] if line}
    named |= {event["line"] for event in facts["happened"]}
    shown = [
        f'<h3 id="line-{number}">trace.jsonl, line {number}</h3>'
        f"<pre>{escape(json.dumps(lines[number - 1]))}</pre>"
        for number in sorted(named)
    ]
    rows = [
        f'<tr id="{_anchor(path)}"><td>'
        f'<a href="{escape(path)}" title="{escape(path)}">{_short(path)}</a></td>'
        f"<td><code>{about['sha256']}</code></td><td>{about['bytes']}</td></tr>"
        for path, about in facts["files"].items()
    ]
    return (
        '<h2>Evidence</h2><table class="files"><tr><th>file</th><th>sha256</th><th>bytes</th></tr>'
        f"{''.join(rows)}</table><h2>Lines of the trace</h2>{''.join(shown)}"
    )

"""The assurance page of a bundle: for a safety reviewer, on the screen and on paper."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from safenav.certify.checker.check_tasks import ASSUMED
from safenav.certify.facts import Claim, facts_of
from safenav.certify.map_picture import glyph, map_svg
from safenav.trace.looks import looks
from safenav.trace.words import counted
from safenav.world.map import RegionMap

_GROUPS = (
    ("Run", "How the run ended, and each of its moves.", ("outcome", "moves", "motion")),
    (
        "Strategies and the scenario",
        "Each strategy obeys the rules of the scenario and meets its objective infinitely often, "
        "under the condition named.",
        ("keeps",),
    ),
    ("Objectives as proven", "The form of each robot's own objective that was proven.", ("form",)),
    (
        "Strategies and their specifications",
        "Each strategy satisfies the text of the specification it was synthesized from.",
        ("realizes",),
    ),
    (
        "Proven impossible",
        "Strategies that do not exist (no weaker assumption suffices), and obstacles that can "
        "never be resolved.",
        ("unrealizable", "weakest", "never"),
    ),
    (
        "Changes and failed assumptions",
        "Changes of the mission during the run, and assumptions that failed.",
        ("changed", "broken"),
    ),
)
"""Groups of claims: heading, common explanation, kinds."""

_MOVES = {"free": "moves in any direction", "heading": "has a heading"}

_STYLE = Path(__file__).with_suffix(".css")


def page_of(
    lines: Sequence[Mapping[str, Any]], claims: Sequence[Claim], files: Mapping[str, bytes]
) -> str:
    """Return the page of a bundle with these files."""
    facts = facts_of(lines, claims, files)
    body = [
        f'<section id="summary">{_summary(facts)}</section>',
        _mission(facts, lines[0]["scenario"]),
        _guaranteed(facts),
        _assumed(facts),
        _happened(facts),
        _evidence(facts, lines),
    ]
    page = (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Assurance: {escape(facts['name'])}</title>"
        f"<style>\n{_STYLE.read_text()}</style></head><body>{''.join(body)}</body></html>\n"
    )
    return page


def _summary(facts: Mapping[str, Any]) -> str:
    """Return the first page: outcome, guarantees, assumptions and limits."""
    colour = "good" if facts["outcome"] == "completed" else "bad"
    kinds = Counter(claim["kind"] for claim in facts["claims"])
    assumed = [
        f"{', '.join(a['robots'])}: {a['text']}. "
        + f"It failed {len(a['failed'])} times in this run." * bool(a["failed"])
        for a in facts["assumptions"]
    ]
    return (
        f"<header><h1>{escape(facts['name'])}</h1></header>"
        f'<p>Outcome: <strong class="{colour}">{escape(facts["outcome"].replace("_", " "))}'
        f"</strong>. {escape(_sentence(facts['explanation']))}</p>"
        f"<h2>Guaranteed</h2>{_list(_promises(facts, kinds))}"
        f"<h2>Assumed</h2>{_list(assumed or ['Nothing: no robot can run into another one.'])}"
        f"<h2>Not covered</h2>{_list(facts['not_covered'])}"
        "<h2>Check it yourself</h2><p>Run <code>python3 -I -S check.py .</code> in this folder. "
        "check.py, which shares no code with the program that made this run, established each of "
        f"the {len(facts['claims'])} claims from the files listed and compares the sentences "
        "below; this summary and the pictures explain.</p>"
    )


def _promises(facts: Mapping[str, Any], kinds: Mapping[str, int]) -> list[str]:
    """Return the claims in a few sentences."""
    told = [c["text"] for c in facts["claims"] if c["kind"] in ("outcome", "moves")]
    found = [re.sub(r"^Tick \d+: ", "", text) for text in told]
    if kept := kinds.get("keeps"):
        texts = [c["text"] for c in facts["claims"] if c["kind"] == "keeps"]
        alone = sum(text.endswith(f"{ASSUMED['none']}.") for text in texts)
        cases = f" in {counted(alone, 'case')}; under the assumptions below in {kept - alone}"
        under = f", whatever the other robots do{cases * (alone < kept)}" if alone else ""
        found.append(
            f"Strategies: {counted(kept, 'proof')}. Each shows that a strategy obeys the rules of "
            "the scenario and meets its objective infinitely often"
            f"{under or ', under the assumptions below'}."
        )
    named = ("unrealizable", "never", "changed", "broken")
    found += [c["text"] for c in facts["claims"] if c["kind"] in named][:_MOST_NAMED]
    if weakest := kinds.get("weakest"):
        found.append(f"No weaker assumption suffices: proven {counted(weakest, 'time')}.")
    return found


_MOST_NAMED = 6
"""Claims that the summary lists one by one; more would not fit on one page."""


def _list(texts: Sequence[str]) -> str:
    items = (re.sub("`(.*?)`", r"<code>\1</code>", escape(text)) for text in texts)
    return f"<ul>{''.join(f'<li>{item}</li>' for item in items)}</ul>"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."


def _mission(facts: Mapping[str, Any], scenario: Mapping[str, Any]) -> str:
    known = scenario["map"]
    world = RegionMap.from_grid(known["grid"], known.get("names"), known.get("areas"))
    rows = [
        '<tr><td><svg class="who" viewBox="-1.4 -1.4 2.8 2.8" aria-hidden="true">'
        f"{glyph(look)}</svg>{escape(r['robot'])}</td><td>{escape(r['model'])}, "
        f"{escape(_MOVES.get(r['mobility'], r['mobility']))}</td>"
        f"<td>{escape(r['start_label'])}</td>"
        f'<td class="must">{escape(r["objective"])}</td>'
        f"<td>{escape(', '.join(r['capabilities']).replace('_', ' ') or 'none')}</td></tr>"
        for r, look in zip(facts["asked"], looks([*scenario["robots"]]), strict=True)
    ]
    obstacles = [
        f"{o['label']}: resolved by {', then '.join(o['needs']).replace('_', ' ')}"
        for o in facts["obstacles"]
    ]
    hidden = (
        "<p>Hidden obstacles, unknown until a robot encounters them (crosses):</p>"
        f"{_list(obstacles)}"
        if obstacles
        else "<p>There are no hidden obstacles.</p>"
    )
    named = ", ".join(f"{name} is {region}" for name, region in world.names.items())
    return (
        f"<h2>Mission</h2>{map_svg(scenario, world)}"
        '<p class="soft">Robots are drawn where they start, in the shapes, colours and letters of '
        "the replay; squares in their colours are their targets. Regions are numbered from the "
        f"north-west, row by row{f': {escape(named)}' if named else ''}.</p>"
        '<table class="words"><tr><th>robot</th><th>kind</th><th>start</th><th>objective</th>'
        "<th>capabilities</th></tr>"
        f"{''.join(rows)}</table>{hidden}"
    )


def _guaranteed(facts: Mapping[str, Any]) -> str:
    parts = ["<h2>Claims</h2>"]
    listed = {kind for _, _, kinds in _GROUPS for kind in kinds}
    rest = tuple(dict.fromkeys(c["kind"] for c in facts["claims"] if c["kind"] not in listed))
    for heading, common, kinds in (*_GROUPS, ("Other claims", "", rest)):
        claims = [c for kind in kinds for c in facts["claims"] if c["kind"] == kind]
        if claims:
            parts.append(f"<h3>{escape(heading)}</h3><p>{escape(common)}</p><ul>")
            parts += (_claim(claim) for claim in claims)
            parts.append("</ul>")
    return "".join(parts)


def _claim(claim: Claim) -> str:
    """Return a claim and its evidence; the checker compares the text."""
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


def _assumed(facts: Mapping[str, Any]) -> str:
    rows = []
    for assumption in facts["assumptions"]:
        failed = assumption["failed"]
        when = "; ".join(f"tick {f['tick']}, {f['robot']}: {f['what']}" for f in failed) or "never"
        rows.append(
            f"<tr><td>{escape(_sentence(assumption['text']))}</td>"
            f"<td>{escape(', '.join(assumption['robots']))}</td>"
            f"<td>{escape(_sentence(assumption['checked_by']))}</td>"
            f'<td class="{"bad" if failed else "good"}">{escape(when)}</td></tr>'
        )
    if not rows:
        return ""
    return (
        "<h2>Assumptions</h2><table><tr><th>assumption</th><th>robots that assume it</th>"
        f"<th>check</th><th>failed in this run</th></tr>{''.join(rows)}</table>"
    )


def _happened(facts: Mapping[str, Any]) -> str:
    rows = [
        f"<tr><td>{event['tick']}</td><td>{escape(event['what'])}</td>"
        f'<td><a href="#line-{event["line"]}">line {event["line"]}</a></td></tr>'
        for event in facts["happened"]
    ]
    if not rows:
        return "<h2>Events</h2><p>No unexpected events.</p>"
    return (
        "<h2>Events</h2><table><tr><th>tick</th><th>event</th><th>trace</th></tr>"
        f"{''.join(rows)}</table>"
    )


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
        f"{''.join(rows)}</table>"
        f'<section id="lines"><h2>Lines of the trace</h2>{"".join(shown)}</section>'
    )

"""The page of a bundle: what its checker established, for a safety reviewer, on screen and paper.

It is outside the proof, and states that: it renders the output of ``check.py --json``, and the
trace.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from safenav.certify.check import BundleVerdict
from safenav.run.looks import Look, looks
from safenav.run.wording import Wording
from safenav.scenario.objective import target_regions, to_data
from safenav.trace.reading import Trace, read_bytes
from safenav.trace.setting import RobotHeader, ScenarioHeader
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
    "Time: no claim states when a goal is met, only that it is met infinitely often.",
    "The checker and Python itself.",
)
_STYLE = Path(__file__).with_suffix(".css")
SIDE = 24
_LETTERS = (7.5, 12.0, 55)
"""Least and largest height of letters (SVG units), and letters across the width of the map."""


def page_of(content: bytes, verdict: BundleVerdict, files: Mapping[str, bytes]) -> str:
    """Return the page of a bundle with these files, the content of its trace, and a verdict of its
    checker."""
    trace = read_bytes(content)
    scenario = trace.header.scenario
    world = RegionMap.from_grid(scenario.map.grid, scenario.map.names, scenario.map.areas)
    body = [
        f'<section id="summary">{_summary(trace, verdict)}</section>',
        _mission(scenario, world),
        _claims(verdict.claims),
        _happened(trace, world),
        _evidence(verdict.claims, content.splitlines(), files),
    ]
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Assurance: {escape(scenario.name)}</title>"
        f"<style>\n{_STYLE.read_text()}</style></head><body>{''.join(body)}</body></html>\n"
    )


def _summary(trace: Trace, verdict: BundleVerdict) -> str:
    end = trace.outcome
    outcome = "unfinished" if end is None else end.outcome.value
    why = "the trace ends before the run does" if end is None else end.explanation
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
        f"<header><h1>{escape(trace.header.scenario.name)}</h1></header>"
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


def _mission(scenario: ScenarioHeader, world: RegionMap) -> str:
    rows = [
        '<tr><td><svg class="who" viewBox="-1.4 -1.4 2.8 2.8" aria-hidden="true">'
        f"{_glyph(look)}</svg>{escape(name)}</td><td>{escape(robot.model)}</td>"
        f"<td>{escape(world.place(robot.start))}</td>"
        f"<td><code>{escape(json.dumps(to_data(robot.objective)))}</code></td>"
        f"<td>{escape(', '.join(sorted(robot.capabilities)).replace('_', ' ') or 'none')}</td></tr>"
        for (name, robot), look in _robots(scenario)
    ]
    named = ", ".join(f"{name} is {region}" for name, region in world.names.items())
    return (
        f"<h2>Mission</h2>{_picture(scenario, world)}"
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


def _happened(trace: Trace, world: RegionMap) -> str:
    wording = Wording(
        world.word,
        world.place,
        actions={o.name: [n.action for n in o.needs] for o in trace.obstacles.values()},
        skills={name: robot.capabilities for name, robot in trace.header.scenario.robots.items()},
    )
    rows = [
        f"<tr><td>{record.tick}</td><td>{escape(wording.sentence(record))}</td>"
        f"<td>line {record.line}</td></tr>"
        for record in trace.records
        if record.type in _EVENTS
    ]
    if not rows:
        return "<h2>Events</h2><p>No unexpected events.</p>"
    head = "<tr><th>tick</th><th>event</th><th>trace</th></tr>"
    return f"<h2>Events</h2><table>{head}{''.join(rows)}</table>"


def _evidence(claims: Sequence[Data], lines: Sequence[bytes], files: Mapping[str, bytes]) -> str:
    named = {line for claim in claims for _, line in claim["evidence"] if line}
    shown = [
        f'<h3 id="line-{number}">trace.jsonl, line {number}</h3>'
        f"<pre>{escape(json.dumps(json.loads(lines[number - 1])))}</pre>"
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


def _robots(scenario: ScenarioHeader) -> Iterator[tuple[tuple[str, RobotHeader], Look]]:
    return zip(scenario.robots.items(), looks([*scenario.robots]), strict=True)


def _picture(scenario: ScenarioHeader, world: RegionMap) -> str:
    """Return the map as SVG: each robot at its start, a square in its colour around each of its
    targets, a cross in the region of each hidden obstacle, and the names of regions and areas. The
    page's style sets the colours of the floor, in a light and a dark variant."""
    width, height = world.cols * SIDE, world.rows * SIDE
    parts = [
        f'<svg class="map" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="Map of {escape(scenario.name)}" xmlns="http://www.w3.org/2000/svg">'
    ]
    for region in range(world.size):
        x, y = _corner(region, world)
        kind = "wall" if region in world.walls else "floor"
        parts.append(f'<rect class="{kind}" x="{x}" y="{y}" width="{SIDE}" height="{SIDE}"/>')
    for area in world.areas.values():
        for region in sorted(area):
            x, y = _corner(region, world)
            parts.append(f'<rect class="area" x="{x}" y="{y}" width="{SIDE}" height="{SIDE}"/>')
    marked = {obstacle.region for obstacle in scenario.obstacles}
    starts = []
    for number, ((_, robot), look) in enumerate(_robots(scenario)):
        inset = 2 + 1.6 * (number % 4)
        targets = target_regions(robot.objective)
        marked |= targets
        for region in sorted(targets):
            x, y = _corner(region, world)
            size = SIDE - 2 * inset
            parts.append(
                f'<rect x="{x + inset}" y="{y + inset}" width="{size}" height="{size}" rx="3" '
                f'fill="none" stroke="{look.colour}" stroke-width="1.6"/>'
            )
        x, y = _corner(robot.start, world)
        starts.append(
            f'<g transform="translate({x + SIDE / 2} {y + SIDE / 2}) scale(7)">{_glyph(look)}</g>'
        )
    for obstacle in scenario.obstacles:
        x, y = _corner(obstacle.region, world)
        a, b = 7, SIDE - 7
        parts.append(
            f'<path class="cross" d="M{x + a} {y + a}L{x + b} {y + b}M{x + b} {y + a}'
            f'L{x + a} {y + b}"><title>{escape(obstacle.name)}</title></path>'
        )
    return "".join([*parts, *starts, *_names(world, marked), "</svg>"])


def _glyph(look: Look) -> str:
    """Return a robot's glyph as SVG, as in the replay: radius 1, around the origin."""
    return (
        f'<path d="{look.path}" fill="{look.colour}" class="body"/><text y="{look.drop}" '
        f'font-size="{look.size}" font-weight="bold" fill="{look.ink}" text-anchor="middle">'
        f"{escape(look.letters)}</text>"
    )


def _names(world: RegionMap, marked: set[int]) -> list[str]:
    """Return names, where they cover no other name, and the numbers of marked regions without a
    name."""
    subjects = [(name, frozenset({region})) for name, region in world.names.items()]
    subjects += [(name, area) for name, area in world.areas.items() if area]
    unnamed = sorted(marked - {*world.names.values()})
    subjects += [(str(region), frozenset({region})) for region in unnamed]
    least, largest, across = _LETTERS
    high = min(max(least, world.cols * SIDE / across), largest)
    placed: list[tuple[float, float, float]] = []  # middle and half of the width
    parts = []
    for text, regions in subjects:
        corners = [_corner(region, world) for region in regions]
        x = sum(corner[0] for corner in corners) / len(corners) + SIDE / 2
        y = sum(corner[1] for corner in corners) / len(corners) + SIDE / 2
        half = 0.3 * high * len(text) + 1
        x = max(min(x, world.cols * SIDE - half), half)
        downs = (0.5, -0.5, 0.85, -0.85) if len(regions) == 1 else (0, 0.35, -0.35, 0.7, -0.7)
        free = (
            y + down * SIDE
            for down in downs
            if high < y + down * SIDE < world.rows * SIDE - 2
            and not any(
                abs(y + down * SIDE - other) < high and abs(x - middle) < half + wide
                for middle, other, wide in placed
            )
        )
        there = next(free, None)
        if there is None:
            continue
        placed.append((x, there, half))
        kind, size = ("name number", 0.8 * high) if text.isdecimal() else ("name", high)
        parts.append(
            f'<text class="{kind}" x="{x:.1f}" y="{there + 0.35 * high:.1f}" '
            f'font-size="{size:.1f}" text-anchor="middle">{escape(text)}</text>'
        )
    return parts


def _corner(region: int, world: RegionMap) -> tuple[int, int]:
    row, col = world.position(region)
    return col * SIDE, row * SIDE

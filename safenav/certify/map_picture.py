"""The scenario's map as a small SVG for the assurance page: walls, names, starts, targets."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from safenav.judge.lines import READS
from safenav.run.looks import Look, looks
from safenav.world.map import RegionMap

SIDE = 24
_LETTERS = (7.5, 12.0, 55)
"""Least and largest height of letters (SVG units), and letters across the width of the map."""


def map_svg(scenario: Mapping[str, Any], world: RegionMap) -> str:
    """Return the map as SVG: each robot at its start, a square in its colour around each of its
    targets, a cross in the region of each hidden obstacle, and the names of regions and areas. The
    page's style sets the colours of the floor, in a light and a dark variant."""
    width, height = world.cols * SIDE, world.rows * SIDE
    parts = [
        f'<svg class="map" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="Map of {escape(scenario["name"])}" xmlns="http://www.w3.org/2000/svg">'
    ]
    for region in range(world.size):
        x, y = _corner(region, world)
        kind = "wall" if region in world.walls else "floor"
        parts.append(f'<rect class="{kind}" x="{x}" y="{y}" width="{SIDE}" height="{SIDE}"/>')
    for area in world.areas.values():
        for region in sorted(area):
            x, y = _corner(region, world)
            parts.append(f'<rect class="area" x="{x}" y="{y}" width="{SIDE}" height="{SIDE}"/>')
    marked = {obstacle["region"] for obstacle in scenario["obstacles"]}
    starts = []
    for number, (robot, look) in enumerate(
        zip(scenario["robots"].values(), looks([*scenario["robots"]]), strict=True)
    ):
        inset = 2 + 1.6 * (number % 4)
        targets = frozenset[int]().union(*READS["objective"](robot["objective"]).targets)
        marked |= targets
        for region in sorted(targets):
            x, y = _corner(region, world)
            size = SIDE - 2 * inset
            parts.append(
                f'<rect x="{x + inset}" y="{y + inset}" width="{size}" height="{size}" rx="3" '
                f'fill="none" stroke="{look.colour}" stroke-width="1.6"/>'
            )
        x, y = _corner(robot["start"], world)
        starts.append(
            f'<g transform="translate({x + SIDE / 2} {y + SIDE / 2}) scale(7)">{glyph(look)}</g>'
        )
    for obstacle in scenario["obstacles"]:
        x, y = _corner(obstacle["region"], world)
        a, b = 7, SIDE - 7
        parts.append(
            f'<path class="cross" d="M{x + a} {y + a}L{x + b} {y + b}M{x + b} {y + a}'
            f'L{x + a} {y + b}"><title>{escape(obstacle["name"])}</title></path>'
        )
    return "".join([*parts, *starts, *_names(world, marked), "</svg>"])


def glyph(look: Look) -> str:
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

"""The scenario's map as a small SVG for the assurance page: walls, starts, targets, obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

SIDE = 24
COLOURS = ("#1b6ca8", "#b3541e", "#2e7d4f", "#7a3b8f", "#8a6d00", "#a8324a")


def map_svg(scenario: Mapping[str, Any]) -> str:
    """The map, with a disc where each robot starts, a square in its colour around each of its
    targets, and a cross in the region of each hidden obstacle."""
    grid = scenario["map"]["grid"]
    rows, cols = len(grid), len(grid[0])
    parts = [
        f'<svg viewBox="0 0 {cols * SIDE} {rows * SIDE}" role="img" '
        f'aria-label="Map of {escape(scenario["name"])}" xmlns="http://www.w3.org/2000/svg">',
        f'<rect width="{cols * SIDE}" height="{rows * SIDE}" fill="#fff"/>',
    ]
    for row, line in enumerate(grid):
        for col, cell in enumerate(line):
            fill = "#4a4f57" if cell == "#" else "#fff"
            parts.append(
                f'<rect x="{col * SIDE}" y="{row * SIDE}" width="{SIDE}" height="{SIDE}" '
                f'fill="{fill}" stroke="#d5d8dc" stroke-width=".6"/>'
            )
    for number, (name, robot) in enumerate(scenario["robots"].items()):
        colour = COLOURS[number % len(COLOURS)]
        inset = 2 + 1.6 * (number % 4)
        for region in sorted(regions_of(robot["objective"])):
            x, y = _corner(region, cols)
            size = SIDE - 2 * inset
            parts.append(
                f'<rect x="{x + inset}" y="{y + inset}" width="{size}" height="{size}" rx="3" '
                f'fill="none" stroke="{colour}" stroke-width="1.6"/>'
                f"{_number(region, cols, SIDE / 2 + 2)}"
            )
        x, y = _corner(robot["start"], cols)
        centre = f"{x + SIDE / 2},{y + SIDE / 2}"
        cx, cy = centre.split(",")
        parts.append(
            f'<circle cx="{cx}" cy="{cy}" r="8" fill="{colour}"/>'
            f'<text x="{cx}" y="{float(cy) + 3.6}" font-size="10" fill="#fff" '
            f'text-anchor="middle">{escape(name[:1].upper())}</text>'
        )
    for obstacle in scenario["obstacles"]:
        x, y = _corner(obstacle["region"], cols)
        a, b = 7, SIDE - 7
        parts.append(
            f'<path d="M{x + a} {y + a}L{x + b} {y + b}M{x + b} {y + a}L{x + a} {y + b}" '
            f'stroke="#c62828" stroke-width="2.4"><title>{escape(obstacle["name"])}</title></path>'
            f"{_number(obstacle['region'], cols, SIDE - 1.4)}"
        )
    return "".join([*parts, "</svg>"])


def _number(region: int, cols: int, down: float) -> str:
    """A region's number, so far down in its square."""
    x, y = _corner(region, cols)
    where = f'x="{x + SIDE / 2}" y="{y + down}"'
    return f'<text {where} font-size="6" fill="#1c2024" text-anchor="middle">{region}</text>'


def regions_of(objective: Mapping[str, Any]) -> set[int]:
    """All regions that an objective names as targets."""
    ((kind, value),) = ((key, value) for key, value in objective.items() if key != "form")
    if kind == "ltl":
        return set()
    found: set[int] = set()
    for target in value if isinstance(value, list) else [value]:
        found.update(target if isinstance(target, list) else [target])
    return found


def _corner(region: int, cols: int) -> tuple[int, int]:
    return region % cols * SIDE, region // cols * SIDE

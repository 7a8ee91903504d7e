"""Sight and beliefs of a robot as shading of the floor; on the page: shading.tsx.

Sight is a tint in the colour of the viewing robot. A belief is hatched in the colour of the other
robot, each in its own direction; the region in which that robot is seen has a plain frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from safenav.report.picture.floor import filled
from safenav.report.picture.legend import Row, lines_of
from safenav.report.picture.names import outline
from safenav.report.picture.svg import SvgWriter, number
from safenav.report.replay.perception import Shading
from safenav.report.replay.timeline import Placed, RobotBelief
from safenav.trace.looks import Look
from safenav.world.map import RegionMap

_ANGLES = (45, -45, 15, -75, 75, -15)
_PITCH, _LINE = 0.16, 0.042
"""Distance and width of the lines of a hatch, in cells."""


def draw_shading(
    page: SvgWriter, shading: Shading, world: RegionMap, cell: float, style: Mapping[str, Look]
) -> None:
    """Tint and hatch the floor. ``style`` has the looks of all robots by name."""
    if shading.sight is not None:
        area, border = filled(world, shading.sight, cell), outline(world, shading.sight, cell)
        _sight(page, area, border, style[shading.robot])
    for other, belief in shading.beliefs:
        order = list(style).index(other)
        area, border = filled(world, belief.regions, cell), outline(world, belief.regions, cell)
        _belief(page, area, border, belief, style[other], cell, order)


def draw_taken(
    page: SvgWriter, robots: Sequence[Placed], world: RegionMap, cell: float, style: Sequence[Look]
) -> None:
    """Draw a frame around both regions of each robot in transit."""
    for robot, look in zip(robots, style, strict=True):
        if not robot.taken:
            continue
        rows, cols = zip(*map(world.position, robot.taken), strict=True)
        gap = 0.06 * cell
        page.rect(
            min(cols) * cell + gap,
            min(rows) * cell + gap,
            (max(cols) - min(cols) + 1) * cell - 2 * gap,
            (max(rows) - min(rows) + 1) * cell - 2 * gap,
            rx=0.2 * cell,
            fill="none",
            stroke=look.colour,
            stroke_width=max(1.5, 0.05 * cell),
        )


def shading_rows(shading: Shading, style: Mapping[str, Look]) -> list[Row]:
    rows = []

    def sight(page: SvgWriter, x: float, y: float) -> None:
        _sight(page, _swatch(x, y), _swatch(x, y), style[shading.robot])

    if shading.sight is not None:
        limit = "" if shading.vision is None else f" (radius {number(shading.vision)} regions)"
        rows.append(Row(sight, lines_of(f"what {shading.robot} sees{limit}", 12)))
    for other, belief in shading.beliefs:

        def believed(
            page: SvgWriter, x: float, y: float, other: str = other, belief: RobotBelief = belief
        ) -> None:
            order, box = list(style).index(other), _swatch(x, y)
            _belief(page, box, box, belief, style[other], 40.0, order, "-legend")

        words = f"where {shading.robot} saw {other} at its last observation"
        if not belief.seen:
            words = f"where {shading.robot} believed {other} to be at its last observation"
        rows.append(Row(believed, lines_of(words, 12)))
    return rows


def taken_row(robots: Sequence[Placed], style: Sequence[Look]) -> Row | None:
    """Return the legend's row for robots in transit; None if there are none."""
    look = next((look for robot, look in zip(robots, style, strict=True) if robot.taken), None)
    if look is None:
        return None

    def icon(page: SvgWriter, x: float, y: float) -> None:
        page.rect(x - 12, y - 6, 24, 12, rx=4, fill="none", stroke=look.colour, stroke_width=2)

    return Row(icon, lines_of("in transit: occupies both regions", 12))


def _swatch(x: float, y: float) -> str:
    return f"M{number(x - 9)},{number(y - 9)}h18v18h-18z"


def _sight(page: SvgWriter, area: str, border: str, look: Look) -> None:
    page.path(area, fill=look.colour, fill_opacity=0.13)
    page.path(border, fill="none", stroke=look.colour, stroke_opacity=0.6, stroke_width=1.2)


def _belief(
    page: SvgWriter,
    area: str,
    border: str,
    belief: RobotBelief,
    look: Look,
    cell: float,
    order: int,
    suffix: str = "",
) -> None:
    if belief.seen:
        page.path(border, fill="none", stroke=look.colour, stroke_width=2.6)
        return
    name, pitch = f"hatch-{order}{suffix}", _PITCH * cell
    line = f'<rect width="{number(_LINE * cell)}" height="{number(pitch)}" fill="{look.colour}"/>'
    page.element(
        "pattern",
        line,
        id=name,
        width=pitch,
        height=pitch,
        patternUnits="userSpaceOnUse",
        patternTransform=f"rotate({_ANGLES[order % len(_ANGLES)]})",
    )
    page.path(area, fill=f"url(#{name})", fill_opacity=0.6)
    page.path(border, fill="none", stroke=look.colour, stroke_width=1.6, stroke_dasharray="5 3")

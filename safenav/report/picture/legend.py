"""The legend of a picture: robots, obstacles, requests, meanings of the marks."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from msgspec import Struct

from safenav.report.picture.floor import AREA, INK, MUTED, WALL, WALL_LINE
from safenav.report.picture.glyphs import GLYPHS, STATUS_MARKS
from safenav.report.picture.svg import SvgWriter, number, wrapped
from safenav.run.looks import Look, looks
from safenav.run.values import ObstacleStatus, Scene, StoryKind
from safenav.trace.words import listed

WIDTH = 270.0
GAP = 24.0
ICON = 30.0

Icon = Callable[[SvgWriter, float, float], None]
"""Draws a sign around a point."""


class Row(Struct, frozen=True):
    """A sign and some lines of text: (words, size, bold, colour). ``heads``: a heading."""

    icon: Icon | None
    lines: tuple[tuple[str, float, bool, str], ...]
    heads: bool = False

    @property
    def height(self) -> float:
        words = sum(size * 1.32 for _, size, _, _ in self.lines)
        return words + 14 if self.heads else max(24.0, words + 6)

    def draw(self, page: SvgWriter, x: float, y: float) -> None:
        if self.icon is not None:
            self.icon(page, x + 12, y + 11)
        baseline = y + (9.0 if self.heads else 3.0)
        indent = ICON if self.icon is not None else 0.0
        for words, size, bold, colour in self.lines:
            baseline += size * 1.32
            page.text(x + indent, baseline - size * 0.28, words, size, bold=bold, fill=colour)


class Legend(Struct, frozen=True):
    """Rows in reading order, in as many columns as fit below the map."""

    rows: tuple[Row, ...]

    def _columns(self, width: float) -> list[list[Row]]:
        count = max(1, int((width + GAP) // (WIDTH + GAP)))
        limit = sum(row.height for row in self.rows) / count + 30
        columns: list[list[Row]] = [[]]
        for row, after in zip(self.rows, [*self.rows[1:], None], strict=True):
            end = _height(columns[-1]) + row.height + (after.height if row.heads and after else 0.0)
            if columns[-1] and end > limit and len(columns) < count:
                columns.append([])
            columns[-1].append(row)
        return columns

    def height(self, width: float) -> float:
        """Return its height below a map of this width."""
        return max(map(_height, self._columns(width)))

    def draw(self, page: SvgWriter, left: float, top: float, width: float) -> None:
        for i, column in enumerate(self._columns(width)):
            y = top
            for row in column:
                row.draw(page, left + i * (WIDTH + GAP), y)
                y += row.height


def _height(column: Sequence[Row]) -> float:
    return sum(row.height for row in column)


def key_of(scene: Scene) -> Legend:
    """Return the robots' signs and names alone: the legend of a film."""
    names = [robot.name for robot in scene.robots]
    pairs = zip(map(_body, looks(names)), names, strict=True)
    return Legend(tuple(Row(icon, lines_of(name, 13)) for icon, name in pairs))


def legend_of(scene: Scene, exclusion: Mapping[str, Any]) -> Legend:
    """Return the legend of a scene's picture. ``exclusion``: the line around such regions."""
    style = looks([robot.name for robot in scene.robots])
    groups = {
        "Robots and objectives": _robots(scene, style),
        "Obstacles": _obstacles(scene),
        "Objective stack, top first": _stack(scene),
        "Marks": _marks(scene, style, exclusion),
    }
    rows: list[Row] = []
    for title, found in groups.items():
        group = [*found]
        rows += [Row(None, lines_of(title, 13, bold=True), heads=True), *group] if group else []
    return Legend(tuple(rows))


def lines_of(
    text: str, size: float, width: float = WIDTH - ICON, bold: bool = False, colour: str = INK
) -> tuple[tuple[str, float, bool, str], ...]:
    return tuple((line, size, bold, colour) for line in wrapped(text, size, width, bold))


def _robots(scene: Scene, style: Sequence[Look]) -> Iterator[Row]:
    for robot, look in zip(scene.robots, style, strict=True):
        lines = lines_of(robot.name, 13, bold=True)
        model = f"{robot.model}, {robot.layer}" if robot.layer else robot.model
        lines += lines_of(model, 12, colour=MUTED)
        lines += lines_of(robot.doing, 12)
        if equipment := robot.equipment(scene.map):
            lines += lines_of(equipment, 12, colour=MUTED)
        yield Row(_body(look), lines)


def _body(look: Look) -> Icon:
    def draw(page: SvgWriter, x: float, y: float) -> None:
        page.glyph(look.path, x, y, 10, fill=look.colour, stroke=INK, stroke_width=0.1)
        centred = {"fill": look.ink, "text_anchor": "middle"}
        page.text(x, y + 10 * look.drop, look.letters, 10 * look.size, bold=True, **centred)

    return draw


def _obstacles(scene: Scene) -> Iterator[Row]:
    for obstacle, status, met in scene.obstacles:
        lines = lines_of(obstacle.label(scene.map), 13, bold=True)
        lines += lines_of(obstacle.state(status, met), 12, colour=MUTED)
        mark = STATUS_MARKS[status]
        yield Row(_glyph(mark.path, 8, fill=mark.colour), lines)


def _stack(scene: Scene) -> Iterator[Row]:
    for depth, row in reversed(list(enumerate(scene.stack, start=1))):
        lines = lines_of(f"{depth}. {row.about(scene.map.word)}", 12, WIDTH, bold=True)
        yield Row(None, lines + lines_of(row.roles, 12, WIDTH))


def _square(half: float, **style: Any) -> Icon:
    return _rect(half, half, **style)


def _rect(wide: float, high: float, **style: Any) -> Icon:
    return lambda page, x, y: page.rect(x - wide, y - high, 2 * wide, 2 * high, **style)


def _glyph(path: str, radius: float, down: float = 0.0, **style: Any) -> Icon:
    return lambda page, x, y: page.glyph(path, x, y + down, radius, **style)


def _line(data: str, **style: Any) -> Icon:
    """Return the sign of a line that begins 11 to the left of the point."""
    begin = {"fill": "none", "stroke_width": 2.6} | style
    return lambda page, x, y: page.path(f"M{number(x - 11)},{number(y)}{data}", **begin)


def _load(page: SvgWriter, x: float, y: float) -> None:
    _square(8, rx=1.5, fill="#FFFFFF", stroke=INK, stroke_width=0.8)(page, x, y)
    page.glyph(GLYPHS.obstacles["crate"], x, y, 6, fill=INK)


def _marks(scene: Scene, style: Sequence[Look], exclusion: Mapping[str, Any]) -> Iterable[Row]:
    """Return the meanings of the marks that the picture has."""
    robots, objectives = scene.robots, [r.objective for r in scene.robots if r.objective]
    colour = style[0].colour if style else INK
    own, thin = {"stroke": colour}, {"fill": "none", "stroke_width": 2}
    found = STATUS_MARKS[ObstacleStatus.FOUND].colour

    def target(page: SvgWriter, x: float, y: float) -> None:
        page.element("circle", cx=x, cy=y, r=8, fill=colour, fill_opacity=0.3, **own)
        dark = {"stroke": INK, "stroke_width": 0.22}
        page.glyph(style[0].path, x + 6, y - 6, 3.4, 0, fill=colour, **dark)

    area = _square(8, stroke=AREA, stroke_dasharray="4 2", fill="none")
    avoided = _square(9, stroke_dasharray="2 4", **own, **thin)
    transit = _rect(12, 6, rx=4, **own, **thin)
    refused = any(event.kind is StoryKind.VIOLATION for event in scene.happened)
    faces = any(robot.heading is not None for robot in robots)
    gone = any(len({*robot.trail}) > 1 for robot in robots)
    goes = any(len(robot.ahead) > 1 for robot in robots)
    table: list[tuple[object, Icon, str]] = [
        (scene.map.walls, _square(8, fill=WALL, stroke=WALL_LINE), "wall"),
        (scene.map.areas, area, "area"),
        (style, target, "target of the robot with this shape; filled: the next one"),
        (goes, _line("h22", stroke_dasharray="3 3", **own), "where the robot goes next"),
        (any(o.avoid for o in objectives), avoided, "regions that the robot of this colour avoids"),
        (gone, _line("h22", stroke_opacity=0.6, **own), "path of a robot, newest part strongest"),
        (faces, _glyph(GLYPHS.nose, 11, 15, fill=INK), "where a robot faces"),
        (refused, _line("h19m-5,-4.5l5,4.5l-5,4.5", stroke=found), "refused step"),
        (any(robot.taken for robot in robots), transit, "in transit: occupies both regions"),
        (any(robot.loads for robot in robots), _load, "load that the robot carries"),
        (scene.chargers, _glyph(GLYPHS.charger, 7, fill="#B87900"), "charger"),
    ]
    for each in scene.exclusions:
        words = f"at most one of {listed(sorted(each.robots))} at a time"
        table.append((True, _square(9, fill="none", **exclusion), words))
    return [Row(icon, lines_of(words, 12)) for drawn, icon, words in table if drawn]

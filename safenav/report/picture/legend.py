"""The legend of a picture: robots, meanings of the marks, events of this moment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from msgspec import Struct, field

from safenav.report.picture.floor import INK, MUTED, WALL, WALL_LINE
from safenav.report.picture.glyphs import GLYPHS, STATUS_MARKS
from safenav.report.picture.names import AREA
from safenav.report.picture.svg import SvgWriter, text_width, wrapped
from safenav.report.replay.timeline import ObstacleStatus, Scene, StackRow, StoryKind
from safenav.trace.looks import Look, looks
from safenav.world.map import RegionMap

WIDTH = 270.0
GAP = 24.0
ICON = 30.0
_QUIET = {StoryKind.SYNTHESIS, StoryKind.PUSH, StoryKind.POP, StoryKind.OUTCOME}

Icon = Callable[[SvgWriter, float, float], None]
"""Draws a sign around a point."""


_ROWS = 12
"""The most rows of an undivided block; larger blocks are divided, to fill several columns."""


class Row(Struct, frozen=True):
    """A sign and some lines of text: (words, size, bold, colour)."""

    icon: Icon | None
    lines: tuple[tuple[str, float, bool, str], ...]

    @property
    def height(self) -> float:
        return max(24.0, sum(size * 1.32 for _, size, _, _ in self.lines) + 6)

    def draw(self, page: SvgWriter, x: float, y: float) -> None:
        if self.icon is not None:
            self.icon(page, x + 12, y + 11)
        baseline = y + 3.0
        indent = ICON if self.icon is not None else 0.0
        for words, size, bold, colour in self.lines:
            baseline += size * 1.32
            page.text(x + indent, baseline - size * 0.28, words, size, bold=bold, fill=colour)


CONTINUED = ", continued"


class Block(Struct, frozen=True):
    """A heading and its rows, in one column."""

    title: str
    rows: tuple[Row, ...]

    @property
    def height(self) -> float:
        return 24.0 + sum(row.height for row in self.rows) + 8.0

    def draw(self, page: SvgWriter, x: float, y: float) -> None:
        page.text(x, y + 14, self.title, 13, bold=True, fill=INK)
        y += 24.0
        for row in self.rows:
            row.draw(page, x, y)
            y += row.height


class Legend(Struct):
    """Blocks in columns. ``arranged`` decides where the legend goes, then ``draw`` it."""

    blocks: tuple[Block, ...]
    columns: list[list[Block]] = field(default_factory=list)

    def arranged(self, width: float, height: float) -> tuple[float, bool]:
        """Arrange the legend beside a map of this size, or below it if that leaves less empty
        space.

        Returns its width, and whether it is beside the map."""
        alone = _joined(self.blocks)
        below = [*map(_joined, self._flow(max(1, int((width + GAP) // (WIDTH + GAP)))))]
        tallest = max(map(_height, below))
        paper_beside = (width + GAP + WIDTH) * max(height, _height(alone))
        paper_below = max(width, WIDTH) * (height + 20 + tallest)
        beside = paper_beside <= paper_below * 1.1
        self.columns = [alone] if beside else below
        return (GAP + WIDTH if beside else len(below) * (WIDTH + GAP) - GAP), beside

    @property
    def height(self) -> float:
        return max(map(_height, self.columns))

    def _flow(self, count: int) -> list[list[Block]]:
        """Return the blocks in reading order over at most ``count`` columns of similar height."""
        limit = max(block.height for block in self.blocks)
        while True:
            columns: list[list[Block]] = [[]]
            for block in self.blocks:
                if columns[-1] and _height(columns[-1]) + block.height > limit:
                    columns.append([])
                columns[-1].append(block)
            if len(columns) <= count:
                return columns
            limit *= 1.1

    def draw(self, page: SvgWriter, x: float, y: float) -> None:
        for i, column in enumerate(self.columns):
            below = y
            for block in column:
                block.draw(page, x + i * (WIDTH + GAP), below)
                below += block.height


def legend_of(scene: Scene, hidden: bool, more: Sequence[Row] = ()) -> Legend:
    """Return the legend of a scene's picture, with ``more`` marks."""
    style = looks([robot.name for robot in scene.robots])
    blocks = [*_parts(_robots(scene, style)), *_parts(_obstacles(scene, hidden))]
    if scene.stack:
        blocks.append(_stack(scene.stack, scene.map))
    events = [event for event in scene.happened if event.kind not in _QUIET]
    if events:
        rows = tuple(Row(None, lines_of(event.text, 12, WIDTH)) for event in events[:6])
        blocks.append(Block("At this moment", rows))
    blocks += _parts(_marks(scene, style, more))
    return Legend(tuple(blocks))


def _parts(block: Block) -> list[Block]:
    """Return a block, divided if it has more than ``_ROWS`` rows; none if it has no rows."""
    rows = block.rows
    size = len(rows) if len(rows) <= _ROWS else _ROWS // 2
    parts = [rows[first : first + size] for first in range(0, len(rows), max(1, size))]
    return [Block(block.title + CONTINUED * (i > 0), part) for i, part in enumerate(parts)]


def _joined(column: Sequence[Block]) -> list[Block]:
    """Return the blocks of a column, with successive parts of one block joined."""
    found: list[Block] = []
    for block in column:
        if found and block.title.removesuffix(CONTINUED) == found[-1].title.removesuffix(CONTINUED):
            found[-1] = Block(found[-1].title, found[-1].rows + block.rows)
        else:
            found.append(block)
    return found


def _height(column: Sequence[Block]) -> float:
    return sum(block.height for block in column)


class KeyRow(Struct, frozen=True):
    """The robots' signs and names in running text: the legend of a film."""

    entries: tuple[tuple[Icon, str], ...]

    def _places(self, width: float) -> list[tuple[float, float]]:
        places, x, y = [], 0.0, 0.0
        for _, name in self.entries:
            needed = ICON + text_width(name, 13) + 18
            if x and x + needed > width:
                x, y = 0.0, y + 28.0
            places.append((x, y))
            x += needed
        return places

    def measure(self, width: float) -> float:
        """Return its height at a width."""
        return self._places(width)[-1][1] + 34.0 if self.entries else 0.0

    def draw(self, page: SvgWriter, left: float, top: float, width: float) -> None:
        for (icon, name), (x, y) in zip(self.entries, self._places(width), strict=True):
            icon(page, left + x + 12, top + y + 14)
            page.text(left + x + ICON, top + y + 18.5, name, 13, fill=INK)


def key_row(scene: Scene) -> KeyRow:
    """Return robot glyphs and names, in one line or a few."""
    names = [robot.name for robot in scene.robots]
    bodies = [_body(look) for look in looks(names)]
    return KeyRow(tuple(zip(bodies, names, strict=True)))


def lines_of(
    text: str, size: float, width: float = WIDTH - ICON, bold: bool = False, colour: str = INK
) -> tuple[tuple[str, float, bool, str], ...]:
    return tuple((line, size, bold, colour) for line in wrapped(text, size, width, bold))


def _robots(scene: Scene, style: tuple[Look, ...]) -> Block:
    rows = []
    for robot, look in zip(scene.robots, style, strict=True):
        lines = lines_of(robot.name, 13, bold=True)
        model = f"{robot.model}, {robot.layer}" if robot.layer else robot.model
        lines += lines_of(model, 12, colour=MUTED)
        lines += lines_of(robot.doing, 12)
        if equipment := robot.equipment(scene.map):
            lines += lines_of(equipment, 12, colour=MUTED)
        rows.append(Row(_body(look), lines))
    return Block("Robots and objectives", tuple(rows))


def _body(look: Look) -> Icon:
    def draw(page: SvgWriter, x: float, y: float) -> None:
        page.glyph(look.path, x, y, 10, fill=look.colour, stroke=INK, stroke_width=0.1)
        centred = {"fill": look.ink, "text_anchor": "middle"}
        page.text(x, y + 10 * look.drop, look.letters, 10 * look.size, bold=True, **centred)

    return draw


def _obstacles(scene: Scene, hidden: bool) -> Block:
    rows = []
    for obstacle, status, met in scene.obstacles:
        if status is ObstacleStatus.HIDDEN and not hidden:
            continue
        lines = lines_of(obstacle.label(scene.map), 13, bold=True)
        lines += lines_of(obstacle.state(status, met), 12, colour=MUTED)
        rows.append(Row(_status(status), lines))
    return Block("Obstacles", tuple(rows))


def _status(status: ObstacleStatus) -> Icon:
    return glyph(STATUS_MARKS[status].path, 8, fill=STATUS_MARKS[status].colour)


def _stack(stack: tuple[StackRow, ...], world: RegionMap) -> Block:
    rows = []
    for depth, frame in reversed(list(enumerate(stack, start=1))):
        words = f"{depth}. {frame.about(world.word)}"
        lines = lines_of(words, 12, WIDTH, bold=True)
        lines += lines_of(frame.roles, 12, WIDTH)
        rows.append(Row(None, lines))
    return Block("Objective stack, top first", tuple(rows))


def square(half: float, **style: Any) -> Icon:
    """Return the sign of a square with sides of twice ``half``."""
    return lambda page, x, y: page.rect(x - half, y - half, 2 * half, 2 * half, **style)


def glyph(path: str, radius: float, down: float = 0.0, **style: Any) -> Icon:
    """Return the sign of a glyph, ``down`` below the point."""
    return lambda page, x, y: page.glyph(path, x, y + down, radius, **style)


def _marks(scene: Scene, style: tuple[Look, ...], more: Sequence[Row]) -> Block:
    colour = style[0].colour if style else INK
    frame = {"fill": "none", "stroke": colour, "stroke_width": 2}

    def target(page: SvgWriter, x: float, y: float) -> None:
        square(9, **frame)(page, x, y)
        look = style[0]
        page.glyph(look.path, x + 4, y + 4, 3.4, fill=look.colour, stroke=INK, stroke_width=0.22)

    def trail(page: SvgWriter, x: float, y: float) -> None:
        for i, opacity in enumerate((0.25, 0.45, 0.7)):
            line = f"M{x - 11 + 7 * i:.0f},{y:.0f}h7"
            page.path(line, stroke=colour, stroke_width=2.6, opacity=opacity)

    def refused(page: SvgWriter, x: float, y: float) -> None:
        arrow = f"M{x - 9:.0f},{y:.0f}h17m-5,-4.5l5,4.5l-5,4.5"
        found = STATUS_MARKS[ObstacleStatus.FOUND].colour
        page.path(arrow, stroke=found, stroke_width=2.6, fill="none")

    robots, objectives = scene.robots, [r.objective for r in scene.robots if r.objective]
    dashed = {"fill": "none", "stroke": AREA, "stroke_dasharray": "4 2"}
    table: tuple[tuple[object, Icon, str], ...] = (
        (scene.map.walls, square(8, fill=WALL, stroke=WALL_LINE), "wall"),
        (scene.map.areas, square(8, **dashed), "area"),
        (style, target, "target of the robot with this shape and colour"),
        (
            any(objective.avoid for objective in objectives),
            square(9, stroke_dasharray="2 4", stroke=colour, stroke_width=2, fill="none"),
            "regions that the robot of this colour avoids",
        ),
        (
            any(len({*robot.trail}) > 1 for robot in robots),
            trail,
            "path of a robot, newest part strongest",
        ),
        (
            any(robot.heading is not None for robot in robots),
            glyph(GLYPHS.nose, 11, 15, fill=INK),
            "where a robot faces",
        ),
        (
            any(event.kind is StoryKind.VIOLATION for event in scene.happened),
            refused,
            "refused step",
        ),
    )
    rows = (Row(icon, lines_of(words, 12)) for drawn, icon, words in table if drawn)
    return Block("Marks", (*rows, *more))

"""A scene as a vector picture for papers: the map, what happens at the moment, robots and obstacles
in words. The marks are those of the page, whose legend explains them.

Everything is placed by arithmetic on known text widths, so that nothing overlaps and nothing
is cut off whatever the names and the size of the map. PNG and GIF are made from this SVG. The map
is cropped to half a region around its free regions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from enum import Enum

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.report.picture import floor, svg
from safenav.run.reading import run_of
from safenav.run.values import Event, Hidden, Look, ObstacleStatus, Placed, Scene, StoryKind, looks
from safenav.scenario.model import Scenario
from safenav.scenario.objective import target_regions
from safenav.trace.file import unstarted
from safenav.world.map import Region

MARGIN = 16.0
NARROWEST = 260.0
"""Least width that leaves room for titles and captions."""
LINE = 18.0
"""Height of a line of the caption."""
CAPTION_LINES = 3
"""Lines of a film's caption, also of an empty one."""
SPOKEN = 6
"""Maximum number of events in the caption of a picture."""
ROBOT = 0.28
"""Radius of a robot's body, in cells."""
LEAST_ROBOT = 8.0
LEAST_MARK = 5.0
"""Least radii of robots' bodies and of marks of obstacles on maps of any size."""
LEAST_SHAPE = 20.0
"""Least side of a cell that has room for the pictogram of an obstacle."""
RING = 0.34
"""Radius of a target's ring, in cells; those of further robots are smaller."""
ASIDE = ((0.71, -0.71), (0.71, 0.71), (-0.71, 0.71))
"""Places of the robots' shapes on rings of one region, from its centre, in radii."""
BADGE = 0.96
"""Distance of a load from the body, in radii of the body."""
EXCLUSION = {"stroke": "#A5568A", "stroke_width": 2.2, "stroke_dasharray": "9 3 2 3"}
"""Line around the regions of ``never_together``."""
_QUIET = {StoryKind.SYNTHESIS, StoryKind.PUSH, StoryKind.POP}


class Layer(Enum):
    """A part of a picture: the floor with all that never changes, and what is above it."""

    GROUND = "ground"
    MOMENT = "moment"


class Options(Struct, frozen=True):
    """Contents of a picture besides the scene itself.

    ``caption``: words below the map instead of those of the moment, always of the same height, and
    the robots' names alone (for the frames of a film). ``layers``: those to draw; without
    ``GROUND`` the picture is transparent."""

    layers: frozenset[Layer] = frozenset(Layer)
    caption: str | None = None


def scene_of(scenario: Scenario) -> Scene:
    """Return the scene of starts, objectives and hidden obstacles."""
    run = replace(run_of(unstarted(scenario)), charges={})
    obstacles = tuple((hidden, ObstacleStatus.HIDDEN, 0) for hidden in run.hidden.values())
    return replace(run.at(0), moment="before the run", obstacles=obstacles)


def svg_of(scene: Scene, options: Options | None = None) -> str:
    options = options or Options()
    cell = floor.cell_size(scene.map)
    left, upper, width, height = (side * cell for side in floor.window(scene.map))
    inner = max(width, NARROWEST)
    title = svg.wrapped(scene.title, 17, inner, bold=True)
    top = MARGIN + 21 * len(title) + 22
    told = [event for event in scene.happened if event.kind not in _QUIET]
    told = sorted(told, key=lambda event: event.kind is not StoryKind.OUTCOME)[:SPOKEN]
    film = options.caption is not None
    says = [options.caption or ""] if film else [f"{event.text}." for event in told]
    caption = [line for text in says for line in svg.wrapped(text, 13, inner)]
    spoken = LINE * (CAPTION_LINES if film else len(caption))
    below = top + height + (spoken + 14 if spoken else 0.0)
    columns = _columns([*_rows(scene, brief=film)], inner)
    end = below + max(map(_height, columns)) + 20 + MARGIN
    page = svg.SvgWriter()
    if Layer.GROUND in options.layers:
        page.rect(0, 0, inner + 2 * MARGIN, end, fill="#FFFFFF")
        for i, line in enumerate(title):
            page.text(MARGIN, MARGIN + 15 + 21 * i, line, 17, bold=True, fill=floor.INK)
        for i, column in enumerate(columns):
            for n, row in enumerate(column):
                row.draw(page, MARGIN + i * (WIDTH + GAP), below + 20 + _height(column[:n]))
    if Layer.MOMENT in options.layers:
        page.text(MARGIN, top - 9, scene.moment, 13, fill=floor.MUTED)
        for i, line in enumerate(caption[: CAPTION_LINES if film else None]):
            page.text(MARGIN, below - spoken + 10 + LINE * i, line, 13, fill=floor.INK)
    inside = "g"  # a cut at the window costs a third of the time, and only the ground needs it
    if Layer.GROUND in options.layers:
        inside, box = "svg", f"{left:g} {upper:g} {width:g} {height:g}"
        page.open(inside, x=MARGIN, y=top, width=width, height=height, viewBox=box)
    else:
        page.open(inside, transform=f"translate({MARGIN - left:g} {top - upper:g})")
    _Drawing(page, scene, cell, options, floor.placed_names(scene.map, cell)).draw(told)
    page.close(inside)
    return page.document(inner + 2 * MARGIN, end, scene.title, _described(scene))


def _described(scene: Scene) -> str:
    robots = ", ".join(
        f"{r.name} in region {scene.map.region(round(r.row), round(r.col))}" for r in scene.robots
    )
    obstacles = ", ".join(f"{o.name} {status.value}" for o, status, _ in scene.obstacles)
    size = f"A map of {scene.map.rows} by {scene.map.cols} regions, {scene.moment}"
    return f"{size}: {robots or 'no robots'}; obstacles: {obstacles or 'none'}."


WIDTH, GAP, ICON = 270.0, 24.0, 30.0
"""Widths of a column of words, of the space beside it, and of its signs."""


class _Row(Struct):
    """The sign of a robot, or the mark of an obstacle, and lines of text: words, size, bold,
    colour."""

    sign: Look | svg.Mark
    lines: list[tuple[str, float, bool, str]] = field(default_factory=list)

    def add(self, words: str, size: float, bold: bool = False, colour: str = floor.INK) -> None:
        for line in svg.wrapped(words, size, WIDTH - ICON, bold):
            self.lines.append((line, size, bold, colour))

    @property
    def height(self) -> float:
        return max(24.0, sum(size * 1.32 for _, size, _, _ in self.lines) + 6)

    def draw(self, page: svg.SvgWriter, x: float, y: float) -> None:
        if isinstance(self.sign, Look):
            draw_body(page, self.sign, x + 12, y + 11, 10.0)
        else:
            page.glyph(self.sign.path, x + 12, y + 11, 8, fill=self.sign.colour)
        baseline = y + 3.0
        for words, size, bold, colour in self.lines:
            baseline += size * 1.32
            page.text(x + ICON, baseline - size * 0.28, words, size, bold=bold, fill=colour)


def _rows(scene: Scene, *, brief: bool) -> Iterator[_Row]:
    """Yield the robots and obstacles of a scene in words; ``brief``: the robots' names alone."""
    for robot, look in zip(scene.robots, looks([r.name for r in scene.robots]), strict=True):
        row = _Row(look)
        row.add(robot.name, 13, bold=not brief)
        if not brief:
            model = f"{robot.model}, {robot.layer}" if robot.layer else robot.model
            row.add(model, 12, colour=floor.MUTED)
            row.add(robot.doing, 12)
            if equipment := robot.equipment(scene.map):
                row.add(equipment, 12, colour=floor.MUTED)
        yield row
    for obstacle, status, met in () if brief else scene.obstacles:
        row = _Row(svg.STATUS_MARKS[status])
        row.add(obstacle.label(scene.map), 13, bold=True)
        row.add(obstacle.state(status, met), 12, colour=floor.MUTED)
        yield row


def _columns(rows: Sequence[_Row], width: float) -> list[list[_Row]]:
    """Return rows in reading order, in as many columns as fit below the map."""
    count = max(1, int((width + GAP) // (WIDTH + GAP)))
    limit = _height(rows) / count + 30
    columns: list[list[_Row]] = [[]]
    for row in rows:
        if columns[-1] and _height([*columns[-1], row]) > limit and len(columns) < count:
            columns.append([])
        columns[-1].append(row)
    return columns


def _height(rows: Sequence[_Row]) -> float:
    return sum(row.height for row in rows)


def draw_body(page: svg.SvgWriter, look: Look, x: float, y: float, radius: float) -> None:
    """Draw a robot's shape with its letters."""
    page.glyph(look.path, x, y, radius, fill=look.colour, stroke=floor.INK, stroke_width=0.09)
    size, centred = radius * look.size, {"fill": look.ink, "text_anchor": "middle"}
    page.text(x, y + radius * look.drop, look.letters, size, bold=True, **centred)


class _Drawing(Struct):
    """Drawing of the map and its contents, bottom layer first."""

    page: svg.SvgWriter
    scene: Scene
    cell: float
    options: Options
    names: list[floor.PlacedName]

    def draw(self, told: Sequence[Event]) -> None:
        style = looks([robot.name for robot in self.scene.robots])
        robots = [*zip(self.scene.robots, style, strict=True)]
        layers = self.options.layers
        if Layer.GROUND in layers:
            floor.draw_floor(self.page, self.scene.map, self.cell)
            self._signs()
        if Layer.MOMENT in layers:
            self._state(robots)
            self._spoken_of(told)
            floor.draw_names(self.page, self.names, floor.INK)
            shifts = svg.separated([(robot.row, robot.col) for robot, _ in robots])
            for (robot, look), (down, right) in zip(robots, shifts, strict=True):
                self._robot(robot, look, robot.row + down, robot.col + right)

    def _signs(self) -> None:
        floor.draw_areas(self.page, self.scene.map, self.cell)
        for each in self.scene.exclusions:
            border = floor.outline(self.scene.map, each.regions, self.cell, 0.06 * self.cell)
            self.page.path(border, fill="none", **EXCLUSION)
        for region in self.scene.chargers:
            x, y = self._corner(region)
            place = (x + 0.13 * self.cell, y + 0.62 * self.cell)
            self.page.glyph(svg.GLYPHS.charger, *place, 0.11 * self.cell, fill="#B87900")
        floor.draw_numbers(self.page, self.scene.map, self.cell, self.names)

    def _state(self, robots: Sequence[tuple[Placed, Look]]) -> None:
        """Draw the parts that change from tick to tick."""
        for i, (robot, look) in enumerate(robots):
            self._trail(robot, look, i - (len(robots) - 1) / 2)
        for obstacle, status, _ in self.scene.obstacles:
            self._obstacle(obstacle, status)
        wide = max(1.5, self.cell * 0.05)
        for robot, look in robots:
            line = {"stroke": look.colour, "stroke_width": wide, "fill": "none"}
            if robot.taken:  # in transit
                border = floor.outline(
                    self.scene.map, frozenset(robot.taken), self.cell, 0.06 * self.cell
                )
                self.page.path(border, stroke_linecap="round", **line)
            if robot.objective is not None and robot.objective.avoid:
                border = floor.outline(self.scene.map, robot.objective.avoid, self.cell, wide)
                self.page.path(border, stroke_dasharray=f"{wide} {2 * wide}", **line)
            if len(robot.ahead) > 1:
                points = [(robot.col + 0.5) * self.cell, (robot.row + 0.5) * self.cell]
                ahead = svg.polyline((points[0], points[1]), *map(self._centre, robot.ahead[1:]))
                thin = line | {"stroke_width": max(1.2, self.cell * 0.035)}
                self.page.path(ahead, stroke_dasharray="3 3", stroke_linejoin="round", **thin)
        self._targets(robots)

    def _corner(self, region: Region) -> tuple[float, float]:
        row, col = self.scene.map.position(region)
        return col * self.cell, row * self.cell

    def _centre(self, region: Region) -> tuple[float, float]:
        x, y = self._corner(region)
        return x + self.cell / 2, y + self.cell / 2

    def _obstacle(self, obstacle: Hidden, status: ObstacleStatus) -> None:
        mark, cell = svg.STATUS_MARKS[status], self.cell
        x, y = self._corner(obstacle.region)
        resolved = status is ObstacleStatus.RESOLVED
        dashes = "3 3" if status is ObstacleStatus.HIDDEN else None
        tint = {ObstacleStatus.HIDDEN: 0.0, ObstacleStatus.BLOCKED: 0.35}.get(status, 0.16)
        if not resolved:  # it is out of the way: no box, a faded outline
            box = {"fill": mark.colour, "fill_opacity": tint, "stroke": mark.colour}
            box |= {"stroke_width": 1.2 if dashes else 2, "stroke_dasharray": dashes}
            side = cell - 2.4
            self.page.rect(x + 1.2, y + 1.2, side, side, rx=cell * 0.08, **box)
        if any(obstacle in robot.loads for robot in self.scene.robots):
            return
        radius = cell * (0.16 if status is ObstacleStatus.HIDDEN else 0.22)
        middle_x, middle_y = self._centre(obstacle.region)
        shape = (svg.opened_pictogram if resolved else svg.obstacle_pictogram)(obstacle.type)
        faded = {"stroke": mark.colour, "stroke_width": 0.08, "stroke_opacity": 0.7}
        look = {"fill": "none", **faded} if resolved else {"fill": mark.colour}
        if cell < LEAST_SHAPE:
            radius = max(radius, LEAST_MARK)
        elif shape:
            self.page.glyph(shape, middle_x, middle_y, cell * 0.27, **look)
            radius, middle_x, middle_y = cell * 0.11, x + cell * 0.83, y + cell * 0.17
        self.page.glyph(mark.path, middle_x, middle_y, radius, fill=mark.colour)

    def _trail(self, robot: Placed, look: Look, lane: float) -> None:
        """Draw a robot's path of the last ticks in its own lane, newer parts stronger."""
        shift = lane * min(0.09, 0.5 / max(1, len(self.scene.robots))) * self.cell
        points = [(x + shift, y + shift) for x, y in map(self._centre, robot.trail)]
        x, y = (robot.col + 0.5) * self.cell, (robot.row + 0.5) * self.cell
        points.append((x + shift, y + shift))
        wide = max(1.5, self.cell * 0.055)
        line = {"fill": "none", "stroke": look.colour, "stroke_width": wide}
        for i, opacity in enumerate((0.25, 0.45, 0.7)):
            part = points[len(points) * i // 3 : len(points) * (i + 1) // 3 + 1]
            kept = [p for k, p in enumerate(part) if k == 0 or p != part[k - 1]]
            if len(kept) > 1:
                more = {"stroke_linejoin": "round", "stroke_opacity": opacity}
                self.page.path(svg.polyline(*kept), **line, **more)

    def _targets(self, robots: Iterable[tuple[Placed, Look]]) -> None:
        """Draw a ring in the robot's colour in each of its target regions, or a line around an
        area, with its shape; the one that it goes to is filled. Rings of several robots are nested,
        and above the name of their region."""
        tops = {self.scene.map.names[n.text]: n.box.top for n in self.names if not n.area}
        areas = [area for area in self.scene.map.areas.values() if len(area) > 1]
        taken: dict[frozenset[Region], int] = {}
        for robot, look in robots:
            left = target_regions(robot.objective)
            framed = [area for area in areas if area <= left]
            left = left.difference(*framed)
            for regions in [*framed, *(frozenset({region}) for region in sorted(left))]:
                slot = taken.get(regions, 0)
                taken[regions] = slot + 1
                if slot >= len(ASIDE):
                    continue
                fill = look.colour if robot.aim in regions else "none"
                ring = {"fill": fill, "fill_opacity": 0.3, "stroke": look.colour}
                ring |= {"stroke_width": max(1.5, self.cell * 0.04)}
                x, y = self._corner(min(regions))
                room = tops.get(min(regions), y + self.cell) - y if len(regions) == 1 else self.cell
                x, y = x + self.cell / 2, y + room / 2
                radius = min(RING * self.cell, room / 2 - 2) * (1 - 0.15 * slot)
                if len(regions) > 1:
                    inset = 2.6 + 3.2 * slot
                    self.page.path(floor.outline(self.scene.map, regions, self.cell, inset), **ring)
                    radius = 0.4 * self.cell
                else:
                    self.page.element("circle", cx=x, cy=y, r=radius, **ring)
                right, down = ASIDE[slot]
                place = (x + radius * right, y + radius * down, max(3.0, self.cell * 0.08))
                self.page.glyph(
                    look.path, *place, fill=look.colour, stroke=floor.INK, stroke_width=0.22
                )

    def _spoken_of(self, told: Sequence[Event]) -> None:
        """Draw a frame around the region that the words below the map are about."""
        for region in [event.region for event in told if event.region is not None][:1]:
            x, y = self._corner(region)
            frame = {"fill": "none", "stroke": floor.INK, "stroke_width": 1.2}
            self.page.rect(x + 3, y + 3, self.cell - 6, self.cell - 6, rx=2, **frame)

    def _robot(self, robot: Placed, look: Look, row: float, col: float) -> None:
        x, y = (col + 0.5) * self.cell, (row + 0.5) * self.cell
        radius = max(ROBOT * self.cell, LEAST_ROBOT)
        if robot.heading is not None:
            self.page.glyph(svg.GLYPHS.nose, x, y, radius * 0.92, robot.heading, fill=floor.INK)
        draw_body(self.page, look, x, y, radius)
        if robot.loads:
            held_x, held_y, side = x - BADGE * radius, y - BADGE * radius, 1.4 * radius
            corner = (held_x - side / 2, held_y - side / 2, side, side)
            self.page.rect(
                *corner, rx=side / 12, fill="#FFFFFF", stroke=floor.INK, stroke_width=0.8
            )
            shape = svg.obstacle_pictogram(robot.loads[0].type) or svg.GLYPHS.obstacles["crate"]
            self.page.glyph(shape, held_x, held_y, radius * 0.6, fill=floor.INK)
            if len(robot.loads) > 1:
                words = f"{len(robot.loads)} x"
                above = {"fill": floor.INK, "text_anchor": "middle"}
                self.page.text(held_x, held_y - side * 0.6, words, radius * 0.7, bold=True, **above)

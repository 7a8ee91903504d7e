"""A scene as a vector picture for papers: the map, a title and a legend.

Everything is placed by arithmetic on known text widths, so that nothing overlaps and nothing
is cut off whatever the names and the size of the map. PNG and GIF are made from this SVG.
"""

from __future__ import annotations

from enum import Enum

from msgspec import Struct

from safenav.report.picture.floor import (
    INK,
    MUTED,
    cell_size,
    draw_axes,
    draw_floor,
    draw_numbers,
)
from safenav.report.picture.glyphs import (
    GLYPHS,
    STATUS_MARKS,
    obstacle_pictogram,
    opened_pictogram,
    robot_pictogram,
    separated,
)
from safenav.report.picture.legend import Row, glyph, key_row, legend_of, lines_of, square
from safenav.report.picture.names import PlacedName, draw_areas, draw_names, outline, placed_names
from safenav.report.picture.shading import draw_shading, draw_taken, shading_rows, taken_row
from safenav.report.picture.svg import SvgWriter, polyline, wrapped
from safenav.report.replay.perception import Shading
from safenav.report.replay.timeline import Hidden, ObstacleStatus, Placed, Scene, StoryKind
from safenav.scenario.objective import target_regions
from safenav.trace.looks import Look, looks
from safenav.trace.words import listed
from safenav.world.map import Region

MARGIN = 16.0
NARROWEST = 260.0
"""Least width that leaves room for titles and captions."""

CAPTION_LINES = 3
ROBOT = 0.28
"""Radius of a robot's body, in cells."""
LEAST_ROBOT = 8.0
LEAST_MARK = 5.0
"""Least radii of robots' bodies and of marks of obstacles on maps of any size."""
LEAST_SHAPE = 20.0
"""Least side of a cell that has room for the pictogram of an obstacle."""

EXCLUSION = {"stroke": "#A5568A", "stroke_width": 2.2, "stroke_dasharray": "9 3 2 3"}
"""Line around the regions of ``never_together``."""

BADGE = 0.96
"""Distance of a model's silhouette below and beside the body, in radii of the body; a load is at
the same distance above it."""


class Layer(Enum):
    """A part of a picture, from the bottom up: the floor with all that never changes, what changes
    from tick to tick, the robots, and the names of regions."""

    GROUND = "ground"
    STATE = "state"
    ROBOTS = "robots"
    NAMES = "names"


class Options(Struct, frozen=True):
    """Contents of a picture besides the scene itself.

    ``numbers``: of regions, where they can be read. ``caption``: some lines below the map instead
    of a legend, always of the same height (for the frames of a film). ``shading``: sight and
    beliefs of a robot. ``axes``: numbers of rows and columns around the map. ``layers``: those to
    draw; without ``GROUND`` the picture is transparent. ``robot``: the only one to draw."""

    layers: frozenset[Layer] = frozenset(Layer)
    robot: str | None = None
    legend: bool = True
    numbers: bool = True
    hidden: bool = True
    caption: str | None = None
    shading: Shading | None = None
    axes: bool = False


def svg_of(scene: Scene, options: Options | None = None) -> str:
    options = options or Options()
    cell = cell_size(scene.map)
    width, height = scene.map.cols * cell, scene.map.rows * cell
    legend = legend_of(scene, options.hidden, _more(scene, options)) if options.legend else None
    across, beside = legend.arranged(width, height) if legend else (0.0, False)
    inner = width + across if beside else max(width, across, NARROWEST)
    title = wrapped(scene.title, 17, inner, bold=True)
    top = MARGIN + 21 * len(title) + 22
    page = SvgWriter()
    drawing = _Drawing(page, scene, cell, options, placed_names(scene.map, cell))
    below = top + height
    if legend is not None:
        below = top + max(height, legend.height) if beside else below + 20 + legend.height
    elif options.caption is not None:
        key_height = key_row(scene).measure(inner)
        below += key_height + 14 + CAPTION_LINES * 18
    if Layer.GROUND in options.layers:
        page.rect(0, 0, inner + 2 * MARGIN, below + MARGIN, fill="#FFFFFF")
        for i, line in enumerate(title):
            page.text(MARGIN, MARGIN + 15 + 21 * i, line, 17, bold=True, fill=INK)
        page.open_map(MARGIN, top)
        drawing.ground()
        page.close_group()
        if legend is not None:
            aside = MARGIN + (width + 24 if beside else 0)
            legend.draw(page, aside, top if beside else top + height + 20)
        elif options.caption is not None:
            key_row(scene).draw(page, MARGIN, top + height + 6, inner)
    page.open_map(MARGIN, top)
    if Layer.STATE in options.layers:
        drawing.state()
        page.text(0, -9, scene.moment, 13, fill=MUTED)
        if legend is None and options.caption is not None:
            for i, line in enumerate(wrapped(options.caption, 13, inner)[:CAPTION_LINES]):
                page.text(0, height + key_height + 24 + 18 * i, line, 13, fill=INK)
    if Layer.ROBOTS in options.layers:
        drawing.robots()
    if Layer.NAMES in options.layers:
        draw_names(page, drawing.names, INK)
    page.close_group()
    size = (inner + 2 * MARGIN, below + MARGIN)
    return page.document(*size, scene.title, _described(scene))


def _more(scene: Scene, options: Options) -> list[Row]:
    """Return marks that only some scenes have, for the legend."""
    names = [robot.name for robot in scene.robots]
    style = looks(names)
    taken = taken_row(scene.robots, style)
    rows = [taken] if taken is not None else []
    if any(robot.loads for robot in scene.robots):
        rows.append(Row(_load_sign, lines_of("load that the robot carries", 12)))
    if scene.chargers:
        rows.append(Row(glyph(GLYPHS.charger, 7, fill="#B87900"), lines_of("charger", 12)))
    for each in scene.exclusions:
        words = f"at most one of {listed(sorted(each.robots))} at a time"
        rows.append(Row(square(9, fill="none", **EXCLUSION), lines_of(words, 12)))
    if options.shading is not None:
        rows += shading_rows(options.shading, dict(zip(names, style, strict=True)))
    return rows


def _load_sign(page: SvgWriter, x: float, y: float) -> None:
    square(8, rx=1.5, fill="#FFFFFF", stroke=INK, stroke_width=0.8)(page, x, y)
    page.glyph(GLYPHS.obstacles["crate"], x, y, 6, fill=INK)


def _described(scene: Scene) -> str:
    robots = ", ".join(
        f"{r.name} in region {scene.map.region(round(r.row), round(r.col))}" for r in scene.robots
    )
    obstacles = ", ".join(f"{o.name} {status.value}" for o, status, _ in scene.obstacles)
    size = f"A map of {scene.map.rows} by {scene.map.cols} regions, {scene.moment}"
    return f"{size}: {robots or 'no robots'}; obstacles: {obstacles or 'none'}."


class _Drawing(Struct):
    """Drawing of the map and its contents, bottom layer first."""

    page: SvgWriter
    scene: Scene
    cell: float
    options: Options
    names: list[PlacedName]

    def ground(self) -> None:
        """Draw the parts that are the same at every moment; with a shading, only the floor."""
        draw_floor(self.page, self.scene.map, self.cell)
        if self.options.shading is None:
            self._signs()

    def _signs(self) -> None:
        draw_areas(self.page, self.scene.map, self.cell)
        for each in self.scene.exclusions:
            border = outline(self.scene.map, each.regions, self.cell, 0.06 * self.cell)
            self.page.path(border, fill="none", **EXCLUSION)
        for region in self.scene.chargers:
            x, y = self._corner(region)
            place = (x + 0.18 * self.cell, y + 0.8 * self.cell)
            self.page.glyph(GLYPHS.charger, *place, 0.17 * self.cell, fill="#B87900")
        if self.options.numbers:
            draw_numbers(self.page, self.scene.map, self.cell, self.names)
        if self.options.axes:
            draw_axes(self.page, self.scene.map, self.cell)

    def state(self) -> None:
        """Draw the parts that change from tick to tick."""
        names = [r.name for r in self.scene.robots]
        style = looks(names)
        if self.options.shading is not None:
            by_name = dict(zip(names, style, strict=True))
            draw_shading(self.page, self.options.shading, self.scene.map, self.cell, by_name)
            self._signs()
        for i, robot in enumerate(self.scene.robots):
            self._trail(robot, style[i], i - (len(style) - 1) / 2)
        for obstacle, status, _ in self.scene.obstacles:
            if status is not ObstacleStatus.HIDDEN or self.options.hidden:
                self._obstacle(obstacle, status)
        draw_taken(self.page, self.scene.robots, self.scene.map, self.cell, style)
        self._targets(style)
        self._avoided(style)
        self._violations()

    def robots(self) -> None:
        style = looks([r.name for r in self.scene.robots])
        drawn = [
            (robot, look)
            for robot, look in zip(self.scene.robots, style, strict=True)
            if self.options.robot in (None, robot.name)
        ]
        shifts = separated([(robot.row, robot.col) for robot, _ in drawn])
        for (robot, look), (d_row, d_col) in zip(drawn, shifts, strict=True):
            self._robot(robot, look, robot.row + d_row, robot.col + d_col)

    def _corner(self, region: Region) -> tuple[float, float]:
        row, col = self.scene.map.position(region)
        return col * self.cell, row * self.cell

    def _centre(self, region: Region) -> tuple[float, float]:
        x, y = self._corner(region)
        return x + self.cell / 2, y + self.cell / 2

    def _obstacle(self, obstacle: Hidden, status: ObstacleStatus) -> None:
        mark, cell = STATUS_MARKS[status], self.cell
        x, y = self._corner(obstacle.region)
        resolved = status is ObstacleStatus.RESOLVED
        dashes = "3 3" if status is ObstacleStatus.HIDDEN else None
        tint = {ObstacleStatus.HIDDEN: 0.0, ObstacleStatus.BLOCKED: 0.35}.get(status, 0.16)
        if not resolved:  # it is out of the way: no box, a faded outline
            self.page.rect(
                x + 1.2,
                y + 1.2,
                cell - 2.4,
                cell - 2.4,
                rx=cell * 0.08,
                fill=mark.colour,
                fill_opacity=tint,
                stroke=mark.colour,
                stroke_width=1.2 if dashes else 2,
                stroke_dasharray=dashes,
            )
        radius = cell * (0.16 if status is ObstacleStatus.HIDDEN else 0.22)
        middle_x, middle_y = self._centre(obstacle.region)
        if any(obstacle in robot.loads for robot in self.scene.robots):
            return
        shape = (opened_pictogram if resolved else obstacle_pictogram)(obstacle.type)
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
        x, y = robot.col * self.cell, robot.row * self.cell
        points.append((x + self.cell / 2 + shift, y + self.cell / 2 + shift))  # as ``_centre``
        for i, opacity in enumerate((0.25, 0.45, 0.7)):
            part = points[len(points) * i // 3 : len(points) * (i + 1) // 3 + 1]
            kept = [p for k, p in enumerate(part) if k == 0 or p != part[k - 1]]
            if len(kept) > 1:
                self.page.path(
                    polyline(*kept),
                    fill="none",
                    stroke=look.colour,
                    stroke_width=max(1.5, self.cell * 0.055),
                    stroke_linejoin="round",
                    stroke_opacity=opacity,
                )

    def _targets(self, style: tuple[Look, ...]) -> None:
        """Draw a frame in the robot's colour around each of its target regions or areas, and its
        shape in a corner; frames of several robots are nested."""
        corners = ((0.8, 0.25), (0.8, 0.8), (0.2, 0.8))  # first above the name of the region
        taken: dict[frozenset[Region], int] = {}
        areas = [area for area in self.scene.map.areas.values() if len(area) > 1]
        for robot, look in zip(self.scene.robots, style, strict=True):
            left = target_regions(robot.objective)
            framed = [area for area in areas if area <= left]
            left = left.difference(*framed)
            for regions in [*framed, *(frozenset({region}) for region in sorted(left))]:
                slot = taken.get(regions, 0)
                taken[regions] = slot + 1
                if slot < len(corners):
                    x, y = self._corner(min(regions))
                    wide = max(1.5, self.cell * 0.05)
                    inset = wide * (0.5 + 1.4 * slot) + 0.5
                    frame = {"fill": "none", "stroke": look.colour, "stroke_width": wide}
                    if len(regions) == 1:
                        side = self.cell - 2 * inset
                        self.page.rect(x + inset, y + inset, side, side, **frame)
                    else:
                        border = outline(self.scene.map, regions, self.cell, inset)
                        self.page.path(border, stroke_linecap="square", **frame)
                    right, down = corners[slot]
                    self.page.glyph(
                        look.path,
                        x + right * self.cell,
                        y + down * self.cell,
                        self.cell * 0.11,
                        fill=look.colour,
                        stroke=INK,
                        stroke_width=0.22,
                    )

    def _avoided(self, style: tuple[Look, ...]) -> None:
        """Draw a dotted frame in the robot's colour around the regions that it avoids."""
        for robot, look in zip(self.scene.robots, style, strict=True):
            regions = robot.objective.avoid if robot.objective is not None else frozenset()
            if regions:
                wide = max(1.5, self.cell * 0.05)
                border = outline(self.scene.map, regions, self.cell, wide)
                line = {"stroke": look.colour, "stroke_width": wide, "fill": "none"}
                self.page.path(border, stroke_dasharray=f"{wide} {2 * wide}", **line)

    def _violations(self) -> None:
        """Draw an arrow from the robot into the region of its refused move."""
        for event in self.scene.happened:
            robot = next((r for r in self.scene.robots if r.name == event.robot), None)
            if event.kind is not StoryKind.VIOLATION or event.region is None or robot is None:
                continue
            x, y = (robot.col + 0.5) * self.cell, (robot.row + 0.5) * self.cell
            to_x, to_y = self._centre(event.region)
            dx, dy = (to_x - x) / self.cell, (to_y - y) / self.cell
            start, end, wing = 0.51 * self.cell, 0.74 * self.cell, 0.09 * self.cell
            tip = (x + dx * end, y + dy * end)
            back = (tip[0] - dx * wing * 1.4, tip[1] - dy * wing * 1.4)
            left, right = ((back[0] - s * dy, back[1] + s * dx) for s in (wing, -wing))
            data = polyline((x + dx * start, y + dy * start), tip) + polyline(left, tip, right)
            colour = STATUS_MARKS[ObstacleStatus.FOUND].colour
            self.page.path(data, stroke=colour, stroke_width=self.cell * 0.06, fill="none")

    def _robot(self, robot: Placed, look: Look, row: float, col: float) -> None:
        x, y = (col + 0.5) * self.cell, (row + 0.5) * self.cell
        radius = max(ROBOT * self.cell, LEAST_ROBOT)
        if robot.heading is not None:
            self.page.glyph(GLYPHS.nose, x, y, radius * 0.92, robot.heading, fill=INK)
        self.page.glyph(look.path, x, y, radius, fill=look.colour, stroke=INK, stroke_width=0.09)
        size, baseline = radius * look.size, y + radius * look.drop
        centred = {"fill": look.ink, "text_anchor": "middle"}
        self.page.text(x, baseline, look.letters, size, bold=True, **centred)
        if shape := robot_pictogram(robot.model):
            badge_x, badge_y = x + BADGE * radius, y + BADGE * radius
            self.page.glyph(GLYPHS.plate, badge_x, badge_y, radius * 0.7, fill="#FFFFFF")
            self.page.glyph(shape, badge_x, badge_y, radius * 0.6, fill=INK)
        if robot.loads:
            held_x, held_y, side = x - BADGE * radius, y - BADGE * radius, 1.4 * radius
            corner = (held_x - side / 2, held_y - side / 2, side, side)
            self.page.rect(*corner, rx=side / 12, fill="#FFFFFF", stroke=INK, stroke_width=0.8)
            shape = obstacle_pictogram(robot.loads[0].type) or GLYPHS.obstacles["crate"]
            self.page.glyph(shape, held_x, held_y, radius * 0.6, fill=INK)
            if len(robot.loads) > 1:
                words = f"{len(robot.loads)} x"
                above = {"fill": INK, "text_anchor": "middle"}
                self.page.text(held_x, held_y - side * 0.6, words, radius * 0.7, bold=True, **above)

"""Moments of a run as vector pictures for papers: the map, the events of the moment, the robots'
names. The marks are those of the page, whose legend explains them.

Arithmetic on known text widths places all parts, so none overlaps or is cut off for any names and
map sizes. PNG and GIF are made from this SVG. The map is cropped to half a region around its free
regions.
"""

from collections.abc import Collection, Iterator
from enum import Enum, auto

from msgspec import Struct

from safenav.report.picture import floor, svg
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Changes, Hidden, Look, ObstacleStatus, StoryKind
from safenav.scenario.model import Scenario
from safenav.scenario.objective import target_regions
from safenav.trace.file import unstarted
from safenav.world.map import Region

MARGIN = 16.0
NARROWEST = 260.0
"""Minimum width with room for titles and captions."""
LINE = 18.0
"""Height of a line of the caption."""
CAPTION_LINES = 3
"""Number of lines of an animation's caption, even if empty; a longer one ends in dots."""
SPOKEN = 6
"""Maximum number of events in the caption of a picture."""
WIDTH, GAP, ICON, ROW = 170.0, 24.0, 30.0, 24.0
"""Widths of a robot's sign with name, the space beside it and the sign; the height."""
ROBOT = 0.28
"""Radius of a robot's body, in cells."""
LEAST_ROBOT = 8.0
LEAST_MARK = 5.0
"""Minimum radii of robots' bodies and of obstacle marks on maps of any size."""
LEAST_SHAPE = 20.0
"""Minimum side of a cell with room for an obstacle's pictogram."""
RING = 0.34
"""Radius of a target's ring, in cells; further robots have smaller rings."""
ASIDE = ((0.71, -0.71), (0.71, 0.71), (-0.71, 0.71))
"""Positions of the robots' shapes on the rings of one region, from its centre, in radii."""
REACH = 2.2
"""Maximum distance of a robot's nose and badges from its centre, in radii of its body."""
BADGE = 0.96
"""Distance of a badge from the body, in radii of the body."""
EXCLUSION = {"stroke": "#A5568A", "stroke_width": 2.2, "stroke_dasharray": "9 3 2 3"}
"""The line around the regions of ``never_together``."""
_QUIET = {StoryKind.SYNTHESIS, StoryKind.PUSH, StoryKind.POP}


class Layer(Enum):
    """A part of a picture: ``GROUND`` never changes, ``MARKS`` change from tick to tick."""

    GROUND = auto()
    MARKS = auto()
    ROBOTS = auto()


def svg_of_scenario(scenario: Scenario) -> str:
    """Return the picture of a scenario: starts, objectives and hidden obstacles."""
    run = run_of(unstarted(scenario))
    for hidden in run.hidden.values():
        hidden.status = Changes.of(ObstacleStatus.HIDDEN)
    return svg_of(run, 0, words="before the run")


class Layout(Struct, frozen=True):
    """Dimensions of a picture: the side of a region, the visible part of the map, the width below
    the title, and the top of the map."""

    cell: float
    left: float
    upper: float
    width: float
    height: float
    inner: float
    title: tuple[str, ...]
    top: float

    @classmethod
    def of(cls, run: Run) -> "Layout":
        cell = floor.cell_size(run.map)
        left, upper, width, height = (side * cell for side in floor.window(run.map))
        inner = max(width, NARROWEST)
        title = tuple(svg.wrapped(run.name, 17, inner, bold=True))
        return cls(cell, left, upper, width, height, inner, title, MARGIN + 21 * len(title) + 22)


def svg_of(
    run: Run,
    tick: int,
    part: float = 0.0,
    *,
    words: str = "",
    caption: str | None = None,
    layers: Collection[Layer] = tuple(Layer),
) -> str:
    """Return the picture of the moment after ``tick``, or at a ``part`` of the time to the next
    one. It shows the knowledge at ``tick``; only positions are interpolated.

    ``words`` describe the moment. ``caption`` (for frames of an animation) replaces the events
    below the map, always at the same height. Without the ground the picture is transparent and ends
    below the caption."""
    of = Layout.of(run)
    words = words or run.stage(tick, part)
    told = [event for event in run.happened(tick) if event.kind not in _QUIET]
    told = sorted(told, key=lambda event: event.kind is not StoryKind.OUTCOME)[:SPOKEN]
    film = caption is not None
    says = [caption or ""] if film else [f"{event.text}." for event in told]
    lines = [line for text in says for line in svg.wrapped(text, 13, of.inner)]
    if film and len(lines) > CAPTION_LINES:
        lines[CAPTION_LINES - 1 :] = [f"{lines[CAPTION_LINES - 1].rpartition(' ')[0]} ..."]
    spoken = LINE * (CAPTION_LINES if film else len(lines))
    below = of.top + of.height + (spoken + 14 if spoken else 0.0)
    columns = max(1, int((of.inner + GAP) // (WIDTH + GAP)))
    end = below + 20 + ROW * -(-len(run.robots) // columns) + MARGIN
    ground, page = Layer.GROUND in layers, svg.SvgWriter()
    if ground:
        page.rect(0, 0, of.inner + 2 * MARGIN, end, fill="#FFFFFF")
        for i, line in enumerate(of.title):
            page.text(MARGIN, MARGIN + 15 + 21 * i, line, 17, bold=True, fill=floor.INK)
        for i, track in enumerate(run.robots):
            x, y = MARGIN + i % columns * (WIDTH + GAP), below + 20 + ROW * (i // columns)
            draw_body(page, track.look, x + 12, y + 11, 10.0)
            name, *more = svg.wrapped(track.name, 13, WIDTH - ICON, bold=True)
            name += " ..." * bool(more)
            page.text(x + ICON, y + 16, name, 13, bold=True, fill=floor.INK)
    if Layer.MARKS in layers:
        for i, line in enumerate(lines):
            page.text(MARGIN, below - spoken + 10 + LINE * i, line, 13, fill=floor.INK)
    if Layer.ROBOTS in layers:
        page.text(MARGIN, of.top - 9, words, 13, fill=floor.MUTED)
    inside = "g"  # only the ground needs clipping, which costs a third of the time
    if ground:
        inside, box = "svg", f"{of.left:g} {of.upper:g} {of.width:g} {of.height:g}"
        page.open(inside, x=MARGIN, y=of.top, width=of.width, height=of.height, viewBox=box)
    else:
        page.open(inside, transform=f"translate({MARGIN - of.left:g} {of.top - of.upper:g})")
    drawing = _Drawing(page, run, tick, part, of.cell, floor.placed_names(run.map, of.cell))
    if ground:
        drawing.ground()
    if Layer.MARKS in layers:
        drawing.marks()
    if Layer.ROBOTS in layers:
        drawing.robots()
    page.close(inside)
    lowest = end if ground else below
    return page.document(of.inner + 2 * MARGIN, lowest, f"{run.name}, {words}")


def sprites(run: Run, tick: int, part: float) -> Iterator[tuple[str, float, float]]:
    """Yield the moving parts of a picture, each as a picture with x and y of its upper left corner:
    the moment's words, then the robots. Headings have steps of 15 degrees."""
    of, page = Layout.of(run), svg.SvgWriter()
    page.text(0, 14, run.stage(tick, part), 13, fill=floor.MUTED)
    yield page.document(of.inner, 20), MARGIN, of.top - 23
    drawing = _Drawing(page, run, tick, part, of.cell, [])
    reach = REACH * drawing.radius
    for track, x, y, heading in drawing.placed():
        drawing.page = svg.SvgWriter()
        drawing.robot(track, reach, reach, None if heading is None else round(heading / 15) * 15)
        corner = MARGIN - of.left + x - reach, of.top - of.upper + y - reach
        yield drawing.page.document(2 * reach, 2 * reach), *corner


def draw_body(page: svg.SvgWriter, look: Look, x: float, y: float, radius: float) -> None:
    """Draw a robot's shape with its letters."""
    page.glyph(look.path, x, y, radius, fill=look.colour, stroke=floor.INK, stroke_width=0.09)
    size, centred = radius * look.size, {"fill": look.ink, "text_anchor": "middle"}
    page.text(x, y + radius * look.drop, look.letters, size, bold=True, **centred)


class _Drawing(Struct):
    """A drawing of the map and its contents, bottom layer first."""

    page: svg.SvgWriter
    run: Run
    tick: int
    part: float
    cell: float
    names: list[floor.PlacedName]

    def ground(self) -> None:
        """Draw the parts of the picture that never change."""
        run, cell = self.run, self.cell
        floor.draw_floor(self.page, run.map, cell)
        floor.draw_areas(self.page, run.map, cell)
        for each in run.exclusions:
            border = floor.outline(run.map, each.regions, cell, 0.06 * cell)
            self.page.path(border, fill="none", **EXCLUSION)
        for region in run.chargers:
            x, y = self._corner(region)
            place = (x + 0.13 * cell, y + 0.62 * cell)
            self.page.glyph(svg.GLYPHS.charger, *place, 0.11 * cell, fill="#B87900")
        floor.draw_numbers(self.page, run.map, cell, self.names)

    @property
    def radius(self) -> float:
        """The radius of a robot's body."""
        return max(ROBOT * self.cell, LEAST_ROBOT)

    def marks(self) -> None:
        """Draw the team's knowledge and intentions: obstacles, paths and targets."""
        run = self.run
        for hidden in run.present(self.tick):
            self._obstacle(hidden)
        for track in run.robots:
            self._intention(track)
        self._targets()
        floor.draw_names(self.page, self.names, floor.INK)

    def placed(self) -> Iterator[tuple[RobotTrack, float, float, float | None]]:
        """Yield the robots, each with the centre of its body (x, y) and its heading."""
        places = [self.run.place(track, self.tick, self.part) for track in self.run.robots]
        shifts = svg.separated([(row, col) for row, col, _ in places])
        for track, (row, col, heading), (down, right) in zip(
            self.run.robots, places, shifts, strict=True
        ):
            yield track, *self._at(row + down, col + right), heading

    def robots(self) -> None:
        for placed in self.placed():
            self.robot(*placed)

    def _intention(self, track: RobotTrack) -> None:
        """Draw the regions that a robot avoids and its path to its next target."""
        world, cell = self.run.map, self.cell
        wide = max(1.5, cell * 0.05)
        line = {"stroke": track.look.colour, "stroke_width": wide, "fill": "none"}
        objective = track.objectives.at(self.tick)
        if objective is not None and objective.avoid:
            border = floor.outline(world, objective.avoid, cell, wide)
            self.page.path(border, stroke_dasharray=f"{wide} {2 * wide}", **line)
        _, way = self.run.ahead(track, self.tick)
        if len(way) > 1:
            ahead = svg.polyline(*map(self._centre, way))
            thin = line | {"stroke_width": max(1.2, cell * 0.035)}
            self.page.path(ahead, stroke_dasharray="3 3", stroke_linejoin="round", **thin)

    def _corner(self, region: Region) -> tuple[float, float]:
        row, col = self.run.map.position(region)
        return col * self.cell, row * self.cell

    def _at(self, row: float, col: float) -> tuple[float, float]:
        return (col + 0.5) * self.cell, (row + 0.5) * self.cell

    def _centre(self, region: Region) -> tuple[float, float]:
        return self._at(*self.run.map.position(region))

    def _obstacle(self, hidden: Hidden) -> None:
        status, cell = hidden.status.at(self.tick), self.cell
        mark, (x, y) = svg.GLYPHS.status[status], self._corner(hidden.region)
        resolved = status is ObstacleStatus.RESOLVED
        dashes = "3 3" if status is ObstacleStatus.HIDDEN else None
        tint = {ObstacleStatus.HIDDEN: 0.0, ObstacleStatus.BLOCKED: 0.35}.get(status, 0.16)
        if not resolved:  # a resolved obstacle has only a faded outline
            box = {"fill": mark.colour, "fill_opacity": tint, "stroke": mark.colour}
            box |= {"stroke_width": 1.2 if dashes else 2, "stroke_dasharray": dashes}
            side = cell - 2.4
            self.page.rect(x + 1.2, y + 1.2, side, side, rx=cell * 0.08, **box)
        if hidden.loads.at(self.tick):
            return
        radius = cell * (0.16 if status is ObstacleStatus.HIDDEN else 0.22)
        middle_x, middle_y = self._centre(hidden.region)
        shape = (svg.opened_pictogram if resolved else svg.obstacle_pictogram)(hidden.type)
        faded = {"stroke": mark.colour, "stroke_width": 0.08, "stroke_opacity": 0.7}
        look = {"fill": "none", **faded} if resolved else {"fill": mark.colour}
        if cell < LEAST_SHAPE:
            radius = max(radius, LEAST_MARK)
        elif shape:
            self.page.glyph(shape, middle_x, middle_y, cell * 0.27, **look)
            radius, middle_x, middle_y = cell * 0.11, x + cell * 0.83, y + cell * 0.17
        self.page.glyph(mark.path, middle_x, middle_y, radius, fill=mark.colour)

    def _targets(self) -> None:
        """Draw each of a robot's target regions as a ring (an area as a line around it), in its
        colour and with its shape. The next target is filled. Rings of several robots are nested,
        above the name of their region."""
        world = self.run.map
        tops = {world.names[n.text]: n.top for n in self.names if not n.area}
        areas = [area for area in world.areas.values() if len(area) > 1]
        taken: dict[frozenset[Region], int] = {}
        for track in self.run.robots:
            look, (aim, _) = track.look, self.run.ahead(track, self.tick)
            left = target_regions(track.objectives.at(self.tick))
            framed = [area for area in areas if area <= left]
            left = left.difference(*framed)
            for regions in [*framed, *(frozenset({region}) for region in sorted(left))]:
                slot = taken.get(regions, 0)
                taken[regions] = slot + 1
                if slot >= len(ASIDE):
                    continue
                fill = look.colour if aim in regions else "none"
                ring = {"fill": fill, "fill_opacity": 0.3, "stroke": look.colour}
                ring |= {"stroke_width": max(1.5, self.cell * 0.04)}
                x, y = self._corner(min(regions))
                room = tops.get(min(regions), y + self.cell) - y if len(regions) == 1 else self.cell
                x, y = x + self.cell / 2, y + room / 2
                radius = min(RING * self.cell, room / 2 - 2) * (1 - 0.15 * slot)
                if len(regions) > 1:
                    inset = 2.6 + 3.2 * slot
                    self.page.path(floor.outline(world, regions, self.cell, inset), **ring)
                    radius = 0.4 * self.cell
                else:
                    self.page.element("circle", cx=x, cy=y, r=radius, **ring)
                right, down = ASIDE[slot]
                place = (x + radius * right, y + radius * down, max(3.0, self.cell * 0.08))
                self.page.glyph(
                    look.path, *place, fill=look.colour, stroke=floor.INK, stroke_width=0.22
                )

    def robot(self, track: RobotTrack, x: float, y: float, heading: float | None) -> None:
        """Draw a robot around a point, with its load and, if it is out of service, a sign."""
        radius = self.radius
        if heading is not None:
            self.page.glyph(svg.GLYPHS.nose, x, y, radius * 0.92, heading, fill=floor.INK)
        draw_body(self.page, track.look, x, y, radius)
        if loads := self.run.loads(track.name, self.tick):
            shape = svg.obstacle_pictogram(loads[0].type) or svg.GLYPHS.obstacles["crate"]
            self._badge(shape, x - BADGE * radius, y - BADGE * radius)
        if track.out.at(self.tick):
            shape = svg.GLYPHS.events[StoryKind.SERVICE]
            self._badge(shape, x + BADGE * radius, y - BADGE * radius)

    def _badge(self, shape: str, x: float, y: float) -> None:
        """Draw a glyph on a plate, around a point beside the body of a robot."""
        side = 1.4 * self.radius
        corner = (x - side / 2, y - side / 2, side, side)
        self.page.rect(*corner, rx=side / 12, fill="#FFFFFF", stroke=floor.INK, stroke_width=0.8)
        self.page.glyph(shape, x, y, self.radius * 0.6, fill=floor.INK)

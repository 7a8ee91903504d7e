"""A moment of a run as a vector picture for papers: the map, the events of the moment, robots and
obstacles in words. The marks are those of the page, whose legend explains them.

Everything is placed by arithmetic on known text widths, so that nothing overlaps and nothing
is cut off whatever the names and the size of the map. PNG and GIF are made from this SVG. The map
is cropped to half a region around its free regions.
"""

from collections.abc import Iterator, Sequence

from msgspec import Struct, field

from safenav.report.picture import floor, svg
from safenav.run.reading import run_of
from safenav.run.run import Run
from safenav.run.tracks import RobotTrack
from safenav.run.values import Changes, Event, Hidden, Look, ObstacleStatus, StoryKind
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
"""Number of lines of a film's caption, even if it is empty; a longer one ends in dots."""
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
"""Positions of the robots' shapes on the rings of one region, from its centre, in radii."""
BADGE = 0.96
"""Distance of a load from the body, in radii of the body."""
EXCLUSION = {"stroke": "#A5568A", "stroke_width": 2.2, "stroke_dasharray": "9 3 2 3"}
"""Line around the regions of ``never_together``."""
_QUIET = {StoryKind.SYNTHESIS, StoryKind.PUSH, StoryKind.POP}


def svg_of_scenario(scenario: Scenario) -> str:
    """Return the picture of a scenario: starts, objectives and hidden obstacles."""
    run = run_of(unstarted(scenario))
    for track in run.robots:
        track.charge = Changes()
    for hidden in run.hidden.values():
        hidden.status = Changes.of(ObstacleStatus.HIDDEN)
    return svg_of(run, 0, words="before the run")


def svg_of(
    run: Run,
    tick: int,
    part: float = 0.0,
    *,
    words: str = "",
    caption: str | None = None,
    ground: bool = True,
    moment: bool = True,
) -> str:
    """Return the moment after ``tick``, or at a ``part`` of the time to the next one. Knowledge is
    that of ``tick``; only positions are interpolated.

    ``words`` describe the moment. ``caption`` (for the frames of a film) replaces them below the
    map, always at the same height, with the robots' names alone. Without the ``ground`` (all that
    never changes) the picture is transparent and ends below the caption; without the ``moment`` it
    lacks all that changes."""
    cell = floor.cell_size(run.map)
    left, upper, width, height = (side * cell for side in floor.window(run.map))
    inner = max(width, NARROWEST)
    title = svg.wrapped(run.name, 17, inner, bold=True)
    top = MARGIN + 21 * len(title) + 22
    words = words or run.stage(tick, part)
    told = [event for event in run.happened(tick) if event.kind not in _QUIET]
    told = sorted(told, key=lambda event: event.kind is not StoryKind.OUTCOME)[:SPOKEN]
    film = caption is not None
    says = [caption or ""] if film else [f"{event.text}." for event in told]
    lines = [line for text in says for line in svg.wrapped(text, 13, inner)]
    if film and len(lines) > CAPTION_LINES:
        lines[CAPTION_LINES - 1 :] = [f"{lines[CAPTION_LINES - 1].rpartition(' ')[0]} ..."]
    spoken = LINE * (CAPTION_LINES if film else len(lines))
    below = top + height + (spoken + 14 if spoken else 0.0)
    columns = _columns([*_rows(run, tick, brief=film)], inner)
    end = below + max(map(_height, columns)) + 20 + MARGIN
    page = svg.SvgWriter()
    if ground:
        page.rect(0, 0, inner + 2 * MARGIN, end, fill="#FFFFFF")
        for i, line in enumerate(title):
            page.text(MARGIN, MARGIN + 15 + 21 * i, line, 17, bold=True, fill=floor.INK)
        for i, column in enumerate(columns):
            for n, row in enumerate(column):
                row.draw(page, MARGIN + i * (WIDTH + GAP), below + 20 + _height(column[:n]))
    if moment:
        page.text(MARGIN, top - 9, words, 13, fill=floor.MUTED)
        for i, line in enumerate(lines):
            page.text(MARGIN, below - spoken + 10 + LINE * i, line, 13, fill=floor.INK)
    inside = "g"  # clipping costs a third of the time, and only the ground needs it
    if ground:
        inside, box = "svg", f"{left:g} {upper:g} {width:g} {height:g}"
        page.open(inside, x=MARGIN, y=top, width=width, height=height, viewBox=box)
    else:
        page.open(inside, transform=f"translate({MARGIN - left:g} {top - upper:g})")
    drawing = _Drawing(page, run, tick, part, cell, floor.placed_names(run.map, cell))
    if ground:
        drawing.ground()
    if moment:
        drawing.moment(told)
    page.close(inside)
    described = _described(run, tick, words)
    lowest = end if ground else below
    return page.document(inner + 2 * MARGIN, lowest, run.name, described)


def _described(run: Run, tick: int, words: str) -> str:
    robots = ", ".join(f"{each.name} in region {each.regions[tick]}" for each in run.robots)
    there = run.present(tick)
    obstacles = ", ".join(f"{each.name} {each.status.at(tick).value}" for each in there)
    size = f"A map of {run.map.rows} by {run.map.cols} regions, {words}"
    return f"{size}: {robots or 'no robots'}; obstacles: {obstacles or 'none'}."


WIDTH, GAP, ICON = 270.0, 24.0, 30.0
"""Widths of a column of words, of the space beside the column, and of its signs."""


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


def _rows(run: Run, tick: int, *, brief: bool) -> Iterator[_Row]:
    """Yield the robots and obstacles in words; ``brief``: the robots' names alone."""
    for track in run.robots:
        row = _Row(track.look)
        row.add(track.name, 13, bold=not brief)
        if not brief:
            model = f"{track.model}, {track.layer}" if track.layer else track.model
            row.add(model, 12, colour=floor.MUTED)
            row.add(run.doing(track, track.objectives.at(tick)), 12)
            if equipment := run.equipment(track, tick):
                row.add(equipment, 12, colour=floor.MUTED)
        yield row
    for hidden in () if brief else run.present(tick):
        row = _Row(svg.STATUS_MARKS[hidden.status.at(tick)])
        row.add(hidden.label(run.map), 13, bold=True)
        row.add(hidden.state(tick), 12, colour=floor.MUTED)
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
    run: Run
    tick: int
    part: float
    cell: float
    names: list[floor.PlacedName]

    def ground(self) -> None:
        """Draw all that never changes."""
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

    def moment(self, told: Sequence[Event]) -> None:
        """Draw all that changes from tick to tick."""
        run = self.run
        places = [run.place(track, self.tick, self.part) for track in run.robots]
        for i, (track, (row, col, _)) in enumerate(zip(run.robots, places, strict=True)):
            self._trail(track, row, col, i - (len(run.robots) - 1) / 2)
        for hidden in run.present(self.tick):
            self._obstacle(hidden)
        for track, (row, col, _) in zip(run.robots, places, strict=True):
            self._intention(track, row, col)
        self._targets()
        self._spoken_of(told)
        floor.draw_names(self.page, self.names, floor.INK)
        shifts = svg.separated([(row, col) for row, col, _ in places])
        for track, (row, col, heading), (down, right) in zip(
            run.robots, places, shifts, strict=True
        ):
            self._robot(track, row + down, col + right, heading)

    def _intention(self, track: RobotTrack, row: float, col: float) -> None:
        """Draw the regions that a robot occupies or avoids, and its way to its next target."""
        world, cell = self.run.map, self.cell
        wide = max(1.5, cell * 0.05)
        line = {"stroke": track.look.colour, "stroke_width": wide, "fill": "none"}
        if step := track.transit(self.tick):
            taken = frozenset({track.regions[self.tick], step.toward})
            border = floor.outline(world, taken, cell, 0.06 * cell)
            self.page.path(border, stroke_linecap="round", **line)
        objective = track.objectives.at(self.tick)
        if objective is not None and objective.avoid:
            border = floor.outline(world, objective.avoid, cell, wide)
            self.page.path(border, stroke_dasharray=f"{wide} {2 * wide}", **line)
        _, way = self.run.ahead(track, self.tick)
        if len(way) > 1:
            ahead = svg.polyline(self._at(row, col), *map(self._centre, way[1:]))
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
        mark, (x, y) = svg.STATUS_MARKS[status], self._corner(hidden.region)
        resolved = status is ObstacleStatus.RESOLVED
        dashes = "3 3" if status is ObstacleStatus.HIDDEN else None
        tint = {ObstacleStatus.HIDDEN: 0.0, ObstacleStatus.BLOCKED: 0.35}.get(status, 0.16)
        if not resolved:  # it is out of the way: no box, a faded outline
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

    def _trail(self, track: RobotTrack, row: float, col: float, lane: float) -> None:
        """Draw a robot's path of the last ticks in its own lane, newer parts stronger."""
        shift = lane * min(0.09, 0.5 / max(1, len(self.run.robots))) * self.cell
        places = [*map(self._centre, self.run.trail(track, self.tick)), self._at(row, col)]
        points = [(x + shift, y + shift) for x, y in places]
        wide = max(1.5, self.cell * 0.055)
        line = {"fill": "none", "stroke": track.look.colour, "stroke_width": wide}
        for i, opacity in enumerate((0.25, 0.45, 0.7)):
            part = points[len(points) * i // 3 : len(points) * (i + 1) // 3 + 1]
            kept = [p for k, p in enumerate(part) if k == 0 or p != part[k - 1]]
            if len(kept) > 1:
                more = {"stroke_linejoin": "round", "stroke_opacity": opacity}
                self.page.path(svg.polyline(*kept), **line, **more)

    def _targets(self) -> None:
        """Draw a ring in the robot's colour in each of its target regions, or a line around an
        area, with its shape; that of its next target is filled. Rings of several robots are nested,
        and above the name of their region."""
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

    def _spoken_of(self, told: Sequence[Event]) -> None:
        """Draw a frame around the region to which the words below the map refer."""
        for region in [event.region for event in told if event.region is not None][:1]:
            x, y = self._corner(region)
            frame = {"fill": "none", "stroke": floor.INK, "stroke_width": 1.2}
            self.page.rect(x + 3, y + 3, self.cell - 6, self.cell - 6, rx=2, **frame)

    def _robot(self, track: RobotTrack, row: float, col: float, heading: float | None) -> None:
        x, y = self._at(row, col)
        radius = max(ROBOT * self.cell, LEAST_ROBOT)
        if heading is not None:
            self.page.glyph(svg.GLYPHS.nose, x, y, radius * 0.92, heading, fill=floor.INK)
        draw_body(self.page, track.look, x, y, radius)
        if loads := self.run.loads(track.name, self.tick):
            held_x, held_y, side = x - BADGE * radius, y - BADGE * radius, 1.4 * radius
            corner = (held_x - side / 2, held_y - side / 2, side, side)
            self.page.rect(
                *corner, rx=side / 12, fill="#FFFFFF", stroke=floor.INK, stroke_width=0.8
            )
            shape = svg.obstacle_pictogram(loads[0].type) or svg.GLYPHS.obstacles["crate"]
            self.page.glyph(shape, held_x, held_y, radius * 0.6, fill=floor.INK)

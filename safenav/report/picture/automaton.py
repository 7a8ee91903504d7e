"""A strategy as a picture: the automaton itself if it is small, else a summary on the map.

Nodes stand in layers by their distance from the start. Layers run from left to right and, where
a page is full, back again in the row below, like an ox ploughs: strategies are long loops, and
a loop of 40 nodes in one line could not be read. Arrows to the next layer are direct; all others
run in the gutters between columns and rows, so that no arrow passes through a box."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from msgspec import Struct

from safenav.report.picture.floor import INK, MUTED
from safenav.report.picture.glyphs import EVENT_MARKS
from safenav.report.picture.strategy import svg_of_summary
from safenav.report.picture.svg import SvgWriter, number, polyline, text_width, wrapped
from safenav.report.replay.timeline import StoryKind
from safenav.scenario.objective import target_regions
from safenav.scenario.objective_text import describe
from safenav.spec.specification import Owner, Section
from safenav.spec.task import Task
from safenav.synthesis.export import in_words
from safenav.synthesis.strategy import Strategy
from safenav.trace.words import regions_words
from safenav.world.map import Heading, RegionMap

Point = tuple[float, float]

GUTTER = 46.0
"""Width of the gaps between columns, and between rows."""
GAP = 20.0
"""Distance between boxes of one layer."""
_LANES = (0.0, 4.0, -4.0, 8.0, -8.0, 11.0, -11.0)
"""Distances of parallel arrows from the middle of their gutter."""
_TOP = 18.0


class Arrow(Struct, frozen=True):
    """A route from box to box as corner points; ``direct`` if it leads to the next layer."""

    source: int
    target: int
    points: tuple[Point, ...]
    direct: bool


class BoxLayout(Struct, frozen=True):
    """``centres`` of the boxes by node, the arrows, and the size of the whole."""

    centres: tuple[Point, ...]
    arrows: tuple[Arrow, ...]
    width: float
    height: float


class _Slot(Struct, frozen=True):
    """The place of a node: its row and column of layers, and the direction of its row."""

    row: int
    col: int
    forward: int
    lowest: bool
    topmost: bool


def layers_of(initial: Sequence[int], transitions: Sequence[Sequence[int]]) -> list[list[int]]:
    """Return layers of nodes by their distance from the initial ones, in the order of a breadth-
    first search. Unreachable nodes are last."""
    seen: set[int] = set()
    layers: list[list[int]] = []
    for start in [list(initial), *([node] for node in range(len(transitions)))]:
        layer = [node for node in start if node not in seen]
        while layer:
            seen.update(layer)
            layers.append(layer)
            reached = dict.fromkeys(s for node in layer for s in transitions[node])
            layer = [node for node in reached if node not in seen]
    return layers


def laid_out(
    initial: Sequence[int],
    transitions: Sequence[Sequence[int]],
    box: tuple[float, float],
) -> BoxLayout:
    """Return the layout for boxes of that width and height."""
    layers = layers_of(initial, transitions)
    columns = _columns(layers, box)
    rows = [layers[i : i + columns] for i in range(0, len(layers), columns)]
    width, height = box
    tall = [max(len(layer) for layer in row) * (height + GAP) - GAP for row in rows]
    middle = [_TOP + sum(tall[:i]) + i * GUTTER + tall[i] / 2 for i in range(len(rows))]
    centres: dict[int, Point] = {}
    slots: dict[int, _Slot] = {}
    for r, row in enumerate(rows):
        forward = 1 if r % 2 == 0 else -1
        for i, layer in enumerate(row):
            col = i if forward > 0 else columns - 1 - i
            for k, node in enumerate(layer):
                x = GUTTER + col * (width + GUTTER) + width / 2
                y = middle[r] + (k - (len(layer) - 1) / 2) * (height + GAP)
                centres[node] = (x, y)
                slots[node] = _Slot(r, col, forward, k == len(layer) - 1, k == 0)
    below = [m + t / 2 + GUTTER / 2 for m, t in zip(middle, tall, strict=True)]
    router = _Router(centres, slots, box, below)
    arrows = tuple(
        router.arrow(node, successor)
        for layer in layers
        for node in layer
        for successor in transitions[node]
    )
    return BoxLayout(
        tuple(centres[node] for node in range(len(transitions))),
        arrows,
        GUTTER + columns * (width + GUTTER),
        _TOP + sum(tall) + len(rows) * GUTTER,
    )


def _columns(layers: Sequence[Sequence[int]], box: tuple[float, float]) -> int:
    """Return the number of layers side by side that makes the page about 1.5 times as wide as
    high."""
    stack = max(map(len, layers), default=1)
    row = stack * (box[1] + GAP) + GUTTER
    wanted = math.sqrt(1.5 * len(layers) * row / (box[0] + GUTTER))
    return max(1, min(len(layers), round(wanted)))


class _Router(Struct):
    centres: dict[int, Point]
    slots: dict[int, _Slot]
    box: tuple[float, float]
    below: list[float]
    _routed: int = 0

    def arrow(self, source: int, target: int) -> Arrow:
        """Return an arrow: direct to the next layer, through the gutters to all others."""
        (x, y), (to_x, to_y) = self.centres[source], self.centres[target]
        a, b = self.slots[source], self.slots[target]
        half_width, half_height = self.box[0] / 2, self.box[1] / 2
        if a.row == b.row and b.col - a.col == a.forward:
            reach = a.forward * half_width
            return Arrow(source, target, ((x + reach, y), (to_x - reach, to_y)), True)
        if b.row - a.row == 1 and a.col == b.col and a.lowest and b.topmost:
            return Arrow(source, target, ((x, y + half_height), (x, to_y - half_height)), True)
        if source == target:
            right, top, up = x + half_width - 12, y - half_height, y - half_height - 13
            loop = ((right - 20, top), (right - 20, up), (right, up), (right, top))
            return Arrow(source, target, loop, False)
        lane = _LANES[self._routed % len(_LANES)]
        self._routed += 1
        aside = max(8.0 - half_height, min(half_height - 8.0, lane))  # not at round corners
        out, into = a.forward, -b.forward
        out_x = x + out * (half_width + GUTTER / 2) + lane
        in_x = to_x + into * (half_width + GUTTER / 2) + lane
        # Below its row, or above it if the route leads up.
        channel = self.below[a.row] if b.row >= a.row else self.below[a.row - 1]
        points = (
            (x + out * half_width, y + aside),
            (out_x, y + aside),
            (out_x, channel + lane),
            (in_x, channel + lane),
            (in_x, to_y + aside),
            (to_x + into * half_width, to_y + aside),
        )
        return Arrow(source, target, points, False)


MOST_STATES = 60
MOST_EDGES = 110
"""Limits of a readable automaton."""

_MARGIN = 20.0
_FILLS = ("#DCECF7", "#FBEBCB", "#D3EEE4", "#F6E3EE", "#E4E7EB", "#FBE0D2")
"""Fill colours of goals: light tints of Okabe and Ito's colours."""
_LINE = "#4A515C"
_ROUND = 7.0


def svg_of_strategy(strategy: Strategy, task: Task, world: RegionMap) -> str:
    """Return the automaton if it is small enough to read, else a summary."""
    states = len(strategy.states)
    if 0 < states <= MOST_STATES and strategy.edges <= MOST_EDGES:
        return svg_of_automaton(strategy, task, world)
    return svg_of_summary(strategy, task, world)


def svg_of_automaton(strategy: Strategy, task: Task, world: RegionMap) -> str:
    """Draw every state as a box with its values, every transition as an arrow."""
    boxes = _boxes(strategy, task, world)
    initial = strategy.initial() or (0,)
    width = max(box.width for box in boxes)
    height = max(box.height for box in boxes)
    layout = laid_out(initial, strategy.transitions, (width, height))
    what = describe(task.objective, world.word)
    title = f"{task.robot.name} ({task.robot.model.name}): {what}"
    inner = max(layout.width, 420.0)
    heading = wrapped(title, 17, inner - _MARGIN, bold=True)
    top = _MARGIN + 21 * len(heading) + 26
    legend = _Legend(strategy, task, world)
    page = SvgWriter()
    total = top + layout.height + legend.height(inner) + _MARGIN
    page.rect(0, 0, inner + 2 * _MARGIN, total, fill="#FFFFFF")
    for i, line in enumerate(heading):
        page.text(_MARGIN, _MARGIN + 15 + 21 * i, line, 17, bold=True, fill=INK)
    figures = f"{len(strategy.states)} states, {strategy.edges} transitions"
    page.text(_MARGIN, top - 12, figures, 13, fill=MUTED)
    page.open_map(_MARGIN, top)
    for node in initial:
        _draw_start(page, layout.centres[node], (width, height))
    for arrow in layout.arrows:
        _draw_arrow(page, arrow)
    for box, centre in zip(boxes, layout.centres, strict=True):
        box.draw(page, centre, (width, height))
    page.close_group()
    legend.draw(page, _MARGIN, top + layout.height, inner)
    summary = f"The automaton of {strategy.specification.robot}: {figures}."
    return page.document(inner + 2 * _MARGIN, total, title, summary)


class _Box(Struct, frozen=True):
    """One state: the robot's region, and the rest of its values below."""

    title: str
    lines: tuple[str, ...]
    goal: int
    target: bool

    @property
    def width(self) -> float:
        title = text_width(self.title, 13, bold=True) + (18 if self.target else 0)
        return max(title, *(text_width(line, 10.5) for line in self.lines), 40.0) + 20

    @property
    def height(self) -> float:
        return 27.0 + 13.5 * len(self.lines)

    def draw(self, page: SvgWriter, centre: Point, size: tuple[float, float]) -> None:
        width, height = size
        left, top = centre[0] - width / 2, centre[1] - height / 2
        fill = _FILLS[self.goal % len(_FILLS)]
        page.rect(left, top, width, height, rx=7, fill=fill, stroke=INK, stroke_width=1.2)
        page.text(left + 10, top + 19, self.title, 13, bold=True, fill=INK)
        if self.target:
            mark = EVENT_MARKS[StoryKind.GOAL].path
            page.glyph(mark, left + width - 14, top + 14, 7, fill=INK)
        for i, line in enumerate(self.lines):
            page.text(left + 10, top + 33 + 13.5 * i, line, 10.5, fill=INK)


def _draw_start(page: SvgWriter, centre: Point, size: tuple[float, float]) -> None:
    left, top = centre[0] - size[0] / 2 - 4, centre[1] - size[1] / 2 - 4
    page.rect(left, top, size[0] + 8, size[1] + 8, rx=10, fill="#FFFFFF", stroke=INK)


def _boxes(strategy: Strategy, task: Task, world: RegionMap) -> list[_Box]:
    targets = target_regions(task.objective)
    boxes = []
    for node, goal in enumerate(strategy.ranks):
        values = strategy.values(node)
        region = values["region"]
        rest = _rest(strategy, values)
        lines = [" ".join(rest)] if rest else []
        inputs = in_words(strategy, values, Owner.INPUT).split()
        seen = [word for word in inputs if not word.startswith("!")]  # false inputs are not shown
        lines += wrapped(" ".join(seen), 10.5, 170) if seen else []
        boxes.append(_Box(world.label(region), tuple(lines), goal, region in targets))
    return boxes


def _rest(strategy: Strategy, values: Mapping[str, int]) -> list[str]:
    """Return the robot's own values beyond its region: heading and memory."""
    words = []
    for variable in strategy.specification.owned(Owner.OUTPUT):
        value = values[variable.name]
        if variable.name == "heading":
            words.append(Heading(value).label)
        elif variable.bounds is None:
            words += [variable.name] if value else []
        elif variable.name != "region":
            words.append(f"{variable.name}={value}")
    return words


def _draw_arrow(page: SvgWriter, arrow: Arrow) -> None:
    """Draw the line with rounded corners, and its head."""
    kept = [p for i, p in enumerate(arrow.points) if i == 0 or p != arrow.points[i - 1]]
    (x0, y0), (x1, y1) = kept[-2], kept[-1]
    length = max(1e-6, ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5)
    dx, dy = (x1 - x0) / length, (y1 - y0) / length
    neck = (x1 - 7 * dx, y1 - 7 * dy)
    page.path(
        _rounded([*kept[:-1], neck]),
        fill="none",
        stroke=_LINE if arrow.direct else "#8A93A0",
        stroke_width=1.3,
    )
    wings = [(neck[0] - side * dy, neck[1] + side * dx) for side in (3.6, -3.6)]
    page.path(polyline((x1, y1), *wings) + "Z", fill=_LINE)


def _rounded(points: Sequence[Point]) -> str:
    data = f"M{number(points[0][0])},{number(points[0][1])}"
    for before, here, after in zip(points, points[1:], points[2:], strict=False):
        first, second = _towards(here, before), _towards(here, after)
        data += f"L{number(first[0])},{number(first[1])}"
        data += f"Q{number(here[0])},{number(here[1])} {number(second[0])},{number(second[1])}"
    return data + f"L{number(points[-1][0])},{number(points[-1][1])}"


def _towards(corner: Point, other: Point) -> Point:
    dx, dy = other[0] - corner[0], other[1] - corner[1]
    length = max(1e-6, (dx * dx + dy * dy) ** 0.5)
    part = min(_ROUND, length / 2) / length
    return corner[0] + dx * part, corner[1] + dy * part


def _pursued(strategy: Strategy, goal: int, world: RegionMap) -> str:
    """Return the number ``goal`` of a state in words, with the goal's regions if it has any."""
    goals = strategy.specification.section(Section.SYS_LIVENESS)
    regions = goals[goal].regions if goal < len(goals) else ()
    return f"heads for {regions_words(regions, world.word)}" if regions else f"pursues goal {goal}"


class _Legend:
    """Meanings of colours and borders, in running text below the automaton."""

    def __init__(self, strategy: Strategy, task: Task, world: RegionMap) -> None:
        goals = sorted(set(strategy.ranks))
        self.entries = [
            (_pursued(strategy, goal, world), _FILLS[goal % len(_FILLS)]) for goal in goals
        ]
        what = describe(task.objective, world.word)
        self.objective = f"Objective: {what}. Double border: a start. Flag: a target."

    def height(self, width: float) -> float:
        return 34.0 + 18 * len(wrapped(self.objective, 12, width))

    def draw(self, page: SvgWriter, left: float, top: float, width: float) -> None:
        x = left
        for words, fill in self.entries:
            page.rect(x, top, 18, 14, rx=3, fill=fill, stroke=INK)
            page.text(x + 25, top + 11.5, words, 12, fill=INK)
            x += 25 + text_width(words, 12) + 22
        for i, line in enumerate(wrapped(self.objective, 12, width)):
            page.text(left, top + 36 + 18 * i, line, 12, fill=INK)

"""A large strategy as one picture: its states per region and its moves.

Each region shows in how many states of the automaton the robot is there, each arrow how many
transitions lead over that border (wider for more). States that differ in the inputs, the heading or
the memory only are merged: the picture shows the robot's routes."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from safenav.report.picture.floor import INK, cell_size, draw_floor, number_size
from safenav.report.picture.glyphs import EVENT_MARKS
from safenav.report.picture.legend import WIDTH, Block, Legend, Row, lines_of, square
from safenav.report.picture.svg import SvgWriter, number, polyline, wrapped
from safenav.report.replay.timeline import StoryKind
from safenav.scenario.objective import target_regions
from safenav.scenario.objective_text import describe
from safenav.spec.compile import assumption_names
from safenav.spec.task import Task
from safenav.synthesis.strategy import Strategy
from safenav.trace.looks import BLUE, VERMILLION
from safenav.world.map import Region, RegionMap

_MARGIN = 16.0
_THINNEST, _WIDEST = 0.015, 0.11
"""Least and largest width of an arrow, in sides of a region; it grows with its transitions."""
_TARGET = EVENT_MARKS[StoryKind.GOAL].path


def svg_of_summary(strategy: Strategy, task: Task, world: RegionMap) -> str:
    """Draw the map with states per region, moves and targets, and the figures of the automaton."""
    field = next(f for f in strategy.fields if f.variable.name == "region")
    regions = [field.decode(state) for state in strategy.states]
    moves = Counter(
        (regions[node], regions[successor])
        for node, successors in enumerate(strategy.transitions)
        for successor in successors
    )
    cell = cell_size(world)
    width, height = world.cols * cell, world.rows * cell
    legend = _legend(strategy, task, world, moves)
    across, beside = legend.arranged(width, height)
    inner = width + across if beside else max(width, across, WIDTH)
    title = wrapped(_title(task, world), 17, inner, bold=True)
    top = _MARGIN + 21 * len(title) + 8
    below = top + (max(height, legend.height) if beside else height + 20 + legend.height)
    page = SvgWriter()
    page.rect(0, 0, inner + 2 * _MARGIN, below + _MARGIN, fill="#FFFFFF")
    for i, line in enumerate(title):
        page.text(_MARGIN, _MARGIN + 15 + 21 * i, line, 17, bold=True, fill=INK)
    page.open_map(_MARGIN, top)
    draw_floor(page, world, cell)
    _draw_states(page, Counter(regions), world, cell)
    _draw_moves(page, moves, world, cell)
    _draw_places(page, task, world, cell)
    page.close_group()
    aside = _MARGIN + (width + 24 if beside else 0)
    legend.draw(page, aside, top if beside else top + height + 20)
    words = f"The strategy of {strategy.specification.robot}: {len(regions)} states in all."
    return page.document(inner + 2 * _MARGIN, below + _MARGIN, strategy.specification.title, words)


def _draw_states(
    page: SvgWriter, states: Mapping[Region, int], world: RegionMap, cell: float
) -> None:
    most = math.log1p(max(states.values(), default=1))
    for region, count in sorted(states.items()):
        row, col = world.position(region)
        tint = 0.08 + 0.42 * math.log1p(count) / most
        page.rect(col * cell, row * cell, cell, cell, fill=BLUE, fill_opacity=round(tint, 3))
    # The count in the middle, clear of the arrows, and below it the region's number.
    small = number_size(cell)
    for region, count in sorted(states.items()):
        row, col = world.position(region)
        size = min(cell * 0.27, cell * 0.62 / len(str(count)) / 0.64)
        middle, drop = (col + 0.5) * cell, size * 0.36 if small is None else -size * 0.05
        baseline = (row + 0.5) * cell + drop
        page.text(middle, baseline, str(count), size, bold=True, text_anchor="middle", fill=INK)
        if small is not None:
            below = baseline + 1.05 * small
            page.text(middle, below, str(region), small, text_anchor="middle", fill="#4A515C")


def _draw_moves(
    page: SvgWriter, moves: Mapping[tuple[Region, Region], int], world: RegionMap, cell: float
) -> None:
    """Draw an arrow over each border that is crossed; opposite arrows run beside each other."""
    most = _busiest(moves)
    for (origin, target), count in sorted(moves.items()):
        if origin == target:
            continue
        (row, col), (to_row, to_col) = world.position(origin), world.position(target)
        dx, dy = to_col - col, to_row - row
        side = 0.2 if (target, origin) in moves else 0.0
        middle_x = ((col + to_col + 1) / 2 - dy * side) * cell
        middle_y = ((row + to_row + 1) / 2 + dx * side) * cell
        wide = (_THINNEST + (_WIDEST - _THINNEST) * count / most) * cell
        head, reach = 1.25 * wide + 0.03 * cell, 0.16 * cell
        tip = (middle_x + dx * reach, middle_y + dy * reach)
        neck = (tip[0] - dx * 1.7 * head, tip[1] - dy * 1.7 * head)
        shaft = polyline((middle_x - dx * reach, middle_y - dy * reach), neck)
        page.path(shaft, stroke=INK, stroke_width=wide)
        wings = [(neck[0] - s * dy * head, neck[1] + s * dx * head) for s in (1, -1)]
        page.path(polyline(tip, *wings) + "Z", fill=INK)


def _busiest(moves: Mapping[tuple[Region, Region], int]) -> int:
    return max((count for (a, b), count in moves.items() if a != b), default=1)


def _title(task: Task, world: RegionMap) -> str:
    kind = task.robot.model.name
    return f"{task.robot.name} ({kind}): {describe(task.objective, world.word)}"


def _draw_places(page: SvgWriter, task: Task, world: RegionMap, cell: float) -> None:
    """Draw a frame and a flag on each target, a round frame on the start."""
    for region in sorted(target_regions(task.objective)):
        row, col = world.position(region)
        edge = {"fill": "none", "stroke": INK, "stroke_width": max(1.5, 0.06 * cell)}
        page.rect(col * cell, row * cell, cell, cell, **edge)
        place = ((col + 0.84) * cell, (row + 0.17) * cell)
        page.glyph(_TARGET, *place, max(5.0, cell * 0.15), fill=VERMILLION)
    row, col = world.position(task.pose.region)
    page.rect(
        (col + 0.04) * cell,
        (row + 0.04) * cell,
        0.92 * cell,
        0.92 * cell,
        rx=0.1 * cell,
        fill="none",
        stroke=VERMILLION,
        stroke_width=max(1.5, 0.045 * cell),
    )


def _legend(
    strategy: Strategy,
    task: Task,
    world: RegionMap,
    moves: Mapping[tuple[Region, Region], int],
) -> Legend:
    stays = sum(count for (a, b), count in moves.items() if a == b)
    crossings = strategy.edges - stays
    figures = [
        f"{len(strategy.states)} states, {strategy.edges} transitions",
        f"{crossings} of them move, {stays} stay",
        f"objective: {describe(task.objective, world.word)}",
    ]
    figures += [f"tracks {other.name}" for other in task.observed]
    figures += [f"assumes: {name}" for name in assumption_names(task, world)]
    rows = tuple(Row(None, lines_of(words, 12, WIDTH)) for words in figures)

    def states(page: SvgWriter, x: float, y: float) -> None:
        square(9, fill=BLUE, fill_opacity=0.3)(page, x, y)
        page.text(x, y + 4, "9", 11, bold=True, text_anchor="middle", fill=INK)

    def move(page: SvgWriter, x: float, y: float) -> None:
        page.path(f"M{number(x - 9)},{number(y)}h10", stroke=INK, stroke_width=2.6)
        page.path(f"M{number(x + 9)},{number(y)}l-9,-5v10z", fill=INK)

    def target(page: SvgWriter, x: float, y: float) -> None:
        square(9, fill="none", stroke=INK, stroke_width=2)(page, x, y)
        page.glyph(_TARGET, x, y, 6, fill=VERMILLION)

    start = square(8, rx=2, fill="none", stroke=VERMILLION, stroke_width=2)
    wide = f"moves; width tells how many transitions, the widest {_busiest(moves)}"
    marks = (
        Row(states, lines_of("states of the automaton in that region, above its number", 12)),
        Row(move, lines_of(wide, 12)),
        Row(target, lines_of("target", 12)),
        Row(start, lines_of("start", 12)),
    )
    robot = strategy.specification.robot
    return Legend((Block(f"Strategy of {robot}", rows), Block("Marks", marks)))

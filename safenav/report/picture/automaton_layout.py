"""Layout of the boxes and arrows of a small automaton.

Nodes stand in layers by their distance from the start. Layers run from left to right and, where
a page is full, back again in the row below, like an ox ploughs: strategies are long loops, and
a loop of 40 nodes in one line could not be read. Arrows to the next layer are direct; all others
run in the gutters between columns and rows, so that no arrow passes through a box."""

from __future__ import annotations

import math
from collections.abc import Sequence

from msgspec import Struct

Point = tuple[float, float]

GUTTER = 46.0
"""Width of the gaps between columns; rows have the same."""
GAP = 20.0
"""Between boxes of one layer."""
_LANES = (0.0, 4.0, -4.0, 8.0, -8.0, 11.0, -11.0)
"""Arrows in one gutter run beside each other, at these distances from its middle."""
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
    """Return the nodes by their distance from the initial ones; each layer in the order in which
    its nodes are reached. Unreachable nodes are last."""
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
    """Return how many layers stand side by side: so that the page is about half wider than high."""
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
            way = a.forward * half_width
            return Arrow(source, target, ((x + way, y), (to_x - way, to_y)), True)
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

"""The layout of small automata: whatever the graph, boxes and arrows stay apart."""

from itertools import combinations, pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from safenav.report.picture.automaton import BoxLayout, Point, laid_out, layers_of

BOX = (90.0, 44.0)


@st.composite
def graphs(draw: st.DrawFn) -> list[list[int]]:
    """Successors by node."""
    size = draw(st.integers(1, 30))
    nodes = st.integers(0, size - 1)
    return draw(st.lists(st.lists(nodes, max_size=4, unique=True), min_size=size, max_size=size))


@given(graphs())
@settings(max_examples=150)
def test_whatever_the_graph_nothing_overlaps_and_every_transition_is_drawn(
    transitions: list[list[int]],
) -> None:
    layout = laid_out((0,), transitions, BOX)
    boxes_are_apart_and_on_the_page(layout)
    every_transition_has_an_arrow_from_box_to_box(layout, transitions)
    no_arrow_passes_through_a_box(layout)


def boxes_are_apart_and_on_the_page(layout: BoxLayout) -> None:
    for (x, y), (to_x, to_y) in combinations(layout.centres, 2):
        assert abs(x - to_x) >= BOX[0] or abs(y - to_y) >= BOX[1]
    for x, y in layout.centres:
        assert BOX[0] / 2 <= x <= layout.width - BOX[0] / 2
        assert BOX[1] / 2 <= y <= layout.height - BOX[1] / 2
    for arrow in layout.arrows:
        assert all(0 <= x <= layout.width and 0 <= y <= layout.height for x, y in arrow.points)


def every_transition_has_an_arrow_from_box_to_box(
    layout: BoxLayout, transitions: list[list[int]]
) -> None:
    drawn = sorted((arrow.source, arrow.target) for arrow in layout.arrows)
    assert drawn == sorted((n, s) for n, successors in enumerate(transitions) for s in successors)
    for arrow in layout.arrows:
        assert _on_border(arrow.points[0], layout.centres[arrow.source])
        assert _on_border(arrow.points[-1], layout.centres[arrow.target])


def no_arrow_passes_through_a_box(layout: BoxLayout) -> None:
    for arrow in layout.arrows:
        for here, there in pairwise(arrow.points):
            assert not any(_crosses(here, there, centre) for centre in layout.centres)


def test_layers_are_the_distances_from_the_start() -> None:
    assert layers_of((0,), [[1, 2], [3], [3], [0], [4]]) == [[0], [1, 2], [3], [4]]


@pytest.mark.parametrize("length", [4, 22, 60])
def test_a_long_loop_is_folded_to_the_shape_of_a_page(length: int) -> None:
    layout = laid_out((0,), [[(n + 1) % length] for n in range(length)], BOX)
    assert 0.8 < layout.width / layout.height < 3.5
    assert sum(arrow.direct for arrow in layout.arrows) == length - 1


def _crosses(here: Point, there: Point, centre: Point) -> bool:
    """Whether the segment has a point inside the box (Liang and Barsky 1984: the part of it that
    lies between the box's sides, one pair of sides after the other)."""
    first, last = 0.0, 1.0
    for axis in range(2):
        low, high = centre[axis] - BOX[axis] / 2 + 1e-6, centre[axis] + BOX[axis] / 2 - 1e-6
        start, way = here[axis], there[axis] - here[axis]
        if way == 0:
            if not low < start < high:
                return False
            continue
        enters, leaves = sorted(((low - start) / way, (high - start) / way))
        first, last = max(first, enters), min(last, leaves)
    return first < last


def _on_border(point: Point, centre: Point) -> bool:
    away = [abs(point[i] - centre[i]) - BOX[i] / 2 for i in range(2)]
    return max(away) == pytest.approx(0, abs=1e-6)

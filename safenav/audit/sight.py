"""Visibility between robots, recomputed from the header of a trace (docs/tracking.md, Visibility).

Independent of ``safenav.world.sight`` on purpose: one line of sight at a time, by its crossings of
region borders, in whole numbers."""

from __future__ import annotations

from collections.abc import Collection

from safenav.audit.grid import Grid
from safenav.trace.vocabulary import Region


def sees(
    grid: Grid, radius: float | None, closed: Collection[Region], one: Region, other: Region
) -> bool:
    """Return whether two free regions see each other. ``closed``: regions whose obstacle blocks the
    view. ``radius`` is in regions, None without limit."""
    (row, col), (to_row, to_col) = divmod(one, grid.cols), divmod(other, grid.cols)
    down, right = abs(to_row - row), abs(to_col - col)
    if radius is not None and down * down + right * right > radius * radius:
        return False
    south, east = (1 if to_row > row else -1), (1 if to_col > col else -1)

    def blocks(rows: int, cols: int) -> bool:
        region = (row + south * rows) * grid.cols + col + east * cols
        return region not in (one, other) and (not grid.is_free(region) or region in closed)

    # The segment crosses border j of the columns at (2j + 1) / (2 right) of its length, border i of
    # the rows at (2i + 1) / (2 down). Between two crossings it is inside one region.
    crossings = sorted(
        {(2 * j + 1) * max(down, 1) for j in range(right)}
        | {(2 * i + 1) * max(right, 1) for i in range(down)}
    )
    rows = cols = 0
    for crossing in crossings:
        across = right > 0 and crossing == (2 * cols + 1) * max(down, 1) and cols < right
        along = down > 0 and crossing == (2 * rows + 1) * max(right, 1) and rows < down
        if across and along and blocks(rows + 1, cols) and blocks(rows, cols + 1):
            return False  # exactly through a corner, between two that block
        rows, cols = rows + along, cols + across
        if blocks(rows, cols):
            return False
    return True

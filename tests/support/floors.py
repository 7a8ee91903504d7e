"""Random floors as rows of text, inside an outer wall."""

from random import Random

import networkx


def rooms(random: Random, down: int, across: int, height: int, width: int) -> list[str]:
    """Rooms with doors one region wide, between the neighbours of a random tree and some others."""
    rows, cols = down * (height + 1) + 1, across * (width + 1) + 1
    cells = [
        ["#."[r % (height + 1) > 0 and c % (width + 1) > 0] for c in range(cols)]
        for r in range(rows)
    ]
    graph = networkx.grid_2d_graph(down, across)
    for pair in graph.edges:
        graph.edges[pair]["weight"] = random.random()
    tree = networkx.minimum_spanning_tree(graph)
    for one, other in graph.edges:
        if tree.has_edge(one, other) or random.random() < 0.3:
            top, left = one[0] * (height + 1), one[1] * (width + 1)
            if one[0] == other[0]:
                cells[top + random.randint(1, height)][left + width + 1] = "."
            else:
                cells[top + height + 1][left + random.randint(1, width)] = "."
    return ["".join(row) for row in cells]


def walled(random: Random, rows: int, cols: int, walls: float) -> list[str]:
    """A room with walls in it."""
    free = ([random.random() >= walls for _ in range(cols)] for _ in range(rows))
    return framed(["".join("#."[each] for each in row) for row in free])


def scattered(random: Random, rows: int, cols: int, walls: float) -> list[str]:
    """A room with walls in it, all free regions connected: the largest part is kept."""
    graph = networkx.grid_2d_graph(rows, cols)
    graph.remove_nodes_from([cell for cell in [*graph] if random.random() < walls])
    parts = networkx.connected_components(graph)
    kept = max(parts, key=lambda part: (len(part), min(part)), default=set())
    return framed(
        ["".join("." if (r, c) in kept else "#" for c in range(cols)) for r in range(rows)]
    )


def open_floor(rows: int, cols: int) -> list[str]:
    return framed(["." * cols] * rows)


def framed(body: list[str]) -> list[str]:
    wall = "#" * (len(body[0]) + 2)
    return [wall, *(f"#{row}#" for row in body), wall]


def free_in(grid: list[str]) -> list[int]:
    return [region for region, cell in enumerate("".join(grid)) if cell == "."]

"""Scalable families of specifications in structuredslugs, for measuring synthesizers.

    python benchmarks/families.py grid --rows 12 --cols 12 --adversary four > grid.structuredslugs
    python benchmarks/families.py requests --size 8 --goals 6
    python benchmarks/families.py arbiter --clients 5

Each family is one function from sizes to text, so that tests and runners can import them.
"""

import argparse
import inspect
from collections.abc import Callable
from dataclasses import dataclass, field

from published import arbiters, robots

ADVERSARIES = ("none", "four", "king")
_FAIRNESS = "fairness: it comes back to far cells, as long as this robot does not keep it off"


@dataclass
class _Text:
    """Sections of a specification under construction, each constraint with its reason."""

    title: str
    sections: dict[str, list[str]] = field(default_factory=dict)

    def add(self, section: str, *lines: str, why: str = "") -> None:
        here = self.sections.setdefault(section, [])
        here += ([f"# {why}"] if why else []) + list(lines)

    def __str__(self) -> str:
        blocks = [f"# {self.title}\n"]
        blocks += [
            f"[{name}]\n" + "".join(f"{line}\n" for line in lines)
            for name, lines in self.sections.items()
        ]
        return "\n".join(blocks)


def grid(
    rows: int = 12, cols: int = 12, adversary: str = "none", walls: bool = False, goals: int = 4
) -> str:
    """A robot patrols the border of a grid, with or without another robot in its way.

    It visits `goals` cells spread evenly over the border, the corners if there are four of them.

    The other robot moves by at most one cell (`four`: to a 4-neighbour, `king`: diagonally too),
    never steps onto the robot, and returns to two far cells infinitely often; else it does what
    it likes.  The robot never steps onto it.  With walls, every third column is a wall with a gap.
    """
    _check(rows, cols, goals)
    text = _Text(f"{rows} x {cols} grid, patrol of {goals} cells, adversary: {adversary}")
    text.add("INPUT")
    text.add("OUTPUT", f"row:0...{rows - 1}", f"col:0...{cols - 1}")
    text.add("SYS_INIT", "row = 0", "col = 0")
    text.add("SYS_TRANS", *_four_neighbours("row", "col"), why="at most one step, not diagonally")
    if walls:
        for col in range(2, cols - 1, 3):
            gap = 0 if col % 2 else rows - 1
            wall = f"!(col' = {col} & row' != {gap})"
            text.add("SYS_TRANS", wall, why=f"wall in column {col} with a gap in row {gap}")
    if adversary != "none":
        _add_adversary(text, rows, cols, diagonal=adversary == "king")
    for row, col in _patrol(rows, cols, goals):
        text.add("SYS_LIVENESS", f"row = {row} & col = {col}")
    return str(text)


def regions(rows: int = 12, cols: int = 12, adversary: str = "none") -> str:
    """The same patrol and adversary as in `grid`, with one integer for each robot's cell.

    Cells are numbered in reading order; the moves are listed cell by cell.  Harder for symbolic
    methods than coordinates, and what one gets from an abstraction without geometry.
    """
    _check(rows, cols)
    text = _Text(f"{rows} x {cols} regions, patrol of the corners, adversary: {adversary}")
    last = rows * cols - 1
    corners = (0, cols - 1, last, last - cols + 1)
    text.add("INPUT")
    text.add("OUTPUT", f"region:0...{last}")
    text.add("SYS_INIT", "region = 0")
    text.add("SYS_TRANS", *_moves("region", rows, cols, diagonal=False), why="to a neighbour")
    if adversary != "none":
        text.add("INPUT", f"other:0...{last}")
        text.add("ENV_INIT", f"other = {last}")
        text.add("ENV_TRANS", *_moves("other", rows, cols, diagonal=adversary == "king"))
        text.add("ENV_TRANS", "other' != region", why="it does not step onto this robot")
        for far in ((rows // 2) * cols, (rows // 2) * cols + cols - 1):
            text.add("ENV_LIVENESS", f"other = {far} | region = {far}", why=_FAIRNESS)
        text.add("SYS_TRANS", "region' != other'", why="no step onto the other robot")
    for corner in corners:
        text.add("SYS_LIVENESS", f"region = {corner}")
    return str(text)


def requests(size: int = 8, goals: int = 6) -> str:
    """Many goals: a robot on a square grid serves requests at scattered cells.

    Each request stays until the robot is there, and a slow door (open infinitely often) divides the
    grid, so that every goal needs both the other player's patience and a path.
    """
    _check(size, size, goals)
    text = _Text(f"{goals} requests on a {size} x {size} grid with a door in the middle")
    text.add("INPUT", "open", *(f"ask{j}" for j in range(goals)))
    text.add("OUTPUT", f"row:0...{size - 1}", f"col:0...{size - 1}")
    text.add("ENV_INIT", "!open", *(f"!ask{j}" for j in range(goals)))
    text.add("SYS_INIT", "row = 0", "col = 0")
    middle = size // 2
    text.add("SYS_TRANS", *_four_neighbours("row", "col"), why="at most one step, not diagonally")
    text.add(
        "SYS_TRANS",
        f"(col = {middle - 1} & col' = {middle}) -> (open & row = {middle})",
        f"(col = {middle} & col' = {middle - 1}) -> (open & row = {middle})",
        why="the two halves are joined by the door alone",
    )
    text.add("ENV_LIVENESS", "open", why="the door opens infinitely often")
    for j in range(goals):
        row, col = (j * 5 + 2) % size, (j * 3 + j * size // max(goals, 1)) % size
        there = f"(row = {row} & col = {col})"
        text.add("ENV_TRANS", f"(ask{j} & !{there}) -> ask{j}'", why=f"request {j} is patient")
        text.add("SYS_LIVENESS", f"!ask{j} | {there}")
    return str(text)


def arbiter(clients: int = 4) -> str:
    """Many assumptions: a bus is lent to one client at a time, which may hold on to it.

    As in bus arbiters (AMBA), each client must let go at some time: one assumption for each; and
    each request must be granted: one guarantee for each.
    """
    if clients < 2:
        raise ValueError("an arbiter needs at least two clients")
    text = _Text(f"arbiter of a bus with {clients} clients")
    text.add(
        "INPUT", *(f"request{i}" for i in range(clients)), *(f"hold{i}" for i in range(clients))
    )
    text.add("OUTPUT", f"owner:0...{clients - 1}", "fresh")
    text.add("ENV_INIT", *(f"!request{i} & !hold{i}" for i in range(clients)))
    text.add("SYS_INIT", "owner = 0", "!fresh")
    for i in range(clients):
        text.add(
            "ENV_TRANS",
            f"(request{i} & owner != {i}) -> request{i}'",
            f"hold{i}' -> (owner = {i} | hold{i})",
            why=f"client {i} waits for its turn, and starts to hold only what it has",
        )
        text.add("ENV_LIVENESS", f"!hold{i}")
        text.add("SYS_TRANS", f"(owner = {i} & hold{i}') -> owner' = {i}")
        text.add(
            "SYS_TRANS",
            f"(owner != {i} & owner' = {i}) -> request{i}",
            why=f"client {i} gets the bus on request only",
        )
        text.add("SYS_LIVENESS", f"!request{i} | owner = {i}")
    changes = " | ".join(f"(owner = {i} & owner' != {i})" for i in range(clients))
    text.add("SYS_TRANS", f"fresh' <-> ({changes})", why="fresh marks a change of owner")
    return str(text)


def _check(rows: int, cols: int, goals: int = 1) -> None:
    if rows < 2 or cols < 2 or goals < 1:
        raise ValueError("a grid has at least two rows and columns, and a goal")


def _patrol(rows: int, cols: int, goals: int) -> list[tuple[int, int]]:
    """Cells of the border, clockwise from the north-west corner."""
    if goals == 4:
        return [(0, 0), (0, cols - 1), (rows - 1, cols - 1), (rows - 1, 0)]
    border = [(0, col) for col in range(cols)]
    border += [(row, cols - 1) for row in range(1, rows)]
    border += [(rows - 1, col) for col in range(cols - 2, -1, -1)]
    border += [(row, 0) for row in range(rows - 2, 0, -1)]
    if goals > len(border):
        raise ValueError(f"{goals} goals on a border of {len(border)} cells")
    return [border[k * len(border) // goals] for k in range(goals)]


def _four_neighbours(row: str, col: str) -> tuple[str, ...]:
    return (*_one_step(row), *_one_step(col), f"{row}' = {row} | {col}' = {col}")


def _one_step(name: str) -> tuple[str, str]:
    return (f"{name}' <= {name} + 1", f"{name} <= {name}' + 1")


def _moves(name: str, rows: int, cols: int, diagonal: bool) -> list[str]:
    lines = []
    for row in range(rows):
        for col in range(cols):
            near = [
                r * cols + c
                for r in range(max(row - 1, 0), min(row + 2, rows))
                for c in range(max(col - 1, 0), min(col + 2, cols))
                if diagonal or r == row or c == col
            ]
            targets = " | ".join(f"{name}' = {cell}" for cell in near)
            lines.append(f"{name} = {row * cols + col} -> ({targets})")
    return lines


def _add_adversary(text: _Text, rows: int, cols: int, diagonal: bool) -> None:
    text.add("INPUT", f"other_row:0...{rows - 1}", f"other_col:0...{cols - 1}")
    text.add("ENV_INIT", f"other_row = {rows - 1}", f"other_col = {cols - 1}")
    steps = (*_one_step("other_row"), *_one_step("other_col"))
    text.add(
        "ENV_TRANS",
        *(steps if diagonal else _four_neighbours("other_row", "other_col")),
        why="the other robot moves by at most one cell",
    )
    text.add(
        "ENV_TRANS", "!(other_row' = row & other_col' = col)", why="and does not step onto this one"
    )
    middle = rows // 2
    for col in (0, cols - 1):
        text.add(
            "ENV_LIVENESS",
            f"(other_row = {middle} & other_col = {col}) | (row = {middle} & col = {col})",
            why=_FAIRNESS,
        )
    text.add(
        "SYS_TRANS", "!(row' = other_row' & col' = other_col')", why="no step onto the other robot"
    )


FAMILIES: dict[str, Callable[..., str]] = {
    "grid": grid,
    "regions": regions,
    "requests": requests,
    "arbiter": arbiter,
    "amba": arbiters.amba,
    "synt15": arbiters.synt15,
    "genbuf": arbiters.genbuf,
    "bunny": robots.bunny,
    "belief": robots.belief,
}


def main() -> None:
    """Print a specification of a scalable family: an option for each parameter of its function."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="family", required=True)
    for family, written in FAMILIES.items():
        command = commands.add_parser(family, help=str(written.__doc__).splitlines()[0])
        for name, parameter in inspect.signature(written).parameters.items():
            default = parameter.default
            if isinstance(default, bool):
                command.add_argument(f"--{name}", action="store_true")
            elif isinstance(default, str):
                command.add_argument(f"--{name}", choices=ADVERSARIES, default=default)
            else:
                command.add_argument(f"--{name}", type=int, default=default)
    given = vars(parser.parse_args())
    try:
        print(FAMILIES[given.pop("family")](**given), end="")
    except ValueError as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()

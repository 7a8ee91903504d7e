"""Observations of other robots by a robot's strategy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import product

from safenav.judge.bundle.strategies import Row, require
from safenav.judge.lines import Line
from safenav.judge.state import State
from safenav.judge.world import World, closure

Seen = Mapping[str, int]


class Others:
    """The robots that a robot tracks, as its strategy knows them. One stays or takes steps; then
    this one looks, and moves. Knowledge of a robot is a region, or a belief: a set of cells, with a
    number above those of the regions."""

    def __init__(self, e: Line, s: State) -> None:
        self.line, self.world, self.live = e, s.world, s.live
        self.radius = s.robots[e.robot].data.vision
        self.cells = s.scenario.partition or ()
        known = e.knowledge or {}
        require(set(known) <= {*s.robots} - {e.robot}, "it knows of robots that do not exist")
        self.first = {name: self.number(name, what) for name, what in known.items()}
        self.names = {name: f"at_{name}" for name in self.first}
        self.values = {self.names[name]: value for name, value in self.first.items()}

    def number(self, name: str, known: int | Iterable[int]) -> int:
        if isinstance(known, int):
            return known
        belief, listed = frozenset(known), (self.line.beliefs or {}).get(name, ())
        require(belief in listed, f"no input says that {name} may be in the cells {sorted(belief)}")
        return self.world.size + int(listed.index(belief))

    def whereabouts(self, name: str, value: int) -> frozenset[int]:
        """Return the regions where another robot may be, given the knowledge ``value`` of it."""
        if value < self.world.size:
            return frozenset({value})
        cells = self.line.beliefs[name][value - self.world.size]
        return frozenset().union(*(self.cells[cell] for cell in cells))

    def later(self, regions: Iterable[int]) -> set[int]:
        """Return where a robot in one of the regions may be at the next look: at most one step
        away; in a live run, where nothing bounds the number of its steps, wherever it can go."""

        def steps(region: int) -> Iterable[int]:
            return (to for to, _ in self.world.steps(False, (region, None)))

        regions = {*regions}
        return closure(regions, steps) if self.live else regions.union(*map(steps, regions))

    def after(self, name: str, region: int, value: int) -> set[int]:
        """Return the possible next knowledge of another robot, given the present one, for a robot
        in a region."""
        reach = self.later(self.whereabouts(name, value))
        seen = {r for r in reach if self.sees(region, r)}
        hidden = [k for k, cell in enumerate(self.cells) if cell & (reach - seen)]
        return seen | ({self.number(name, hidden)} if seen != reach else set())

    def expected(self, region: int, values: Seen) -> Iterable[Collection[Row]]:
        """Yield the possible next values of each input."""
        for name, key in self.names.items():
            yield [(value,) for value in self.after(name, region, values[key])]

    def look(self, s: State, known: dict[str, int]) -> dict[str, int]:
        """Return the inputs of a robot now, and update what is ``known``."""
        here, found = s.robots[self.line.robot].pose[0], dict[str, int]()
        for name, key in self.names.items():
            there = s.robots[name].pose[0]
            if not self.sees(here, there):
                hidden = self.after(name, here, known[name])
                possible = {v for v in hidden if there in self.whereabouts(name, v)}
                require(possible or s.external, f"{name} is outside every possible belief")
                there = max(possible or hidden)
            found[key] = known[name] = there
        return found

    def sees(self, a: int, b: int) -> bool:
        return sees(self.world, a, b, self.radius, self.line.sight_closed or ())

    def check_known(self, s: State) -> None:
        """Refuse unless what the robot knows of others is so."""
        for name, value in self.first.items():
            where = self.whereabouts(name, value)
            later = self.later(where) if s.tick else where  # it may have moved since the look
            holds = s.robots[name].holds & later
            require(holds, f"{self.line.robot} believes {name} to be where it is not")


def sees(world: World, a: int, b: int, radius: float | None, closed: Collection[int]) -> bool:
    """Return whether region b is in sight from a. The distance of the centres is at most the
    radius; the segment between them passes through the interior of no wall or closed region, and
    not between two of them that touch at a corner."""
    (row, col), (row_b, col_b) = divmod(a, world.cols), divmod(b, world.cols)
    down, right = row_b - row, col_b - col
    if radius is not None and down * down + right * right > radius * radius:
        return False
    shut: dict[tuple[int, int], int] = {}  # distance of the segment from closed regions
    for r, c in product(*(range(min(0, far), max(0, far) + 1) for far in (down, right))):
        region = (row + r) * world.cols + col + c
        if region not in world.free or (region in closed and region not in (a, b)):
            shut[r, c] = 2 * abs(down * c - right * r) - abs(down) - abs(right)
    across = (1 if down > 0 else -1, 1 if right > 0 else -1)
    corners = ((r, c) for r, c in shut if shut.get((r + across[0], c - across[1])) == 0)
    return min(shut.values(), default=0) >= 0 and all(shut[corner] > 0 for corner in corners)

"""Small teams on drawn floors, for tables of tests: problems of the coordination layer by hand."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from safenav.runtime.resolution.problem import Member, OpenNeed, OpenObstacle, Problem

from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, region_mask

FACING = {"n": Heading.NORTH, "e": Heading.EAST, "s": Heading.SOUTH, "w": Heading.WEST}


@dataclass(frozen=True)
class Bot:
    """A robot: its pose (``"12"``, or ``"12e"`` with heading mobility), its targets in turn, its
    capabilities."""

    at: str
    targets: Sequence[int]
    can: str = ""
    ticks: int = 1
    layer: str = "ground"
    any_order: bool = False
    holds: bool = False


@dataclass(frozen=True)
class Block:
    """An obstacle: its region, and its needs as (action, robots, regions, together)."""

    region: int
    needs: Sequence[tuple[str, int, Sequence[int], bool]]
    blocks: Iterable[int] | None = None


class Floor:
    """A map with robots and obstacles on it."""

    def __init__(
        self, grid: Sequence[str], bots: Mapping[str, Bot], blocks: Sequence[Block] = ()
    ) -> None:
        self.world = RegionMap.from_grid(grid)
        graphs = {m: PoseGraph(self.world, m) for m in Mobility}
        members, poses = [], []
        listed = list(bots.items())
        for name, bot in listed:
            turning = bot.at[-1] in FACING
            graph = graphs[Mobility.HEADING if turning else Mobility.FREE]
            pose = Pose(int(bot.at[:-1]), FACING[bot.at[-1]]) if turning else Pose(int(bot.at))
            poses.append(graph.number(pose))
            members.append(
                Member(
                    name,
                    graph,
                    graph.everywhere,
                    tuple(graph.poses_on(1 << target) for target in bot.targets),
                    not bot.any_order,
                    bot.holds,
                    frozenset(bot.can.split()),
                    bot.ticks,
                )
            )
        gates = []
        for number, block in enumerate(blocks):
            actions = {action for action, *_ in block.needs}
            blocked = block.blocks
            if blocked is None:
                able = [set(bot.can.split()) >= actions for _, bot in listed]
                blocked = [i for i, yes in enumerate(able) if not yes]
            needs = tuple(OpenNeed(a, n, region_mask(at), t) for a, n, at, t in block.needs)
            barred = (frozenset(blocked),) * len(needs)
            gates.append(OpenObstacle(f"o{number}", block.region, barred, needs))
        layers = [bot.layer for _, bot in listed]
        conflicts = tuple(
            frozenset(j for j, other in enumerate(layers) if other == layer and j != i)
            for i, layer in enumerate(layers)
        )
        self.problem = Problem(tuple(members), tuple(gates), conflicts)
        self.poses = tuple(poses)
        self.counts = ((0, 0, 0),) * len(poses)

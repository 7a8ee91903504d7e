"""A joint plan as a trace has it: written, and read where a run continues another."""

from __future__ import annotations

from safenav.begun import PlanLeft
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.traffic import execution
from safenav.trace import records
from safenav.trace.header import heading_in_trace
from safenav.world.map import HEADINGS
from safenav.world.moves import Pose


def plan_record(tick: int, floor: Floor, plan: execution.Schedule, reason: str) -> records.Plan:
    """A plan as it stands in a trace."""
    robots = {}
    for index, (name, way) in enumerate(zip(floor.names, plan.ways, strict=True)):
        graph = floor.problem.members[index].graph
        poses = [graph.pose(number) for number in way]
        robots[name] = tuple((pose.region, heading_in_trace(pose)) for pose in poses)
    names = floor.names
    orders = tuple(
        # Step k leads from place k to place k + 1.
        (names[order.other], order.before + 1, names[order.robot], order.step + 1)
        for order in plan.orders
    )
    return records.Plan(tick, reason, robots, orders)


def scheduled(floor: Floor, left: PlanLeft) -> execution.Schedule | None:
    """A plan that a header has; None if it is not one of this team."""
    if left.robots.keys() != {*floor.names}:
        return None
    ways = tuple(
        tuple(
            member.graph.number(Pose(region, None if heading is None else HEADINGS[heading]))
            for region, heading in left.robots[name]
        )
        for name, member in zip(floor.names, floor.problem.members, strict=True)
    )
    orders = tuple(
        execution.Order(floor.index(then), j - 1, floor.index(first), i - 1)
        for first, i, then, j in left.orders
    )
    return execution.Schedule(ways, orders)

"""The joint plan that robots follow where a trace ends."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.begun import PlanLeft
from safenav.trace import records
from safenav.world.moves import Pose


class FollowedPlan(Struct):
    """A joint ``plan`` (None: there is none), with the number of steps that each robot has
    ``taken``; ``to_follow``: it is the plan of the earlier run, which no robot follows yet."""

    plan: PlanLeft | None = None
    taken: dict[str, int] = field(default_factory=dict)
    to_follow: bool = False

    def begin(self, plan: records.Plan | PlanLeft | None, *, to_follow: bool = False) -> None:
        """Follow a joint plan, or none, from now on."""
        self.plan = None if plan is None else PlanLeft(plan.robots, plan.orders, plan.reason)
        self.taken = {} if plan is None else dict.fromkeys(plan.robots, 0)
        self.to_follow = to_follow

    def sets_out(self) -> None:
        """Forget the plan of the earlier run if a robot departs before any robot follows that
        plan."""
        if self.to_follow:
            self.begin(None)

    def step(self, robot: str, pose: Pose) -> None:
        """Count a step of a robot if it is the next one of the plan."""
        if self.plan is not None and robot in self.plan.robots:
            ahead = self.plan.robots[robot][self.taken[robot] + 1 :]
            self.taken[robot] += bool(ahead) and Pose.of(*ahead[0]) == pose

    def left(self, poses: Mapping[str, Pose]) -> PlanLeft | None:
        """The rest of the plan; None if a robot has left it, or all have arrived."""
        if self.plan is None or self.plan.robots.keys() != poses.keys():
            return None
        left = {name: way[self.taken[name] :] for name, way in self.plan.robots.items()}
        if all(len(way) == 1 for way in left.values()):
            return None
        for name, way in left.items():
            here = poses[name]
            if len(way) == 1:  # the robot may have left the plan
                left[name] = (here.place,)
            elif Pose.of(*way[0]) != here:
                return None
        orders = (
            (first, i - self.taken[first], then, j - self.taken[then])
            for first, i, then, j in self.plan.orders
        )
        to_come = tuple(order for order in orders if order[1] > 0 and order[3] > 0)
        return PlanLeft(left, to_come, self.plan.reason)

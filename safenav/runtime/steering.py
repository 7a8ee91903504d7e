"""Coordination without resynthesis: the second strategy behind the same face (paper, V-D).

Requests, bids and the stack are those of ``Resynthesis``; what differs is how a robot is told:
by the inputs of its strategy instead of a new strategy. New strategies are still needed when
the known obstacles change.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from safenav.runtime.coordination import Resynthesis
from safenav.runtime.refuge import Refuge
from safenav.runtime.tasks import Assignment, helping, holding
from safenav.scenario.model import Obstacle, Robot
from safenav.spec.assignable import Signal
from safenav.world.map import Region
from safenav.world.moves import distances


class Steering(Resynthesis):
    """Reassigns robots by signals to the strategies that they have."""

    def give_way(self, refuge: Refuge) -> bool:
        """Let robots stand aside by sending them there."""
        state = self._state
        if any(place not in self._places(name) for name, place in refuge.places):
            return False
        changes = {name: self._waiting(name, place) for name, place in refuge.places}
        helper = refuge.places[-1][0]
        frame = state.tasks.push(None, refuge.stuck, helper, state.tick, changes)
        self._tell_push(frame)
        return True

    def _reassignments(
        self, obstacle: Obstacle, requester: Robot, helper: Robot, serving: bool
    ) -> Iterator[dict[str, Assignment]]:
        """The requester waits where it stands, the helper is sent to the nearest place where it
        can resolve the obstacle and come back from."""
        state = self._state
        wait = self._waiting(requester.name, state.region(requester))
        if serving:
            yield {requester.name: wait}
            return
        place = self._nearest(obstacle, helper)
        if place is None:
            return
        current = state.tasks.current[helper.name]
        go = replace(
            current,
            objective=helping(current.objective, frozenset({place}), None),
            signal=Signal(place, wait=False),
            specified=current.specified or current.objective,
            temporary=True,
        )
        yield {requester.name: wait, helper.name: go}

    def _waiting(self, name: str, place: Region) -> Assignment:
        current = self._state.tasks.current[name]
        return replace(
            current,
            objective=holding(current.objective, place),
            signal=Signal(place, wait=True),
            specified=current.specified or current.objective,
            temporary=True,
        )

    def _nearest(self, obstacle: Obstacle, helper: Robot) -> Region | None:
        state = self._state
        reach = distances(
            helper.model.mobility,
            state.next_pose(helper),
            state.scenario.map,
            self._blocked(helper, self._state.knowledge.pending),
        )
        possible = [
            region
            for region in obstacle.resolution_regions(state.scenario.map)
            if region in reach and region in self._places(helper.name)
        ]
        return min(possible, key=lambda region: (reach[region], region), default=None)

    def _places(self, name: str) -> frozenset[Region]:
        switch = self._state.planners[name].switch
        return switch.places if switch is not None else frozenset()

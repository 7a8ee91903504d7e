"""The least charge with which a robot can continue forever, for each pose and next target.

More charge is never worse, so one number says all, without a product with the charge:
``need_k(p)`` is the least over steps p -> q of ``move`` + (``need_{k+1}(q)`` if q is target k, else
``need_k(q)``), and 0 at a charger if what leaving it takes is at most the capacity; the greatest
fixpoint of that.
"""

from __future__ import annotations

from collections.abc import Sequence
from heapq import heappop, heappush

from safenav.scenario.model import Battery
from safenav.world.poses import Mask, PoseGraph, bits

NEVER = 1 << 40
"""No charge suffices."""

Needs = tuple[dict[int, int], ...]
"""For each next target the need of each pose from which some charge suffices."""


def needs(
    graph: PoseGraph,
    targets: Sequence[Mask],
    allowed: Mask,
    chargers: Mask,
    battery: Battery,
    *,
    settles: bool = False,
) -> Needs:
    """The needs of a robot that meets ``targets`` in turn inside ``allowed`` poses; one that
    ``settles`` stays at the last."""
    before: dict[int, list[int]] = {pose: [] for pose in bits(allowed)}
    for pose in before:
        for step in graph.steps(pose):
            if step in before:
                before[step].append(pose)

    def following(turn: int) -> int:
        last = len(targets) - 1
        return turn + 1 if turn < last else last if settles else 0

    found: Needs = tuple(dict.fromkeys(before, 0) for _ in targets)
    while True:
        after = tuple(
            _leg(before, targets[k] & allowed, found[following(k)], chargers, battery)
            for k in range(len(targets))
        )
        grown = tuple(
            {pose: max(new[pose], old[pose]) for pose in new if pose in old}
            for new, old in zip(after, found, strict=True)
        )
        if grown == found:
            return found
        found = grown


def _leg(
    before: dict[int, list[int]],
    target: Mask,
    then: dict[int, int],
    chargers: Mask,
    battery: Battery,
) -> dict[int, int]:
    """The charge that a way to the target takes, with what is needed there; chargers take none."""
    best: dict[int, int] = {}
    queue: list[tuple[int, int]] = []

    def offer(pose: int, charge: int) -> None:
        if charge > battery.capacity:
            return
        if chargers >> pose & 1:
            charge = 0
        if charge < best.get(pose, NEVER):
            best[pose] = charge
            heappush(queue, (charge, pose))

    for pose in bits(target):
        if pose not in then:
            continue
        for former in before[pose]:
            offer(former, then[pose] + battery.move)
        if chargers >> pose & 1:
            offer(pose, then[pose])
        else:  # without charge for a step it is out of service, and meets nothing by staying
            offer(pose, max(then[pose] + battery.stay, battery.move))
    while queue:
        charge, pose = heappop(queue)
        if charge == best[pose]:
            for former in before[pose]:
                offer(former, charge + battery.move)
    return best

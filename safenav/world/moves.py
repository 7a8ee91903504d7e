"""Moves of robots between regions (docs/scenario.md; paper, Section VI).

``free``: stay, or step to a 4-neighbour. ``heading``: a pose is a region and a heading; stay,
step straight on, or turn 90 degrees and step; never backwards, never a turn on the spot.
"""

from __future__ import annotations

from collections.abc import Collection
from enum import StrEnum

from msgspec import Struct

from safenav.world.map import HEADINGS, Heading, Region, RegionMap


class Mobility(StrEnum):
    FREE = "free"
    HEADING = "heading"


class Pose(Struct, frozen=True):
    """Region of a robot and, for heading mobility, its heading."""

    region: Region
    heading: Heading | None = None

    @classmethod
    def of(cls, region: Region, facing: str | None) -> Pose:
        """The pose that faces a direction of this name."""
        return cls(region, None if facing is None else HEADINGS[facing])

    @property
    def facing(self) -> str | None:
        """The name of its heading, as traces have it."""
        return None if self.heading is None else self.heading.label

    @property
    def place(self) -> tuple[Region, str | None]:
        """Its region and the name of its heading, as traces have them."""
        return self.region, self.facing


def moves(
    mobility: Mobility, pose: Pose, world: RegionMap, blocked: Collection[Region] = ()
) -> tuple[Pose, ...]:
    """Return all poses after one tick: the stay first, then the steps north, east, south, west.

    ``blocked`` regions are treated like walls for steps (never for staying).
    """
    found = [pose]
    for heading in Heading:
        turned = pose.heading if mobility is Mobility.HEADING else None
        if turned is not None and heading is turned.opposite:
            continue
        target = world.step(pose.region, heading)
        if target is None or target in world.walls or target in blocked:
            continue
        found.append(Pose(target, heading if mobility is Mobility.HEADING else None))
    return tuple(found)

"""The world: maps of regions and how robots move on them."""

from safenav.world.frame import Frame
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.mobility import Mobility, Pose, distances, moves, shortest_path

__all__ = [
    "Frame",
    "Heading",
    "Mobility",
    "Pose",
    "Region",
    "RegionMap",
    "distances",
    "moves",
    "shortest_path",
]

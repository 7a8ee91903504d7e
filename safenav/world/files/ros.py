"""Occupancy maps of ROS map_server: an image and how to read it.

What map_server calls unknown is a wall here: a controller must not rely on it. So a pixel is
free only if map_server says free: occupancy (how dark it is, or how bright if ``negate``) below
``free_thresh`` and not above ``occupied_thresh``. The modes trinary and scale agree on that.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from safenav.world.files.image import Image
from safenav.world.files.pixels import Blocked


class RosMap(Struct, frozen=True):
    """The YAML file of a map. ``resolution``: metres per pixel; ``origin``: x, y and yaw of its
    lower left corner."""

    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float


def occupied(image: Image, settings: RosMap) -> Blocked:
    """The pixels that are occupied or unknown; transparent ones are unknown."""
    values = np.arange(image.white + 1)
    occupancy = (values if settings.negate else image.white - values) / image.white
    free = (occupancy < settings.free_thresh) & ~(occupancy > settings.occupied_thresh)
    found = image.where(~free)
    return found if image.transparent is None else found | image.transparent

"""The world: maps of regions and the motion of robots on them."""
